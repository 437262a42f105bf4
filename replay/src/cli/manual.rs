//! The command line in other forms: a shell's completions, the manual page.

use std::io::Write as _;

use anyhow::Result;
use clap::CommandFactory as _;

use super::{Answer, Cli, answer};

/// A shell's completions.
pub(super) fn completions(shell: clap_complete::Shell) -> Result<Answer> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "replay", &mut script);
    answer(|out| out.write_all(&script))?;
    Ok(Answer::Given)
}

/// The manual page.
pub(super) fn page() -> Result<Answer> {
    answer(|out| clap_mangen::Man::new(Cli::command()).render(out))?;
    Ok(Answer::Given)
}
