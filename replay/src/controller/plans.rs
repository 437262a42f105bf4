//! The landings that a flight computer plans. They are not in its log, but running the computer again gives the same
//! plans.

use flight::computer::pilot::Pilot;
use flight::guidance::controller::ControlLevel;
use flight::guidance::powered::Plane;
use flight::vehicle::dynamics::PlanarState;
use nalgebra::Vector3;

/// Tells a new plan from an earlier plan that is still being flown; frames must come in order.
#[derive(Debug, Clone, Default)]
pub struct NewPlans {
    flown: Vec<PlanarState>,
}

impl NewPlans {
    /// The plan that a flight computer made in the frame it has just run, in which `level` decided: states relative to
    /// the air in the plane of the landing, and the time between them, s. `None` if it flies an earlier plan or none.
    pub fn made<'p>(&mut self, pilot: &'p Pilot, level: u32) -> Option<(&'p [PlanarState], f64)> {
        let planned = level != u32::from(ControlLevel::Idle.index());
        let (states, step_s) =
            pilot.planned().filter(|(states, _)| planned && *states != self.flown.as_slice())?;
        self.flown = states.to_vec();
        Some((states, step_s))
    }
}

/// The path of the centre of gravity in a plan just made, m: x, y, z of the world. It begins at the estimated position;
/// motion across the plane of the landing is not planned.
pub fn path_in_world_m(pilot: &Pilot, states: &[PlanarState], step_s: f64) -> Vec<[f64; 3]> {
    let (Some(plane), Some(estimate), Some(first)) = (pilot.plane(), pilot.estimate(), states.first()) else {
        return Vec::new();
    };
    let wind_m_s = estimate.wind_m_s.push(0.0).dot(&plane.along);
    let place = |(node, state): (usize, &PlanarState)| {
        let over_ground = Plane::over_ground(state, wind_m_s, node as f64 * step_s);
        let moved =
            plane.along * (over_ground.x_m - first.x_m) + Vector3::z() * (over_ground.z_m - first.z_m);
        (estimate.state.position_m + moved).into()
    };
    states.iter().enumerate().map(place).collect()
}
