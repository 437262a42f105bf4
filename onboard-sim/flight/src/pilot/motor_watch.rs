//! Watching the landing motor: whether it burns, since when, and how strongly.

use crate::thrust_curve::ThrustCurve;

/// Thrust that is no drag, as a share of the certified mean.
const LIGHT_SHARE: f64 = 0.25;
/// A burning motor has been felt for this long; a spike has not, s.
const CONFIRM_S: f64 = 0.01;
/// The scale is not believed before the curve has risen, s.
const SETTLE_S: f64 = 0.12;

/// What the accelerometer says about the motor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotorWatch {
    frame_s: f64,
    felt_since_s: Option<f64>,
    began_s: Option<f64>,
    scale: f64,
    lag_s: f64,
}

impl MotorWatch {
    /// Watching a motor that has not been lit; the scale follows what is felt with a lag.
    pub fn new(frame_s: f64, lag_s: f64) -> Self {
        Self { frame_s, felt_since_s: None, began_s: None, scale: 1.0, lag_s }
    }

    /// Takes the thrust felt over the frame that ended at `time_s`, N.
    pub fn feel(&mut self, time_s: f64, thrust_n: f64, curve: &ThrustCurve) {
        let mean_n = curve.total_impulse_n_s() / curve.burn_time_s();
        if self.began_s.is_none() {
            if thrust_n > LIGHT_SHARE * mean_n {
                let since_s = *self.felt_since_s.get_or_insert(time_s - self.frame_s);
                if time_s - since_s >= CONFIRM_S {
                    self.began_s = Some(since_s);
                }
            } else {
                self.felt_since_s = None;
            }
        }
        let Some(burning_s) = self.burning_s(time_s) else { return };
        let expected_n = curve.mean_thrust_n(burning_s - self.frame_s, self.frame_s);
        if burning_s > SETTLE_S && expected_n > 0.1 * mean_n {
            let share = self.frame_s / (self.frame_s + self.lag_s);
            self.scale += share * ((thrust_n / expected_n).clamp(0.5, 1.5) - self.scale);
        }
    }

    /// Time since the thrust began, s; `None` before.
    pub fn burning_s(&self, time_s: f64) -> Option<f64> {
        self.began_s.map(|began_s| time_s - began_s)
    }

    /// Thrust felt over thrust certified.
    pub fn scale(&self) -> f64 {
        self.scale
    }
}
