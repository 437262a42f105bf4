//! Finds a fin that does not move when commanded.
//!
//! A command that sweeps to and fro passes a stuck fin again and again, so a fin at its commanded angle may still be
//! stuck. A fin is stuck if its command has been far away for longer than a servo needs and the fin has not moved.

use crate::computer::memory::remembers;
use serde::{Deserialize, Serialize};

/// A fin that has moved by this much is working, rad. Halved or doubled: no flight changes.
const MOVED_RAD: f64 = 0.015;
/// A working fin moves at once if its command is farther away than this, rad: the tolerance of the ignition gate.
const FAR_RAD: f64 = super::step::FIN_THERE_RAD;
/// A fin is stuck if its command has been far away for this long in total and it has not moved, s.
/// Halved or doubled: no flight changes.
const STUCK_AFTER_S: f64 = 0.25;

/// State of the watch over one fin.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
struct Watched {
    /// Angle after its last movement, rad.
    rests_at_rad: f64,
    /// Total time since then with a command far from the fin, s.
    called_for_s: f64,
}

/// The watch over all fins.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct FinWatch {
    fins: [Watched; 4],
}

remembers!(Watched { rests_at_rad, called_for_s });
remembers!(FinWatch { fins });

impl FinWatch {
    /// Takes a frame: measured and commanded angles of the fins, rad.
    pub(super) fn look(&mut self, found_rad: &[f64; 4], told_rad: &[f64; 4], frame_s: f64) {
        for ((fin, found_rad), told_rad) in self.fins.iter_mut().zip(found_rad).zip(told_rad) {
            if (found_rad - fin.rests_at_rad).abs() > MOVED_RAD {
                *fin = Watched { rests_at_rad: *found_rad, called_for_s: 0.0 };
            } else if (told_rad - found_rad).abs() > FAR_RAD {
                fin.called_for_s += frame_s;
            }
        }
    }

    /// Whether any fin is stuck.
    pub(super) fn any_stuck(&self) -> bool {
        self.fins.iter().any(|fin| fin.called_for_s >= STUCK_AFTER_S)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::computer::FRAME_S;

    /// When the watch reports a fin that sticks from `stuck_from_s` on, in a sweep with a period of 1 s.
    fn found_after_s(stuck_from_s: f64, rate_rad_s: f64) -> Option<f64> {
        let mut watch = FinWatch::default();
        let mut fin_rad: f64 = 0.0;
        (0..2000).map(|frame| f64::from(frame) * FRAME_S).find(|time_s| {
            let told_rad = 0.6 + 0.5 * libm::sin(core::f64::consts::TAU * time_s);
            if *time_s < stuck_from_s {
                fin_rad += (told_rad - fin_rad).clamp(-rate_rad_s * FRAME_S, rate_rad_s * FRAME_S);
            }
            watch.look(&[0.6, fin_rad, 0.6, 0.6], &[0.6, told_rad, 0.6, 0.6], FRAME_S);
            watch.any_stuck()
        })
    }

    #[test]
    fn a_stuck_fin_is_found_although_the_command_sweeps_past_it() {
        let found_s = found_after_s(2.3, 5.0).expect("the stuck fin is found");
        assert!((2.5..3.3).contains(&found_s), "{found_s}");
    }

    #[test]
    fn a_fin_that_follows_slowly_is_not_stuck() {
        assert_eq!(found_after_s(f64::INFINITY, 5.0), None);
        assert_eq!(found_after_s(f64::INFINITY, 0.5), None, "a tenth of the rate");
    }
}
