//! The abort chord: Ctrl-X then Enter, or Ctrl-X twice, distinguished from a held Ctrl-X.
//!
//! Enter completes the chord at once on every terminal. A second Ctrl-X is harder to recognise. Many terminals send a
//! held key as the same bytes over and over: once at the press, again after the keyboard's delay (250 ms or more),
//! then every 20 to 100 ms. The first repeat looks like a second press; the repeats after it do not. So a second
//! Ctrl-X counts only if no further one follows within [`REPEATS_WITHIN`], and a held key is one press. On a terminal
//! that reports repeats, the second Ctrl-X counts at once.

use std::time::Duration;

/// How long the second key may take, from the first press or from the end of its hold.
pub const ABORT_TIME_LIMIT: Duration = Duration::from_secs(2);
/// Presses closer together than this are repeats of a held key: keyboards repeat every 20 to 100 ms, fingers are
/// slower. A second press also waits this long to show that it is no repeat.
pub const REPEATS_WITHIN: Duration = Duration::from_millis(120);

/// The state of the chord.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum AbortChord {
    #[default]
    Open,
    /// Pressed once and perhaps still held; the time of the last Ctrl-X.
    Once(Duration),
    /// Pressed a second time, at this time. It counts unless a repeat follows.
    Twice(Duration),
}

impl AbortChord {
    /// Whether the first key was pressed and its time limit has not expired.
    pub fn is_begun(self, now: Duration) -> bool {
        match self {
            Self::Open => false,
            Self::Once(at) => now.saturating_sub(at) <= ABORT_TIME_LIMIT,
            Self::Twice(_) => true,
        }
    }

    /// When a second press counts.
    pub fn acts_at(self) -> Option<Duration> {
        match self {
            Self::Twice(at) => Some(at + REPEATS_WITHIN),
            Self::Open | Self::Once(_) => None,
        }
    }

    pub fn press(&mut self, now: Duration) {
        *self = match *self {
            Self::Once(at) if now.saturating_sub(at) >= REPEATS_WITHIN && self.is_begun(now) => {
                Self::Twice(now)
            }
            // The ground was too busy to act in time, so nobody knows when this key was pressed.
            Self::Twice(at) if now.saturating_sub(at) >= REPEATS_WITHIN => Self::Twice(now),
            // The first press, or a repeat of a held key.
            Self::Open | Self::Once(_) | Self::Twice(_) => Self::Once(now),
        };
    }

    /// A key that cannot be a repeat of the first was pressed: Enter, or Ctrl-X on a terminal that reports repeats.
    /// Returns whether it completes the chord, which then starts over.
    pub fn confirm(&mut self, now: Duration) -> bool {
        let complete = self.is_begun(now);
        if complete {
            *self = Self::Open;
        }
        complete
    }

    /// Another key was pressed, so Ctrl-X is no longer held. Returns whether the chord is complete; then it starts
    /// over. A chord that has only begun stays begun until its time limit.
    pub fn end(&mut self) -> bool {
        let complete = matches!(self, Self::Twice(_));
        if complete {
            *self = Self::Open;
        }
        complete
    }

    /// Lets time pass. Returns whether the chord is complete; then it starts over.
    pub fn pass(&mut self, now: Duration) -> bool {
        if self.acts_at().is_some_and(|at| now >= at) {
            return self.end();
        }
        if !self.is_begun(now) {
            *self = Self::Open;
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Presses Ctrl-X at these times and lets time pass every 10 ms. Returns how often the chord was completed.
    fn aborts(presses_ms: &[u64]) -> usize {
        let mut chord = AbortChord::default();
        let end = presses_ms.last().copied().unwrap_or(0) + 3_000;
        let mut count = 0;
        for now in 0..end {
            if presses_ms.contains(&now) {
                chord.press(Duration::from_millis(now));
            }
            if now % 10 == 0 {
                count += usize::from(chord.pass(Duration::from_millis(now)));
            }
        }
        count
    }

    fn held(delay_ms: u64, period_ms: u64, repeats: u64) -> Vec<u64> {
        std::iter::once(0).chain((0..repeats).map(|k| delay_ms + k * period_ms)).collect()
    }

    #[test]
    fn a_held_key_never_aborts() {
        for delay_ms in [250, 400, 500, 600, 1_000] {
            assert_eq!(aborts(&held(delay_ms, 33, 200)), 0, "first repeat after {delay_ms} ms");
        }
    }

    #[test]
    fn two_presses_abort_once_whether_fast_or_slow() {
        for pause_ms in [120, 150, 200, 350, 600, 1_000, 1_500, 2_000] {
            assert_eq!(aborts(&[0, pause_ms]), 1, "{pause_ms} ms between");
        }
        assert_eq!(aborts(&[0, 2_100]), 0);
        assert_eq!(aborts(&[0, 20]), 0, "a contact that bounces");
    }

    #[test]
    fn a_held_key_is_one_press_and_the_next_press_aborts() {
        let mut presses = held(500, 33, 30);
        let released = presses.last().copied().unwrap();
        presses.push(released + 400);
        assert_eq!(aborts(&presses), 1);
    }

    #[test]
    fn enter_completes_the_chord_only_after_ctrl_x_and_in_time() {
        let at = Duration::from_millis;
        let mut chord = AbortChord::default();
        assert!(!chord.confirm(at(0)));
        chord.press(at(0));
        assert!(chord.confirm(at(1)));
        assert!(!chord.confirm(at(2)), "once");
        chord.press(at(10));
        assert!(!chord.confirm(at(2_011)), "too late");
        for repeat in held(500, 33, 30) {
            chord.press(at(5_000 + repeat));
        }
        assert!(chord.confirm(at(7_000)), "a hold is a first press");
    }

    #[test]
    fn many_quick_presses_abort() {
        assert!(aborts(&[0, 140, 280, 420, 560]) >= 1);
        assert!(aborts(&[0, 100, 200, 300, 600]) >= 1, "too fast to tell from a hold, until the last");
    }

    proptest! {
        #[test]
        fn a_held_key_never_aborts_at_any_repeat_rate(
            delay_ms in 150_u64..1_900,
            gaps in prop::collection::vec(15_u64..119, 2..200),
        ) {
            let mut presses = vec![0, delay_ms];
            for gap in gaps {
                presses.push(presses.last().copied().unwrap_or(0) + gap);
            }
            prop_assert_eq!(aborts(&presses), 0);
        }
    }
}
