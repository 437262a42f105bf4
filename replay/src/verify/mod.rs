//! Checks whether the controller makes the recorded decisions again, bit for bit.
//!
//! [`verify`] builds the flight computer from the mission in the log and runs it on every recorded
//! input. It compares every field of the output, the digest of the memory, the estimate,
//! and the computer at its release with the record. The inputs themselves are judged: some cannot
//! be. [`verify_strictly`] also draws the world of a simulated flight again, and compares its
//! measurements and its verdict. The answer lists what was compared and what was not; truth, events
//! and measured times are not.
//!
//! A vehicle's log has every frame from power-up on, so self-test, arming, countdown, gate and
//! abort are compared as well. A frame in flight is a *frame* and counts from the release; a log of
//! a flight that begins there has only frames, and the report says so.
//!
//! The computer remembers its plan, so a frame can be re-executed only if every frame before it can
//! be. The comparison ends at a gap, and the report says so.
//!
//! A log joined by other tools may hold several flights; each has its own report. A flight without
//! comparisons is never identical, and a flight whose record ends before the flight did is reported
//! as cut.

mod again;
pub mod book;
mod difference;
pub mod explain;
mod flight;
mod inputs;
mod parts;

use std::io::Read;
use std::path::{Path, PathBuf};

use self::again::WorldAgain;
use self::flight::FlightVerifier;
use anyhow::{Result, bail};
pub use difference::{Divergence, FieldDifference, FieldValue, differences, ulp_distance};
pub use parts::Part;
use protocol::log::record::{SCHEMA_VERSION, TOPIC_COMPUTER_FRAME, TOPIC_COMPUTER_START, TOPIC_VERDICT};
use protocol::program::Exit;
use serde::Serialize;

use crate::cli::{Answer, give_each, logs_of, print_note, warn_of_loss};
use crate::controller::FrameError;
use crate::log::{BuildComparison, Cut, Entry, FlightLog, Gap, Head, LogError, LoggedFlight};
use crate::print::{counted, messages_lost};

/// The topics that a verification reads.
const VERIFIED: [&str; 3] = [TOPIC_COMPUTER_START, TOPIC_COMPUTER_FRAME, TOPIC_VERDICT];

/// Verifies a log file: one report on each of its flights, or one report if it has none.
///
/// # Errors
/// The file is not a flight log or cannot be read. A log that cannot be replayed is a report, not
/// an error.
pub fn verify(path: &Path) -> Result<Vec<VerifyReport>, LogError> {
    verify_as(path, false)
}

/// Verifies a log file, and draws the world of a simulated flight again.
///
/// # Errors
/// As [`verify`].
pub fn verify_strictly(path: &Path) -> Result<Vec<VerifyReport>, LogError> {
    verify_as(path, true)
}

fn verify_as(path: &Path, strict: bool) -> Result<Vec<VerifyReport>, LogError> {
    let mut log = FlightLog::open(path)?.decoding(&VERIFIED);
    verify_log(&mut log, strict, || {
        // Another tool may have moved the attachments to the end of the file, after the messages.
        let mut log = FlightLog::open(path)?;
        while log.next_entry()?.is_some() {}
        Ok(log.head().clone())
    })
}

/// Verifies a log that is being read, strictly or not. `complete_head` is called for the log's
/// whole head if its first frame comes before its profile.
///
/// # Errors
/// As [`verify`].
pub fn verify_log<R: Read>(
    log: &mut FlightLog<R>,
    strict: bool,
    complete_head: impl Fn() -> Result<Head, LogError>,
) -> Result<Vec<VerifyReport>, LogError> {
    let mut computers: Vec<FlightVerifier> = Vec::new();
    // An unreadable record before the first flight may have been its beginning.
    let mut unreadable = None;
    while let Some(stamped) = log.next_entry()? {
        if log.flights.found.len() > computers.len() {
            computers.push(FlightVerifier::new(strict, !computers.is_empty(), unreadable.take()));
        }
        let Some(computer) = computers.last_mut() else {
            if let Entry::Unreadable { reason } = stamped.entry {
                unreadable.get_or_insert(reason);
            }
            continue;
        };
        computer.take(stamped, log, &complete_head)?;
    }
    if computers.is_empty() {
        computers.push(FlightVerifier::new(strict, false, unreadable));
    }
    let of = computers.len();
    let report = |(place, computer): (usize, FlightVerifier)| {
        let flight = (of > 1).then_some(FlightPlace { number: place + 1, of });
        computer.into_report(log, flight, log.flights.found.get(place).and_then(LoggedFlight::cut))
    };
    Ok(computers.into_iter().enumerate().map(report).collect())
}

