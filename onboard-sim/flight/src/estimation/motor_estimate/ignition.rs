//! Finds the instant of ignition with a resolution finer than a frame.

use super::NominalThrust;
use crate::computer::memory::remembers;
use serde::{Deserialize, Serialize};

/// The motor burns when the thrust is above this fraction of the peak in two frames in a row. Halved and doubled: 142, 147.
const CAUGHT_SHARE: f64 = 0.1;
/// Standard deviation of the instant, s. Halved and doubled: 145, 144.
pub(super) const SIGMA_S: f64 = 0.004;
/// The curve's own rise to that fraction is searched up to this time, and in steps of this length, s.
/// Halved or doubled: no flight changes.
const RISE_S: f64 = 0.3;
const RISE_STEP_S: f64 = 0.0005;

#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct Detector {
    /// Middle of the last frame, s, and its thrust, N.
    last: Option<(f64, f64)>,
    /// When the thrust rose through the threshold, if the last frame was above it, s.
    crossed_s: Option<f64>,
}

remembers!(Detector { last, crossed_s });

impl Detector {
    /// Whether the last frame was above the threshold; the next frame then decides.
    pub(super) fn suspects(&self) -> bool {
        self.crossed_s.is_some()
    }

    /// Takes a frame's mean thrust. Returns the instant of ignition when this is the second frame above the threshold.
    pub(super) fn take(&mut self, curve: &impl NominalThrust, middle_s: f64, thrust_n: f64) -> Option<f64> {
        let mark_n = CAUGHT_SHARE * curve.peak_n();
        let before = self.last.replace((middle_s, thrust_n));
        if thrust_n <= mark_n {
            self.crossed_s = None;
            return None;
        }
        if let Some(crossed_s) = self.crossed_s {
            return Some(crossed_s - rise_s(curve, mark_n));
        }
        self.crossed_s = Some(match before {
            Some((before_s, before_n)) if thrust_n > before_n && before_n <= mark_n => {
                before_s + (middle_s - before_s) * (mark_n - before_n) / (thrust_n - before_n)
            }
            _ => middle_s,
        });
        None
    }
}

/// How long the curve itself takes to rise to the threshold, s.
fn rise_s(curve: &impl NominalThrust, mark_n: f64) -> f64 {
    let steps = (RISE_S / RISE_STEP_S) as u32;
    (0..steps)
        .map(|step| f64::from(step) * RISE_STEP_S)
        .find(|time_s| curve.thrust_n(*time_s) >= mark_n)
        .unwrap_or(0.0)
}
