//! A fin that does not move although it is told to.
//!
//! A command that sweeps to and fro passes a stuck fin again and again, so being where it is told to be says little. A
//! fin that is told to be far away, for longer than a servo needs, and has not moved at all meanwhile, is stuck.

use crate::computer::memory::remembers;

/// A fin that has moved by this much lives, rad.
const MOVED_RAD: f64 = 0.015;
/// Farther than this from where it is, a fin that lives goes where it is told at once, rad: as far as the gate allows.
const FAR_RAD: f64 = super::step::FIN_THERE_RAD;
/// Told to be far away for so long altogether without having moved, it is stuck, s.
const STUCK_AFTER_S: f64 = 0.25;

/// What is remembered of one fin.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Watched {
    /// Where it was when it last moved, rad.
    rests_at_rad: f64,
    /// How long it has been told to be far from there since, s.
    called_for_s: f64,
}

/// The watch over all fins.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct FinWatch {
    fins: [Watched; 4],
}

remembers!(Watched { rests_at_rad, called_for_s });
remembers!(FinWatch { fins });

impl FinWatch {
    /// Takes a frame: where the fins are and where they had been told to be, rad.
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

    /// When a sweep of all fins, 1 s to and fro, finds one stuck that follows only until a time.
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
    fn a_fin_that_the_command_passes_by_is_found_all_the_same() {
        let found_s = found_after_s(2.3, 5.0).expect("found");
        assert!((2.5..3.3).contains(&found_s), "{found_s}");
    }

    #[test]
    fn one_that_follows_late_is_not_stuck() {
        assert_eq!(found_after_s(f64::INFINITY, 5.0), None);
        assert_eq!(found_after_s(f64::INFINITY, 0.5), None, "a tenth of the rate");
    }
}
