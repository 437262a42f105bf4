//! Health of the estimate: whether it is good enough to ignite a motor, and if not, why. Also the
//! two independent heights behind that decision.

use core::fmt;
use serde::{Deserialize, Serialize};

use super::{Aids, EstimatorConfig, Sigmas};

/// Number of frames without a usable inertial sample that the last sample bridges.
pub(super) const BRIDGED_FRAMES: u32 = 4;
/// Shortest time that the estimate stays unhealthy after a restart, s.
pub(super) const UNHEALTHY_AFTER_RESTART_S: f64 = 1.0;
/// The same after a small velocity surprise, s: two fixes, after which the standard deviations show
/// the uncertainty. Longer would abandon a landing: half a second of bad health ends it.
pub(super) const UNHEALTHY_AFTER_SURPRISE_S: f64 = 0.45;

/// Verdict of the estimator.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Health {
    /// Every standard deviation is inside its limit, and the sensors agree with the estimate.
    Good,
    /// The estimate must not be used.
    Unhealthy(HealthIssue),
}

numbered_enum! {
/// Why an estimate must not be used; the worst reason comes first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum HealthIssue {
    /// The state was not a number, and the filter restarted.
    Restarted = "estimate diverged and started afresh",
    /// The inertial unit has sent no usable sample for several frames.
    Imu = "no usable inertial samples",
    /// The filter had to increase its uncertainty, because satellite velocities differed too much
    /// from their predictions on average.
    Surprised = "satellite velocities kept disagreeing",
    /// The velocity's standard deviation is too large.
    Velocity = "velocity uncertain",
    /// The height's standard deviation is too large.
    Height = "height uncertain",
    /// The horizontal position's standard deviation is too large.
    Horizontal = "horizontal position uncertain",
    /// The tilt's standard deviation is too large.
    Tilt = "tilt uncertain",
}
}

impl Health {
    /// [`Health::Good`].
    pub fn is_good(self) -> bool {
        self == Self::Good
    }
}

impl fmt::Display for Health {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Good => out.write_str("good"),
            Self::Unhealthy(reason) => out.write_str(reason.name()),
        }
    }
}

/// The verdict; the worst reason comes first. Ages are times since the event, s.
pub(super) fn judge(
    config: &EstimatorConfig,
    aids: &Aids,
    sigmas: &Sigmas,
    restart_age_s: f64,
    surprised: bool,
) -> Health {
    let limits = &config.health;
    // In the order of the reasons.
    let applies = [
        restart_age_s < UNHEALTHY_AFTER_RESTART_S,
        aids.imu.refused_in_a_row > BRIDGED_FRAMES,
        surprised,
        sigmas.velocity_m_s.z > limits.velocity_m_s || sigmas.velocity_m_s.xy().max() > limits.lateral_m_s,
        sigmas.position_m.z > limits.height_m,
        sigmas.position_m.xy().max() > limits.horizontal_m,
        sigmas.attitude_rad.xy().max() > limits.tilt_deg.to_radians(),
    ];
    let issue = HealthIssue::ALL.into_iter().zip(applies).find_map(|(issue, holds)| holds.then_some(issue));
    issue.map_or(Health::Good, Health::Unhealthy)
}

with_defaults! {
    /// Consistency of satellite velocities over time. Each may pass its gate although together they
    /// differ too much from their predictions: the test of the normalised innovation squared over
    /// time (Y. Bar-Shalom, X. R. Li and T. Kirubarajan, Estimation with Applications to Tracking
    /// and Navigation, 2001, section 5.4), with a fading memory.
    #[derive(Debug, Clone, Copy, PartialEq, Serialize)]
    pub(super) struct Surprise {
        mean: f64 = 1.0,
    }
}

/// Weight of the newest value in the running mean of the normalised innovation squared: the mean
/// remembers three fixes of three numbers.
const NEWEST: f64 = 0.1;
/// In a consistent filter a mean this large has a probability below 1e-6 per fix (the expected mean
/// is 1).
const TOO_MUCH: f64 = 5.0;

