//! Closed loop: the flight flown again in simulation from a chosen moment, with other settings.
//!
//! The recorded truth is not enough, because no log holds the internal states of gusts, servos and sensors. So the flight
//! is flown again from its start, with the recorded draw and seed, up to that moment, and compared with the record frame
//! by frame on the way. From there on the changed settings apply to world and flight computer. Nothing of the record is
//! used after the start, so this answers what *would have* happened; [`evaluate`](mod@crate::evaluate) answers what the
//! flight computer alone *would have commanded* on the recorded inputs. With nothing changed, a simulated flight is
//! reproduced bit for bit.
//!
//! Faults may be added and taken away ("would it have landed without the GNSS outage?"): then the flight is flown from
//! its beginning with the other faults, and the settings apply from the start, as always.
//!
//! Settings change both flight computer and world. Settings "of the plant" change the world only, timed ones the flight
//! computer only. The crew's abort comes at its recorded frame.

pub(crate) mod prepared;
mod rerun;

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result};
use clap::ValueEnum;
use flight::rules::phase::Phase;
use prepared::Prepared;
use protocol::log::record::{Event, EventLevel, Record};
use protocol::log::v1;
use protocol::log::writer::LogHeader;
use serde::Serialize;
use sim::sortie::SetUpError;
use sim::world::whole::WorldError;

use crate::cli::{Outcome, answer, warn_of_what_is_missing};
use crate::controller::{REFLOWN_AT, REFLOWN_BY};
use crate::log::VerdictFacts;
use crate::log::{Clock, ClockTime, Moment, NewLog, Recording, RecordingError};
use crate::output::{Destination, Overwrite, WriteError};
use crate::print::{LimitRow, counted, print_json, shown, verdict_rows, verdict_words};
use crate::settings::{Setting, SettingArguments, SettingError};

/// The controller that flies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Law {
    /// As recorded.
    #[default]
    AsRecorded,
    /// The pilot itself.
    Nmpc,
    /// Ignition and fins at times fixed in advance.
    OpenLoop,
    /// The nose swings to waste thrust.
    Oscillating,
}

impl Law {
    /// The name on a command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::AsRecorded => "as-recorded",
            Self::Nmpc => "nmpc",
            Self::OpenLoop => "open-loop",
            Self::Oscillating => "oscillating",
        }
    }
}

/// Where to begin.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum StartAt {
    /// The first frame of the landing.
    #[default]
    Landing,
    /// Its number in the log.
    Frame(u64),
    /// The first frame at or after this vehicle time, s.
    Time(f64),
    /// The frame after the one that entered this phase.
    Phase(Phase),
}

/// Which recorded state to begin from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum From {
    /// The simulated world's.
    #[default]
    Truth,
    /// The flight computer's estimate.
    Estimate,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct StartState {
    /// The first frame flown again, by its number in the log.
    pub frame: u64,
    /// The same since the release.
    #[serde(skip)]
    pub since_release: u64,
    /// Its vehicle time, s.
    pub time_s: f64,
    pub phase: &'static str,
    /// The recorded state that was used.
    pub from: From,
    /// Horizontal distance from the pad, m.
    pub x_m: f64,
    /// Altitude, m.
    pub z_m: f64,
}

/// Options of a re-flown flight.
#[derive(Debug, Clone, Default)]
pub struct ReflyOptions {
    /// Where to begin.
    pub start: StartAt,
    /// Which recorded state to begin from.
    pub from: From,
    /// Settings of controller and plant; timed ones change the controller only.
    pub settings: Vec<Setting>,
    /// Additional settings of the plant only.
    pub plant_settings: Vec<Setting>,
    /// The controller that flies.
    pub law: Law,
    /// Seed of the plant's dispersions instead of the recorded seed.
    pub seed: Option<u64>,
    /// Other faults than the recorded ones.
    pub faults: FaultChanges,
}

