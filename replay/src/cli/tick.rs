//! `replay tick`.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use replay::log::Recording;
use replay::print::{print_json, print_tick};
use replay::tick::tick;

use super::{Answer, answer, warn_of_what_is_missing};

#[derive(Debug, Args)]
pub(super) struct Ask {
    /// The log, an MCAP file.
    file: PathBuf,
    /// The tick's number.
    tick: u64,
    /// Answer in JSON, with the whole path.
    #[arg(long)]
    json: bool,
}

impl Ask {
    pub(super) fn run(self) -> Result<Answer> {
        let recording = Recording::open(&self.file)?;
        warn_of_what_is_missing(&recording);
        let report = tick(&recording, self.tick)?;
        answer(|output| if self.json { print_json(&report, output) } else { print_tick(&report, output) })?;
        Ok(Answer::Given)
    }
}
