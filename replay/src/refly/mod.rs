//! Closed loop: the flight flown again in simulation from a chosen moment, with other settings.
//!
//! The recorded truth is not enough, because no log holds the internal states of gusts, servos and
//! sensors. So the flight is flown again from its start, with the recorded draw and seed, up to
//! that moment, and compared with the record frame by frame on the way. From there on the changed
//! settings apply to world and flight computer. Nothing of the record is used after the start, so
//! this answers what *would have* happened; [`evaluate`](mod@crate::evaluate) answers what the
//! flight computer alone *would have commanded* on the recorded inputs. With nothing changed, a
//! simulated flight is reproduced bit for bit.
//!
//! Faults may be added and taken away ("would it have landed without the GNSS outage?"): then the
//! flight is flown from its beginning with the other faults, and the settings apply from the start,
//! as always.
//!
//! Settings change both flight computer and world. Settings "of the plant" change the world only,
//! timed ones the flight computer only. The crew's abort comes at its recorded frame.

mod others;
pub(crate) mod rerun;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::Result;
use avionics::log::frame::phase_of;
use flight::computer::FRAME_S;
use flight::rules::phase::Phase;
use prost::Message as _;
use protocol::log::computer_v1::{ComputerFrame, ComputerInput, ComputerOutput};
use protocol::log::record::{Event, EventLevel, Record};
use protocol::log::v1::LimitResult;
use protocol::log::writer::LogHeader;
use protocol::program::{Exit, in_range};
use serde::Serialize;
use sim::sortie::SetUpError;
use sim::wire::record;

pub use self::others::{OtherFlights, other_flights};
use self::rerun::Rerun;
use crate::cli::{Answer, WithSettings, give};
use crate::controller::{AgainError, SETTINGS_IN_FLIGHT, phase_name, refuse};
use crate::log::{Clock, ClockTime, Moment, Recording, Verdict, share, write_records};
use crate::output::WriteError;
use crate::print::{counted, verdict_table};
use crate::settings::{Schedule, Setting, mission_with, truth_with};

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct StartState {
    /// The first frame flown again, by its number in the log.
    pub frame: u64,
    /// Its vehicle time, s.
    pub time_s: f64,
    pub phase: &'static str,
    /// Horizontal distance from the pad, m.
    pub x_m: f64,
    /// Altitude, m.
    pub z_m: f64,
}

/// Options of a re-flown flight.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ReflyOptions {
    /// Where to begin: at the frame, at the first one of that time, or at the one after the one
    /// that entered the phase. `None`: at the landing's first frame.
    pub start: Option<Moment>,
    /// Settings of controller and plant; timed ones change the controller only.
    pub settings: Vec<Setting>,
    /// Additional settings of the plant only.
    pub plant_settings: Vec<Setting>,
    /// Other faults than the recorded ones.
    pub faults: FaultChanges,
}

/// How the faults of a flight differ from the recorded ones.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct FaultChanges {
    /// Faults that happen as well, as on the command line of a simulated flight.
    pub with: Vec<String>,
    /// Recorded faults that do not happen: each by its name, or in full as it was given; `all` for
    /// every one.
    pub without: Vec<String>,
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
    /// The faults that differ from the recorded ones, from the beginning of the flight on.
    pub faults: FaultChanges,
    pub start: StartState,
    /// How the frames before the start compare with the record.
    pub reached: Reached,
    /// True impulse over certified impulse.
    pub thrust_scale: f64,
    /// The recorded verdict.
    pub recorded: Option<Verdict>,
    /// The verdict now; `None` if the vehicle did not come down in a minute.
    pub reflown: Option<Verdict>,
    /// Whether one of the two stands undamaged and the other does not; `None` if either is unknown.
    pub verdict_changed: Option<bool>,
    /// The smallest distance to a limit that decides whether it stands undamaged, as a fraction of
    /// the limit: 1 far from it, 0 on it, negative outside. `None` without a contact.
    pub margin: Option<f64>,
    /// Frames that the controller ran.
    pub frames: usize,
    /// Of these, how many have the outputs of the recorded frame of the same number.
    pub commands_identical: usize,
    /// Something was to be changed, and every output from the start on is the recorded one.
    pub never_acted: bool,
    /// What the changes do to other flights, if requested.
    pub others: Option<OtherFlights>,
}

