//! Verifies a flight and flies it again.

use std::collections::BTreeMap;
use std::fs::File;
use std::io;
use std::io::{BufRead as _, BufReader, Write as _};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

use campaign::row::{Row, from_csv};
use campaign::run::in_parallel;
use campaign::store::{self, StoreError};
use flight_log::sortie;
use protocol::log::build::build_info;
use serde::{Deserialize, Serialize};
use sim::sortie::Sortie;

use super::{Checked, FlightResult, Flown, Found, SuiteError};
use crate::digest::digest;
use crate::log::VerdictFacts;
use crate::log::{Entry, FlightLog, LogError, Recording};
use crate::refly::{ReflyOptions, StartAt, margin, refly};
use crate::verify::{Obstacle, Verification, verify};

/// This many of the first records of the flight computer name a flight: its power-up and half a second.
const NAMING_RECORDS: usize = 100;

/// What this build makes of a flight. Whatever is wrong is part of the outcome.
pub(super) fn fly(found: &Found) -> FlightResult {
    match found.number {
        None => log(&found.path),
        Some(number) => fly_campaign(&found.path, number).unwrap_or_else(|error| FlightResult {
            flight: None,
            checked: Checked::Unverified,
            flown: None,
            problem: Some(words(error)),
        }),
    }
}

fn log(path: &Path) -> FlightResult {
    let (checked, mut problem) = match verify(path) {
        // What cannot be read now may still be a flight.
        Err(error @ LogError::Read { .. }) => (Checked::Unverified, Some(words(error))),
        Err(error) => return no_flight(words(error)),
        Ok(reports) if reports.iter().all(|report| report.obstacle == Some(Obstacle::NoComputer)) => {
            return no_flight(Obstacle::NoComputer.to_string());
        }
        Ok(reports) => {
            let any = |wanted: Verification| reports.iter().any(|report| report.outcome == wanted);
            let obstacle = reports.iter().find_map(|report| {
                let cut = || report.cut.as_ref().map(ToString::to_string);
                let obstacle = report.obstacle.as_ref().map(ToString::to_string);
                obstacle.or_else(|| report.damage.clone()).or_else(cut)
            });
            if any(Verification::Diverged) {
                let first = reports.iter().find_map(|report| report.first_divergence.as_ref());
                (Checked::Diverged, first.map(|first| format!("first different at frame {}", first.frame)))
            } else if any(Verification::Impossible) {
                (Checked::Unverified, reports.iter().find_map(|report| report.part("inputs")?.why.clone()))
            } else if reports.iter().all(|report| report.outcome == Verification::Identical) {
                (Checked::Identical, None)
            } else {
                (Checked::Unverified, obstacle.or_else(|| Some("not the whole flight".to_owned())))
            }
        }
    };
    let again = Recording::open(path).map_err(Into::into).and_then(|recording| {
        // From its first frame on, the whole flight is this build's.
        let start = recording
            .frames
            .first()
            .map_or(StartAt::Landing, |first| StartAt::Frame(recording.release_frame + first.input.frame));
        refly(&recording, &ReflyOptions { start, ..ReflyOptions::default() })
    });
    let flown = match again {
        Ok(report) => report.reflown.map(|verdict| Flown {
            landed: verdict.landed,
            margin: Some(format!("{:?}", margin(&verdict))),
            ending: verdict.ending,
        }),
        Err(error) => {
            problem.get_or_insert(words(error));
            None
        }
    };
    FlightResult { flight: flight_of(path), checked, flown, problem }
}

/// Which flight a log holds: its run and the first records of its flight computer.
fn flight_of(path: &Path) -> Option<String> {
    let mut log = FlightLog::open(path).ok()?;
    let mut records = Vec::new();
    while records.len() < NAMING_RECORDS
        && let Ok(Some(stamped)) = log.next_entry()
    {
        if matches!(stamped.entry, Entry::ComputerStart(_) | Entry::ComputerFrame(_)) {
            records.push(stamped.data);
        }
    }
    let run = log.head().run.iter().flat_map(|(fact, value)| [fact.as_bytes(), value.as_bytes()]);
    (!records.is_empty()).then(|| name_of(run.chain(records.iter().map(Vec::as_slice))))
}

