//! Holds the logs of a directory against a baseline: did this build make any flight worse?
//!
//! Each log is verified (the recorded decisions, made again) and flown again closed loop. The
//! baseline is a file that an earlier run wrote.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result, bail, ensure};
use onboard_sim::run::in_parallel;
use protocol::program::Exit;
use serde::{Deserialize, Serialize};

use super::{Obstacle, Verification, VerifyReport, verify};
use crate::cli::{Answer, give, logs_of, say};
use crate::digest::digest;
use crate::log::{Entry, FlightLog, LogError, Moment, Recording};
use crate::output::NewFile;
use crate::print::{columns, counted, print_json};
use crate::refly::{ReflyOptions, margin, refly};

/// A margin that changed by no more than this is the same; 1 is from the middle of the limits to
/// their edge.
const SAME_MARGIN: f64 = 0.02;
/// This many of the first records of the flight computer name a flight: its power-up and half a
/// second.
const NAMING_RECORDS: usize = 100;

/// What this build makes of the log of a flight.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Flight {
    /// Which flight it is, by its content.
    content: Option<String>,
    /// The recorded decisions are made again, bit for bit; `None` if not all of them could be
    /// compared.
    identical: Option<bool>,
    /// When flown again; `None` if it did not come down, or cannot be flown again.
    stands: Option<bool>,
    /// The smallest distance to a limit as a fraction of it; see [`margin`].
    margin: Option<f64>,
    /// How it ended, or why that is not known.
    words: String,
}

/// The outcomes by the logs' paths below the directory.
type Flights = BTreeMap<String, Flight>;

/// What became of a flight.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
enum Change {
    NoLongerStands,
    /// It is gone, is another flight, or can no longer be verified or flown again.
    Lost,
    Worse,
    /// The recorded decisions are not made any more, and the margin is not smaller.
    Diverged,
    NowStands,
    Better,
    New,
    Same,
}

impl Change {
    fn word(self) -> &'static str {
        match self {
            Self::NoLongerStands => "FLIPPED: stands no longer",
            Self::Lost => "LOST",
            Self::Worse => "WORSE",
            Self::Diverged => "DIVERGED",
            Self::NowStands => "FLIPPED: stands now",
            Self::Better => "better",
            Self::New => "new",
            Self::Same => "same",
        }
    }

    fn fails(self, may_diverge: bool) -> bool {
        matches!(self, Self::NoLongerStands | Self::Lost | Self::Worse)
            || (self == Self::Diverged && !may_diverge)
    }

    fn of(before: Option<&Flight>, now: Option<&Flight>) -> Self {
        let Some(now) = now.filter(|now| now.identical.is_some()) else { return Self::Lost };
        let Some(before) = before else { return Self::New };
        if before.content != now.content || (before.margin.is_some() && now.margin.is_none()) {
            return Self::Lost;
        }
        let stands = |flight: &Flight| flight.stands == Some(true);
        let gained = match (before.margin, now.margin) {
            (Some(before), Some(now)) => now - before,
            (None, Some(_)) => f64::INFINITY,
            _ => 0.0,
        };
        match (stands(before), stands(now)) {
            (true, false) => Self::NoLongerStands,
            _ if gained < -SAME_MARGIN => Self::Worse,
            _ if before.identical == Some(true) && now.identical == Some(false) => Self::Diverged,
            (false, true) => Self::NowStands,
            _ if gained > SAME_MARGIN => Self::Better,
            _ => Self::Same,
        }
    }
}

/// A flight and what became of it.
#[derive(Debug, PartialEq, Serialize)]
struct Judged<'a> {
    log: &'a str,
    change: Change,
    before: Option<&'a Flight>,
    now: Option<&'a Flight>,
}

/// Every flight of either, the worst first.
fn judge<'a>(before: &'a Flights, now: &'a Flights) -> Vec<Judged<'a>> {
    let names: BTreeSet<&String> = before.keys().chain(now.keys()).collect();
    let judged = names.into_iter().map(|log| {
        let (before, now) = (before.get(log), now.get(log));
        Judged { log, change: Change::of(before, now), before, now }
    });
    let mut judged: Vec<Judged> = judged.collect();
    judged.sort_by_key(|judged| judged.change);
    judged
}