/// How the faults of a flight differ from the recorded ones.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct FaultChanges {
    /// Faults that happen as well, as on the command line of a simulated flight.
    pub with: Vec<String>,
    /// Recorded faults that do not happen: each by its name, or in full as it was given; `all` for every one.
    pub without: Vec<String>,
}

impl FaultChanges {
    fn is_none(&self) -> bool {
        self.with.is_empty() && self.without.is_empty()
    }
}

/// Why a flight cannot be flown again.
#[derive(Debug, thiserror::Error)]
pub enum ReflyError {
    /// The log lacks the records that are needed.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// A setting is wrong.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// The requested start is not in the log.
    #[error("{name}: {reason}")]
    Start {
        /// The file.
        name: String,
        /// What was requested and what the log has.
        reason: String,
    },
    /// The flight cannot be set up.
    #[error(transparent)]
    Flight(#[from] SetUpError),
    /// The world cannot be changed this way at the start.
    #[error(transparent)]
    World(#[from] WorldError),
    /// The log does not say how its flight was flown, or this build does not know it.
    #[error("{name}: cannot be flown again from its start: {reason}")]
    Recipe {
        /// The file.
        name: String,
        /// What is missing or unknown.
        reason: String,
    },
    /// A fault cannot be added or left out.
    #[error("{name}: {reason}")]
    Fault {
        /// The file.
        name: String,
        reason: String,
    },
    /// A setting of the controller given to the plant, or the other way round.
    #[error("{setting}: {belongs}")]
    Misplaced {
        setting: String,
        /// The owner of the setting.
        belongs: &'static str,
    },
    /// A setting of the plant has a time.
    #[error(
        "{setting}: the plant's settings hold from the beginning; only the controller's can change in flight"
    )]
    TimedPlant { setting: String },
}

/// How the re-flown frames before the start compare with the record.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Reached {
    /// Recorded frames before the start.
    pub frames: usize,
    /// Of these, how many were reproduced bit for bit.
    pub identical: usize,
    /// The first frame that was not.
    pub first_different: Option<u64>,
}

/// The result of flying again.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ReflyReport {
    /// Marks the report as closed loop.
    pub kind: &'static str,
    /// The log.
    pub file: String,
    /// The changed settings of controller and plant.
    pub settings: Vec<String>,
    /// The changed settings of the plant only.
    pub plant_settings: Vec<String>,
    /// The controller that flew.
    pub law: Law,
    /// The faults that differ from the recorded ones, from the beginning of the flight on.
    pub faults: FaultChanges,
    /// The seed of the plant's draw, if it is not the recorded one.
    pub seed: Option<u64>,
    pub start: StartState,
    /// How the frames before the start compare with the record.
    pub reached: Reached,
    /// True impulse over certified impulse.
    pub thrust_scale: f64,
    /// The recorded verdict.
    pub recorded: Option<VerdictFacts>,
    /// The verdict now; `None` if the vehicle did not come down in a minute.
    pub reflown: Option<VerdictFacts>,
    /// Whether one of the two stands undamaged and the other does not; `None` if either is unknown.
    pub verdict_changed: Option<bool>,
    /// The smallest distance to a limit that decides whether it stands undamaged, as a fraction of the limit: 1 far from it, 0 on
    /// it, negative outside. `None` without a contact.
    pub margin: Option<f64>,
    /// Frames that the controller ran.
    pub frames: usize,
    /// Of these, how many have a recorded frame of the same number.
    pub commands_recorded: usize,
    /// Of those, how many commanded the same gimbal angle, bit for bit.
    pub commands_identical: usize,
    /// The largest difference of a gimbal command from the recorded command of the same frame, rad.
    pub gimbal_difference_max_rad: f64,
}

/// A re-flown flight.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ReflownFlight {
    /// All its records, with vehicle times, s.
    pub records: Vec<(f64, Record)>,
    /// Facts that its log has in addition to those of the recorded flight.
    pub run: BTreeMap<String, String>,
    /// The landing verdict; `None` if it did not come down.
    pub verdict: Option<v1::LandingVerdict>,
}

