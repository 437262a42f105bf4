//! `replay info`.

use std::io::{IsTerminal as _, Write as _};
use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use replay::info::{Info, info, info_of};
use replay::log::{FlightLog, LogError};
use replay::print::{print_info, print_json};

use super::{Answer, answer, say, warn_of_completeness};

/// Stands for standard input.
const STDIN: &str = "-";

#[derive(Debug, Args)]
pub(super) struct Ask {
    /// The logs, MCAP files; - is standard input.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Answer in JSON: a description, or a list of descriptions for several logs.
    #[arg(long)]
    json: bool,
}

impl Ask {
    pub(super) fn run(self) -> Result<Answer> {
        let (mut described, mut refused) = (Vec::new(), false);
        for file in &self.files {
            match description(file) {
                Ok(info) => described.push(info),
                Err(error) if self.files.len() == 1 => return Err(error.into()),
                // One unreadable log must not hide the others.
                Err(error) => {
                    refused = true;
                    say(&format!("{:#}", anyhow::Error::from(error)));
                }
            }
        }
        answer(|output| match described.as_slice() {
            [only] if self.json && self.files.len() == 1 => print_json(only, output),
            all if self.json => print_json(&all, output),
            all => all.iter().enumerate().try_for_each(|(place, info)| {
                if place > 0 {
                    writeln!(output)?;
                }
                print_info(info, output)
            }),
        })?;
        // On a terminal the description has said it already.
        let said = !self.json && std::io::stdout().is_terminal();
        for info in described.iter().filter(|_| !said) {
            warn_of_completeness(&info.file, &info.completeness);
        }
        Ok(if refused { Answer::NotAll } else { Answer::Given })
    }
}

fn description(file: &std::path::Path) -> Result<Info, LogError> {
    if file.as_os_str() == STDIN {
        // A stream has no end to look for a summary at.
        return info_of(&mut FlightLog::read("standard input".to_owned(), std::io::stdin().lock())?, || None);
    }
    info(file)
}
