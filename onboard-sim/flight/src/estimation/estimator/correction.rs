//! The scalar correction, and the status of each aiding measurement.
//!
//! The gate is that of the normalised innovation (Y. Bar-Shalom, X. R. Li and T. Kirubarajan,
//! Estimation with Applications to Tracking and Navigation, 2001, section 5.4).

use serde::Serialize;

use super::Estimator;
use super::covariance::{ACCELEROMETER_BIAS, ATTITUDE, POSITION, VELOCITY};

/// After this many rejected ranges or numbers of satellite positions (three for each fix) in a row
/// the filter assumes that the estimated position is wrong.
pub(super) const POSITION_REJECTIONS: u32 = 10;
/// Standard deviation that the filter adds to a position or an offset that it assumes to be wrong,
/// m.
pub(super) const INFLATION_POSITION_M: f64 = 3.0;

/// The result of a scalar correction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Correction {
    /// Measured less predicted.
    pub(super) innovation: f64,
    /// Innovation squared divided by its variance; its expected value is 1.
    pub(super) normalised_squared: f64,
    /// Variance of the innovation.
    pub(super) variance: f64,
    /// The largest normalised square that is used.
    pub(super) gate: f64,
    pub(super) accepted: bool,
}

/// Status of one aid, the same for all. A rejected measurement is counted; many rejections in a row
/// mean that the filter is wrong.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct AidStatus {
    /// The last measurement less its prediction, in the aid's unit; for a fix, that of its worst
    /// component. 0 for NaN.
    pub innovation: f64,
    /// Innovation over the gate: above 1 the measurement was rejected. Infinite for NaN.
    pub test_ratio: f64,
    /// Measurements used.
    pub used: u32,
    /// Measurements rejected by the gate, or NaN.
    pub refused: u32,
    /// Measurements rejected since the last one used.
    pub refused_in_a_row: u32,
    /// Measured in the last frame.
    pub fresh: bool,
}

/// The status of all aids.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Aids {
    /// Inertial samples; an impossible sample is replaced by the sample before it.
    pub imu: AidStatus,
    pub barometer: AidStatus,
    /// Satellite velocity, three numbers a fix.
    pub gnss_velocity: AidStatus,
    /// Satellite position, three numbers a fix.
    pub gnss_position: AidStatus,
    pub lidar: AidStatus,
    /// Sideways force, for the wind.
    pub wind: AidStatus,
}

impl Aids {
    /// Begins a frame.
    pub(super) fn begin_frame(&mut self) {
        let Self { imu, barometer, gnss_velocity, gnss_position, lidar, wind } = self;
        for aid in [imu, barometer, gnss_velocity, gnss_position, lidar, wind] {
            aid.fresh = false;
        }
    }
}

impl AidStatus {
    /// Takes a correction.
    pub(super) fn take(&mut self, correction: &Correction) {
        self.take_next(0, correction);
    }

    /// Takes the correction by one component of a fix; component 0 begins a fix.
    pub(super) fn take_next(&mut self, number: usize, correction: &Correction) {
        let &Correction { innovation, normalised_squared, gate, accepted, .. } = correction;
        // No NaN is stored: its bits differ between processors.
        let (innovation, test_ratio) = if normalised_squared.is_finite() {
            (innovation, libm::sqrt(normalised_squared / gate))
        } else {
            (0.0, f64::INFINITY)
        };
        if number == 0 || test_ratio > self.test_ratio {
            (self.innovation, self.test_ratio) = (innovation, test_ratio);
        }
        self.count(accepted);
    }

    /// Discards the three components of a fix without information on the estimate.
    pub(super) fn discard(&mut self) {
        self.fresh = true;
        self.refused = self.refused.saturating_add(3);
    }

    /// Counts a decision and returns it.
    pub(super) fn count(&mut self, accepted: bool) -> bool {
        self.fresh = true;
        if accepted {
            self.used = self.used.saturating_add(1);
            self.refused_in_a_row = 0;
        } else {
            self.refused = self.refused.saturating_add(1);
            self.refused_in_a_row = self.refused_in_a_row.saturating_add(1);
        }
        accepted
    }
}

/// Whether a height measurement may correct this error: not the attitude, nor the motion along the
/// ground. They are coupled by the force of a leaning vehicle, but the flow around static ports and
/// a sloping field cause errors that last for seconds.
pub(super) fn shown_by_height(index: usize) -> bool {
    ![POSITION, POSITION + 1, VELOCITY, VELOCITY + 1].contains(&index)
        && !(ATTITUDE..ACCELEROMETER_BIAS).contains(&index)
}

/// A sensitivity whose last entry belongs to an error that the configuration may exclude.
pub(super) fn without_last_if(ruled_out: bool, sensitivity: &[(usize, f64)]) -> &[(usize, f64)] {
    &sensitivity[..sensitivity.len() - usize::from(ruled_out)]
}

/// Standard deviation of the velocity of a vehicle at rest on the ground, m/s: wind rocks it.
const AT_REST_M_S: f64 = 0.02;

impl Estimator {
    /// Corrects velocity and position of a vehicle at rest: its velocity is zero. Attitude and
    /// biases are not changed.
    pub(crate) fn take_rest(&mut self) {
        for axis in 0..3 {
            let off_m_s = -self.nominal.velocity_m_s[axis];
            let noise = AT_REST_M_S * AT_REST_M_S;
            let motion = |index| index < ATTITUDE;
            if !self.correct(&[(VELOCITY + axis, 1.0)], off_m_s, noise, motion).accepted {
                // Worse than it was assumed.
                self.covariance.widen(VELOCITY + axis, off_m_s * off_m_s);
                self.correct(&[(VELOCITY + axis, 1.0)], off_m_s, noise, motion);
            }
        }
    }

    /// Corrects by one scalar with its sensitivity to each error. Errors that are not `moved` count
    /// in the variance but are not changed.
    pub(super) fn correct(
        &mut self,
        sensitivity: &[(usize, f64)],
        innovation: f64,
        noise_variance: f64,
        moved: impl Fn(usize) -> bool,
    ) -> Correction {
        self.catch_up();
        let (seen, with) = self.covariance.project(sensitivity);
        let variance = seen + noise_variance;
        let normalised_squared = innovation * innovation / variance;
        let gate = self.config.gate_sigmas * self.config.gate_sigmas;
        // The comparison is false for NaN, so NaN is rejected.
        let accepted = normalised_squared <= gate && variance > 0.0 && variance.is_finite();
        if accepted {
            let mut gain = with;
            for (index, value) in gain.iter_mut().enumerate() {
                *value = if moved(index) { *value / variance } else { 0.0 };
            }
            self.nominal.inject(&gain.map(|share| share * innovation));
            self.covariance.update(&gain, &with, variance);
        }
        Correction { innovation, normalised_squared, variance, gate, accepted }
    }
}
