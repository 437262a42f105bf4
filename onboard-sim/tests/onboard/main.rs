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
mod findings;
mod hazard;
mod playback;
mod site;
mod trial;
mod trials;
mod unbraked;
