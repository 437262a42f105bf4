//! The satellite receiver: fixes of position and velocity that arrive late.
//!
//! A fix has white noise and an error that wanders slowly (Groves 2013, chapter 9).

use serde::Serialize;

use super::correction::{INFLATION_POSITION_M, POSITION_REJECTIONS, without_last_if};
use super::covariance::{
    ACCELEROMETER_BIAS, ATTITUDE, GNSS_OFFSET, GNSS_TIME_TAG, GYRO_BIAS, POSITION, VELOCITY,
};
use super::gnss_gate::REPORTED_M;
use super::strapdown::Since;
use super::{Estimator, EstimatorConfig, GnssFix, health};

/// Inflation of the standard deviations when satellite velocities do not fit on average: velocity.
/// All four cover the effect of a fault of the inertial unit.
const INFLATION_VELOCITY_M_S: f64 = 0.5;
/// Velocity deviation, m/s, below which a surprise counts as creeping: a gyro error of 2 deg/s has
/// moved the velocity by 0.3 when it is detected, one of 20 deg/s by more than 0.45.
const CREEPS_M_S: f64 = 0.4;
/// Inflation of the attitude.
const INFLATION_ATTITUDE_RAD: f64 = 0.04;
/// Inflation of the gyro bias.
const INFLATION_GYRO_BIAS_RAD_S: f64 = 0.05;
/// Inflation of the accelerometer bias.
const INFLATION_ACCELEROMETER_BIAS_M_S2: f64 = 0.5;
/// Lean, rad, beyond which an antenna along the nose loses satellites, and the factor on the
/// assumed error of a fix there. With 1, 1.5 and 2 a receiver with threefold noise there, which
/// loses half of its fixes, lands mk3 in 31, 55 and 59 of 60 flights; a gyro that jumps by 2 deg/s
/// 3 s into the fall in 24, 24 and 19 of 24.
const LEANS_RAD: f64 = 0.35;
const LEANING_NOISE: f64 = 1.5;
/// Speed along an axis, m/s, below which a satellite position does not show the age of its fix: 10
/// ms are 0.15 m.
const SHOWS_AGE_M_S: f64 = 15.0;
/// Weight of the prior, in fixes.
const PRIOR_FIXES: f64 = 10.0;
/// Memory length, in fixes: 8 s.
const REMEMBERED_FIXES: f64 = 40.0;
/// Limit of one fix, standard deviations: an outlier carries no information on the age.
const AGE_SIGMAS: f64 = 3.0;
/// Position components, of ten fixes in two seconds, that must fit after a surprise before the
/// fixes outvote the barometer.
const FITS_AGAIN: u32 = 30;

/// Jitter of the ages of the fixes, estimated from their position errors along the motion:
/// innovation-based adaptive estimation (Mehra, "Approaches to adaptive filtering", IEEE Trans.
/// Automatic Control 17, 1972), of this one number.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(super) struct FixAge {
    variance_s2: f64,
    fixes: f64,
    #[serde(skip)]
    smallest_s2: f64,
}

impl FixAge {
    pub(super) fn new(config: &EstimatorConfig) -> Self {
        let variance_s2 = config.gnss_age_jitter_s * config.gnss_age_jitter_s;
        Self { variance_s2, fixes: PRIOR_FIXES, smallest_s2: 0.1 * variance_s2 }
    }

    /// Takes a position innovation, m, its expected variance for a fix of exact age, m^2, and the
    /// speed, m/s.
    fn take(&mut self, innovation_m: f64, exact_m2: f64, speed_m_s: f64) {
        if self.smallest_s2 <= 0.0 || speed_m_s.abs() < SHOWS_AGE_M_S || !innovation_m.is_finite() {
            return;
        }
        let speed_m2_s2 = speed_m_s * speed_m_s;
        let most_m2 = AGE_SIGMAS * AGE_SIGMAS * (exact_m2 + speed_m2_s2 * self.variance_s2);
        let shown_s2 = ((innovation_m * innovation_m).min(most_m2) - exact_m2) / speed_m2_s2;
        self.fixes = (self.fixes + 1.0).min(REMEMBERED_FIXES);
        self.variance_s2 += (shown_s2 - self.variance_s2) / self.fixes;
        self.variance_s2 = self.variance_s2.max(self.smallest_s2);
    }
}

