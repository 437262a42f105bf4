//! The commands that only print: settings, completions, the manual page.

use std::io::Write as _;
use std::path::PathBuf;

use anyhow::Context as _;
use clap::CommandFactory as _;

use crate::cli::{Cli, ConfigCommand};
use crate::config::{Config, EXAMPLE, usual_path};
use crate::exit::Exit;

/// Checks the settings, or prints an example of them.
///
/// # Errors
/// The settings are wrong; the error says where, and what would be accepted.
pub fn config(cli: &Cli, command: &ConfigCommand) -> anyhow::Result<Exit> {
    match command {
        ConfigCommand::Example => print(EXAMPLE.as_bytes())?,
        ConfigCommand::Check { file } => {
            let named = file.as_ref().or(cli.config.as_ref());
            let config = Config::load(named.map(PathBuf::as_path))?;
            let file = named.cloned().or_else(usual_path);
            let said = match file {
                Some(path) if path.exists() => format!("{}: valid", path.display()),
                Some(path) => format!("{}: no such file; these are the defaults", path.display()),
                None => "no settings file; these are the defaults".to_owned(),
            };
            print(format!("{said}\n\n{}", config.table()).as_bytes())?;
        }
    }
    Ok(Exit::Landed)
}

/// A shell's completions, from the same definition as the command line itself.
///
/// # Errors
/// Standard output cannot be written.
pub fn completions(shell: clap_complete::Shell) -> anyhow::Result<Exit> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "ground", &mut script);
    print(&script)?;
    Ok(Exit::Landed)
}

/// The manual page, from the same definition as the command line itself.
///
/// # Errors
/// Standard output cannot be written.
pub fn manual() -> anyhow::Result<Exit> {
    let mut page = Vec::new();
    clap_mangen::Man::new(Cli::command()).render(&mut page).context("writing the manual page")?;
    print(&page)?;
    Ok(Exit::Landed)
}

fn print(bytes: &[u8]) -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    out.write_all(bytes).and_then(|()| out.flush()).context("writing to standard output")
}
