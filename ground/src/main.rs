//! `ground`: the terminal ground station. Parses the command line, runs, and returns the exit code.

use std::io::Write as _;
use std::panic::AssertUnwindSafe;
use std::process::ExitCode;

use clap::CommandFactory as _;
use ground::cli::Cli;
use ground::exit::Exit;

fn main() -> ExitCode {
    let given = match Cli::command().try_get_matches() {
        Ok(given) => given,
        Err(message) => {
            // Help and version are printed here, too. A failure to print them is ignored.
            let _ = message.print();
            return if message.use_stderr() { code(Exit::Usage) } else { ExitCode::SUCCESS };
        }
    };
    // While it unwound, the panic has printed its message, restored the terminal and finished the log.
    let ended = std::panic::catch_unwind(AssertUnwindSafe(|| ground::app::run(&given)));
    match ended {
        Ok(Ok(exit)) => code(exit),
        Ok(Err(error)) => {
            let _ = writeln!(std::io::stderr(), "error: {error:#}");
            code(Exit::Error)
        }
        Err(_panic) => code(Exit::Error),
    }
}

fn code(exit: Exit) -> ExitCode {
    ExitCode::from(exit as u8)
}
