//! Hardware in the loop on a simulated wire that loses, doubles, delays and reorders what it carries: no sockets, no
//! clock.
#![expect(clippy::unwrap_used, reason = "a test that cannot set itself up has failed")]

mod bad_wire;
mod lockstep;
mod messages;
mod real_time;

use hil::start::{Pace, Start};
use sim::dispersion::Dispersion;
use sim::recipe::Recipe;
use sim::remote::RemoteFlight;
use simulated_vehicle::hil::computer::ComputerEnd;

/// mk2 on a day at the field, with what the wire can carry.
fn recipe() -> Recipe {
    let (name, mission) = *vehicles::mission::BUILTIN.iter().find(|(name, _)| *name == "mk2").unwrap();
    let field = Dispersion::builtin_toml("field").unwrap();
    let toml = Dispersion::toml_with_wire_resolution(field, "field").unwrap();
    Recipe { seed: 2002, ..Recipe::from_texts((name, mission), ("field", &toml)).unwrap() }
}

fn computer(recipe: &Recipe) -> ComputerEnd {
    ComputerEnd::new(&recipe.mission, &recipe.mission_toml)
}

fn start(flight: &RemoteFlight, flight_id: u32, pace: Pace) -> Start {
    Start { flight_id, believed: *flight.believed(), pace }
}
