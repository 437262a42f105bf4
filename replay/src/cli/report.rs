//! `replay report`.

use std::path::PathBuf;

use anyhow::{Context as _, Result, bail};
use clap::Args;
use replay::output::{Destination, NewFile, Overwrite, same_file};
use replay::report::{report, report_with};

use super::{Answer, answer, warn_of_completeness};

#[derive(Debug, Args)]
pub(super) struct Ask {
    /// The log, an MCAP file.
    file: PathBuf,
    /// The page to write, or - for standard output; the log's name with .html if left out.
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Another log, whose flight is drawn into the same pictures.
    #[arg(long, value_name = "LOG")]
    with: Option<PathBuf>,
    /// Replace an existing file, but never the log.
    #[arg(long)]
    force: bool,
}

impl Ask {
    pub(super) fn run(self) -> Result<Answer> {
        use std::io::Write as _;
        let page = match &self.with {
            None => report(&self.file)?,
            Some(with) => report_with(&self.file, with)?,
        };
        let html = page.html;
        let path = self.output.clone().unwrap_or_else(|| self.file.with_extension("html"));
        if path.as_os_str() == "-" {
            answer(|output| output.write_all(html.as_bytes()))?;
            warn_of_completeness(&page.name, &page.completeness);
            return Ok(Answer::Given);
        }
        if self.with.as_deref().is_some_and(|with| same_file(with, &path)) {
            bail!("{}: is a log that is being read", path.display());
        }
        let destination = Destination { path: &path, overwrite: Overwrite::if_forced(self.force) };
        NewFile::create(destination, &self.file)
            .and_then(|mut file| {
                file.write_all(html.as_bytes())?;
                file.commit()
            })
            .with_context(|| format!("{}: cannot be written", path.display()))?;
        answer(|output| writeln!(output, "{}", path.display()))?;
        warn_of_completeness(&page.name, &page.completeness);
        Ok(Answer::Given)
    }
}
