//! The `replay` command.

use std::process::ExitCode;

use clap::Parser as _;
use protocol::program::Exit;
use replay::{Cli, cli};

fn main() -> ExitCode {
    let answered = Cli::try_parse().map_or_else(|message| Ok(Exit::unread(&message)), Cli::run);
    answered
        .unwrap_or_else(|error| {
            cli::say(&format!("{error:#}"));
            Exit::Error
        })
        .into()
}
