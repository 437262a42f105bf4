//! `replay recover`.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use replay::output::{Destination, Overwrite};
use replay::print::{print_json, print_recovery};
use replay::recover::recover;

use super::{Answer, answer};

#[derive(Debug, Args)]
pub(super) struct Ask {
    /// The damaged log.
    file: PathBuf,
    /// The log to write.
    output: PathBuf,
    /// Replace an existing file, but never the damaged log itself.
    #[arg(long)]
    force: bool,
    /// Answer in JSON.
    #[arg(long)]
    json: bool,
}

impl Ask {
    pub(super) fn run(self) -> Result<Answer> {
        let destination = Destination { path: &self.output, overwrite: Overwrite::if_forced(self.force) };
        let recovery = recover(&self.file, destination)?;
        answer(
            |output| {
                if self.json { print_json(&recovery, output) } else { print_recovery(&recovery, output) }
            },
        )?;
        Ok(Answer::Given)
    }
}
