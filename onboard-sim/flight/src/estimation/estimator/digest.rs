//! The estimator's memory, for the pilot's digest.

use super::{
    Doubt, Estimate, Estimator, GateCounters, Gates, Health, HeightSources, ImuSample, Nominal, Sigmas,
};
use crate::computer::memory::{Memory, Remembers, remembers};
use crate::vehicle::rigid::RigidState;

// Configuration, noise and the initial uncertainty come from the mission.
remembers!(Estimator {
    start_s, frames, nominal, covariance, pending, history, heights, sideways, gates, surprise, last_imu, rate_rad_s,
    specific_force_m_s2, last_good, restarts, restarted_at_s, surprised_at_s,
} but { config, noise, start });

remembers!(Nominal {
    position_m,
    velocity_m_s,
    world_from_body,
    gyro_bias_rad_s,
    accelerometer_bias_m_s2,
    wind_m_s,
    barometer_offset_m,
    barometer_ram,
    gnss_offset_m,
    gnss_time_tag_s,
    barometer_late_s,
    lidar_late_s,
    slope,
});
remembers!(Gates { imu, barometer, gnss_velocity, gnss_position, lidar, wind });
remembers!(GateCounters { accepted, rejected, rejected_in_a_row });
remembers!(ImuSample { gyro_rad_s, specific_force_m_s2 });
remembers!(Estimate {
    time_s,
    state,
    specific_force_m_s2,
    wind_m_s,
    gyro_bias_rad_s,
    accelerometer_bias_m_s2,
    sigmas,
    heights,
    health,
});
remembers!(RigidState { position_m, velocity_m_s, world_from_body, rate_rad_s });
remembers!(Sigmas {
    position_m,
    velocity_m_s,
    attitude_rad,
    gyro_bias_rad_s,
    accelerometer_bias_m_s2,
    wind_m_s,
});
remembers!(HeightSources { inertial_m, inertial_sigma_m, barometric_m });

impl Remembers for Health {
    fn remember(&self, memory: &mut Memory) {
        let doubt: u8 = match self {
            Self::Good => 0,
            Self::Doubtful(Doubt::Restarted) => 1,
            Self::Doubtful(Doubt::Imu) => 2,
            Self::Doubtful(Doubt::Surprised) => 3,
            Self::Doubtful(Doubt::Velocity) => 4,
            Self::Doubtful(Doubt::Height) => 5,
            Self::Doubtful(Doubt::Horizontal) => 6,
            Self::Doubtful(Doubt::Tilt) => 7,
        };
        doubt.remember(memory);
    }
}
