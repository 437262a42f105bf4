//! Where a servo should be by its airframe's data: a delay, then a rate.
//!
//! A command is not a position: a flight computer that takes one for the other brakes with fins
//! that are not open yet, and meets the ground at 1.9 m/s in the rehearsal of mk2, whose legs bear
//! 1.0 m/s. So servos that report nothing are where this model has them, and those that report are
//! watched by it.

use serde::Serialize;

use crate::computer::FRAME_S;
use crate::computer::pad_check::SURFACES;
use crate::vehicle::airframe::{Airframe, Servo};

/// An airframe's servo delay is 0.1 s at most.
const LINE_FRAMES: usize = 24;
/// The first surfaces are the gimbal's.
pub(crate) const GIMBALS: usize = 2;

/// One servo, by its commands.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct ServoModel {
    /// The last commands, the oldest at `next`, rad.
    line_rad: [f64; LINE_FRAMES],
    next: usize,
    delay_frames: usize,
    step_rad: f64,
    pub(crate) at_rad: f64,
}

impl ServoModel {
    fn new(servo: &Servo, at_rad: f64) -> Self {
        Self {
            line_rad: [at_rad; LINE_FRAMES],
            next: 0,
            delay_frames: (libm::round(servo.delay_s / FRAME_S) as usize).min(LINE_FRAMES - 1),
            step_rad: servo.rate_rad_s() * FRAME_S,
            at_rad,
        }
    }

    /// The servos of all surfaces at rest, rad.
    pub(crate) fn of_each(airframe: &Airframe, at_rad: [f64; SURFACES]) -> [Self; SURFACES] {
        core::array::from_fn(|surface| {
            let servo = if surface < GIMBALS { &airframe.gimbal.servo } else { &airframe.fins.servo };
            Self::new(servo, at_rad[surface])
        })
    }

    /// Takes the command of a frame.
    pub(crate) fn take(&mut self, command_rad: f64) {
        self.line_rad[self.next] = command_rad;
        self.next = (self.next + 1) % LINE_FRAMES;
    }

    /// Moves for a frame under the commands so far: towards the command of a delay ago, by at most
    /// the rate. A data sheet states the rate alone, as the time for 60 degrees; the delay is
    /// measured.
    pub(crate) fn advance(&mut self) {
        let delayed = (self.next + LINE_FRAMES - 1 - self.delay_frames) % LINE_FRAMES;
        self.at_rad += (self.line_rad[delayed] - self.at_rad).clamp(-self.step_rad, self.step_rad);
    }
}

#[cfg(test)]
mod tests {
    use alloc::vec::Vec;

    use super::*;

    /// 20 ms are four frames, and 300 degrees/s are 1.5 degrees a frame.
    #[test]
    fn val_hand_a_step_of_three_degrees_arrives_after_six_frames() {
        let servo = Servo { rate_deg_s: 300.0, delay_s: 0.02, slop_deg: 0.0 };
        let mut model = ServoModel::new(&servo, 0.1);
        let mut step = |told_rad: f64| {
            model.take(told_rad);
            model.advance();
            model.at_rad
        };
        assert!((step(0.1) - 0.1).abs() < 1e-15, "it begins at its command");
        let found: Vec<f64> = (0..7).map(|_| (step(0.1 + 3.0_f64.to_radians()) - 0.1).to_degrees()).collect();
        for (found, expected) in found.into_iter().zip([0.0, 0.0, 0.0, 0.0, 1.5, 3.0, 3.0]) {
            assert!((found - expected).abs() < 1e-9, "{found} {expected}");
        }
    }
}