/// Flies a recorded flight again.
///
/// # Errors
/// See [`ReflyError`].
pub fn refly(recording: &Recording, options: &ReflyOptions) -> Result<ReflyReport, ReflyError> {
    Prepared::new(recording, options)?.fly(options)
}

/// Flies a recorded flight again and keeps the flight itself.
///
/// # Errors
/// See [`ReflyError`].
pub fn refly_flight(
    recording: &Recording,
    options: &ReflyOptions,
) -> Result<(ReflyReport, ReflownFlight), ReflyError> {
    Prepared::new(recording, options)?.fly_kept(options)
}

/// Refuses a time on settings of the plant.
fn refuse_timed(plant_settings: &[Setting]) -> Result<(), ReflyError> {
    let timed = plant_settings.iter().find(|setting| setting.at_s.is_some());
    timed.map_or(Ok(()), |timed| Err(ReflyError::TimedPlant { setting: timed.to_string() }))
}

/// The smallest distance to a limit as a fraction of it; see [`ReflyReport::margin`].
pub fn margin(verdict: &VerdictFacts) -> f64 {
    let left = verdict.deciding().map(|limit| 1.0 - limit.share());
    // A NaN counts as infinitely far outside.
    left.map(|left| if left.is_nan() { f64::NEG_INFINITY } else { left }).fold(f64::INFINITY, f64::min)
}

/// Writes a re-flown flight as a log that every command accepts.
///
/// # Errors
/// The file exists and may not be replaced, or cannot be created or written.
pub fn write_log<'a>(
    destination: impl Into<Destination<'a>>,
    recording: &Recording,
    options: &ReflyOptions,
    report: &ReflyReport,
    flight: &ReflownFlight,
) -> Result<(), WriteError> {
    let destination = destination.into();
    let header = header(recording, options, report, flight);
    let mut log = NewLog::create(destination, Path::new(&recording.name), &header)?;
    for (time_s, record) in records(report, flight) {
        log.write(&record, (time_s.max(0.0) * 1e9) as u64)?;
    }
    log.finish()
}

fn header(
    recording: &Recording,
    options: &ReflyOptions,
    report: &ReflyReport,
    flight: &ReflownFlight,
) -> LogHeader {
    let mut run: BTreeMap<String, String> = recording.head.run.clone();
    run.insert("reflown_from".to_owned(), report.file.clone());
    run.insert(REFLOWN_AT.to_owned(), report.start.since_release.to_string());
    run.insert("reflown_with".to_owned(), report.settings.join(" "));
    if report.law != Law::AsRecorded {
        run.insert(REFLOWN_BY.to_owned(), report.law.name().to_owned());
    }
    run.extend(flight.run.clone());
    run.insert("plant_settings".to_owned(), report.plant_settings.join(" "));
    run.retain(|_, fact| !fact.is_empty());
    if let Some(seed) = options.seed {
        run.insert("seed".to_owned(), seed.to_string());
        let before = recording.head.run.get("seed").map_or("not recorded", String::as_str);
        run.insert("reflown_instead_of_seed".to_owned(), before.to_owned());
    }
    let start = recording.head.run.get("start_unix_ns").and_then(|text| text.parse().ok());
    LogHeader {
        writer: "replay".to_owned(),
        start_unix_ns: start.unwrap_or(0),
        run,
        // It keeps its mission; its settings change in flight.
        profile_toml: recording.profile_toml().ok().map(str::to_owned),
        scenario_toml: recording.head.scenario_toml.clone(),
    }
}

