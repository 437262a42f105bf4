//! `replay info`.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use replay::info::info;
use replay::print::{print_info, print_json};

use super::{Answer, answer, warn_of_completeness};

#[derive(Debug, Args)]
pub(super) struct Ask {
    /// The log, an MCAP file.
    file: PathBuf,
    /// Answer in JSON.
    #[arg(long)]
    json: bool,
}

impl Ask {
    pub(super) fn run(self) -> Result<Answer> {
        let info = info(&self.file)?;
        answer(|output| if self.json { print_json(&info, output) } else { print_info(&info, output) })?;
        warn_of_completeness(&info.file, &info.completeness);
        Ok(Answer::Given)
    }
}