impl Estimator {
    /// A fix measures the past position and velocity, and the slow offset of the position.
    pub(super) fn take_gnss(&mut self, fix: &GnssFix) {
        self.catch_up();
        let upright = (self.nominal.world_from_body * nalgebra::Vector3::x()).z;
        let leaning = if upright < libm::cos(LEANS_RAD) { LEANING_NOISE } else { 1.0 };
        let [lever_m, lever_m_s] = self.history.lever;
        let off_m_s = self.since_fix(fix).map_or(0.0, |since| {
            (fix.velocity_m_s - self.nominal.velocity_m_s - lever_m_s + since.gained_m_s).norm()
        });
        let reported_m = |horizontal_m: f64| if horizontal_m > REPORTED_M { horizontal_m } else { 0.0 };
        let [horizontal_m, vertical_m] = [
            self.config.gnss_horizontal_m.max(reported_m(fix.quality.horizontal_m)),
            self.config.gnss_vertical_m.max(reported_m(fix.quality.vertical_m)),
        ];
        let sigma_m_s = leaning * self.config.gnss_velocity_m_s.max(fix.quality.speed_m_s);
        for axis in 0..3 {
            let Some(since) = self.since_fix(fix) else {
                self.aids.gnss_velocity.count(false);
                continue;
            };
            // The past velocity is the present one minus the gain since. The gain depends on the
            // attitude and the accelerometer bias, which have errors.
            let sensed = since.gained_m_s - lever_m_s
                + nalgebra::Vector3::z() * (self.config.gravity_m_s2 * since.age_s);
            let by_attitude = sensed.cross_matrix();
            let by_bias = self.nominal.world_from_body.to_rotation_matrix().into_inner() * since.age_s;
            let sensitivity = [
                (VELOCITY + axis, 1.0),
                (ATTITUDE, by_attitude[(axis, 0)]),
                (ATTITUDE + 1, by_attitude[(axis, 1)]),
                (ATTITUDE + 2, by_attitude[(axis, 2)]),
                (ACCELEROMETER_BIAS, by_bias[(axis, 0)]),
                (ACCELEROMETER_BIAS + 1, by_bias[(axis, 1)]),
                (ACCELEROMETER_BIAS + 2, by_bias[(axis, 2)]),
                (GNSS_TIME_TAG, -since.acceleration_m_s2[axis]),
            ];
            let sensitivity = without_last_if(self.config.gnss_time_tag_s <= 0.0, &sensitivity);
            let predicted = self.nominal.velocity_m_s[axis] + lever_m_s[axis] - since.gained_m_s[axis];
            let late = since.acceleration_m_s2[axis];
            let noise = sigma_m_s * sigma_m_s + late * late * self.fix_age.variance_s2;
            let correction = self.correct(sensitivity, fix.velocity_m_s[axis] - predicted, noise, |_| true);
            self.aids.gnss_velocity.take_next(axis, &correction);
            if correction.normalised_squared.is_finite() && self.surprise.take(correction.normalised_squared)
            {
                self.inflate_motion(off_m_s < CREEPS_M_S);
            }
        }
        for axis in 0..3 {
            let Some(since) = self.since_fix(fix) else {
                self.aids.gnss_position.count(false);
                continue;
            };
            let then_m_s = self.nominal.velocity_m_s[axis] + lever_m_s[axis] - since.gained_m_s[axis];
            let sensitivity = [
                (POSITION + axis, 1.0),
                (VELOCITY + axis, -since.age_s),
                (GNSS_OFFSET + axis, 1.0),
                (GNSS_TIME_TAG, -then_m_s),
            ];
            let sensitivity = without_last_if(self.config.gnss_time_tag_s <= 0.0, &sensitivity);
            let predicted = self.nominal.position_m[axis] + lever_m[axis] - since.moved_m[axis]
                + self.nominal.gnss_offset_m[axis];
            let sigma = leaning * if axis == 2 { vertical_m } else { horizontal_m };
            let aged_m2 = then_m_s * then_m_s * self.fix_age.variance_s2;
            let innovation_m = fix.position_m[axis] - predicted;
            let correction = self.correct(sensitivity, innovation_m, sigma * sigma + aged_m2, |_| true);
            self.aids.gnss_position.take_next(axis, &correction);
            self.fix_age.take(innovation_m, correction.variance - aged_m2, then_m_s);
            if axis == 2 && fix.position_m.z.is_finite() {
                let height_m = fix.position_m.z - lever_m.z;
                for heights in [&mut self.heights, &mut self.heights_without_lidar] {
                    heights.take_gnss(&self.config, height_m, since.moved_m.z, aged_m2);
                }
            }
        }
        if self.aids.gnss_position.refused_in_a_row >= POSITION_REJECTIONS {
            self.aids.gnss_position.refused_in_a_row = 0;
            // Until the barometer agrees with the result.
            self.outvoted_from = u32::MAX;
            for axis in 0..3 {
                self.covariance.widen(POSITION + axis, INFLATION_POSITION_M * INFLATION_POSITION_M);
                self.covariance.widen(GNSS_OFFSET + axis, INFLATION_POSITION_M * INFLATION_POSITION_M);
            }
        }
    }

