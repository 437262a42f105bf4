//! Tells from their timing whether keys were typed, repeated by a held key, or pasted.
//!
//! The keys of the abort count in every case.

use std::time::Duration;

use super::chord::REPEATS_WITHIN;
use crate::key::Key;

/// Different keys closer together than this were not typed by hand. Two fingers are about 40 ms apart; pasted text
/// arrives at 1 ms a letter on a serial console at 9,600 baud, 8 ms at 1,200 baud, and at once everywhere else.
pub const FINGERS_APART: Duration = Duration::from_millis(25);
/// Dropped keys are reported at most this often.
const REPORTED_EVERY: Duration = Duration::from_secs(2);

/// How a key arrived.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum KeyOrigin {
    /// Typed by hand.
    Typed,
    /// A repeat: the key is held down.
    Repeat,
    /// In one read with other keys, or sooner after another key than a hand can type.
    TooFast,
}

/// The last key and when it arrived.
#[derive(Debug, Clone, Copy, Default)]
pub struct KeyTiming {
    /// The key is `None` after a paste.
    last: Option<(Option<Key>, Duration)>,
    reported_at: Option<Duration>,
}

impl KeyTiming {
    /// How this key arrived; `together` if one read of the terminal brought several.
    pub fn origin(&mut self, key: Key, together: bool, now: Duration) -> KeyOrigin {
        let before = self.last.replace((Some(key), now));
        match before {
            _ if together => KeyOrigin::TooFast,
            Some((Some(last), at)) if last == key && now.saturating_sub(at) < REPEATS_WITHIN => {
                KeyOrigin::Repeat
            }
            Some((_, at)) if now.saturating_sub(at) < FINGERS_APART => KeyOrigin::TooFast,
            _ => KeyOrigin::Typed,
        }
    }

    /// Something was pasted; keys shortly after it were not typed by hand either.
    pub fn pasted(&mut self, now: Duration) {
        self.last = Some((None, now));
    }

    /// A key was dropped. Returns whether to report it.
    pub fn reports_drop(&mut self, now: Duration) -> bool {
        let reports = self.reported_at.is_none_or(|at| now.saturating_sub(at) >= REPORTED_EVERY);
        if reports {
            self.reported_at = Some(now);
        }
        reports
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn typed_repeated_and_pasted_keys_are_distinguished() {
        let at = Duration::from_millis;
        let mut timing = KeyTiming::default();
        let mut touch = |key, now| timing.origin(Key::Char(key), false, at(now));
        assert_eq!(touch('A', 0), KeyOrigin::Typed);
        assert_eq!(touch('R', 40), KeyOrigin::Typed);
        assert_eq!(touch('M', 48), KeyOrigin::TooFast);
        // Held: the keyboard's delay first, then a repeat every 33 ms.
        assert_eq!(touch('q', 1_000), KeyOrigin::Typed);
        assert_eq!(touch('q', 1_500), KeyOrigin::Typed);
        assert_eq!(touch('q', 1_533), KeyOrigin::Repeat);
        assert_eq!(timing.origin(Key::Char('S'), true, at(9_000)), KeyOrigin::TooFast);
    }
}
