//! `replay import`.

use std::io::Write as _;
use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use replay::import::{ImportProgress, import_tlog};
use replay::output::{Destination, Overwrite};
use replay::print::print_json;

use super::{Answer, answer, say};

#[derive(Debug, Args)]
pub(super) struct Ask {
    /// The telemetry log of a ground station, a .tlog.
    file: PathBuf,
    /// The flight log to write; the .tlog's name with .mcap if left out.
    output: Option<PathBuf>,
    /// Replace an existing file.
    #[arg(long)]
    force: bool,
    /// Answer in JSON.
    #[arg(long)]
    json: bool,
}

impl Ask {
    pub(super) fn run(self) -> Result<Answer> {
        let path = self.output.clone().unwrap_or_else(|| self.file.with_extension("mcap"));
        let destination = Destination { path: &path, overwrite: Overwrite::if_forced(self.force) };
        let mut told = 0;
        let imported = import_tlog(&self.file, destination, &mut |progress| tell(progress, &mut told))?;
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

/// Reports every tenth of the progress of a long import.
fn tell(ImportProgress { read, total }: ImportProgress, told: &mut u64) {
    const LARGE_BYTES: u64 = 32_000_000;
    const MEGABYTE: u64 = 1_000_000;
    let tenths = (10 * read).checked_div(total).unwrap_or(0);
    if total > LARGE_BYTES && tenths > *told {
        *told = tenths;
        say(&format!("{} of {} MB", read / MEGABYTE, total / MEGABYTE));
    }
}
