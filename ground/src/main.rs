//! `ground`: the terminal ground station. Parses the command line, runs, and returns the exit code.

use std::io::Write as _;
use std::panic::AssertUnwindSafe;
use std::process::ExitCode;

use clap::CommandFactory as _;
use ground::cli::Cli;
use ground::exit::Exit;
use protocol::program;

fn main() -> ExitCode {
    let given = match program::read(Cli::command()) {
        Ok(given) => given,
        Err(message) => return Exit::unread(&message).into(),
    };
    // While it unwound, the panic has printed its message, restored the terminal and finished the
    // log.
    let ended = std::panic::catch_unwind(AssertUnwindSafe(|| ground::app::run(&given)));
    match ended {
        Ok(Ok(exit)) => exit,
        Ok(Err(error)) => {
            let _ = writeln!(std::io::stderr(), "error: {error:#}");
            Exit::Error
        }
        Err(_panic) => Exit::Error,
    }
    .into()
}
