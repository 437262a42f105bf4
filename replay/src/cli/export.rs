//! `replay export`.

use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context as _, Result, bail, ensure};
use clap::{Args, ValueEnum};
use replay::export::{TableFormat, export_tables, export_tlog};
use replay::log::FlightLog;
use replay::output::{Destination, Overwrite};

use super::{Answer, answer, warn_of_damage};

#[derive(Debug, Args)]
pub(super) struct Ask {
    /// The log, an MCAP file.
    file: PathBuf,
    /// The format.
    #[arg(long, value_enum)]
    to: Format,
    /// Output: a directory for csv and parquet (one file for each table), a file for tlog.
    #[arg(long, short, value_name = "PATH")]
    output: PathBuf,
    /// For tlog: the endpoint whose frames are written, if the log has several [default: ground].
    #[arg(long, value_name = "vehicle|ground")]
    endpoint: Option<String>,
    /// Replace existing files.
    #[arg(long)]
    force: bool,
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
}

impl Ask {
    pub(super) fn run(self) -> Result<Answer> {
        let format = match self.to {
            Format::Csv => TableFormat::Csv,
            Format::Parquet => TableFormat::Parquet,
            Format::Tlog => return self.tlog(),
            Format::Rrd => return self.rerun(),
        };
        let mut log = FlightLog::open(&self.file)?;
        let files = export_tables(&mut log, format, self.destination())?;
        answer(|output| {
            use std::io::Write as _;
            files.iter().try_for_each(|file| {
                writeln!(output, "{}: {} rows of {} columns", file.path.display(), file.rows, file.columns)
            })
        })?;
        warn_of_damage(log.name(), log.damage().map(ToString::to_string).as_deref());
        Ok(Answer::Given)
    }

    /// Rerun costs more to compile than all the rest, so a separate program does this export. If it was built, it lies
    /// beside this one.
    fn rerun(&self) -> Result<Answer> {
        let program =
            std::env::current_exe().context("where this program lies")?.with_file_name("replay-rerun");
        let (log, recording) = (self.file.display(), self.output.display());
        if !program.exists() {
            bail!(
                "the export to Rerun is not built (it takes some ten minutes): \
                 cargo run --release -p replay-rerun -- {log} --output {recording}"
            );
        }
        let status = Command::new(&program)
            .arg(&self.file)
            .arg("--output")
            .arg(&self.output)
            .args(self.force.then_some("--force"))
            .status()
            .with_context(|| format!("{}", program.display()))?;
        ensure!(status.success(), "{}: the export to Rerun failed ({status})", self.file.display());
        Ok(Answer::Given)
    }

    fn destination(&self) -> Destination<'_> {
        Destination { path: &self.output, overwrite: Overwrite::if_forced(self.force) }
    }

    fn tlog(&self) -> Result<Answer> {
        let open = || FlightLog::open(&self.file);
        let written = export_tlog(&open, self.endpoint.as_deref(), self.destination())?;
        answer(|output| {
            use std::io::Write as _;
            let path = self.output.display();
            let (received, sent) = (written.received, written.sent);
            writeln!(output, "{path}: {received} frames received and {sent} sent by the {}", written.endpoint)
        })?;
        warn_of_damage(&self.file.display().to_string(), written.damage.as_deref());
        Ok(Answer::Given)
    }
}
