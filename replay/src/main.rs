//! The `replay` command.

use std::process::ExitCode;

use clap::{CommandFactory as _, FromArgMatches as _};
use protocol::program::{self, Exit};
use replay::{Cli, cli};

fn main() -> ExitCode {
    let read = program::read(Cli::command()).and_then(|given| Cli::from_arg_matches(&given));
    let answered = read.map_or_else(|message| Ok(Exit::unread(&message)), Cli::run);
    answered
        .unwrap_or_else(|error| {
            cli::print_error(&format!("{error:#}"));
            Exit::Error
        })
        .into()
}