impl Surprise {
    /// Takes one normalised innovation squared. Returns true when the filter must increase its
    /// uncertainty; the mean then starts again.
    pub(super) fn take(&mut self, normalised_squared: f64) -> bool {
        self.mean += NEWEST * (normalised_squared.min(100.0) - self.mean);
        let too_much = self.mean > TOO_MUCH;
        if too_much {
            self.mean = 1.0;
        }
        too_much
    }
}

// Two independent heights. A check before ignition compares them.
//
// The first uses no barometer, only the estimated vertical velocity (inertial and satellite),
// satellite heights with their slow offset, and the lidar. The second is the barometer's last
// sample without its estimated errors.

/// Maximum age of a barometer sample, s: a dozen missing samples.
const BAROMETER_MAX_AGE_S: f64 = 0.25;
/// Correlation time of the vertical velocity's errors, s: satellite velocities correct them in
/// about that time.
const VELOCITY_ERROR_LASTS_S: f64 = 1.0;

/// Growth of the height's variance with each rejected measurement; below 1 the variance would
/// shrink.
const INFLATION_FACTOR: f64 = 1.1;

/// Smallest contradiction, standard deviations.
const CONTRADICTS_SIGMAS: f64 = 3.0;

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

    /// The same, m, if the inertial height is accurate enough to contradict; without fixes it soon
    /// is not.
    pub fn contradiction_m(&self) -> Option<f64> {
        self.disagreement_m()
            .filter(|off_m| off_m.is_nan() || *off_m > CONTRADICTS_SIGMAS * self.inertial_sigma_m)
    }
}

/// Height and the satellite height's offset, with their covariance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(super) struct HeightChannel {
    height_m: f64,
    offset_m: f64,
    /// Variances of the two and their covariance, m^2.
    height_m2: f64,
    offset_m2: f64,
    cross_m2: f64,
    barometric_m: f64,
    barometer_age_s: f64,
    fix_age_s: f64,
}

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
            fix_age_s: 0.0,
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
        // The variance of an error that has lasted for a time grows with twice that time.
        self.fix_age_s += interval_s;
        self.height_m2 += velocity_m2_s2 * (2.0 * self.fix_age_s).max(VELOCITY_ERROR_LASTS_S) * interval_s;
        let walk = config.gnss_vertical_walk_m_sqrt_s;
        self.offset_m2 += walk * walk * interval_s;
        self.barometric_m += moved_m;
        self.barometer_age_s += interval_s;
    }

    pub(super) fn take_barometer(&mut self, height_m: f64) {
        self.barometric_m = height_m;
        self.barometer_age_s = 0.0;
    }

    pub(super) fn forget_barometer(&mut self) {
        self.barometer_age_s = f64::INFINITY;
    }

    /// Takes a satellite height, the distance that the vehicle has climbed since the fix was valid,
    /// and the variance that its unknown age adds, m^2.
    pub(super) fn take_gnss(
        &mut self,
        config: &EstimatorConfig,
        height_m: f64,
        climbed_since_m: f64,
        aged_m2: f64,
    ) {
        self.fix_age_s = 0.0;
        let innovation_m = height_m - (self.height_m - climbed_since_m + self.offset_m);
        let noise = config.gnss_vertical_m * config.gnss_vertical_m + aged_m2;
        self.update(config, innovation_m, [1.0, 1.0], noise);
    }

    /// Takes a height from the lidar's range and the tilt; the noise grows with the tilt of the
    /// beam.
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
            // Each rejected measurement inflates the variance a little, so that the channel cannot
            // reject a sensor forever.
            self.height_m2 *= INFLATION_FACTOR;
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
            barometric_m: (self.barometer_age_s <= BAROMETER_MAX_AGE_S).then_some(self.barometric_m),
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
    fn a_steady_pull_is_detected_and_one_outlier_is_not() {
        let mut surprise = Surprise::default();
        assert!(!surprise.take(40.0));
        for _ in 0..50 {
            assert!(!surprise.take(1.0));
        }
        let pulls = (0..50).take_while(|_| !surprise.take(9.0)).count();
        assert!((4..=8).contains(&pulls), "{pulls}");
    }

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
            channel.take_gnss(&config, 9.2, 0.0, 0.0);
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
