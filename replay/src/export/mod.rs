//! Writes the content of a log in the formats of other programs.
//!
//! * [`export_tables`]: CSV or Parquet, one file a table; see [`table`](crate::table).
//! * [`export_tlog`]: the raw MAVLink frames as a `.tlog`, which ground stations play back.
//! * [`write_frames`]: the stream that a board reads, and the answers that it should give.
//!
//! A separate program exports to Rerun, because Rerun costs more to compile than all the rest.

mod frames;
mod tables;
mod tlog;

use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context as _, Result, bail, ensure};
use clap::ValueEnum;
pub use frames::{FramesError, write_frames};
pub use tables::{ExportedFile, TableFormat, export_tables};
pub use tlog::{ExportedTlog, export_tlog};

use crate::cli::{Outcome, answer, warn_of_damage};
use crate::log::{FlightLog, LogError, import_tlog, is_tlog};
use crate::output::{Destination, Overwrite, WriteError};
use crate::print::print_json;
use serde::Serialize;

/// Why a log could not be exported.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// The file is not a flight log, or cannot be read.
    #[error(transparent)]
    Log(#[from] LogError),
    #[error(transparent)]
    Write(#[from] WriteError),
    /// The log has no such content.
    #[error("{name}: has {found}; {wanted}")]
    Nothing {
        /// The log.
        name: String,
        /// What the log has.
        found: String,
        wanted: String,
    },
}

#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The log, an MCAP file, or the telemetry log of a ground station, a .tlog.
    file: PathBuf,
    /// The format; a .tlog becomes a log.
    #[arg(long, value_enum)]
    to: Option<Format>,
    /// Output: a directory for csv and parquet (one file for each table) and for frames, otherwise a file; of a .tlog its
    /// name with .mcap if left out.
    #[arg(long, short, value_name = "PATH")]
    output: Option<PathBuf>,
    /// Replace existing files.
    #[arg(long)]
    force: bool,
    /// Answer in JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    /// Comma-separated values.
    Csv,
    /// Apache Parquet.
    Parquet,
    /// Raw MAVLink frames, for ground stations.
    Tlog,
    /// Rerun; a separate program writes it.
    Rrd,
    /// The frames that `board fly` reads, and the answers recorded to them, as the files frames and recorded.
    Frames,
    /// A log, of a .tlog.
    Mcap,
}

impl Args {
    pub(crate) fn run(self) -> Result<Outcome> {
        let is_tlog = is_tlog(&self.file).with_context(|| self.file.display().to_string())?;
        let format = self.to.or(is_tlog.then_some(Format::Mcap));
        let format = format.context("--to is missing: csv, parquet, tlog, rrd or frames")?;
        let output = self.output.clone().or_else(|| is_tlog.then(|| self.file.with_extension("mcap")));
        let output = output.context("--output is missing: where to write")?;
        let destination = Destination { path: &output, overwrite: Overwrite::if_forced(self.force) };
        match format {
            Format::Csv => self.tables(TableFormat::Csv, destination),
            Format::Parquet => self.tables(TableFormat::Parquet, destination),
            Format::Tlog => self.tlog(destination),
            Format::Rrd => self.rerun(&output),
            Format::Frames => {
                let written = write_frames(&self.file, destination)?;
                self.answer(&written, |output| writeln!(output, "{written} frames"))
            }
            Format::Mcap => self.log(destination),
        }
    }

    fn answer(
        &self,
        written: &impl Serialize,
        words: impl FnOnce(&mut dyn io::Write) -> io::Result<()>,
    ) -> Result<Outcome> {
        answer(|output| if self.json { print_json(written, output) } else { words(output) })?;
        Ok(Outcome::Given)
    }

    fn tables(&self, format: TableFormat, destination: Destination) -> Result<Outcome> {
        let mut log = FlightLog::open(&self.file)?;
        let files = export_tables(&mut log, format, destination)?;
        self.answer(&files, |output| {
            files.iter().try_for_each(|file| {
                writeln!(output, "{}: {} rows of {} columns", file.path.display(), file.rows, file.columns)
            })
        })?;
        warn_of_damage(log.name(), log.damage().map(ToString::to_string).as_deref());
        Ok(Outcome::Given)
    }

    fn tlog(&self, destination: Destination) -> Result<Outcome> {
        let open = || FlightLog::open(&self.file);
        let written = export_tlog(&open, None, destination)?;
        self.answer(&written, |output| {
            let path = destination.path.display();
            let (received, sent) = (written.received, written.sent);
            writeln!(output, "{path}: {received} frames received and {sent} sent by the {}", written.endpoint)
        })?;
        warn_of_damage(&self.file.display().to_string(), written.damage.as_deref());
        Ok(Outcome::Given)
    }

    fn log(&self, destination: Destination) -> Result<Outcome> {
        let imported = import_tlog(&self.file, destination)?;
        self.answer(&imported, |output| {
            writeln!(
                output,
                "{}: {} frames, {} of them not understood, and {} records of telemetry; left out: {} frames of MAVLink 1, {} bytes of no frame",
                destination.path.display(),
                imported.frames,
                imported.not_understood,
                imported.telemetry,
                imported.mavlink1,
                imported.garbage_bytes
            )
        })
    }

    /// Rerun costs more to compile than all the rest, so a separate program does this export. If it was built, it lies
    /// beside this one.
    fn rerun(&self, output: &Path) -> Result<Outcome> {
        let program =
            std::env::current_exe().context("where this program lies")?.with_file_name("replay-rerun");
        let (log, recording) = (self.file.display(), output.display());
        if !program.exists() {
            bail!(
                "the export to Rerun is not built (it takes some ten minutes): \
                 cargo run --release -p replay-rerun -- {log} --output {recording}"
            );
        }
        let status = Command::new(&program)
            .arg(&self.file)
            .arg("--output")
            .arg(output)
            .args(self.force.then_some("--force"))
            .status()
            .with_context(|| format!("{}", program.display()))?;
        ensure!(status.success(), "{}: the export to Rerun failed ({status})", self.file.display());
        Ok(Outcome::Given)
    }
}
