//! Writes the content of a log in the formats of other programs.
//!
//! * [`export_tables`]: CSV, one file a table; see [`table`](crate::table).
//!
//! A separate program exports to Rerun, because Rerun costs more to compile than all the rest.

mod tables;

use std::path::PathBuf;

use anyhow::{Context as _, Result};
use clap::ValueEnum;
pub use tables::{ExportedFile, export_tables};

use crate::cli::{Answer, give, warn_of_loss};
use crate::log::FlightLog;
use protocol::program::Exit;

#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The log, an MCAP file.
    file: PathBuf,
    /// The format.
    #[arg(long, value_enum)]
    to: Option<Format>,
    /// The directory to write: one file for each table.
    #[arg(long, short, alias = "output", value_name = "PATH")]
    out: Option<PathBuf>,
    /// Answer in JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    /// Comma-separated values.
    Csv,
}

impl Args {
    pub(crate) fn run(self) -> Result<Exit> {
        // What is no log needs no format.
        let mut log = FlightLog::open(&self.file)?;
        self.to.context("--to is missing: csv; replay-rerun writes a Rerun recording")?;
        let output = self.out.as_deref().context("--out is missing: where to write")?;
        let files = export_tables(&mut log, output)?;
        let outcome = give(&files, self.json)?;
        warn_of_loss(log.name(), log.damage().map(ToString::to_string).as_deref(), None);
        Ok(outcome)
    }
}

impl Answer for ExportedFile {
    fn sentences(&self) -> Vec<String> {
        vec![format!("{}: {} rows of {} columns", self.path.display(), self.rows, self.columns)]
    }
}