fn no_flight(why: String) -> FlightResult {
    FlightResult { flight: None, checked: Checked::NoFlight, flown: None, problem: Some(why) }
}

/// An error and its causes.
fn words(error: impl std::error::Error) -> String {
    let mut words = error.to_string();
    let mut cause = error.source();
    while let Some(deeper) = cause {
        let more = deeper.to_string();
        if !words.contains(&more) {
            words = format!("{words}: {more}");
        }
        cause = deeper.source();
    }
    words
}

/// The files of a campaign.
pub(super) const MANIFEST: &str = "manifest.json";
const ROWS: &str = "flights.csv";

/// The numbers of the flights in a campaign's directory.
pub(super) fn flights_of(directory: &Path) -> Result<Vec<u64>, SuiteError> {
    Ok(rows(directory)?.into_iter().map(|row| row.number).collect())
}

/// Flies one flight of a campaign.
fn fly_campaign(directory: &Path, number: u64) -> Result<FlightResult, SuiteError> {
    let campaign =
        |error: StoreError| SuiteError::Campaign { path: directory.to_owned(), reason: words(error) };
    let recipe = store::order_of(directory).map_err(campaign)?.recipe;
    let row = rows(directory)?.into_iter().find(|row| row.number == number).ok_or_else(|| {
        SuiteError::Campaign { path: directory.join(ROWS), reason: format!("has no flight {number}") }
    })?;
    let mut flight = Sortie::new(&recipe, number)
        .map_err(|error| SuiteError::Campaign { path: directory.to_owned(), reason: error.to_string() })?;
    let outcome = flight.run();
    let bits = |value: Option<f64>| value.map(f64::to_bits);
    let touchdown = outcome.touchdown.as_ref();
    let same = row.legs == outcome.legs
        && row.strict == outcome.strict
        && row.failure == outcome.failure.map_or("", |failure| failure.name())
        && bits(row.touchdown_time_s) == bits(touchdown.map(|touchdown| touchdown.time_s))
        && bits(row.touchdown_vertical_m_s) == bits(touchdown.map(|touchdown| touchdown.vertical_m_s));
    let verdict = sortie::verdict(&flight).as_ref().map(VerdictFacts::of);
    let (seed, number) = (recipe.seed.to_le_bytes(), number.to_le_bytes());
    let parts = [recipe.mission_toml.as_bytes(), recipe.dispersion_toml.as_bytes(), &seed, &number];
    Ok(FlightResult {
        flight: Some(name_of(parts)),
        checked: if same { Checked::Identical } else { Checked::Diverged },
        flown: verdict.map(|verdict| Flown {
            landed: verdict.landed,
            margin: Some(format!("{:?}", margin(&verdict))),
            ending: verdict.ending,
        }),
        problem: None,
    })
}

fn rows(directory: &Path) -> Result<Vec<Row>, SuiteError> {
    let path = directory.join(ROWS);
    let csv = std::fs::read(&path).map_err(|source| SuiteError::Read { path: path.clone(), source })?;
    from_csv(&csv).map_err(|error| SuiteError::Campaign { path, reason: error.to_string() })
}