/// What this build makes of a log; `None` if it holds no flight.
fn fly(path: &Path) -> Option<Flight> {
    let (identical, why) = match verify(path) {
        Err(LogError::Foreign { .. }) => return None,
        Err(error) => return Some(Flight { words: words(error), ..Flight::default() }),
        Ok(reports) => {
            if reports.iter().all(|report| report.obstacle == Some(Obstacle::NoComputer)) {
                return None;
            }
            let any = |outcome| reports.iter().any(|report| report.outcome == outcome);
            let all = reports.iter().all(|report| report.outcome == Verification::Identical);
            let identical = if all { Some(true) } else { any(Verification::Diverged).then_some(false) };
            (identical, reports.iter().find_map(why_not))
        }
    };
    let again = Recording::open(path).map_err(Into::into).and_then(|recording| {
        // From its first frame on, the whole flight is this build's.
        let first = recording.frames.first().map(|first| recording.release_frame + first.input.frame);
        refly(&recording, &ReflyOptions { start: first.map(Moment::Frame), ..ReflyOptions::default() })
    });
    let (flown, ending) = match again {
        Ok(report) => (report.reflown, None),
        Err(error) => (None, Some(words(error))),
    };
    let ending = flown.as_ref().map(|verdict| verdict.ending.clone()).or(ending);
    let words = [Some(ending.unwrap_or_else(|| "did not come down".to_owned())), why];
    Some(Flight {
        content: content_of(path),
        identical,
        stands: flown.as_ref().map(|verdict| verdict.landing.stands),
        margin: flown.as_ref().map(margin),
        words: words.into_iter().flatten().collect::<Vec<_>>().join("; "),
    })
}

fn why_not(report: &VerifyReport) -> Option<String> {
    let diverged = || Some(format!("first different at frame {}", report.first_divergence.as_ref()?.frame));
    let obstacle = || report.obstacle.as_ref().map(ToString::to_string);
    let cut = || report.cut.as_ref().map(ToString::to_string);
    let part = || report.parts.iter().find_map(|part| part.why.clone());
    let why = diverged().or_else(obstacle).or_else(|| report.damage.clone()).or_else(cut).or_else(part);
    why.filter(|_| report.outcome != Verification::Identical)
}

fn words(error: impl std::error::Error + Send + Sync + 'static) -> String {
    format!("{:#}", anyhow::Error::from(error))
}

/// Which flight a log holds: its run and the first records of its flight computer.
fn content_of(path: &Path) -> Option<String> {
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
    (!records.is_empty()).then(|| format!("{:016x}", digest(run.chain(records.iter().map(Vec::as_slice)))))
}

/// How a directory of logs is held against a baseline.
#[derive(Debug, clap::Args)]
#[group(id = "held")]
pub(super) struct Arguments {
    /// Hold the logs of a directory (*.mcap), in subdirectories, too, against the outcomes that
    /// were accepted, a JSON file.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["explain", "strict"])]
    pub(super) baseline: Option<PathBuf>,
    /// Write the outcomes of this build as the new baseline; exit code 0 whatever changed. A log
    /// that cannot be verified is not accepted.
    #[arg(long, requires = "baseline")]
    accept: bool,
    /// Let this build decide differently from the record, as long as no flight gets worse.
    #[arg(long, requires = "baseline")]
    may_diverge: bool,
}

impl Arguments {
    pub(super) fn run(&self, path: &Path, directory: &Path, json: bool) -> Result<Exit> {
        let before = if self.accept && !path.exists() { Flights::new() } else { read(path)? };
        let logs = logs_of(directory)?;
        let flown = in_parallel(&logs, |log| fly(log), &|_| {});
        let name = |log: &Path| log.strip_prefix(directory).unwrap_or(log).display().to_string();
        let named = logs.iter().map(|log| name(log)).zip(flown);
        let now: Flights = named.filter_map(|(log, flight)| Some((log, flight?))).collect();
        let judged = judge(&before, &now);
        ensure!(!judged.is_empty(), "{}: none of its logs holds a flight", directory.display());
        let comparison = Comparison { judged, may_diverge: self.may_diverge };
        let outcome = give(&comparison, json)?;
        if !self.accept {
            return Ok(outcome);
        }
        // Accepted, it would pass for ever.
        if let Some((log, flight)) = now.iter().find(|(_, flight)| flight.identical.is_none()) {
            bail!("nothing is accepted: {log}: {}; mend it or take it out of the directory", flight.words);
        }
        ensure!(!now.is_empty(), "nothing is accepted: none of the logs holds a flight");
        NewFile::replace(path)?.fill(|file| print_json(&now, file))?;
        say(&format!("accepted: {}", path.display()));
        Ok(Exit::Yes)
    }
}

