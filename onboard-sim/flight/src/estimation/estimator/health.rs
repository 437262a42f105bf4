//! Whether the estimate is good enough to light a motor, and if not, why.

use core::fmt;
use serde::{Deserialize, Serialize};

use super::{EstimatorConfig, Gates, Sigmas};

/// Number of frames without a usable inertial sample that the last sample bridges.
const BRIDGED_FRAMES: u32 = 4;
/// Shortest time that the estimate stays unhealthy after a restart, s.
pub(super) const DOUBT_AFTER_RESTART_S: f64 = 1.0;

/// The estimator's own verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Health {
    /// Every standard deviation is inside its limit and the sensors agree with it.
    Good,
    /// The estimate must not be used.
    Doubtful(Doubt),
}

/// Why an estimate must not be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Doubt {
    /// The state was not a number, and the filter restarted.
    Restarted,
    /// The inertial unit has sent nothing usable for several frames.
    Imu,
    /// The filter had to increase its uncertainty, because satellite velocities differed too much from their
    /// predictions on average.
    Surprised,
    /// The velocity's standard deviation is too large.
    Velocity,
    /// The height's standard deviation is too large.
    Height,
    /// The horizontal position's standard deviation is too large.
    Horizontal,
    /// The tilt's standard deviation is too large.
    Tilt,
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
            Self::Doubtful(doubt) => doubt.fmt(out),
        }
    }
}

impl fmt::Display for Doubt {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(match self {
            Self::Restarted => "estimate diverged and started afresh",
            Self::Imu => "no usable inertial samples",
            Self::Surprised => "satellite velocities kept disagreeing",
            Self::Velocity => "velocity uncertain",
            Self::Height => "height uncertain",
            Self::Horizontal => "horizontal position uncertain",
            Self::Tilt => "tilt uncertain",
        })
    }
}

/// The verdict; the worst reason comes first. Ages are times since the event, s.
pub(super) fn judge(
    config: &EstimatorConfig,
    gates: &Gates,
    sigmas: &Sigmas,
    restart_age_s: f64,
    surprise_age_s: f64,
) -> Health {
    let limits = &config.health;
    let doubts = [
        (restart_age_s < DOUBT_AFTER_RESTART_S, Doubt::Restarted),
        (gates.imu.rejected_in_a_row > BRIDGED_FRAMES, Doubt::Imu),
        (surprise_age_s < DOUBT_AFTER_RESTART_S, Doubt::Surprised),
        (sigmas.velocity_m_s.max() > limits.velocity_m_s, Doubt::Velocity),
        (sigmas.position_m.z > limits.height_m, Doubt::Height),
        (sigmas.position_m.xy().max() > limits.horizontal_m, Doubt::Horizontal),
        (sigmas.attitude_rad.xy().max() > limits.tilt_deg.to_radians(), Doubt::Tilt),
    ];
    doubts
        .into_iter()
        .find_map(|(applies, doubt)| applies.then_some(Health::Doubtful(doubt)))
        .unwrap_or(Health::Good)
}