/// A re-flown flight.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ReflownFlight {
    /// All its records, with vehicle times, s.
    pub records: Vec<(f64, Record)>,
    /// The facts of its log.
    pub run: BTreeMap<String, String>,
}

/// Flies a recorded flight again.
///
/// # Errors
/// See [`AgainError`].
pub fn refly(recording: &Recording, options: &ReflyOptions) -> Result<ReflyReport, AgainError> {
    Ok(refly_flight(recording, options)?.0)
}

/// Flies a recorded flight again and returns the flight. The frames before the start are the
/// re-flown ones, too: recorded frames may come from another build or be partly lost, and the
/// flight after the start would not continue them.
///
/// # Errors
/// See [`AgainError`].
pub fn refly_flight(
    recording: &Recording,
    options: &ReflyOptions,
) -> Result<(ReflyReport, ReflownFlight), AgainError> {
    refuse_misplaced(options)?;
    let (_, frames) = recording.recorded_frames()?;
    let mut rerun = Rerun::of(recording, &FaultChanges::default())?;
    let place = find(recording, frames, options.start)?;
    let first_frame = frames[place].input.frame;
    rerun = rerun.fly_before(first_frame);
    let reached = reached(recording, &rerun, &frames[..place]);
    let world = rerun.flight.world();
    let start = StartState {
        frame: recording.release_frame + first_frame,
        time_s: frames[place].input.time_s,
        phase: place.checked_sub(1).map_or("DEPLOY", |before| phase_name(&frames[before].output)),
        x_m: world.state().position_m.xy().norm(),
        z_m: world.height_m(),
    };
    if options.faults != FaultChanges::default() {
        // It may come there another way.
        rerun = Rerun::of(recording, &options.faults)?.fly_before(first_frame);
    }
    let in_flight = in_flight(options, first_frame);
    change(recording, options, &in_flight, &mut rerun)?;
    let began = Event {
        level: EventLevel::Info,
        name: "replay".to_owned(),
        message: format!("flown again in simulation from frame {}", start.frame),
    };
    rerun.records.push((rerun.flight.frame() as f64 * FRAME_S, Record::Event(began)));
    rerun = rerun.fly_before(u64::MAX);

    let verdict = record::verdict(&rerun.flight);
    let (recorded, reflown) = (recording.verdict.clone(), verdict.as_ref().map(Verdict::of));
    let end_s = rerun.flight.frame() as f64 * FRAME_S;
    rerun.records.extend(verdict.map(|verdict| (end_s, Record::LandingVerdict(Box::new(verdict)))));
    let landed = |verdict: &Option<Verdict>| verdict.as_ref().map(|verdict| verdict.landing.stands);
    let listed = |settings: &[Setting]| settings.iter().map(ToString::to_string).collect();
    let changes = ReflyOptions { start: None, ..options.clone() } != ReflyOptions::default();
    let beside: Vec<bool> =
        rerun.beside(&frames[place..]).map(|(now, then)| now.output != then.output).collect();
    let other = beside.iter().filter(|other| **other).count();
    let report = ReflyReport {
        kind: "closed loop: flown again in simulation",
        file: recording.name.clone(),
        settings: listed(&options.settings),
        plant_settings: listed(&options.plant_settings),
        faults: options.faults.clone(),
        start,
        reached,
        thrust_scale: rerun.flight.world().truth().impulse_scale,
        verdict_changed: landed(&recorded).map(|then| Some(then) != landed(&reflown)),
        recorded,
        margin: reflown.as_ref().map(margin),
        reflown,
        frames: rerun.frames().filter(|frame| frame.input.frame >= first_frame).count(),
        commands_identical: beside.len() - other,
        never_acted: changes && other == 0,
        others: None,
    };
    let run = run_facts(recording, &report, &in_flight, &rerun);
    Ok((report, ReflownFlight { records: rerun.records, run }))
}

/// How the frames before the start compare with the record.
fn reached(recording: &Recording, rerun: &Rerun, before: &[ComputerFrame]) -> Reached {
    let mut reached = Reached { frames: 0, identical: 0, first_different: None };
    for (now, then) in rerun.beside(before) {
        reached.frames += 1;
        if is_same_flight(now, then, !recording.from_power_up) {
            reached.identical += 1;
        } else {
            reached.first_different.get_or_insert(recording.release_frame + then.input.frame);
        }
    }
    reached
}

