//! Opens a log in a viewer that is installed, with our layout.

use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context as _, Result, ensure};
use protocol::program::Exit;

use crate::cli::say;
use crate::log::FlightLog;

/// How a log is shown: programs with their words, one after the other, and what is left to do by hand. LOG and LAYOUT are
/// files, and a name with a dot a file of the viewer.
pub type Way = (&'static [&'static [&'static str]], &'static str);

const BY_HAND: &str = "our layout is to be imported there: LAYOUT";

/// The best first.
const WAYS: [Way; 4] = [
    (&[&["replay-rerun", "LOG", "--out", "flight.rrd"], &["rerun", "flight.rrd"]], ""),
    (&[&["foxglove-studio", "LOG"]], BY_HAND),
    (&[&["lichtblick", "LOG"]], BY_HAND),
    (&[&["rerun", "LOG"]], "`cargo build --release -p replay-rerun` adds the rocket and our layout"),
];

const LAYOUT: &str = include_str!("../layouts/foxglove-space.json");

const NOTHING: &str = "no viewer is installed: `pip install rerun-sdk==0.36.3` installs Rerun; foxglove-studio and \
                       lichtblick are accepted, too";

/// The best way of which every program is found.
pub fn way(is_found: impl Fn(&str) -> bool) -> Option<Way> {
    WAYS.into_iter().find(|(programs, _)| programs.iter().all(|words| is_found(words[0])))
}

/// Where a program lies: beside this one, or on the PATH.
fn found(name: &str) -> Option<PathBuf> {
    let own = std::env::current_exe().unwrap_or_default();
    let path = std::env::var_os("PATH").unwrap_or_default();
    let folders = own.parent().map(PathBuf::from).into_iter().chain(std::env::split_paths(&path));
    let mut named = folders.map(|folder| folder.join(name).with_extension(std::env::consts::EXE_EXTENSION));
    named.find(|program| program.is_file())
}

#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The log, an MCAP file.
    file: PathBuf,
}

impl Args {
    pub(crate) fn run(self) -> Result<Exit> {
        FlightLog::open(&self.file)?;
        let (programs, by_hand) = way(|name| found(name).is_some()).context(NOTHING)?;
        // A viewer reads its files as long as it runs, and some go on after their command.
        let folder = tempfile::tempdir().context("a folder for the viewer's files")?.keep();
        let layout = folder.join("foxglove-space.json");
        std::fs::write(&layout, LAYOUT).with_context(|| layout.display().to_string())?;
        if !by_hand.is_empty() {
            say(&by_hand.replace("LAYOUT", &layout.display().to_string()));
        }
        for words in programs {
            let file = |word: &&str| match *word {
                "LOG" => self.file.clone(),
                word if word.contains('.') => folder.join(word),
                word => PathBuf::from(word),
            };
            let program = found(words[0]).unwrap_or_default();
            let status = Command::new(&program).args(words[1..].iter().map(file)).status();
            let status = status.with_context(|| program.display().to_string())?;
            ensure!(status.success(), "{} failed ({status})", program.display());
        }
        Ok(Exit::Yes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_best_way_of_which_everything_is_found_is_taken() {
        let of = |found: &[&str]| way(|name| found.contains(&name)).map(|(programs, _)| programs.concat());
        let with_rocket = ["replay-rerun", "LOG", "--out", "flight.rrd", "rerun", "flight.rrd"];
        assert_eq!(of(&["lichtblick", "rerun", "replay-rerun"]).unwrap(), with_rocket);
        // Without a viewer a recording is of no use.
        assert_eq!(of(&["replay-rerun"]), None);
        assert_eq!(of(&["rerun", "lichtblick"]).unwrap(), ["lichtblick", "LOG"]);
        assert_eq!(of(&["rerun"]).unwrap(), ["rerun", "LOG"]);
        // Foxglove's program for its cloud is no viewer.
        assert_eq!(of(&["foxglove"]), None);
    }
}
