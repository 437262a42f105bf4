//! Writes the content of a log in the formats of other programs.
//!
//! * [`export_tables`]: CSV, one file a table; see [`table`](crate::table).
//!
//! A separate program exports to Rerun, because Rerun costs more to compile than all the rest.

mod tables;

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context as _, Result, bail, ensure};
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
    /// Output: a directory for csv (one file for each table), otherwise a file.
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
    /// Rerun; a separate program writes it.
    Rrd,
}

impl Args {
    pub(crate) fn run(self) -> Result<Exit> {
        // What is no log needs no format.
        FlightLog::open(&self.file)?;
        let format = self.to.context("--to is missing: csv or rrd")?;
        let output = self.out.as_deref().context("--out is missing: where to write")?;
        match format {
            Format::Csv => self.tables(output),
            Format::Rrd => self.rerun(output),
        }
    }

    fn tables(&self, output: &Path) -> Result<Exit> {
        let mut log = FlightLog::open(&self.file)?;
        let files = export_tables(&mut log, output)?;
        let outcome = give(&files, self.json)?;
        warn_of_loss(log.name(), log.damage().map(ToString::to_string).as_deref(), None);
        Ok(outcome)
    }

    /// Rerun costs more to compile than all the rest, so a separate program does this export. If it
    /// was built, it lies beside this one.
    fn rerun(&self, output: &Path) -> Result<Exit> {
        let program =
            std::env::current_exe().context("where this program lies")?.with_file_name("replay-rerun");
        let (log, recording) = (self.file.display(), output.display());
        if !program.exists() {
            bail!(
                "the export to Rerun is not built (it takes some ten minutes): \
                 cargo run --release -p replay-rerun -- {log} --out {recording}"
            );
        }
        let status = Command::new(&program)
            .arg(&self.file)
            .arg("--out")
            .arg(output)
            .status()
            .with_context(|| format!("{}", program.display()))?;
        ensure!(status.success(), "{}: the export to Rerun failed ({status})", self.file.display());
        Ok(Exit::Yes)
    }
}

impl Answer for ExportedFile {
    fn sentences(&self) -> Vec<String> {
        vec![format!("{}: {} rows of {} columns", self.path.display(), self.rows, self.columns)]
    }
}