/// The outcome of every flight; stops early if `stop` is set, with the outcomes until then.
///
/// # Errors
/// The state cannot be written.
pub fn fly_all(
    flights: &[Found],
    state: &mut SuiteState,
    stop: &AtomicBool,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> io::Result<BTreeMap<String, FlightResult>> {
    let mut outcomes = BTreeMap::new();
    let mut missing = Vec::new();
    for found in flights {
        let key = key(found).ok();
        match key.as_ref().and_then(|key| state.outcome(key)) {
            Some(known) => {
                outcomes.insert(found.name.clone(), known.clone());
            }
            None => missing.push((found, key)),
        }
    }
    let known = outcomes.len();
    let state = Mutex::new(state);
    let fly_noted = |(found, key): &(&Found, Option<String>)| -> io::Result<_> {
        if stop.load(Ordering::Relaxed) {
            return Ok(None);
        }
        let outcome = fly(found);
        // A file that cannot be read now may be readable the next time.
        if let Some(key) = key.clone().filter(|_| outcome.checked != Checked::Unverified) {
            let mut state = state.lock().unwrap_or_else(PoisonError::into_inner);
            state.note(key, outcome.clone()).inspect_err(|_| stop.store(true, Ordering::Relaxed))?;
        }
        Ok(Some((found.name.clone(), outcome)))
    };
    for result in in_parallel(&missing, fly_noted, &|done| progress(known + done, flights.len())) {
        outcomes.extend(result?);
    }
    Ok(outcomes)
}

/// The outcomes known so far, by what was flown and by which build.
#[derive(Debug, Default)]
pub struct SuiteState {
    known: BTreeMap<String, FlightResult>,
    file: Option<File>,
}

/// A line of the file.
#[derive(Serialize, Deserialize)]
struct Line {
    key: String,
    outcome: FlightResult,
}

/// How every line begins that is not empty.
const LINE_BEGINS: &str = "{\"key\":";

impl SuiteState {
    /// A state in memory only.
    pub fn in_memory() -> Self {
        Self::default()
    }

    /// A state in a file, continued if the file exists. What another build or another content left there is not used.
    ///
    /// # Errors
    /// The file cannot be read or written, or holds something else; then it is left as it is.
    pub fn open(path: &Path) -> io::Result<Self> {
        let mut file = File::options().read(true).append(true).create(true).open(path)?;
        let mut known = BTreeMap::new();
        for line in BufReader::new(file.try_clone()?).lines() {
            let line = line?;
            // The last line of a killed run may be incomplete; its flight is then flown again.
            if let Ok(Line { key, outcome }) = serde_json::from_str(&line) {
                known.insert(key, outcome);
            } else if !(line.starts_with(LINE_BEGINS) || LINE_BEGINS.starts_with(&line)) {
                let words = "holds something else than the state of a suite; give another file";
                return Err(io::Error::new(io::ErrorKind::InvalidData, words));
            }
        }
        // An incomplete line must not be joined with the next one.
        writeln!(file)?;
        Ok(Self { known, file: Some(file) })
    }

    /// The outcome of this key, if it is known.
    pub(super) fn outcome(&self, key: &str) -> Option<&FlightResult> {
        self.known.get(key)
    }

    pub(super) fn note(&mut self, key: String, outcome: FlightResult) -> io::Result<()> {
        let line = Line { key, outcome };
        if let Some(file) = &mut self.file {
            writeln!(file, "{}", serde_json::to_string(&line)?)?;
        }
        self.known.insert(line.key, line.outcome);
        Ok(())
    }
}

/// Identifies a flight, its content and this build.
pub(super) fn key(found: &Found) -> io::Result<String> {
    let files = match found.number {
        None => vec![std::fs::read(&found.path)?],
        Some(_) => ["manifest.json", "mission.toml", "dispersion.toml", "flights.csv"]
            .iter()
            .map(|name| std::fs::read(found.path.join(name)))
            .collect::<io::Result<_>>()?,
    };
    let content = digest(files.iter().map(Vec::as_slice));
    let build = build_info();
    let build = digest(build.iter().flat_map(|(fact, value)| [fact.as_bytes(), value.as_bytes()]));
    Ok(format!("{} {content:016x} {build:016x}", found.name))
}

/// Names a flight by its content.
pub(super) fn name_of<'a>(parts: impl IntoIterator<Item = &'a [u8]>) -> String {
    format!("{:016x}", digest(parts))
}
