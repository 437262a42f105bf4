//! The pilot after a restart in the air.

use super::{Outlook, Pilot};
use crate::control::aim::AimLoop;
use crate::estimation::estimator::{Estimator, StartUncertainty};
use crate::guidance::powered::PoweredGuidance;

impl Pilot {
    /// This pilot after a restart at `time_s`.
    ///
    /// Kept, as if in memory that survives a power loss: the knowledge of motor and drag, the last commands, and the
    /// last estimate. The estimate is extrapolated over the lost time with the last measured rates and forces, and gets
    /// the same uncertainty as at apogee. Estimator, outlook, plan and gimbal loop start afresh.
    #[must_use]
    pub fn restarted(&self, time_s: f64) -> Self {
        let mission = &self.known.mission;
        let uncertainty = StartUncertainty::at_apogee();
        let estimator = self.estimate.map_or_else(
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
        Self {
            estimator,
            outlook: Outlook::default(),
            powered: PoweredGuidance::new(mission.powered),
            aim_loop: AimLoop::new(mission.aim, mission.estimator.frame_s),
            gate_refusal: None,
            gate_shut_since_s: None,
            ..self.clone()
        }
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
        let found = pilot.restarted(estimate.time_s + 0.2).estimator.estimate().state.world_from_body;
        let turned = UnitQuaternion::from_scaled_axis(estimate.state.rate_rad_s * 0.2);
        let expected = estimate.state.world_from_body * turned;
        assert!(found.angle_to(&expected) < 1e-6, "{}", found.angle_to(&expected));
    }
}
