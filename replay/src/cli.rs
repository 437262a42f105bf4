//! What all commands have in common: how they ended, what they print, how they stop.

use std::collections::{BTreeSet, VecDeque};
use std::ffi::OsStr;
use std::fs::DirEntry;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result, ensure};
pub(crate) use onboard_sim::files::text_of;
use protocol::program::{Exit, is_quiet, print};
use protocol::text::printable;
use serde::Serialize;

use crate::log::{Cut, Gap, Recording};
use crate::settings::Setting;

/// The worse of two answers: a no, then what could not be answered.
pub(crate) fn worse(one: Exit, other: Exit) -> Exit {
    if one == Exit::No || other == Exit::Yes { one } else { other }
}

/// What a command has found: data for programs, sentences for people.
pub trait Answer: Serialize {
    /// The answer as lines of text.
    fn sentences(&self) -> Vec<String>;

    fn outcome(&self) -> Exit {
        Exit::Yes
    }
}

/// Of several answers the worst decides. Those of more than a line stand apart.
impl<One: Answer> Answer for Vec<One> {
    fn sentences(&self) -> Vec<String> {
        let mut lines = Vec::new();
        for sentences in self.iter().map(Answer::sentences) {
            if sentences.len() > 1 && !lines.is_empty() {
                lines.push(String::new());
            }
            lines.extend(sentences);
        }
        lines
    }

    fn outcome(&self) -> Exit {
        self.iter().map(Answer::outcome).fold(Exit::Yes, worse)
    }
}

/// Prints an answer.
pub(crate) fn give(found: &impl Answer, json: bool) -> Result<Exit> {
    answer(|output| {
        if json {
            serde_json::to_writer_pretty(&mut *output, found)?;
            return writeln!(output);
        }
        let lines = found.sentences();
        lines.iter().try_for_each(|line| writeln!(output, "{}", printable(line.as_bytes())))
    })?;
    Ok(found.outcome())
}

/// Prints what is found of each file, the only one's as it is and those of several as a list. One
/// that cannot be read does not hide the others; if no file can be read, that is an error.
pub(crate) fn give_each<A: Answer>(
    files: &[PathBuf],
    json: bool,
    find: impl Fn(&Path) -> Result<Vec<A>>,
) -> Result<Exit> {
    let (mut all, mut outcome) = (Vec::new(), Exit::Yes);
    for file in files {
        match find(file) {
            Ok(found) => all.extend(found),
            Err(error) if files.len() == 1 => return Err(error),
            Err(error) => {
                print_error(&format!("{error:#}"));
                outcome = Exit::NotSeen;
            }
        }
    }
    let given = match all.as_slice() {
        [] => return Ok(Exit::Error),
        [only] if files.len() == 1 => give(only, json)?,
        _ => give(&all, json)?,
    };
    Ok(worse(given, outcome))
}

/// What a file's name ends in, in lower case.
pub(crate) fn ending(file: &Path) -> String {
    file.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase()
}

/// The logs of a directory, in subdirectories, too. Each regular file counts once, however many
/// links lead to it. A name of a log that is no regular file (a pipe, a broken link) is reported
/// and never opened.
pub(crate) fn logs_of(directory: &Path) -> Result<Vec<PathBuf>> {
    let (mut seen, mut logs, mut left) =
        (BTreeSet::new(), Vec::new(), VecDeque::from([directory.to_owned()]));
    while let Some(path) = left.pop_back() {
        let is_wanted = path.extension() == Some(OsStr::new("mcap"));
        let failed = || format!("{}: cannot be read", path.display());
        match path.metadata() {
            Ok(found) if found.is_dir() && seen.insert(path.canonicalize().with_context(failed)?) => {
                let entries: io::Result<Vec<_>> = std::fs::read_dir(&path).and_then(Iterator::collect);
                let mut entries = entries.with_context(failed)?;
                entries.sort_by_key(DirEntry::path);
                for entry in entries {
                    // Files come before links to them, so that a file is listed under its name.
                    let is_link = entry.path().is_symlink();
                    if is_link { left.push_front(entry.path()) } else { left.push_back(entry.path()) }
                }
            }
            Ok(found) if found.is_dir() => {}
            Ok(found) if is_wanted && found.is_file() && seen.insert(path.canonicalize()?) => logs.push(path),
            Err(error) if path == directory => return Err(error).with_context(failed),
            _ if is_wanted => print_note(&format!("left out: {}: no file, or here already", path.display())),
            _ => {}
        }
    }
    ensure!(!logs.is_empty(), "{}: holds no log (*.mcap)", directory.display());
    logs.sort();
    Ok(logs)
}