/// Whether two frames are of the same flight: measurements, decisions and memory, unless the memory
/// covers a pad. Differences made by a crew or the disk of a log do not count.
fn is_same_flight(now: &ComputerFrame, then: &ComputerFrame, same_memory: bool) -> bool {
    let compared = |frame: &ComputerFrame| {
        let output = ComputerOutput { answers: Vec::new(), released: false, ..frame.output.clone() };
        let state_digest = if same_memory { frame.state_digest } else { 0 };
        ComputerFrame { input: sensed(&frame.input), output, state_digest }.encode_to_vec()
    };
    compared(now) == compared(then)
}

/// The part of an input that the world determines, without crew, pad and disk of the log.
pub(crate) fn sensed(input: &ComputerInput) -> ComputerInput {
    ComputerInput {
        measured: input.measured,
        gimbal_rad: input.gimbal_rad.clone(),
        fins_rad: input.fins_rad.clone(),
        contact: input.contact,
        igniter_continuity: input.igniter_continuity,
        booster_attached: input.booster_attached,
        ..ComputerInput::default()
    }
}

/// The settings as timed ones. None applies before the start (half a frame before the end of its
/// first frame), because until then the flight is the recorded one.
fn in_flight(options: &ReflyOptions, first_frame: u64) -> Vec<Setting> {
    let start_s = (first_frame as f64 - 0.5) * FRAME_S;
    let mut in_flight = options.settings.clone();
    // Of two settings that take effect at the start, the later setting wins, as it would have in
    // flight.
    in_flight.sort_by(|a, b| a.at_s.unwrap_or(f64::MIN).total_cmp(&b.at_s.unwrap_or(f64::MIN)));
    for setting in &mut in_flight {
        setting.at_s = Some(setting.at_s.map_or(start_s, |at_s| at_s.max(start_s)));
    }
    in_flight
}

/// Changes the flight from here on. The world gets its airframe from all settings without a time,
/// and its draw from the settings of the draw.
fn change(
    recording: &Recording,
    options: &ReflyOptions,
    in_flight: &[Setting],
    rerun: &mut Rerun,
) -> Result<(), AgainError> {
    let toml = recording.profile_toml()?;
    rerun.schedule = Some(Schedule::of(toml, recording.recorded_frames()?.0, in_flight)?);
    let (of_truth, of_mission): (Vec<Setting>, Vec<Setting>) =
        options.plant_settings.iter().cloned().partition(|setting| setting.path.starts_with("truth."));
    let lasting = options.settings.iter().filter(|setting| setting.at_s.is_none());
    let all: Vec<Setting> = lasting.chain(&of_mission).cloned().collect();
    let true_mission = mission_with(toml, &all)?;
    let world = rerun.flight.world();
    let truth = truth_with(world.truth(), &of_truth)?;
    if truth != *world.truth() || true_mission.airframe != *world.airframe() {
        let motor = truth.curve(&true_mission).map_err(SetUpError::from)?;
        let changed = world.changed(&true_mission.airframe, motor.as_ref(), &truth);
        *rerun.flight.world_mut() = changed.map_err(SetUpError::from)?;
    }
    Ok(())
}

/// The plant takes settings of the airframe and of the draw, from the beginning; the controller
/// takes all but those of the draw and of its estimator.
fn refuse_misplaced(options: &ReflyOptions) -> Result<(), AgainError> {
    refuse(&options.plant_settings, |Setting { path, at_s, .. }| {
        let why = if at_s.is_some() {
            "the plant's settings hold from the beginning; only the controller's can change in flight"
        } else if !(path.starts_with("truth.") || path.starts_with("airframe")) {
            "the plant has airframe.* and truth.*; everything else is the controller's (--set)"
        } else {
            return None;
        };
        Some(why.to_owned())
    })?;
    refuse(&options.settings, |Setting { path, .. }| {
        let why = match path.split_once('.')?.0 {
            "truth" => "the random draw belongs to the plant alone (--plant)",
            "estimator" => "the estimator is set up at apogee; evaluate takes it",
            _ => return None,
        };
        Some(why.to_owned())
    })
}