/// The result of a verification.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verification {
    /// The flight is whole, has frames, and all that was compared is identical.
    #[default]
    Identical,
    /// The log is damaged, ends before its flight did or lacks a part, and what could be compared
    /// is identical.
    IdenticalReadablePart,
    /// Something differs.
    Diverged,
    /// Nothing differs, and an input cannot be.
    Impossible,
    /// Some frame could not be re-executed, and all others are identical.
    NotReplayable,
}

/// Why frames were not compared.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Obstacle {
    /// No frame of a flight computer in the log.
    #[error(
        "it has no frames of a flight computer that this build knows: replay needs the log of the vehicle or of the demonstration, not of a ground station"
    )]
    NoComputer,
    /// No profile in the log.
    #[error("it has no attachment profile.toml, and without the profile the controller cannot be built")]
    NoProfile,
    /// This build cannot use the profile in the log.
    #[error("its profile cannot be used by this build: {0}")]
    ProfileUnreadable(String),
    /// The log does not begin with the first frame, but with this one.
    #[error(
        "it begins with frame {0}, and the frames before it are missing: what the flight computer remembered then is unknown"
    )]
    BeginningMissing(u64),
    /// Frames are missing.
    #[error(
        "after frame {} comes frame {}: what the flight computer remembered there is unknown, and nothing behind the gap was compared",
        .0.after, .0.before
    )]
    Gap(Gap),
    #[error("a record cannot be read: {0}")]
    Unreadable(String),
    /// A flight computer was released, and none of its frames follow.
    #[error("it has a record /computer/start and no frame of the flight computer behind it")]
    NoFrames,
    /// There are frames of a flight computer, and no record of what it was built from.
    #[error("it has frames of the flight computer and no record /computer/start before them to begin from")]
    NoStart,
    /// The log's contents are of another version.
    #[error("it says that its contents have version {0}; this build reads {SCHEMA_VERSION}")]
    Schema(String),
    /// A frame cannot be given to this build's flight computer.
    #[error("{0}")]
    Frame(#[from] FrameError),
}

/// As text.
impl Serialize for Obstacle {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// The place of a flight in a log that holds several.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct FlightPlace {
    /// Its number, from 1.
    pub number: usize,
    /// Number of flights.
    pub of: usize,
}

/// The report on one flight.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct VerifyReport {
    /// The log.
    pub file: String,
    /// The place of the flight, if the log holds several.
    pub flight: Option<FlightPlace>,
    /// The result of a verification.
    pub outcome: Verification,
    /// Whether the frames begin at power-up, and not at the release.
    pub from_power_up: bool,
    /// What was compared, and what was not.
    pub parts: Vec<Part>,
    /// The log says how many records it has. Otherwise nothing shows that the last ones are
    /// missing.
    pub counted: bool,
    /// Frames that could be read.
    pub frames_recorded: u64,
    /// Frames that were re-executed and compared.
    pub frames_compared: u64,
    /// Frames identical in every bit.
    pub frames_identical: u64,
    pub frames_different: u64,
    /// Frames in flight that were compared.
    pub frames_in_flight: u64,
    /// Fields that differ, over all frames.
    pub fields_different: u64,
    /// The numbers of the first and the last frame compared.
    pub span: Option<(u64, u64)>,
    /// Vehicle time from the first frame compared to the last, s.
    pub flight_s: Option<f64>,
    /// The first frame that differs.
    pub first_divergence: Option<Divergence>,
    /// Why not every frame was compared.
    pub obstacle: Option<Obstacle>,
    /// Where the record ends, if that is before the end of the flight.
    pub cut: Option<Cut>,
    /// Why the log could not be read to its end.
    pub damage: Option<String>,
    /// Records that are missing, by their numbers.
    pub messages_lost: u64,
    /// Comparison of the build that wrote the log with this one.
    pub build: BuildComparison,
    /// Only a whole flight of which everything was compared is identical.
    #[serde(skip)]
    pub(super) strict: bool,
}

impl VerifyReport {
    /// A part of the record by its name.
    pub fn part(&self, name: &str) -> Option<&Part> {
        self.parts.iter().find(|part| part.name == name)
    }