/// Writes an answer to standard output. A reader that closes the pipe early is not an error.
pub(crate) fn answer(write: impl FnOnce(&mut Vec<u8>) -> io::Result<()>) -> Result<()> {
    let mut text = Vec::new();
    write(&mut text)?;
    print(harmless(&text).as_bytes()).context("standard output")
}

/// Text without what steers a terminal: text of a log or a file name is only shown.
fn harmless(text: &[u8]) -> String {
    let steers = |c: &char| c.is_control() && !matches!(c, '\n' | '\t');
    let text = String::from_utf8_lossy(text);
    text.chars().map(|c| if steers(&c) { char::REPLACEMENT_CHARACTER } else { c }).collect()
}

/// Writes a note to standard error, unless --quiet is given.
pub(crate) fn print_note(text: &str) {
    if !is_quiet() {
        let _ = writeln!(io::stderr(), "replay: {}", harmless(text.as_bytes()));
    }
}

/// Writes an error to standard error; a closed standard error is ignored.
pub fn print_error(text: &str) {
    let _ = writeln!(io::stderr(), "error: {}", harmless(text.as_bytes()));
}

/// An input file, and the log to write from it.
#[derive(Debug, clap::Args)]
pub(crate) struct FromTo {
    /// The file to read: for import .ulg, .bin or .csv, for recover a damaged log.
    file: PathBuf,
    /// The log to write.
    output: PathBuf,
    /// Answer in JSON.
    #[arg(long)]
    json: bool,
}

impl FromTo {
    pub(crate) fn run<A: Answer, E>(self, write: fn(&Path, &Path) -> Result<A, E>) -> Result<Exit>
    where
        anyhow::Error: From<E>,
    {
        give(&write(&self.file, &self.output)?, self.json)
    }
}

/// A recorded flight, and other settings for it.
#[derive(Debug, clap::Args)]
pub(crate) struct WithSettings {
    /// The log, an MCAP file.
    file: PathBuf,
    /// Another setting, PATH=VALUE or PATH=VALUE@S.
    ///
    /// With @6.5 it applies from that vehicle time on, s. May be given more than once.
    #[arg(long = "set", value_name = "SETTING")]
    pub(crate) settings: Vec<Setting>,
    /// Answer in JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

impl WithSettings {
    pub(crate) fn recording(&self) -> Result<Recording> {
        recording(&self.file)
    }
}

/// A recorded flight, with warnings about damage, a missing end and missing frames.
pub(crate) fn recording(file: &Path) -> Result<Recording> {
    let recording = Recording::open(file)?;
    if let Some(Gap { after, before }) = recording.gap() {
        let name = &recording.name;
        print_note(&format!(
            "warning: {name}: after frame {after} comes frame {before}; nothing after the gap was run again"
        ));
    }
    warn_of_loss(&recording.name, recording.damage.as_deref(), recording.cut.as_ref());
    Ok(recording)
}

/// Warns of a log that is damaged, and of a flight that was not recorded to its end.
pub(crate) fn warn_of_loss(file: &str, damage: Option<&str>, cut: Option<&Cut>) {
    if let Some(damage) = damage {
        print_note(&format!("warning: {file} is damaged: {damage}; what can be read was used"));
    }
    if let Some(cut) = cut {
        print_note(&format!("warning: {file}: the flight {cut}"));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_that_steers_a_terminal_is_shown() {
        let text = "grün\tand\n\u{1b}[2J \u{9b}2J \u{7f}\u{8}\r§\u{85}";
        let r = char::REPLACEMENT_CHARACTER;
        assert_eq!(harmless(text.as_bytes()), format!("grün\tand\n{r}[2J {r}2J {r}{r}{r}§{r}"));
    }
}
