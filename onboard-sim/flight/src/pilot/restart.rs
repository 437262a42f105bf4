//! The flight computer after a restart in the air.

use super::{Outlook, Pilot};
use crate::aim::AimLoop;
use crate::estimator::{Estimator, StartUncertainty};
use crate::powered::PoweredGuidance;

impl Pilot {
    /// What is left of a pilot that starts again at `time_s`.
    ///
    /// Kept, as in memory that outlives the power: phase and latches, what is known of motor and drag, the last
    /// commands, and the last estimate, which is carried on by what was last felt over the time that was lost, and
    /// believed no better than at apogee. Estimator, outlook, plan and gimbal loop begin anew.
    #[must_use]
    pub fn restarted(&self, time_s: f64) -> Self {
        let mission = &self.known.mission;
        let uncertainty = StartUncertainty::at_apogee();
        let estimator = self.estimate.map_or_else(
            || self.estimator.clone(),
            |estimate| {
                let lost_s = (time_s - estimate.time_s).max(0.0);
                let mut believed = estimate.state;
                let force = believed.world_from_body * estimate.specific_force_m_s2;
                let acceleration_m_s2 = force - nalgebra::Vector3::z() * mission.gravity_m_s2;
                believed.position_m +=
                    believed.velocity_m_s * lost_s + acceleration_m_s2 * (0.5 * lost_s * lost_s);
                believed.velocity_m_s += acceleration_m_s2 * lost_s;
                Estimator::new(&mission.estimator, &uncertainty, time_s, &believed)
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
