//! The subcommands of the program, one file each.

pub(crate) mod campaign;
pub(crate) mod card;
mod choices;
pub(crate) mod computer;
mod cost;
pub(crate) mod fly;
pub(crate) mod hazard;
pub(crate) mod landability;
pub(crate) mod manual;
pub(crate) mod motors;
pub(crate) mod output;
pub(crate) mod paper;
mod single;
pub(crate) mod world;
