//! The lidar.

use flight::vehicle::rigid::RigidState;
use serde::{Deserialize, Serialize};

use super::noise::{Fate, Flaws, fate};
use super::{SensorParams, SensorTruth, Sensors};

flight::with_defaults! {
    /// Lidar, looking backwards along the axis.
    #[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
    #[serde(deny_unknown_fields, default)]
    pub struct LidarParams {
        /// Time between samples, ms; a multiple of the frame's 5 ms.
        pub period_ms: u32 = 10,
        /// Noise of one range, m.
        pub noise_m: f64 = 0.06,
        /// Shortest range, m.
        pub range_min_m: f64 = 0.05,
        /// Longest range, m, straight down; it shrinks as the beam leans.
        pub range_max_m: f64 = 12.0,
        /// Beyond this tilt the ground gives no echo, degrees.
        pub tilt_max_deg: f64 = 45.0,
        /// Below this height of the feet there is no echo while the motor burns, m: dust.
        pub blind_below_m: f64 = 0.0,
        /// Lean of the beam against the axis, each way, degrees.
        pub beam_deg: f64 = 0.0,
        /// Height of the grass tops that reflect the beam, lowest and highest, m; the feet are on
        /// the ground.
        pub grass_m: [f64; 2] = [0.0; 2],
        /// Age of a range beyond the flight computer's assumption, constant over a flight, s.
        pub late_s: f64 = 0.0,
        /// Probability that a range is lost.
        pub dropout_share: f64 = 0.0,
        /// Probability that a range is an outlier: any value within the sensor's limits.
        pub outlier_share: f64 = 0.0,
    }
}

impl Sensors {
    pub(super) fn lidar(&mut self, truth: &SensorTruth) -> Option<f64> {
        let lidar = &self.params.lidar;
        if !self.elapsed_ms.is_multiple_of(lidar.period_ms) {
            return None;
        }
        let noise_m = lidar.noise_m * self.lidar_noise.next();
        let (fate, anywhere) = self.flaws.of_range(&self.params);
        let along_beam = truth.state.world_from_body * self.flaws.beam;
        let tilt_rad = RigidState { world_from_body: along_beam, ..truth.state }.tilt_rad();
        if tilt_rad > lidar.tilt_max_deg.to_radians() {
            return None;
        }
        let lever_m = truth.state.world_from_body * self.places.lever_arms(&truth.cg_m).lidar_m;
        let then_m = truth.state.position_m.z + lever_m.z
            - truth.ground_m
            - self.flaws.grass_m
            - truth.state.velocity_m_s.z * self.flaws.lidar_late_s;
        let range_m = then_m / libm::cos(tilt_rad) + noise_m;
        // Rough ground reflects light in all directions, and less at an angle (Lambert's cosine
        // law). The echo weakens with the square of the range.
        let farthest_m = lidar.range_max_m * libm::cos(tilt_rad).sqrt();
        let blind = truth.burning
            && truth.state.position_m.z - truth.ground_m - truth.cg_over_feet_m < lidar.blind_below_m;
        match fate {
            Fate::Lost => None,
            _ if blind => None,
            Fate::Outlier => Some(lidar.range_min_m + anywhere * (lidar.range_max_m - lidar.range_min_m)),
            Fate::Arrives => (lidar.range_min_m..=farthest_m).contains(&range_m).then_some(range_m),
        }
    }
}

impl Flaws {
    /// Fate of a range, and the position of an outlier between the sensor's limits, 0 to 1.
    fn of_range(&mut self, params: &SensorParams) -> (Fate, f64) {
        let fate = fate(self.lidar.unit(), params.lidar.dropout_share, params.lidar.outlier_share);
        (fate, self.lidar.unit())
    }
}
