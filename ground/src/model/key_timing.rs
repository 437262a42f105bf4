//! Tells from their timing whether keys were typed, repeated by a held key, or arrived faster than a hand types.
//!
//! Keys that arrive too fast may be a paste, but also typed keys that a slow connection delivered in bunches. So they
//! only show and prepare; what they complete is asked again ([`super::dialog::Dialog::Again`]). The keys of the abort
//! count in every case.

use std::time::Duration;

use super::chord::REPEATS_WITHIN;
use crate::key::Key;

/// Different keys closer together than this were not typed by hand. Two fingers are about 40 ms apart; pasted text
/// arrives at 1 ms a letter on a serial console at 9,600 baud, 8 ms at 1,200 baud, and at once everywhere else.
pub const FINGERS_APART: Duration = Duration::from_millis(25);
/// After a key that has no meaning among keys that arrive too fast, the others are dropped until none has arrived for
/// this long. A connection may pause within a paste, and a hand is no faster.
const RUN_ENDS: Duration = REPEATS_WITHIN;
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
    /// In a run of keys that is dropped.
    Dropped,
}

/// The last key and when it arrived.
#[derive(Debug, Clone, Copy, Default)]
pub struct KeyTiming {
    /// The key is `None` after a paste.
    last: Option<(Option<Key>, Duration)>,
    /// The rest of this run of keys is dropped.
    drops: bool,
    /// A key of the open dialog was not typed by hand.
    pub hurried: bool,
    reported_at: Option<Duration>,
}

impl KeyTiming {
    /// How this key arrived; `together` if one read of the terminal brought several.
    pub fn origin(&mut self, key: Key, together: bool, now: Duration) -> KeyOrigin {
        let before = self.last.replace((Some(key), now)).map(|(last, at)| (last, now.saturating_sub(at)));
        self.drops &= before.is_some_and(|(_, ago)| ago < RUN_ENDS);
        match before {
            _ if self.drops => KeyOrigin::Dropped,
            Some((Some(last), ago)) if last == key && ago < REPEATS_WITHIN => KeyOrigin::Repeat,
            Some((_, ago)) if ago < FINGERS_APART => KeyOrigin::TooFast,
            _ if together => KeyOrigin::TooFast,
            _ => KeyOrigin::Typed,
        }
    }

    /// The keys of this run are no input for this program: the rest of them is dropped.
    pub fn drop_run(&mut self) {
        self.drops = true;
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
        assert_eq!(timing.origin(Key::Char('S'), true, at(9_000)), KeyOrigin::Repeat);
    }

    #[test]
    fn a_dropped_run_ends_with_a_pause() {
        let at = Duration::from_millis;
        let mut timing = KeyTiming::default();
        timing.origin(Key::Char('e'), true, at(0));
        timing.drop_run();
        assert_eq!(timing.origin(Key::Char('A'), true, at(0)), KeyOrigin::Dropped);
        assert_eq!(timing.origin(Key::Char('A'), false, at(100)), KeyOrigin::Dropped);
        assert_eq!(timing.origin(Key::Char('A'), false, at(250)), KeyOrigin::Typed);
    }
}
