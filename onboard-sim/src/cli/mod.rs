//! Subcommands of the program, a file each.

pub(crate) mod campaign;
mod cost;
mod single;
