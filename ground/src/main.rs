//! `ground`: the terminal ground station.

use std::io::Write as _;
use std::panic::AssertUnwindSafe;
use std::process::ExitCode;

use clap::Parser as _;
use ground::cli::Cli;
use ground::exit::Exit;

fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(message) => {
            // Help and version are printed here too. Nothing is left to do if they cannot be.
            let _ = message.print();
            return if message.use_stderr() { code(Exit::Usage) } else { ExitCode::SUCCESS };
        }
    };
    if let Some(flag) = cli.ignored_flag() {
        let why = "it belongs to the station that holds the link";
        let _ = writeln!(std::io::stderr(), "error: {flag} means nothing to this command: {why}");
        return code(Exit::Usage);
    }
    // A panic has restored the terminal and ended the log while it unwound, and has said what it was.
    let ended = std::panic::catch_unwind(AssertUnwindSafe(|| ground::app::run(&cli)));
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
