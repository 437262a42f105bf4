//! Two independent heights. A check before ignition compares them.
//!
//! The first uses no barometer, only the estimated vertical velocity (inertial and satellite), satellite heights with
//! their slow offset, and the lidar. The second is the barometer's last sample without its estimated errors.

use super::EstimatorConfig;
use crate::computer::memory::remembers;
use serde::{Deserialize, Serialize};

/// An older barometer sample is not used, s. Halved or doubled: no flight changes.
const BAROMETER_KEEPS_S: f64 = 0.25;
/// Correlation time of the vertical velocity's errors, s. Halved or doubled: no flight changes.
const VELOCITY_ERROR_LASTS_S: f64 = 1.0;

/// Growth of the height's variance with each measurement that does not fit. Halved and doubled: 69, 144;
/// halved, the variance shrinks instead.
const DOUBT_FACTOR: f64 = 1.1;

/// Heights of the centre of gravity above the pad, from two sources.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct HeightSources {
    /// Inertial, satellite and lidar, m.
    pub inertial_m: f64,
    /// Its standard deviation, m.
    pub inertial_sigma_m: f64,
    /// Barometer, m; `None` when it has been silent for a quarter of a second.
    pub barometric_m: Option<f64>,
}

impl HeightSources {
    /// The difference of the two heights, m; `None` when there is only one.
    pub fn disagreement_m(&self) -> Option<f64> {
        self.barometric_m.map(|height_m| (height_m - self.inertial_m).abs())
    }
}

/// Height and the satellite height's offset, with their covariance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct HeightChannel {
    height_m: f64,
    offset_m: f64,
    /// Variances of the two and their covariance, m^2.
    height_m2: f64,
    offset_m2: f64,
    cross_m2: f64,
    barometric_m: f64,
    barometer_age_s: f64,
}

remembers!(HeightChannel {
    height_m,
    offset_m,
    height_m2,
    offset_m2,
    cross_m2,
    barometric_m,
    barometer_age_s,
});

impl HeightChannel {
    pub(super) fn new(height_m: f64, height_sigma_m: f64, offset_sigma_m: f64) -> Self {
        Self {
            height_m,
            offset_m: 0.0,
            height_m2: height_sigma_m * height_sigma_m,
            offset_m2: offset_sigma_m * offset_sigma_m,
            cross_m2: 0.0,
            barometric_m: height_m,
            barometer_age_s: f64::INFINITY,
        }
    }

    pub(super) fn predict(
        &mut self,
        config: &EstimatorConfig,
        moved_m: f64,
        velocity_m2_s2: f64,
        interval_s: f64,
    ) {
        self.height_m += moved_m;
        self.height_m2 += velocity_m2_s2 * VELOCITY_ERROR_LASTS_S * interval_s;
        let walk = config.gnss_vertical_walk_m_sqrt_s;
        self.offset_m2 += walk * walk * interval_s;
        self.barometric_m += moved_m;
        self.barometer_age_s += interval_s;
    }

    pub(super) fn take_barometer(&mut self, height_m: f64) {
        self.barometric_m = height_m;
        self.barometer_age_s = 0.0;
    }

    /// Takes a satellite height, and the distance that the vehicle has climbed since the fix was valid.
    pub(super) fn take_gnss(&mut self, config: &EstimatorConfig, height_m: f64, climbed_since_m: f64) {
        let innovation_m = height_m - (self.height_m - climbed_since_m + self.offset_m);
        let noise = config.gnss_vertical_m * config.gnss_vertical_m;
        self.update(config, innovation_m, [1.0, 1.0], noise);
    }

    /// Takes a height from the lidar's range and the tilt; the noise grows with the tilt of the beam.
    pub(super) fn take_lidar(&mut self, config: &EstimatorConfig, height_m: f64, cos_tilt: f64) {
        let sigma = config.lidar_m * cos_tilt;
        self.update(config, height_m - self.height_m, [1.0, 0.0], sigma * sigma);
    }

    fn update(
        &mut self,
        config: &EstimatorConfig,
        innovation_m: f64,
        [height, offset]: [f64; 2],
        noise: f64,
    ) {
        let with_height = height * self.height_m2 + offset * self.cross_m2;
        let with_offset = height * self.cross_m2 + offset * self.offset_m2;
        let variance = height * with_height + offset * with_offset + noise;
        let gate = config.gate_sigmas * config.gate_sigmas * variance;
        if innovation_m.is_nan() || innovation_m * innovation_m > gate {
            // Each rejected measurement increases the variance a little, so that the channel cannot reject a sensor
            // forever.
            self.height_m2 *= DOUBT_FACTOR;
            return;
        }
        let (gain_height, gain_offset) = (with_height / variance, with_offset / variance);
        self.height_m += gain_height * innovation_m;
        self.offset_m += gain_offset * innovation_m;
        self.height_m2 -= gain_height * with_height;
        self.cross_m2 -= gain_height * with_offset;
        self.offset_m2 -= gain_offset * with_offset;
    }

    pub(super) fn sources(&self) -> HeightSources {
        HeightSources {
            inertial_m: self.height_m,
            inertial_sigma_m: libm::sqrt(self.height_m2.max(0.0)),
            barometric_m: (self.barometer_age_s <= BAROMETER_KEEPS_S).then_some(self.barometric_m),
        }
    }

    pub(super) fn is_finite(&self) -> bool {
        [self.height_m, self.offset_m, self.height_m2, self.offset_m2, self.cross_m2, self.barometric_m]
            .iter()
            .all(|value| value.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_jump_or_silence_of_the_barometer_is_visible() {
        let config = EstimatorConfig::default();
        let mut channel = HeightChannel::new(100.0, 0.5, 1.0);
        assert_eq!(channel.sources().disagreement_m(), None);
        channel.take_barometer(103.5);
        assert_eq!(channel.sources().disagreement_m(), Some(3.5));
        for _ in 0..60 {
            channel.predict(&config, -0.2, 0.01, 0.005);
        }
        assert_eq!(channel.sources().disagreement_m(), None);
        assert!((channel.sources().inertial_m - 88.0).abs() < 1e-9);
    }

    #[test]
    fn the_lidar_removes_the_offset_of_the_satellite_heights() {
        let config = EstimatorConfig::default();
        // The truth is 8 m, the channel has 9 m, and the satellites' offset is 1.2 m.
        let mut channel = HeightChannel::new(9.0, 0.8, 1.0);
        for _ in 0..3 {
            channel.take_gnss(&config, 9.2, 0.0);
        }
        for _ in 0..50 {
            channel.take_lidar(&config, 8.0, 1.0);
        }
        let sources = channel.sources();
        assert!((sources.inertial_m - 8.0).abs() < 0.02, "{sources:?}");
        assert!(sources.inertial_sigma_m < 0.01, "{sources:?}");
        assert!((channel.offset_m - 1.2).abs() < 0.1, "{channel:?}");
    }
}
