//! Subcommands of the program, a file each.

pub(crate) mod campaign;
mod cost;
pub(crate) mod fly;
mod single;
