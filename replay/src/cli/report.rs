//! `replay report`.

use std::path::PathBuf;

use anyhow::{Context as _, Result};
use clap::Args;
use replay::report::report;

use super::{Answer, answer};

#[derive(Debug, Args)]
pub(super) struct Ask {
    /// The log, an MCAP file.
    file: PathBuf,
    /// The page to write, or - for standard output; the log's name with .html if left out.
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
}

impl Ask {
    pub(super) fn run(self) -> Result<Answer> {
        use std::io::Write as _;
        let page = report(&self.file)?;
        let path = self.output.clone().unwrap_or_else(|| self.file.with_extension("html"));
        if path.as_os_str() == "-" {
            answer(|output| output.write_all(page.as_bytes()))?;
            return Ok(Answer::Given);
        }
        std::fs::write(&path, page).with_context(|| format!("{}: cannot be written", path.display()))?;
        answer(|output| writeln!(output, "{}", path.display()))?;
        Ok(Answer::Given)
    }
}
