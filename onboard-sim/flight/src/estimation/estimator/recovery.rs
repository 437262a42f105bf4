//! Recovery of a lost estimate: barometer and satellite receiver agree with each other, and
//! contradict it.
//!
//! After an inertial failure every good measurement is rejected, because the filter trusts its
//! state. Two sensors that fail in the same way for a second are less likely than one filter.

use nalgebra::Vector3;
use serde::Serialize;

use super::covariance::{ATTITUDE, POSITION, VELOCITY};
use super::{Estimator, GnssFix, Measurements, health, start_heights};

/// Agreement of the two heights: within this, m, and within this share, the barometer's scale.
const AGREE_M: f64 = 5.0;
const AGREE_SHARE: f64 = 0.07;
/// Smallest error of a lost estimate, m, and as a multiple of the difference of the two.
const LOST_M: f64 = 20.0;
const LOST_TIMES: f64 = 3.0;
/// Time for which it must last, s.
const LOST_S: f64 = 1.0;
/// Maximum age of a fix, s.
const FIX_LASTS_S: f64 = 0.6;
/// Assumed lean uncertainty of a lost attitude, rad.
const LOST_RAD: f64 = 0.3;

with_defaults! {
    /// The last fix, admitted or not, and the time for which the estimate has been contradicted, s.
    #[derive(Debug, Clone, Copy, PartialEq, Serialize)]
    pub(super) struct Contradiction {
        fix_m: Vector3<f64> = Vector3::zeros(),
        fix_m_s: Vector3<f64> = Vector3::zeros(),
        fix_age_s: f64 = f64::INFINITY,
        lasts_s: f64 = 0.0,
        since_pressure_s: f64 = 0.0,
    }
}

impl Estimator {
    /// Takes a frame's measurements, and restarts the estimate once both have contradicted it for
    /// long enough.
    pub(super) fn recover_if_lost(&mut self, measurements: &Measurements) {
        let seen = &mut self.contradiction;
        seen.fix_age_s += self.config.frame_s;
        if let Some(GnssFix { position_m, velocity_m_s, valid_at_s, .. }) = measurements.gnss {
            (seen.fix_m, seen.fix_m_s) = (position_m, velocity_m_s);
            seen.fix_age_s = self.start_s + self.frames as f64 * self.config.frame_s - valid_at_s;
        }
        seen.since_pressure_s += self.config.frame_s;
        let Some(altitude_m) = measurements.pressure_altitude_m else { return };
        let interval_s = core::mem::take(&mut seen.since_pressure_s);
        let fix_m = seen.fix_m + seen.fix_m_s * seen.fix_age_s;
        let apart_m = (altitude_m - fix_m.z).abs();
        let off_m = [altitude_m, fix_m.z].map(|height_m| (height_m - self.nominal.position_m.z).abs());
        let off_m = off_m[0].min(off_m[1]);
        let lost = (0.0..=FIX_LASTS_S).contains(&seen.fix_age_s)
            && apart_m <= AGREE_M + AGREE_SHARE * altitude_m.abs()
            && off_m > LOST_M.max(LOST_TIMES * apart_m);
        seen.lasts_s = if lost { seen.lasts_s + interval_s } else { 0.0 };
        if seen.lasts_s < LOST_S {
            return;
        }
        let (off_m, off_m_s) = (fix_m - self.nominal.position_m, seen.fix_m_s - self.nominal.velocity_m_s);
        seen.lasts_s = 0.0;
        self.catch_up();
        for axis in 0..3 {
            self.covariance.widen(POSITION + axis, off_m[axis] * off_m[axis]);
            self.covariance.widen(VELOCITY + axis, off_m_s[axis] * off_m_s[axis]);
            self.covariance.widen(ATTITUDE + axis, LOST_RAD * LOST_RAD);
        }
        self.heights = start_heights(&self.start, altitude_m);
        self.heights_without_lidar = self.heights;
        // The barometer confirms the receiver.
        self.gnss_gate.quarantined = false;
        self.unhealthy_until_s = self.time_s() + health::UNHEALTHY_AFTER_RESTART_S;
    }
}
