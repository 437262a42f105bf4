//! The command line, and the library of campaigns behind it.

mod aborted;
mod bar;
mod campaign;
mod card;
mod check;
mod command_campaign;
mod command_card;
mod command_fly_log;
mod custom_vehicles;
mod drawing;
mod faults;
mod field;
mod findings;
mod hazard;
#[path = "../../flight/tests/missions/mod.rs"]
mod missions;
mod playback;
mod site;
mod trial;
mod trials;
mod unbraked;
mod winds;

use sim::dispersion::Dispersion;
use sim::recipe::Recipe;

/// A flight of a built-in mission, or of one that only tests fly, with a built-in set of
/// dispersions.
fn recipe_of(name: &str, dispersion: &str) -> Recipe {
    let mut missions = flight::vehicles::mission::BUILTIN.iter().chain(&missions::TEST_MISSIONS);
    let mission = missions.find(|(available, _)| *available == name).expect("a mission");
    let set = (dispersion, Dispersion::builtin_toml(dispersion).expect("a set"));
    Recipe::from_texts(*mission, set).expect("a recipe")
}
