//! The world in which a flight begins.

use flight::computer::FRAME_MS;
use flight::vehicle::mission::Mission;
use flight::vehicle::mission::StartPoint;
use flight::vehicle::rigid::RigidState;
use world::{Actuators, World};

use super::SetUpError;
use crate::draw::Draw;

/// Frames that a hanging vehicle falls until its computer knows.
const UNNOTICED_FRAMES: usize = 20;

/// The world at the start of the flight.
pub(crate) fn world(mission: &Mission, drawn: &Draw) -> Result<World, SetUpError> {
    let world = world_at(mission, drawn, &drawn.apogee)?;
    Ok(match (mission.start.at, &mission.launch) {
        (StartPoint::Pad, Some(launch)) => world.on_rail(launch, &drawn.ascent),
        _ => world,
    })
}

/// A world with the vehicle in a state.
pub(super) fn world_at(mission: &Mission, drawn: &Draw, state: &RigidState) -> Result<World, SetUpError> {
    let Draw { truth, flight_seed, .. } = drawn;
    Ok(World::new(&mission.airframe, &mission.motor_curve, truth, state, *flight_seed)?)
}

/// The draw with the state in which the fall begins.
pub(crate) fn falling_as(mission: &Mission, drawn: &Draw) -> Result<Draw, SetUpError> {
    Ok(Draw { apogee: falling(mission, drawn)?, ..*drawn })
}

/// The state in which the fall begins.
fn falling(mission: &Mission, drawn: &Draw) -> Result<RigidState, SetUpError> {
    let (StartPoint::Drone, Some(hanging)) = (mission.start.at, &drawn.hanging) else {
        return Ok(drawn.apogee);
    };
    let (let_go, _) = hanging.at(0.0);
    let mut world = world_at(mission, drawn, &let_go)?;
    world.advance(&at_rest(mission), UNNOTICED_FRAMES * FRAME_MS as usize);
    Ok(*world.state())
}

/// Every fin closed, and no current.
pub(crate) fn at_rest(mission: &Mission) -> Actuators {
    Actuators { fins_rad: [mission.airframe.fins.closed_rad(); 4], ..Actuators::NONE }
}
