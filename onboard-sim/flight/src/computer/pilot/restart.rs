//! What a pilot saves for a restart in the air, and how it goes on.

use serde::{Deserialize, Serialize};

use super::Pilot;
use super::ascent::AscentWatch;
use super::fin_watch::FinWatch;
use crate::estimation::estimator::{Estimate, Estimator, StartUncertainty};
use crate::estimation::motor_estimate::MotorEstimate;

/// What a pilot keeps through a reset: the knowledge of motor and drag, the last commands, the last estimate, and what it has
/// seen of its ascent and of its fins. Covariances of the estimator, outlook, plan and gimbal loop are not kept.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SavedPilot {
    motor: MotorEstimate,
    estimate: Option<Estimate>,
    ascent: AscentWatch,
    apogee_m: f64,
    ignited_at_s: Option<f64>,
    fin_share: f64,
    fins_rad: [f64; 4],
    fin_watch: FinWatch,
    gimbal_rad: [f64; 2],
}

impl Pilot {
    pub(in crate::computer) fn saved(&self) -> SavedPilot {
        SavedPilot {
            motor: self.known.motor,
            estimate: self.estimate,
            ascent: self.ascent,
            apogee_m: self.apogee_m,
            ignited_at_s: self.ignited_at_s,
            fin_share: self.fin_share,
            fins_rad: self.fins_rad,
            fin_watch: self.fin_watch,
            gimbal_rad: self.gimbal_rad,
        }
    }

    /// This pilot, which was just powered up, from what was saved before a reset that ended at `time_s`. The saved estimate
    /// is extrapolated over the lost time with the last measured rates and forces, and gets the same uncertainty as
    /// at apogee.
    #[must_use]
    pub(in crate::computer) fn resumed(&self, saved: &SavedPilot, time_s: f64) -> Self {
        let mission = &self.known.mission;
        let uncertainty = StartUncertainty::at_apogee();
        let estimator = saved.estimate.map_or_else(
            || self.estimator.clone(),
            |estimate| {
                let lost_s = (time_s - estimate.time_s).max(0.0);
                let mut believed = estimate.state;
                // It keeps its last rotation rate; the force has the direction at half of the lost time.
                let half = nalgebra::UnitQuaternion::from_scaled_axis(believed.rate_rad_s * (0.5 * lost_s));
                believed.world_from_body *= half;
                let force = believed.world_from_body * estimate.specific_force_m_s2;
                believed.world_from_body *= half;
                let acceleration_m_s2 = force - nalgebra::Vector3::z() * mission.gravity_m_s2;
                believed.position_m +=
                    believed.velocity_m_s * lost_s + acceleration_m_s2 * (0.5 * lost_s * lost_s);
                believed.velocity_m_s += acceleration_m_s2 * lost_s;
                Estimator::new(&mission.estimator, &uncertainty, time_s, &believed)
                    .with_gyro_bias(estimate.gyro_bias_rad_s)
            },
        );
        let SavedPilot {
            motor,
            estimate,
            ascent,
            apogee_m,
            ignited_at_s,
            fin_share,
            fins_rad,
            fin_watch,
            gimbal_rad,
        } = *saved;
        let mut resumed = Self {
            estimator,
            estimate,
            ascent,
            apogee_m,
            ignited_at_s,
            fin_share,
            fins_rad,
            fin_watch,
            gimbal_rad,
            ..self.clone()
        };
        resumed.known.motor = motor;
        resumed
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{UnitQuaternion, Vector3};

    use crate::computer::pilot::sample::{falling, input, released};

    #[test]
    fn the_attitude_is_extrapolated_over_the_lost_time() {
        let mut pilot = falling();
        pilot.step(&mut released(), &input(1, 0.0));
        let mut estimate = pilot.estimate.expect("the pilot has an estimate");
        estimate.state.rate_rad_s = Vector3::new(2.0, 0.5, -0.3);
        pilot.estimate = Some(estimate);
        let found = falling()
            .resumed(&pilot.saved(), estimate.time_s + 0.2)
            .estimator
            .estimate()
            .state
            .world_from_body;
        let turned = UnitQuaternion::from_scaled_axis(estimate.state.rate_rad_s * 0.2);
        let expected = estimate.state.world_from_body * turned;
        assert!(found.angle_to(&expected) < 1e-6, "{}", found.angle_to(&expected));
    }
}
