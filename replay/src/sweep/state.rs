//! Keeps the results of a sweep on disk: one line that identifies the sweep, then one line for each job.

use std::fs::File;
use std::io::{BufRead as _, BufReader, Write as _};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::FlightOutcome;

/// Why a state file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum StateError {
    /// It cannot be read or written.
    #[error("{}: cannot be used", path.display())]
    File {
        path: PathBuf,
        /// Error from the operating system.
        source: std::io::Error,
    },
    /// It belongs to another sweep.
    #[error("{}: belongs to another sweep: other flights, settings, points or another build; give another file", path.display())]
    Other { path: PathBuf },
}

/// The outcomes of a sweep's jobs, perhaps backed by a file.
#[derive(Debug, Default)]
pub struct State {
    outcomes: Vec<Option<FlightOutcome>>,
    file: Option<(PathBuf, File)>,
}

/// A line of the file. The margin is text, because every reader reads text back as the same number.
#[derive(Serialize, Deserialize)]
struct Line {
    job: usize,
    landed: bool,
    margin: Option<String>,
}

impl State {
    /// A state in memory only.
    pub fn in_memory(jobs: usize) -> Self {
        Self { outcomes: vec![None; jobs], file: None }
    }

    /// A state in a file, continued if the file exists. `identity` is one line that identifies the sweep.
    ///
    /// # Errors
    /// The file cannot be read or written, or belongs to another sweep.
    pub fn open(path: &Path, identity: &str, jobs: usize) -> Result<Self, StateError> {
        let failed = |source| StateError::File { path: path.to_owned(), source };
        let mut outcomes = vec![None; jobs];
        let mut file = File::options().read(true).append(true).create(true).open(path).map_err(failed)?;
        let mut lines = BufReader::new(file.try_clone().map_err(failed)?).lines();
        match lines.next().transpose().map_err(failed)? {
            None => writeln!(file, "{identity}").map_err(failed)?,
            Some(found) if found == identity => {
                // The last line of a killed run may be incomplete; its job is then run again.
                for line in lines {
                    let line = line.map_err(failed)?;
                    if let Ok(Line { job, landed, margin }) = serde_json::from_str(&line)
                        && let Some(place) = outcomes.get_mut(job)
                    {
                        let margin = margin.and_then(|text| text.parse().ok());
                        *place = Some(FlightOutcome { landed, margin });
                    }
                }
                // An incomplete line must not be joined with the next one.
                writeln!(file).map_err(failed)?;
            }
            Some(_) => return Err(StateError::Other { path: path.to_owned() }),
        }
        Ok(Self { outcomes, file: Some((path.to_owned(), file)) })
    }

    /// The outcome of a job, if it is known.
    pub fn outcome(&self, job: usize) -> Option<FlightOutcome> {
        self.outcomes.get(job).copied().flatten()
    }

    /// How many outcomes are known.
    pub fn known(&self) -> usize {
        self.outcomes.iter().flatten().count()
    }

    /// Notes an outcome.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(super) fn note(&mut self, job: usize, outcome: FlightOutcome) -> Result<(), StateError> {
        if let Some(place) = self.outcomes.get_mut(job) {
            *place = Some(outcome);
        }
        if let Some((path, file)) = &mut self.file {
            let margin = outcome.margin.map(|margin| format!("{margin:?}"));
            let line = Line { job, landed: outcome.landed, margin };
            let text = serde_json::to_string(&line).unwrap_or_default();
            writeln!(file, "{text}").map_err(|source| StateError::File { path: path.clone(), source })?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_state_is_continued_bit_for_bit_and_the_state_of_another_sweep_is_refused() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("sweep.jsonl");
        let outcome = FlightOutcome { landed: true, margin: Some(0.1 + 0.2) };
        let mut state = State::open(&path, "sweep A", 3).unwrap();
        state.note(1, outcome).unwrap();
        state.note(2, FlightOutcome { landed: false, margin: Some(f64::NEG_INFINITY) }).unwrap();
        drop(state);
        // Killed in the middle of a line.
        let mut bytes = std::fs::read(&path).unwrap();
        bytes.truncate(bytes.len() - 5);
        std::fs::write(&path, bytes).unwrap();
        let mut state = State::open(&path, "sweep A", 3).unwrap();
        assert_eq!((state.outcome(0), state.outcome(1), state.known()), (None, Some(outcome), 1));
        state.note(2, outcome).unwrap();
        assert_eq!(State::open(&path, "sweep A", 3).unwrap().known(), 2);
        assert!(matches!(State::open(&path, "sweep B", 3), Err(StateError::Other { .. })));
    }
}
