//! The lidar: the slant range to the ground behind the vehicle.

use super::correction::{INFLATION_POSITION_M, POSITION_REJECTIONS, shown_by_height};
use super::covariance::{ATTITUDE, LIDAR_LATE, POSITION, SLOPE};
use super::{Estimator, HeightSources};
use crate::estimation::sensor_watch::LIDAR_BLIND_M;

/// Number of correlated samples: a beam misalignment causes the same error in all samples taken at
/// the same lean, 20 in 0.2 s.
const ASKEW_SAMPLES: f64 = 20.0;
/// Agreement of ranges that contradict the estimate, m, before they are accepted instead of it: in
/// two hundredths of a second the estimate's error changes by centimetres, and an outlier by
/// metres.
const AGREES_M: f64 = 0.5;
/// Distance from the barometer's height, m, beyond which such ranges are not accepted: the
/// vehicle's exhaust causes 3 m of pressure error, a slow offset some more.
const ASTRAY_M: f64 = 8.0;
/// Cosine of the tilt (49 degrees) beyond which a lidar range is not used for the height: the beam
/// meets the ground too far away.
const LIDAR_COS_TILT: f64 = 0.65;

/// Vertical speed, m/s, at which no range repeats the one before it to the centimetre.
const MOVES_M_S: f64 = 1.0;
/// Deviation of a lidar height, m and standard deviations, that loses against two other heights
/// that agree.
const CONTRADICTS_M: f64 = 1.0;
const CONTRADICTS_SIGMAS: f64 = 2.0;
/// Two heights agree if they differ by less than this share of the farther one's distance from it.
const AGREE_SHARE: f64 = 0.7;

impl Estimator {
    /// Whether barometer and inertial height, both independent of the lidar, agree against its
    /// height, m.
    pub(crate) fn others_contradict_m(&self, height_m: f64) -> bool {
        let HeightSources { inertial_m, inertial_sigma_m, barometric_m } =
            self.heights_without_lidar.sources();
        let Some(barometric_m) = barometric_m else { return false };
        let [inertial_off_m, barometric_off_m] =
            [inertial_m, barometric_m].map(|other_m| (height_m - other_m).abs());
        inertial_off_m.min(barometric_off_m) > CONTRADICTS_M + CONTRADICTS_SIGMAS * inertial_sigma_m
            && (barometric_m - inertial_m).abs() < AGREE_SHARE * inertial_off_m.max(barometric_off_m)
    }

    /// The lidar looks along body `-x` from its place behind the centre of gravity. Its range plus
    /// that distance is the height divided by the cosine of the tilt: `s = h / n`, `n` the nose's
    /// vertical part. A small turn `d` about the world's axes adds `d_x n_y - d_y n_x` to `n`, so
    /// it adds `-s / n (d_x n_y - d_y n_x)` to `s`.
    pub(super) fn take_lidar(&mut self, range_m: f64, lever_m: &nalgebra::Vector3<f64>) {
        let nose = self.nominal.world_from_body * nalgebra::Vector3::x();
        if nose.z < LIDAR_COS_TILT {
            self.aids.lidar.count(false);
            return;
        }
        let state = &self.nominal;
        let climb_m_s = state.velocity_m_s.z;
        // The point where the beam meets the ground, from the pad.
        let reach = state.position_m.z / nose.z;
        let hit_m = state.position_m.xy() - nose.xy() * reach;
        let height_m = state.position_m.z - state.lidar_late_s * climb_m_s - state.slope.dot(&hit_m);
        let slant_m = height_m / nose.z;
        let mut sensitivity = [(POSITION + 2, 1.0 / nose.z); 6];
        sensitivity[1] = (ATTITUDE, -slant_m / nose.z * nose.y);
        sensitivity[2] = (ATTITUDE + 1, slant_m / nose.z * nose.x);
        let mut known = 3;
        if self.config.lidar_late_s > 0.0 {
            sensitivity[known] = (LIDAR_LATE, -climb_m_s / nose.z);
            known += 1;
        }
        if self.config.ground_slope_deg > 0.0 {
            sensitivity[known] = (SLOPE, -hit_m.x / nose.z);
            sensitivity[known + 1] = (SLOPE + 1, -hit_m.y / nose.z);
            known += 2;
        }
        let aside_m = self.nominal.world_from_body * nalgebra::Vector3::new(0.0, lever_m.y, lever_m.z);
        let measured_m = range_m - lever_m.x - aside_m.z / nose.z;
        // The beam leans with the airframe, not with the inertial unit: the same error in many
        // samples.
        let askew_m = slant_m * nose.xy().norm() / nose.z * self.config.mounting_deg.to_radians();
        let noise = self.config.lidar_m * self.config.lidar_m + askew_m * askew_m * ASKEW_SAMPLES;
        let take = |estimator: &mut Self| {
            estimator.correct(&sensitivity[..known], measured_m - slant_m, noise, shown_by_height)
        };
        let repeated = range_m.to_bits() == self.last_range_m.to_bits() && climb_m_s.abs() > MOVES_M_S;
        self.last_range_m = range_m;
        if repeated || range_m < LIDAR_BLIND_M || self.others_contradict_m(measured_m * nose.z) {
            self.aids.lidar.count(false);
            return;
        }
        let before_m = self.aids.lidar.innovation;
        let correction = take(self);
        self.aids.lidar.take(&correction);
        let agrees = (correction.innovation - before_m).abs() < AGREES_M;
        let barometric_m = self.heights.sources().barometric_m;
        let astray = barometric_m.is_some_and(|height_m| (measured_m * nose.z - height_m).abs() > ASTRAY_M);
        if agrees && !astray && self.aids.lidar.refused_in_a_row >= POSITION_REJECTIONS {
            self.aids.lidar.refused_in_a_row = 0;
            self.covariance.widen(POSITION + 2, INFLATION_POSITION_M * INFLATION_POSITION_M);
            // At once: the barometer's next sample would end the rejection at a height that fits no
            // range.
            take(self);
        }
        if measured_m.is_finite() {
            let late_m = self.nominal.lidar_late_s * climb_m_s;
            self.heights.take_lidar(&self.config, measured_m * nose.z + late_m, nose.z);
        }
    }
}