/// The index of the frame to start with. For a phase it is the frame after the one that entered it,
/// because changes cannot act earlier.
fn find(recording: &Recording, frames: &[ComputerFrame], start: Option<Moment>) -> Result<usize, AgainError> {
    let logged = |frame: &ComputerFrame| recording.release_frame + frame.input.frame;
    let in_phase = |wanted: &dyn Fn(Phase) -> bool| {
        let entered = frames.iter().position(|frame| phase_of(&frame.output).is_some_and(wanted))?;
        Some(entered + 1).filter(|place| *place < frames.len())
    };
    let (found, reason) = match start {
        None => (
            in_phase(&Phase::is_landing),
            "no frame of a landing to start from; a frame, a time or a phase names another moment".to_owned(),
        ),
        Some(Moment::Frame(number)) => {
            let [first, last] = [frames.first(), frames.last()].map(|frame| frame.map_or(0, logged));
            (
                frames.iter().position(|frame| logged(frame) == number),
                format!("no frame {number}; there are {first} to {last}"),
            )
        }
        Some(Moment::Time(time)) => match recording.clocks.convert(time, Clock::Flight) {
            Some(ClockTime { time_s, .. }) => (
                frames.iter().position(|frame| frame.input.time_s >= time_s),
                format!(
                    "no frame at or after {time_s} s; the last is at {:.3} s",
                    frames.last().map_or(0.0, |frame| frame.input.time_s)
                ),
            ),
            None => (
                None,
                format!("does not say when T+0 was on the clock of {time}; give the time as T+SECONDS"),
            ),
        },
        Some(Moment::Phase(phase)) => {
            (in_phase(&|found| found == phase), format!("no frame in phase {}", phase.name()))
        }
    };
    found.ok_or_else(|| AgainError::Refused { of: recording.name.clone(), reason })
}

/// The smallest distance to a limit as a fraction of it; see [`ReflyReport::margin`]. A vehicle
/// that fell over is as far from standing as load, speed and tilt at its contact say.
pub fn margin(verdict: &Verdict) -> f64 {
    let has_width = |limit: &&LimitResult| limit.maximum > limit.minimum;
    let fell = verdict.deciding().any(|limit| !has_width(&limit) && !limit.passed);
    let limits: Vec<&LimitResult> =
        if fell { verdict.of_the_legs().filter(has_width).collect() } else { verdict.deciding().collect() };
    let left = limits.into_iter().map(|limit| 1.0 - share(limit));
    // A NaN counts as infinitely far outside.
    let most = if fell { 0.0 } else { f64::INFINITY };
    left.map(|left| if left.is_nan() { f64::NEG_INFINITY } else { left }).fold(most, f64::min)
}

/// Writes a re-flown flight as a log that every command accepts.
///
/// # Errors
/// The file cannot be created or written.
pub fn write_log(
    output: &Path,
    recording: &Recording,
    flight: &ReflownFlight,
) -> Result<PathBuf, WriteError> {
    let start = recording.head.run.get("start_unix_ns").and_then(|text| text.parse().ok());
    let header = LogHeader {
        writer: "replay".to_owned(),
        start_unix_ns: start.unwrap_or(0),
        run: flight.run.clone(),
        // It keeps its mission; its settings change in flight.
        profile_toml: recording.profile_toml().ok().map(str::to_owned),
        scenario_toml: recording.head.scenario_toml.clone(),
        live: None,
    };
    write_records(output, &header, &flight.records)
}

/// Facts about the run of a re-flown flight.
fn run_facts(
    recording: &Recording,
    report: &ReflyReport,
    in_flight: &[Setting],
    rerun: &Rerun,
) -> BTreeMap<String, String> {
    let lines: Vec<String> = in_flight.iter().map(ToString::to_string).collect();
    let faults: Vec<String> = rerun.recipe.faults.iter().map(ToString::to_string).collect();
    let mut run = recording.head.run.clone();
    run.extend(
        [
            ("reflown_from", report.file.clone()),
            ("reflown_with", report.settings.join(" ")),
            (SETTINGS_IN_FLIGHT, lines.join("\n")),
            ("faults", faults.join(" ")),
            ("plant_settings", report.plant_settings.join(" ")),
        ]
        .map(|(fact, value)| (fact.to_owned(), value)),
    );
    run.retain(|_, fact| !fact.is_empty());
    run
}

