//! `replay frames`.

use std::io::Write as _;
use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use replay::frames::write_frames;
use replay::output::Overwrite;

use super::{Answer, answer};

#[derive(Debug, Args)]
pub(super) struct Ask {
    /// The log, an MCAP file.
    file: PathBuf,
    /// The new file for what the flight computer was given.
    frames: PathBuf,
    /// The new file for what it decided and remembered.
    answers: PathBuf,
    /// Replace existing files.
    #[arg(long)]
    force: bool,
}

impl Ask {
    pub(super) fn run(self) -> Result<Answer> {
        let written =
            write_frames(&self.file, &self.frames, &self.answers, Overwrite::if_forced(self.force))?;
        answer(|output| writeln!(output, "{written} frames"))?;
        Ok(Answer::Given)
    }
}