fn read(path: &Path) -> Result<Flights> {
    let text = std::fs::read_to_string(path)
        .with_context(|| format!("{}: cannot be read; --accept writes a first baseline", path.display()))?;
    serde_json::from_str(&text)
        .with_context(|| format!("{}: is no baseline of `replay verify`", path.display()))
}

/// A directory against its baseline.
#[derive(Serialize)]
#[serde(transparent)]
struct Comparison<'a> {
    judged: Vec<Judged<'a>>,
    #[serde(skip)]
    may_diverge: bool,
}

impl Answer for Comparison<'_> {
    fn sentences(&self) -> Vec<String> {
        let row = |Judged { log, change, before, now }: &Judged| {
            let margin = |flight: Option<&Flight>| {
                flight
                    .and_then(|flight| flight.margin)
                    .map_or("-".to_owned(), |margin| format!("{margin:.3}"))
            };
            let words = match (before, now) {
                (Some(before), Some(now)) if before.content != now.content => "another flight has its name",
                (_, Some(now)) => &now.words,
                (_, None) => "no flight has its name",
            };
            let change = change.word().to_owned();
            [(*log).to_owned(), change, margin(*before), margin(*now), words.to_owned()]
        };
        let head = ["log", "change", "before", "margin", "ending"].map(str::to_owned);
        let rows = std::iter::once(head).chain(self.judged.iter().map(row));
        let mut lines = columns(['<', '<', '>', '>', '<'], rows);
        lines.push(counted(self.judged.len() as u64, "flight"));
        lines
    }

    fn outcome(&self) -> Exit {
        Exit::of(!self.judged.iter().any(|judged| judged.change.fails(self.may_diverge)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flight(identical: Option<bool>, stands: bool, margin: f64) -> Flight {
        Flight { content: None, identical, stands: Some(stands), margin: Some(margin), words: String::new() }
    }

    #[test]
    fn every_change_has_its_name_and_the_bad_ones_fail() {
        let (identical, diverged) = (Some(true), Some(false));
        let before = flight(identical, true, 0.5);
        // Whether it fails, and whether it does if the decisions may differ.
        for (now, expected, fails) in [
            (flight(identical, true, 0.51), Change::Same, [false, false]),
            (flight(identical, true, 0.6), Change::Better, [false, false]),
            (flight(identical, true, 0.4), Change::Worse, [true, true]),
            (flight(diverged, true, 0.51), Change::Diverged, [true, false]),
            (flight(diverged, true, 0.6), Change::Diverged, [true, false]),
            (flight(diverged, true, 0.4), Change::Worse, [true, true]),
            (flight(None, true, 0.6), Change::Lost, [true, true]),
            (flight(identical, false, -0.1), Change::NoLongerStands, [true, true]),
        ] {
            let change = Change::of(Some(&before), Some(&now));
            assert_eq!((change, [false, true].map(|may| change.fails(may))), (expected, fails));
        }
        let crashed = flight(diverged, false, -2.0);
        assert_eq!(Change::of(Some(&crashed), Some(&flight(diverged, true, 0.1))), Change::NowStands);
        // A divergence that was accepted is no news.
        assert_eq!(Change::of(Some(&crashed), Some(&crashed)), Change::Same);
        // What cannot be verified fails, whether the baseline has it or not.
        assert_eq!(Change::of(None, Some(&flight(None, true, 0.5))), Change::Lost);
    }

    #[test]
    fn a_flight_that_only_one_of_them_has_is_named() {
        let named = |name: &str| Flights::from([(name.to_owned(), flight(Some(true), true, 0.5))]);
        let (before, now) = (named("b"), named("a"));
        let changes: Vec<_> = judge(&before, &now).iter().map(|one| (one.log, one.change)).collect();
        assert_eq!(changes, [("b", Change::Lost), ("a", Change::New)]);
    }

    /// A crash whose file is replaced by another flight that landed has not been mended.
    #[test]
    fn another_flight_under_the_name_of_a_crash_is_not_that_crash_landing() {
        let of = |content: &str, landed| Flight {
            content: Some(content.to_owned()),
            ..flight(Some(true), landed, 0.5)
        };
        assert_eq!(Change::of(Some(&of("crashed", false)), Some(&of("landed", true))), Change::Lost);
        assert_eq!(Change::of(Some(&of("crashed", false)), Some(&of("crashed", true))), Change::NowStands);
    }
}
