//! The `replay` command.

use std::process::ExitCode;

use clap::Parser as _;

use replay::{Cli, cli};

/// Every exit code is decided here, and listed in the help of [`Cli`].
fn main() -> ExitCode {
    let answered = match Cli::try_parse() {
        Ok(cli) => cli.run(),
        Err(usage) => {
            // Help goes to stdout and is not an error; anything else goes to stderr. If writing fails here, there is
            // nothing left to do.
            let _ = usage.print();
            return ExitCode::from(if usage.use_stderr() { cli::EXIT_NO_ANSWER } else { 0 });
        }
    };
    match answered {
        Ok(answer) => ExitCode::from(answer.exit_code()),
        Err(error) => {
            cli::say(&format!("{error:#}"));
            ExitCode::from(cli::EXIT_NO_ANSWER)
        }
    }
}
