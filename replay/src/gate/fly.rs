//! Verifies a flight and flies it again.

use std::path::Path;

use super::state::name_of;
use super::{Checked, Flown, Found, Outcome, campaign};
use crate::log::{Entry, FlightLog, LogError, Recording};
use crate::refly::{ReflyOptions, StartAt, margin, refly};
use crate::verify::{Obstacle, Verification, verify};

/// This many of the first records of the flight computer name a flight: its power-up and half a second.
const NAMING_RECORDS: usize = 100;

/// What this build makes of a flight. Whatever is wrong is part of the outcome.
pub(super) fn fly(found: &Found) -> Outcome {
    match found.number {
        None => log(&found.path),
        Some(number) => campaign::fly(&found.path, number).unwrap_or_else(|error| Outcome {
            flight: None,
            checked: Checked::Unverified,
            flown: None,
            problem: Some(words(error)),
        }),
    }
}

fn log(path: &Path) -> Outcome {
    let (checked, mut problem) = match verify(path) {
        // What cannot be read now may still be a flight.
        Err(error @ LogError::Read { .. }) => (Checked::Unverified, Some(words(error))),
        Err(error) => return no_flight(words(error)),
        Ok(reports) if reports.iter().all(|report| report.obstacle == Some(Obstacle::NoTicks)) => {
            return no_flight(Obstacle::NoTicks.to_string());
        }
        Ok(reports) => {
            let all = |wanted: Verification| reports.iter().all(|report| report.outcome == wanted);
            let obstacle = reports.iter().find_map(|report| {
                report.obstacle.as_ref().map(ToString::to_string).or_else(|| report.damage.clone())
            });
            match () {
                () if reports.iter().any(|report| report.outcome == Verification::Diverged) => {
                    let first = reports.iter().find_map(|report| report.first_divergence.as_ref());
                    (Checked::Diverged, first.map(|first| format!("first different at tick {}", first.tick)))
                }
                () if all(Verification::Identical) => (Checked::Identical, None),
                () => (Checked::Unverified, obstacle.or_else(|| Some("not the whole flight".to_owned()))),
            }
        }
    };
    let again = Recording::open(path).map_err(Into::into).and_then(|recording| {
        // From its first frame on, the whole flight is this build's.
        let start = recording.frames.first().map_or(StartAt::Landing, |tick| StartAt::Tick(tick.input.frame));
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
    Outcome { flight: flight_of(path), checked, flown, problem }
}

/// Which flight a log holds: its run and the first records of its flight computer.
fn flight_of(path: &Path) -> Option<String> {
    let mut log = FlightLog::open(path).ok()?;
    let mut records = Vec::new();
    while records.len() < NAMING_RECORDS
        && let Ok(Some(stamped)) = log.next_entry()
    {
        if matches!(stamped.entry, Entry::ComputerStart(_) | Entry::ComputerFrame(_) | Entry::PilotTick(_)) {
            records.push(stamped.data);
        }
    }
    let run = log.head().run.iter().flat_map(|(fact, value)| [fact.as_bytes(), value.as_bytes()]);
    (!records.is_empty()).then(|| name_of(run.chain(records.iter().map(Vec::as_slice))))
}

fn no_flight(why: String) -> Outcome {
    Outcome { flight: None, checked: Checked::NoFlight, flown: None, problem: Some(why) }
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