    /// The motion since a fix was valid, by its time tag less the tag's estimated error.
    pub(super) fn since_fix(&self, fix: &GnssFix) -> Option<Since> {
        let [_, lever_m_s] = self.history.lever;
        let antenna_m_s = self.nominal.velocity_m_s + lever_m_s;
        self.history.since(fix.valid_at_s - self.nominal.gnss_time_tag_s, &antenna_m_s)
    }

    /// Increases the uncertainty of motion and inertial biases: satellite velocities do not fit on
    /// average, so an error of the inertial unit must have changed. `creeping`: by little so far.
    fn inflate_motion(&mut self, creeping: bool) {
        self.unhealthy_until_s = self.time_s()
            + if creeping { health::UNHEALTHY_AFTER_SURPRISE_S } else { health::UNHEALTHY_AFTER_RESTART_S };
        self.outvoted_from = self.aids.gnss_position.used.saturating_add(FITS_AGAIN);
        for axis in 0..3 {
            let widen = [
                (VELOCITY, INFLATION_VELOCITY_M_S),
                (ATTITUDE, INFLATION_ATTITUDE_RAD),
                (GYRO_BIAS, INFLATION_GYRO_BIAS_RAD_S),
                (ACCELEROMETER_BIAS, INFLATION_ACCELEROMETER_BIAS_M_S2),
            ];
            for (first, sigma) in widen {
                self.covariance.widen(first + axis, sigma * sigma);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn age() -> FixAge {
        FixAge::new(&EstimatorConfig { gnss_age_jitter_s: 0.01, ..EstimatorConfig::default() })
    }

    /// Innovations of both signs with exactly the variance of this jitter, s, at 40 m/s, beside 0.4
    /// m of everything else.
    fn shown(jitter_s: f64, fixes: u32) -> f64 {
        let mut age = age();
        let off_m = libm::sqrt(0.16 + 1600.0 * jitter_s * jitter_s);
        for fix in 0..fixes {
            age.take(if fix % 2 == 0 { off_m } else { -off_m }, 0.16, -40.0);
        }
        libm::sqrt(age.variance_s2)
    }

    #[test]
    fn fixes_show_how_much_their_ages_vary() {
        assert!((shown(0.03, 200) - 0.03).abs() < 0.002, "{}", shown(0.03, 200));
        assert!((shown(0.01, 200) - 0.01).abs() < 1e-9, "{}", shown(0.01, 200));
        // A fall has about 40 fixes.
        assert!(shown(0.03, 40) > 0.02, "{}", shown(0.03, 40));
        // Exact ages: a third of the prior is left, as an offset of the clock requires.
        assert!((shown(0.0, 200) - 0.01 * libm::sqrt(0.1)).abs() < 1e-9, "{}", shown(0.0, 200));
    }

    #[test]
    fn an_outlier_a_slow_fix_and_nan_have_little_or_no_effect() {
        let mut once = age();
        once.take(500.0, 0.16, -40.0);
        assert!(libm::sqrt(once.variance_s2) < 0.02, "{once:?}");
        let mut none = age();
        none.take(f64::NAN, 0.16, -40.0);
        none.take(500.0, 0.16, 10.0);
        assert_eq!(none, age());
        let mut ruled_out = FixAge::new(&EstimatorConfig::default());
        ruled_out.take(5.0, 0.16, -40.0);
        assert_eq!(ruled_out, FixAge::new(&EstimatorConfig::default()));
    }
}
