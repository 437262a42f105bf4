//! `replay evaluate`.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use replay::evaluate::evaluate;
use replay::log::Recording;
use replay::print::{print_evaluate, print_evaluate_csv, print_json};

use super::settings::SettingArguments;
use super::{Answer, answer, warn_of_what_is_missing};

#[derive(Debug, Args)]
pub(super) struct Ask {
    /// The log, an MCAP file.
    file: PathBuf,
    #[command(flatten)]
    settings: SettingArguments,
    /// Answer in JSON, with every tick.
    #[arg(long, conflicts_with = "csv")]
    json: bool,
    /// Answer as CSV, with every tick.
    #[arg(long)]
    csv: bool,
}

impl Ask {
    pub(super) fn run(self) -> Result<Answer> {
        let recording = Recording::open(&self.file)?;
        warn_of_what_is_missing(&recording);
        let report = evaluate(&recording, &self.settings.all()?)?;
        answer(|output| match () {
            () if self.json => print_json(&report, output),
            () if self.csv => print_evaluate_csv(&report, output),
            () => print_evaluate(&report, output),
        })?;
        Ok(Answer::Given)
    }
}