/// Every record with its vehicle time, s, in order.
fn records(report: &ReflyReport, flight: &ReflownFlight) -> Vec<(f64, Record)> {
    let mut records = flight.records.clone();
    let began = Event {
        level: EventLevel::Info,
        name: "replay".to_owned(),
        message: format!("flown again in simulation from frame {}", report.start.frame),
    };
    records.push((report.start.time_s, Record::Event(began)));
    let end_s = records.iter().map(|(time_s, _)| *time_s).fold(0.0, f64::max);
    records.extend(flight.verdict.clone().map(|verdict| (end_s, Record::LandingVerdict(Box::new(verdict)))));
    records.sort_by(|a, b| a.0.total_cmp(&b.0));
    records
}

/// Writes the result of flying a flight again.
///
/// # Errors
/// The output failed.
pub fn print_refly(report: &ReflyReport, output: &mut impl Write) -> io::Result<()> {
    writeln!(output, "{}: {}", shown(&report.file), report.kind)?;
    let start = &report.start;
    writeln!(
        output,
        "from frame {} (T+{:.3} s, {}, recorded {}): x {:.3} m, altitude {:.3} m, thrust {:.4} of nominal",
        start.frame,
        start.time_s,
        start.phase,
        match start.from {
            crate::refly::From::Truth => "truth",
            crate::refly::From::Estimate => "estimate",
        },
        start.x_m,
        start.z_m,
        report.thrust_scale
    )?;
    for (what, settings) in [("with", &report.settings), ("plant alone with", &report.plant_settings)] {
        if !settings.is_empty() {
            writeln!(output, "{what} {}", shown(&settings.join(" ")))?;
        }
    }
    for (what, faults) in
        [("with the fault", &report.faults.with), ("without the fault", &report.faults.without)]
    {
        if !faults.is_empty() {
            writeln!(output, "{what} {}, from the beginning of the flight", shown(&faults.join(" ")))?;
        }
    }
    if let Some(seed) = report.seed {
        writeln!(output, "plant drawn with seed {seed} instead of the recorded one")?;
    }
    let Reached { frames, identical, first_different } = report.reached;
    writeln!(
        output,
        "flown again from its start up to there: {identical} of {frames} recorded frames identical"
    )?;
    if let Some(frame) = first_different {
        writeln!(
            output,
            "NOT AS RECORDED from frame {frame} on: this build flies differently, and the result continues from its own flight"
        )?;
    }
    match report.law {
        Law::AsRecorded => {}
        law => writeln!(output, "with the landing burn flown by {}", law.name())?,
    }
    print_verdicts(report.recorded.as_ref(), report.reflown.as_ref(), output)?;
    let answer = match report.verdict_changed {
        Some(true) => "the verdict CHANGES",
        Some(false) => "the verdict does not change",
        None => "the log has no verdict to compare with",
    };
    let margin = report.margin.map_or_else(|| "no contact".to_owned(), |margin| format!("{margin:.3}"));
    writeln!(output, "{answer}; margin to the nearest limit {margin}")?;
    writeln!(
        output,
        "{}; of {} recorded too, {} with the same gimbal command bit for bit; largest difference {:.3e} rad",
        counted(report.frames as u64, "frame"),
        report.commands_recorded,
        report.commands_identical,
        report.gimbal_difference_max_rad
    )
}

/// Two verdicts, limit by limit.
pub(crate) fn print_verdicts(
    recorded: Option<&VerdictFacts>,
    now: Option<&VerdictFacts>,
    output: &mut impl Write,
) -> io::Result<()> {
    let words = |verdict| verdict_words(verdict, "no verdict");
    writeln!(output, "{:<14} {:>22} {:>22}", "", "recorded", "flown again")?;
    writeln!(output, "{:<14} {:>22} {:>22}", "verdict", words(recorded), words(now))?;
    for LimitRow { limit, values: [then, now] } in
        verdict_rows(now.or(recorded), [recorded, now], shown, " OUTSIDE")
    {
        writeln!(
            output,
            "{:<14} {then:>22} {now:>22}   limit {:.4} to {:.4}",
            shown(&limit.name),
            limit.minimum,
            limit.maximum
        )?;
    }
    Ok(())
}