    /// Compares what only a strict verification does. `world`: that of the flight, drawn again;
    /// `recorded`: its verdict.
    fn compare_strictly(&mut self, world: Option<Result<WorldAgain, String>>, recorded: Option<&[u8]>) {
        let is_flown = self.part("truth").is_some_and(|truth| truth.recorded > 0);
        let judged = match world {
            _ if self.flight.is_some() => Err("a file with several flights is not flown again".to_owned()),
            _ if self.outcome != Verification::Identical => {
                Err("what differs or is not whole is not flown again".to_owned())
            }
            Some(Ok(world)) => Ok(world.judge(recorded)),
            Some(Err(error)) => Err(format!("cannot be flown again: {error}")),
            None if is_flown => {
                Err("cannot be flown again: its run facts do not say what it was drawn from".to_owned())
            }
            None => Err(NOT_DRAWN.to_owned()),
        };
        for (place, name) in ONLY_STRICTLY.iter().enumerate() {
            let part = self.parts.iter_mut().find(|part| part.name == *name && part.different == 0);
            let Some(part) = part else { continue };
            match &judged {
                Ok(judged) => {
                    part.compare(judged[place].0);
                    part.why.clone_from(&judged[place].1);
                }
                Err(why) => {
                    part.follows = why != NOT_DRAWN;
                    part.why = Some(why.clone());
                }
            }
        }
        self.conclude();
    }

    /// Whether every part that follows from the inputs was compared.
    pub fn is_all_compared(&self) -> bool {
        self.parts.iter().all(Part::is_complete)
    }

    fn conclude(&mut self) {
        let different = |part: &&Part| part.different > 0;
        let of_inputs = |part: &Part| part.name == "inputs";
        let complete = |part: &Part| part.is_complete() || ONLY_STRICTLY.contains(&part.name);
        self.outcome = if self.parts.iter().filter(different).any(|part| !of_inputs(part)) {
            Verification::Diverged
        } else if self.parts.iter().filter(different).any(of_inputs) {
            Verification::Impossible
        } else if self.obstacle.is_some() {
            Verification::NotReplayable
        } else if self.damage.is_some()
            || self.cut.is_some()
            || self.messages_lost > 0
            || !self.parts.iter().all(complete)
        {
            Verification::IdenticalReadablePart
        } else {
            Verification::Identical
        };
    }
}

/// Why nothing of a flight that was not simulated is drawn again.
const NOT_DRAWN: &str = "no simulated flight: nothing to draw it from again";

/// Parts that only a strict verification compares.
const ONLY_STRICTLY: [&str; 2] = ["verdict", "metadata"];

/// Most fields of the first diverged frame that are shown.
const FIELDS_SHOWN: usize = 5;

impl Answer for VerifyReport {
    fn outcome(&self) -> Exit {
        match self.outcome {
            Verification::Identical | Verification::IdenticalReadablePart => {
                Exit::of(!self.strict || self.outcome == Verification::Identical && self.is_all_compared())
            }
            Verification::Impossible | Verification::Diverged => Exit::No,
            Verification::NotReplayable => Exit::NotSeen,
        }
    }

    fn sentences(&self) -> Vec<String> {
        let place = self.flight.map(|FlightPlace { number, of }| format!(": flight {number} of {of}"));
        let mut lines = vec![format!("{}{}: {}", self.file, place.unwrap_or_default(), self.headline())];
        lines.extend(self.first_divergence.iter().flat_map(Divergence::sentences));
        if self.frames_compared > 0 {
            let beginning = self.flight_s.filter(|_| self.from_power_up).map_or_else(
                || FRAMES_ALONE.to_owned(),
                |flight_s| {
                    let in_flight = self.frames_in_flight;
                    format!("from power-up to {flight_s:.3} s after it, {in_flight} of them in flight")
                },
            );
            lines.push(beginning);
            lines.extend(parts::table(&self.parts));
        }
        if !self.counted {
            lines.push(NOT_COUNTED.to_owned());
        }
        let obstacle = self.obstacle.as_ref().filter(|_| self.frames_compared > 0);
        lines.extend(obstacle.map(|obstacle| format!("not every frame was compared: {obstacle}")));
        let missing = self.what_is_missing();
        if self.outcome != Verification::IdenticalReadablePart && !missing.is_empty() {
            let of_flight = format!("what was compared is{missing}");
            lines.push(missing.strip_prefix("; ").map_or(of_flight, str::to_owned));
        }
        lines
    }
}

