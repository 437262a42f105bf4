//! `replay import`.

use std::io::Write as _;
use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use replay::import::import_tlog;
use replay::print::print_json;

use super::{Answer, answer};

#[derive(Debug, Args)]
pub(super) struct Ask {
    /// The telemetry log of a ground station, a .tlog.
    file: PathBuf,
    /// The flight log to write; the .tlog's name with .mcap if left out. An existing file is not overwritten.
    output: Option<PathBuf>,
    /// Answer in JSON.
    #[arg(long)]
    json: bool,
}

impl Ask {
    pub(super) fn run(self) -> Result<Answer> {
        let path = self.output.clone().unwrap_or_else(|| self.file.with_extension("mcap"));
        let imported = import_tlog(&self.file, &path)?;
        answer(|output| {
            if self.json {
                return print_json(&imported, output);
            }
            writeln!(
                output,
                "{}: {} frames, {} of them not understood, and {} records of telemetry; left out: {} frames of MAVLink 1, {} bytes of no frame",
                path.display(),
                imported.frames,
                imported.not_understood,
                imported.telemetry,
                imported.mavlink1,
                imported.garbage_bytes
            )
        })?;
        Ok(Answer::Given)
    }
}
