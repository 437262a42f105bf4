//! A frame of the simulated vehicle and of its end of MAVLink.

pub use avionics::link::endpoint::{Outgoing, Path, UplinkState, VehicleEndpoint, gives_out_its_log};
pub use avionics::link::vehicle::VehicleKind;
use flight::computer::crew::{Answer, Request};
use flight::computer::messages::CrewMessage;

use crate::wire::vehicle::{Vehicle, VehicleEvent, VehicleStep};

/// Steps the vehicle by one frame with the requests from the links and from its own programme.
/// Returns the events and the answers to its own programme. Answers to the links come out of
/// [`VehicleEndpoint::poll`].
pub fn step(
    endpoint: &mut VehicleEndpoint,
    vehicle: &mut Vehicle,
    local: &[Request],
) -> (Vec<VehicleEvent>, Vec<Answer>) {
    let UplinkState { uplink, commander, requests } = endpoint.uplink_state(vehicle.time_s());
    vehicle.set_uplink(uplink, commander);
    let requests = [&requests, local].concat();
    let VehicleStep { events, mut answers } = vehicle.step(&requests);
    let to_itself = answers.drain((requests.len() - local.len()).min(answers.len())..).collect();
    endpoint.on_answers(&answers, &vehicle.state());
    for event in &events {
        match event {
            VehicleEvent::Message(CrewMessage::Text { severity, text }) => {
                endpoint.send_text(*severity, text);
            }
            VehicleEvent::Verdict => endpoint.announce_verdict(),
            // [`VehicleEndpoint::poll`] sees a new phase, like every other change of the mode.
            VehicleEvent::Message(CrewMessage::PhaseChanged { .. }) | VehicleEvent::Planned(_) => {}
        }
    }
    (events, to_itself)
}

#[cfg(test)]
mod tests;