impl Answer for ReflyReport {
    fn sentences(&self) -> Vec<String> {
        let StartState { frame, time_s, phase, x_m, z_m } = self.start;
        let mut lines = vec![
            format!("{}: {}", self.file, self.kind),
            format!(
                "from frame {frame} (T+{time_s:.3} s, {phase}): x {x_m:.3} m, altitude {z_m:.3} m, thrust {:.4} of nominal",
                self.thrust_scale
            ),
        ];
        let FaultChanges { with, without } = &self.faults;
        for (what, changes, since) in [
            ("with", &self.settings, ""),
            ("plant alone with", &self.plant_settings, ""),
            ("with the fault", with, ", from the beginning of the flight"),
            ("without the fault", without, ", from the beginning of the flight"),
        ] {
            if !changes.is_empty() {
                lines.push(format!("{what} {}{since}", changes.join(" ")));
            }
        }
        let Reached { frames, identical, first_different } = self.reached;
        lines.push(format!(
            "flown again from its start up to there: {identical} of {frames} recorded frames identical"
        ));
        lines.extend(first_different.map(|frame| {
            format!(
                "NOT AS RECORDED from frame {frame} on: this build flies differently, and the result continues from its own flight"
            )
        }));
        let verdicts = [self.recorded.as_ref(), self.reflown.as_ref()];
        lines.extend(verdict_table(["recorded", "flown again"], verdicts));
        let answer = match self.verdict_changed {
            Some(true) => "the verdict CHANGES",
            Some(false) => "the verdict does not change",
            None => "the log has no verdict to compare with",
        };
        let margin = self.margin.map_or_else(|| "no contact".to_owned(), |margin| format!("{margin:.3}"));
        lines.push(if self.never_acted {
            "what was to be changed NEVER ACTED: every output is the recorded one".to_owned()
        } else {
            format!("{answer}; margin to the nearest limit {margin}")
        });
        let asks = self.others.is_none() && !self.never_acted && !self.settings.is_empty();
        lines.extend(self.others.as_ref().map(OtherFlights::words));
        if asks && self.verdict_changed == Some(true) {
            lines.push(
                "one flight may be luck: --flights 200 asks as many others, with and without the change"
                    .to_owned(),
            );
        }
        let frames = counted(self.frames as u64, "frame");
        lines.push(format!("{frames}, {} of them with the recorded commands", self.commands_identical));
        lines
    }
}

#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    flight: WithSettings,
    /// Another setting of the plant alone.
    ///
    /// As in truth.impulse_scale=0.97. The controller does not know about it. Also
    /// airframe.motor=G33, truth.wind_m_s=7. May be given more than once.
    #[arg(long, value_name = "SETTING")]
    plant: Vec<Setting>,
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
    /// Begin at T+12.9, POWERED or frame:1290.
    ///
    /// A time is in seconds, on the clock that its name says: T+12.9 or 12.9 (since the release),
    /// boot:19.8 (since power-up), log:19.7 (since the first record). A frame has its number in the
    /// log. Without this, it is the landing's first frame.
    #[arg(long, value_name = "WHERE")]
    at: Option<Moment>,
    /// Fly this many other flights of the recorded mission and dispersions, too, as recorded and
    /// with the changes.
    #[arg(long, value_name = "N", value_parser = in_range(1..=100_000_u64))]
    flights: Option<u64>,
    /// Write the flight as a new log.
    #[arg(long, alias = "log", value_name = "FILE")]
    out: Option<PathBuf>,
}

impl Args {
    pub(crate) fn run(self) -> Result<Exit> {
        let recording = self.flight.recording()?;
        let options = ReflyOptions {
            start: self.at,
            settings: self.flight.settings,
            plant_settings: self.plant,
            faults: FaultChanges { with: self.faults, without: self.without_fault },
        };
        let (mut report, flight) = refly_flight(&recording, &options)?;
        report.others =
            self.flights.map(|flights| other_flights(&recording, &options, flights)).transpose()?;
        if let Some(path) = &self.out {
            write_log(path, &recording, &flight)?;
        }
        give(&report, self.flight.json)
    }
}
