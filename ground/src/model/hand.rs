//! Whose keys they are: a finger's, a held key's repeats, or a text that somebody pasted.
//!
//! Nothing here is asked about the abort: its keys count however they come.

use std::time::Duration;

use super::chord::REPEATS_WITHIN;
use crate::key::Key;

/// Different keys that arrive closer together than this were not struck by fingers. Two keys rolled by two fingers are
/// some 40 ms apart; a text comes with 1 ms a letter on a serial console at 9,600 baud, 8 ms at 1,200, and at once
/// everywhere else.
pub const FINGERS_APART: Duration = Duration::from_millis(25);
/// What was dropped is said once in this time.
const SAID_EVERY: Duration = Duration::from_secs(2);

/// How a key came.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Touch {
    /// By a finger.
    Finger,
    /// Again by itself: the key is held down.
    Repeat,
    /// Together with others, or faster behind another than fingers are.
    Hurried,
}

/// When which key came last.
#[derive(Debug, Clone, Copy, Default)]
pub struct Hand {
    /// `None` is a paste.
    last: Option<(Option<Key>, Duration)>,
    said_at: Option<Duration>,
}

impl Hand {
    /// How this key came; `together` with others in one read of the terminal.
    pub fn touch(&mut self, key: Key, together: bool, now: Duration) -> Touch {
        let before = self.last.replace((Some(key), now));
        match before {
            _ if together => Touch::Hurried,
            Some((Some(last), at)) if last == key && now.saturating_sub(at) < REPEATS_WITHIN => Touch::Repeat,
            Some((_, at)) if now.saturating_sub(at) < FINGERS_APART => Touch::Hurried,
            _ => Touch::Finger,
        }
    }

    /// Something was pasted; what comes close behind it is no finger's either.
    pub fn pasted(&mut self, now: Duration) {
        self.last = Some((None, now));
    }

    /// Something was dropped. Returns whether that is to be said.
    pub fn says(&mut self, now: Duration) -> bool {
        let says = self.said_at.is_none_or(|at| now.saturating_sub(at) >= SAID_EVERY);
        if says {
            self.said_at = Some(now);
        }
        says
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fingers_repeats_and_pastes_are_told_apart() {
        let at = Duration::from_millis;
        let mut hand = Hand::default();
        let mut touch = |key, now| hand.touch(Key::Char(key), false, at(now));
        assert_eq!(touch('A', 0), Touch::Finger);
        assert_eq!(touch('R', 40), Touch::Finger);
        assert_eq!(touch('M', 48), Touch::Hurried);
        // Held: the keyboard's delay first, then a repeat every 33 ms.
        assert_eq!(touch('q', 1_000), Touch::Finger);
        assert_eq!(touch('q', 1_500), Touch::Finger);
        assert_eq!(touch('q', 1_533), Touch::Repeat);
        assert_eq!(hand.touch(Key::Char('S'), true, at(9_000)), Touch::Hurried);
    }
}