impl VerifyReport {
    fn headline(&self) -> String {
        let Self { frames_identical: identical, frames_compared: compared, .. } = self;
        match self.outcome {
            Verification::Identical => format!("{identical} of {compared} frames identical"),
            Verification::IdenticalReadablePart => {
                let of = if self.damage.is_some() { " of the readable part" } else { "" };
                format!("{identical} of {compared} frames identical{of}{}", self.what_is_missing())
            }
            Verification::Diverged if self.first_divergence.is_none() => {
                let different = self.parts.iter().filter(|part| part.different > 0);
                let names: Vec<&str> = different.map(|part| part.name).collect();
                let names = names.join(", ");
                format!("DIVERGED: {identical} of {compared} frames are identical, and not: {names}")
            }
            Verification::Diverged => {
                let (different, fields) = (self.frames_different, counted(self.fields_different, "field"));
                format!("DIVERGED: {different} of {compared} frames differ, in {fields}")
            }
            Verification::Impossible => "IMPOSSIBLE: some recorded inputs cannot be".to_owned(),
            Verification::NotReplayable if *compared == 0 => {
                let reason = self.obstacle.as_ref().map(ToString::to_string);
                format!("nothing was compared: {}", reason.unwrap_or_default())
            }
            Verification::NotReplayable => {
                let recorded = self.frames_recorded;
                format!("not replayable as a whole: the first {identical} of {recorded} frames are identical")
            }
        }
    }

    /// What is missing from the part of the flight that was read.
    fn what_is_missing(&self) -> String {
        let cut = self.cut.as_ref().map(|cut| format!(" of an INCOMPLETE flight: {cut}"));
        let unread = self.damage.as_ref().map(|damage| format!("; not all of it was read: {damage}"));
        let lost = (self.messages_lost > 0).then(|| format!("; {}", messages_lost(self.messages_lost)));
        [cut, unread, lost].into_iter().flatten().collect()
    }
}

/// The remark on a log whose flight computer cannot be run again from power-up on.
const FRAMES_ALONE: &str = "the log has no frames of the flight computer from power-up: arming and countdown, if any, were not run again";

/// The remark on a log without a summary.
const NOT_COUNTED: &str =
    "the log has no summary that counts its records: whether the last of them are missing cannot be known";

impl Divergence {
    fn sentences(&self) -> Vec<String> {
        let Self { frame, time_s, phase, .. } = self;
        let time =
            if self.in_flight { format!("T+{time_s:.3} s") } else { format!("{time_s:.3} s after power-up") };
        let fields = counted(self.fields_different as u64, "field");
        let mut lines = vec![format!("first at frame {frame} ({time}, {phase}), {fields}:")];
        for FieldDifference { path, recorded, recomputed, ulps } in self.fields.iter().take(FIELDS_SHOWN) {
            lines.push(format!("  {path}"));
            for (name, FieldValue { value, bits }) in [("recorded", recorded), ("recomputed", recomputed)] {
                let line = format!("    {name:<10}  {value:<24}  {}", bits.as_deref().unwrap_or_default());
                lines.push(line.trim_end().to_owned());
            }
            lines.extend(ulps.map(|ulps| format!("    apart       {ulps} ULP")));
        }
        let more = self.fields_different.saturating_sub(FIELDS_SHOWN) as u64;
        lines.extend((more > 0).then(|| format!("  and {} more", counted(more, "field"))));
        lines
    }
}

#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The logs, MCAP files, and directories of logs.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Answer in JSON: a report, or a list of reports for several logs.
    #[arg(long)]
    json: bool,
    /// Exit code 3 unless all that can be compared was: damaged logs fail, logs that end before
    /// their flight did, and logs that lack a part. A simulated flight is flown again, and its
    /// verdict compared.
    #[arg(long)]
    strict: bool,
    /// Solve the plan of this frame of the only log again, and judge it.
    #[arg(long, value_name = "FRAME", conflicts_with = "strict")]
    explain: Option<u64>,
    #[command(flatten)]
    book: book::Arguments,
}

impl Args {
    pub(crate) fn run(self) -> Result<Exit> {
        if self.book.book {
            return self.book.run(&self.files, self.json);
        }
        if let Some(frame) = self.explain {
            let [file] = self.files.as_slice() else { bail!("--explain takes one log") };
            return explain::run(file, frame, self.json);
        }
        let mut files = Vec::new();
        for file in &self.files {
            if file.is_dir() { files.extend(logs_of(file)?) } else { files.push(file.clone()) }
        }
        give_each(&files, self.json, |file| {
            let found = verify_as(file, self.strict)?;
            for report in &found {
                warn_of_loss(&report.file, report.damage.as_deref(), report.cut.as_ref());
                warn_of_build(report);
            }
            Ok(found)
        })
    }
}

fn warn_of_build(report: &VerifyReport) {
    let differences = &report.build.differences;
    if report.outcome == Verification::Diverged && !differences.is_empty() {
        let facts: Vec<&str> = differences.iter().map(|difference| difference.fact.as_str()).collect();
        print_note(&format!("note: another build wrote {}; it differs in {}", report.file, facts.join(", ")));
    }
}