#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The log, an MCAP file.
    file: PathBuf,
    #[command(flatten)]
    how: FlownHow,
    /// Begin at T+12.9, POWERED or frame:1290.
    ///
    /// A time is in seconds, on the clock that its name says: T+12.9 or 12.9 (since the release), boot:19.8 (since power-up),
    /// log:19.7 (since the first record). A frame has its number in the log. Without this, it is the landing's first frame.
    #[arg(long, value_name = "WHERE")]
    at: Option<Moment>,
    /// Write the flight as a new log.
    #[arg(long, value_name = "FILE")]
    log: Option<PathBuf>,
    /// Replace an existing file, but never the log that is flown again.
    #[arg(long, requires = "log", hide_short_help = true)]
    force: bool,
    /// Answer in JSON.
    #[arg(long)]
    json: bool,
}

/// How a flight is flown again, wherever it begins.
#[derive(Debug, clap::Args)]
pub(crate) struct FlownHow {
    #[command(flatten)]
    pub(crate) settings: SettingArguments,
    /// Another setting of the plant alone.
    ///
    /// As in truth.impulse_scale=0.97. The controller does not know about it. Also airframe.motor=G33, truth.wind_m_s=7. May be given more than once.
    #[arg(long, value_name = "SETTING")]
    plant: Vec<Setting>,
    /// The recorded state to begin from.
    #[arg(long, value_enum, default_value_t = From::Truth, hide_short_help = true)]
    from: From,
    /// The controller that flies.
    #[arg(long, value_enum, value_name = "NAME", default_value_t = Law::AsRecorded, hide_short_help = true)]
    controller: Law,
    /// Another fault, as in gnss-out@5.
    #[arg(
        long = "fault",
        value_name = "FAULT",
        long_help = format!("Another fault, from the beginning of the flight on; may be given more than once. Write {}", sim::fault::how_to_write())
    )]
    faults: Vec<String>,
    /// Leave out a recorded fault; `all` for every one.
    ///
    /// By its name, or in full as it was given.
    #[arg(long, value_name = "FAULT")]
    without_fault: Vec<String>,
    /// Seed of the plant's dispersions instead of the recorded one.
    #[arg(long, value_name = "N", hide_short_help = true)]
    seed: Option<u64>,
}

impl FlownHow {
    pub(crate) fn options(&self, start: StartAt) -> Result<ReflyOptions> {
        Ok(ReflyOptions {
            start,
            from: self.from,
            settings: self.settings.all()?,
            plant_settings: self.plant.clone(),
            law: self.controller,
            seed: self.seed,
            faults: FaultChanges { with: self.faults.clone(), without: self.without_fault.clone() },
        })
    }
}

impl Args {
    pub(crate) fn run(self) -> Result<Outcome> {
        let recording = Recording::open(&self.file)?;
        let start = match self.at {
            Some(Moment::Frame(frame)) => StartAt::Frame(frame),
            Some(Moment::Time(time)) => StartAt::Time(flight_time_s(&recording, time)?),
            Some(Moment::Phase(phase)) => StartAt::Phase(phase),
            None => StartAt::Landing,
        };
        warn_of_what_is_missing(&recording);
        let options = self.how.options(start)?;
        let (report, flight) = refly_flight(&recording, &options)?;
        if let Some(path) = &self.log {
            let destination = Destination { path, overwrite: Overwrite::if_forced(self.force) };
            write_log(destination, &recording, &options, &report, &flight)?;
        }
        answer(|output| if self.json { print_json(&report, output) } else { print_refly(&report, output) })?;
        Ok(Outcome::Given)
    }
}

fn flight_time_s(recording: &Recording, time: ClockTime) -> Result<f64> {
    let converted = recording.clocks.convert(time, Clock::Flight);
    let name = &recording.name;
    converted.map(|time| time.time_s).with_context(|| {
        format!("--at {time}: {name} does not say when its T+0 was on that clock; give the time as T+SECONDS")
    })
}
