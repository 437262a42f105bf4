//! `replay recover`.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use replay::print::{print_json, print_recovery};
use replay::recover::recover;

use super::{Answer, answer};

#[derive(Debug, Args)]
pub(super) struct Ask {
    /// The damaged log.
    file: PathBuf,
    /// The log to write. An existing file is not overwritten.
    output: PathBuf,
    /// Answer in JSON.
    #[arg(long)]
    json: bool,
}

impl Ask {
    pub(super) fn run(self) -> Result<Answer> {
        let recovery = recover(&self.file, &self.output)?;
        answer(
            |output| {
                if self.json { print_json(&recovery, output) } else { print_recovery(&recovery, output) }
            },
        )?;
        Ok(Answer::Given)
    }
}
