//! `replay bisect`.

use std::path::PathBuf;

use anyhow::{Result, ensure};
use clap::Args;
use replay::log::Recording;
use replay::print::{print_bisect, print_json};
use replay::refly::StartAt;
use replay::sweep::{BisectOptions, bisect};

use super::refly::FlownHow;
use super::{Answer, answer, stop_on_interrupt, warn_of_what_is_missing};

#[derive(Debug, Args)]
pub(super) struct Ask {
    /// The log, an MCAP file.
    file: PathBuf,
    /// The setting to change, named as in the mission.
    path: String,
    /// Lowest value tried.
    #[arg(long, value_name = "VALUE", allow_negative_numbers = true)]
    lowest: f64,
    /// Highest value tried.
    #[arg(long, value_name = "VALUE", allow_negative_numbers = true)]
    highest: f64,
    /// Value to begin with [default: the mission's value].
    #[arg(long, allow_negative_numbers = true)]
    value: Option<f64>,
    /// Change the plant only; the controller does not know about the change.
    #[arg(long)]
    of_plant: bool,
    /// Values tried on either side before the change is narrowed down.
    #[arg(long, value_name = "N", default_value_t = 32)]
    steps: u32,
    #[command(flatten)]
    how: FlownHow,
    /// Answer in JSON.
    #[arg(long)]
    json: bool,
}

impl Ask {
    pub(super) fn run(self) -> Result<Answer> {
        let range = (self.lowest, self.highest);
        ensure!(range.0 < range.1, "--lowest {} must be below --highest {}", range.0, range.1);
        let recording = Recording::open(&self.file)?;
        warn_of_what_is_missing(&recording);
        let options = BisectOptions {
            path: self.path,
            plant_alone: self.of_plant,
            value: self.value,
            from: self.lowest,
            to: self.highest,
            steps: self.steps,
            refly: self.how.options(StartAt::Landing)?,
        };
        let stop = stop_on_interrupt()?;
        let report = bisect(&recording, &options, &stop)?;
        answer(|output| if self.json { print_json(&report, output) } else { print_bisect(&report, output) })?;
        Ok(Answer::Given)
    }
}
