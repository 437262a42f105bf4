//! Where servos that report nothing should be: where their airframe's data take them.
//!
//! A command is not a position: a flight computer that takes one for the other brakes with fins that are not open yet, and
//! meets the ground at 1.9 m/s in the rehearsal of mk2, whose legs bear 1.0 m/s.

use alloc::collections::VecDeque;
use serde::Serialize;

use crate::computer::FRAME_S;
use crate::vehicle::airframe::Servo;

/// One servo, by its commands.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub(crate) struct SilentServo {
    /// Commands that have not reached it yet, rad.
    late_rad: VecDeque<f64>,
    at_rad: Option<f64>,
}

impl SilentServo {
    /// Where it is at the end of a frame in which this command stood, rad.
    pub(crate) fn step(&mut self, told_rad: f64, servo: &Servo) -> f64 {
        let at_rad = self.at_rad.unwrap_or(told_rad);
        self.late_rad.push_back(told_rad);
        let delay_frames = libm::round(servo.delay_s / FRAME_S) as usize;
        let arrived_rad = if self.late_rad.len() > delay_frames { self.late_rad.pop_front() } else { None };
        let most_rad = servo.rate_rad_s() * FRAME_S;
        let moved_rad =
            arrived_rad.map_or(0.0, |wanted_rad| (wanted_rad - at_rad).clamp(-most_rad, most_rad));
        *self.at_rad.insert(at_rad + moved_rad)
    }
}

#[cfg(test)]
mod tests {
    use alloc::vec::Vec;

    use super::*;

    /// 20 ms are four frames, and 300 degrees/s are 1.5 degrees a frame.
    #[test]
    fn val_hand_a_step_of_three_degrees_arrives_after_six_frames() {
        let (mut silent, servo) =
            (SilentServo::default(), Servo { rate_deg_s: 300.0, delay_s: 0.02, slop_deg: 0.0 });
        assert!((silent.step(0.1, &servo) - 0.1).abs() < 1e-15, "it begins where it is told to be");
        let found: Vec<f64> =
            (0..7).map(|_| (silent.step(0.1 + 3.0_f64.to_radians(), &servo) - 0.1).to_degrees()).collect();
        for (found, expected) in found.into_iter().zip([0.0, 0.0, 0.0, 0.0, 1.5, 3.0, 3.0]) {
            assert!((found - expected).abs() < 1e-9, "{found} {expected}");
        }
    }
}
