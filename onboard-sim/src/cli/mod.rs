//! The subcommands of the program, one file each.

pub(crate) mod campaign;
mod cost;
pub(crate) mod fly;
mod single;
