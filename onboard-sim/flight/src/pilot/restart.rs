//! The flight computer after a restart in the air.

use super::{Outlook, Pilot};
use crate::aim::AimLoop;
use crate::estimator::{Estimator, StartUncertainty};
use crate::powered::PoweredGuidance;

impl Pilot {
    /// What is left of a pilot that starts again at `time_s`.
    ///
    /// Kept, as in memory that outlives the power: phase and latches, when the motor was commanded and when it was
    /// felt, and the last estimate, which is carried on by its velocity and gravity over the time that was lost, and
    /// believed no better than at apogee. Everything else begins anew.
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
        let mut known = self.known.clone();
        known.drag_scale = 1.0;
        Self {
            known,
            estimator,
            estimate: self.estimate,
            mode: self.mode,
            ignited_at_s: self.ignited_at_s,
            outlook: Outlook::default(),
            powered: PoweredGuidance::new(mission.powered),
            aim_loop: AimLoop::new(mission.aim, mission.estimator.frame_s),
            fin_share: 1.0,
            fins_rad: self.fins_rad,
            gate_refusal: None,
        }
    }
}
