//! Open loop: runs the controller alone on the recorded inputs, with other settings.
//!
//! Every tick gets its recorded input, so the vehicle moves as it did in flight, for any command. The answer
//! is what the controller *would have commanded*, beside what it did command. What *would have happened* is a question
//! for the [closed loop](mod@crate::refly). For example, a flight computer that lights its motor earlier than in flight
//! measures no thrust until the recorded ignition.

use std::io::{self, Write};
use std::path::PathBuf;

use anyhow::Result;
use serde::Serialize;

use crate::cli::{Outcome, answer, warn_of_what_is_missing};
pub use crate::controller::Decided;
use crate::controller::{FrameError, LoggedComputer, phase_name};
use crate::log::{Recording, RecordingError};
use crate::print::{print_json, shown};
use crate::settings::{Setting, SettingArguments, SettingError};

/// Sections that a flight computer never sees: the limits of the verdict, and the random draw.
const NOT_THE_PILOTS: [&str; 3] = ["touchdown_limits.", "leg_limits.", "truth."];

/// The time between frames.
const FRAME: &str = "estimator.frame_s";

/// Why a flight cannot be evaluated.
#[derive(Debug, thiserror::Error)]
pub enum EvaluateError {
    /// The log lacks the records that are needed.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// A setting is wrong.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// A recorded frame cannot be executed again.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// A timed setting of the estimator, which is set up only once.
    #[error("{setting}: the estimator's configuration holds from the beginning and cannot change in flight")]
    TimedEstimator { setting: String },
    /// A setting whose time comes after the last tick.
    #[error("{setting}: takes effect after the end of {name}, whose last tick is at T+{last_s:.3} s")]
    AfterTheEnd {
        setting: String,
        /// The file.
        name: String,
        /// Time of the last tick, s.
        last_s: f64,
    },
    /// A setting that the controller does not have.
    #[error(
        "{path} is not a setting of the controller: on recorded inputs it changes nothing; use refly to fly with it"
    )]
    NotTheControllers {
        /// The setting.
        path: String,
    },
    /// A setting that would change the times of the ticks.
    #[error("{path} cannot be changed on recorded inputs: there is one input every {recorded_s} s")]
    SampleTime {
        /// The setting.
        path: &'static str,
        /// The recorded value, s.
        recorded_s: f64,
    },
}

/// A tick: the recorded decision, and the decision with other settings.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EvaluatedTick {
    pub tick: u64,
    /// Vehicle time, s.
    pub time_s: f64,
    pub phase: &'static str,
    /// As recorded.
    pub recorded: Decided,
    /// With the other settings.
    pub evaluated: Decided,
}

/// The time at which a phase was entered.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PhaseEntered {
    pub phase: &'static str,
    /// As recorded, vehicle time, s; `None` if the phase was not entered.
    pub recorded_s: Option<f64>,
    /// With the other settings.
    pub evaluated_s: Option<f64>,
}

/// The result of an evaluation.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EvaluateReport {
    /// Marks the report as open loop.
    pub kind: &'static str,
    /// The log.
    pub file: String,
    /// The changed settings.
    pub settings: Vec<String>,
    /// Ticks that this build decides differently from the record even with nothing changed: differences there may come
    /// from the build and not from the settings.
    pub unchanged_different: usize,
    /// Number of ticks whose gimbal command differs in any bit.
    pub commands_different: usize,
    /// Root mean square of the differences of the gimbal commands in the landing, rad.
    pub gimbal_difference_rms_rad: f64,
    /// The largest difference of a gimbal command, rad.
    pub gimbal_difference_max_rad: f64,
    /// The tick with the largest difference.
    pub gimbal_difference_max_tick: Option<u64>,
    /// The largest difference of a fin command, rad.
    pub fins_difference_max_rad: f64,
    /// Number of ticks on which another control level decides.
    pub levels_different: usize,
    /// When each phase was entered, as recorded and with the other settings.
    pub phases: Vec<PhaseEntered>,
    pub ticks: Vec<EvaluatedTick>,
}

/// Every tick, and how many of them this build decides differently with nothing changed.
type Evaluated = (Vec<EvaluatedTick>, usize);

/// Evaluates a recorded flight under other settings.
///
/// # Errors
/// See [`EvaluateError`].
pub fn evaluate(recording: &Recording, settings: &[Setting]) -> Result<EvaluateReport, EvaluateError> {
    let ticks = side_by_side(recording, settings)?;
    let last_s = ticks.0.last().map_or(0.0, |tick| tick.time_s);
    match settings.iter().find(|setting| setting.at_s.is_some_and(|at_s| at_s > last_s)) {
        Some(late) => Err(EvaluateError::AfterTheEnd {
            setting: late.to_string(),
            name: recording.name.clone(),
            last_s,
        }),
        None => Ok(summarise(recording, settings, ticks)),
    }
}

/// Runs two flight computers on every frame. The recorded decision comes from the record; what the record leaves out
/// (cost and iterations of a plan) comes from `then`, which runs with the recorded settings.
fn side_by_side(recording: &Recording, settings: &[Setting]) -> Result<Evaluated, EvaluateError> {
    let (start, frames) = recording.replayable_frames()?;
    let toml = recording.profile_toml()?;
    let run = &recording.head.run;
    let mut then = LoggedComputer::recorded(toml, start, run, &[])?;
    refuse(settings, then.pilot().mission().estimator.frame_s)?;
    let mut now = LoggedComputer::recorded(toml, start, run, settings)?;
    let mut evaluated = Vec::with_capacity(frames.len());
    let mut unchanged_different = 0;
    for frame in frames {
        let unchanged = then.run_again(frame)?;
        let again = now.run_again(frame)?;
        let recorded = then.decided(frame);
        unchanged_different += usize::from(then.decided(&unchanged) != recorded);
        evaluated.push(EvaluatedTick {
            tick: frame.input.frame,
            time_s: frame.input.time_s,
            phase: phase_name(&frame.output),
            recorded,
            evaluated: now.decided(&again),
        });
    }
    Ok((evaluated, unchanged_different))
}

/// Refuses settings that the flight computer does not have, or that cannot change on recorded inputs.
fn refuse(settings: &[Setting], recorded_s: f64) -> Result<(), EvaluateError> {
    for setting in settings {
        let path = &setting.path;
        if NOT_THE_PILOTS.iter().any(|section| path.starts_with(section)) {
            return Err(EvaluateError::NotTheControllers { path: path.clone() });
        }
        if path == FRAME {
            return Err(EvaluateError::SampleTime { path: FRAME, recorded_s });
        }
        if setting.at_s.is_some() && path.starts_with("estimator.") {
            return Err(EvaluateError::TimedEstimator { setting: setting.to_string() });
        }
    }
    Ok(())
}

/// The largest difference of two commands' angles, rad.
fn apart_rad(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

fn summarise(
    recording: &Recording,
    settings: &[Setting],
    (ticks, unchanged_different): Evaluated,
) -> EvaluateReport {
    let difference_rad =
        |tick: &EvaluatedTick| apart_rad(&tick.recorded.gimbal_rad, &tick.evaluated.gimbal_rad);
    let landing: Vec<&EvaluatedTick> = ticks
        .iter()
        .filter(|tick| matches!(tick.phase, "LAND_ARMED" | "IGNITION" | "POWERED" | "TOUCHDOWN"))
        .collect();
    let squares: f64 = landing.iter().map(|tick| difference_rad(tick) * difference_rad(tick)).sum();
    let largest = ticks.iter().max_by(|a, b| difference_rad(a).total_cmp(&difference_rad(b)));
    let count = |differs: &dyn Fn(&EvaluatedTick) -> bool| ticks.iter().filter(|tick| differs(tick)).count();
    let bits = |angles: &[f64]| angles.iter().map(|angle| angle.to_bits()).collect::<Vec<_>>();
    let fins_rad = |tick: &EvaluatedTick| apart_rad(&tick.recorded.fins_rad, &tick.evaluated.fins_rad);
    EvaluateReport {
        kind: "open loop: the controller alone on recorded inputs",
        file: recording.name.clone(),
        settings: settings.iter().map(ToString::to_string).collect(),
        unchanged_different,
        commands_different: count(&|tick| {
            bits(&tick.recorded.gimbal_rad) != bits(&tick.evaluated.gimbal_rad)
        }),
        gimbal_difference_rms_rad: if landing.is_empty() {
            0.0
        } else {
            libm::sqrt(squares / landing.len() as f64)
        },
        gimbal_difference_max_rad: largest.map_or(0.0, difference_rad),
        gimbal_difference_max_tick: largest.filter(|tick| difference_rad(tick) > 0.0).map(|tick| tick.tick),
        fins_difference_max_rad: ticks.iter().map(fins_rad).fold(0.0, f64::max),
        levels_different: count(&|tick| tick.recorded.level != tick.evaluated.level),
        phases: phases(&ticks),
        ticks,
    }
}

/// Every phase in the order it was first entered.
fn phases(ticks: &[EvaluatedTick]) -> Vec<PhaseEntered> {
    let mut phases: Vec<PhaseEntered> = Vec::new();
    for tick in ticks {
        for (phase, is_recorded) in [(tick.recorded.phase, true), (tick.evaluated.phase, false)] {
            let place = phases.iter().position(|known| known.phase == phase).unwrap_or_else(|| {
                phases.push(PhaseEntered { phase, recorded_s: None, evaluated_s: None });
                phases.len() - 1
            });
            let entered = &mut phases[place];
            let time_s = if is_recorded { &mut entered.recorded_s } else { &mut entered.evaluated_s };
            time_s.get_or_insert(tick.time_s);
        }
    }
    phases
}

/// Most differing ticks that are shown.
const TICKS_SHOWN: usize = 120;

/// Writes an evaluation as text: the summary, then the ticks that differ.
///
/// # Errors
/// The output failed.
pub fn print_evaluate(report: &EvaluateReport, output: &mut impl Write) -> io::Result<()> {
    writeln!(output, "{}: {}", shown(&report.file), report.kind)?;
    if !report.settings.is_empty() {
        writeln!(output, "with {}", shown(&report.settings.join(" ")))?;
    }
    if report.unchanged_different > 0 {
        writeln!(
            output,
            "with nothing changed this build decides {} of {} ticks differently from the record",
            report.unchanged_different,
            report.ticks.len()
        )?;
    }
    let largest =
        report.gimbal_difference_max_tick.map(|tick| format!(" at tick {tick}")).unwrap_or_default();
    writeln!(
        output,
        "{} of {} gimbal commands differ: root mean square {:.3} deg in the landing, largest {:.3} deg{largest}",
        report.commands_different,
        report.ticks.len(),
        report.gimbal_difference_rms_rad.to_degrees(),
        report.gimbal_difference_max_rad.to_degrees()
    )?;
    writeln!(
        output,
        "fin commands differ by {:.3} deg at most; {} ticks are decided by another level",
        report.fins_difference_max_rad.to_degrees(),
        report.levels_different
    )?;
    for PhaseEntered { phase, recorded_s, evaluated_s } in &report.phases {
        if recorded_s != evaluated_s {
            let at = |time_s: Option<f64>| {
                time_s.map_or_else(|| "never".to_owned(), |time_s| format!("at {time_s:.3} s"))
            };
            writeln!(output, "{phase}: entered {} -> {}", at(*recorded_s), at(*evaluated_s))?;
        }
    }
    let differing: Vec<&EvaluatedTick> =
        report.ticks.iter().filter(|tick| tick.recorded != tick.evaluated).collect();
    if differing.is_empty() {
        return Ok(());
    }
    // Text shows planning frames only, because the others hardly differ; --csv has all 200 frames a second.
    let stride = differing.len().div_ceil(TICKS_SHOWN).max(1);
    if stride > 1 {
        writeln!(output, "one of {stride} differing ticks; --csv and --json show all:")?;
    }
    writeln!(
        output,
        "{:>5} {:>9} {:<12} {:>34} {:>22} {:>13}  plan lands",
        "tick", "time s", "phase", "gimbal deg", "cost", "iterations"
    )?;
    for tick in differing.into_iter().step_by(stride) {
        let (then, now) = (&tick.recorded, &tick.evaluated);
        let levels = if then.level == now.level {
            String::new()
        } else {
            format!("  {} -> {}", then.level, now.level)
        };
        writeln!(
            output,
            "{:>5} {:>9.3} {:<12} {:>15} -> {:>15} {:>9.2} -> {:>9.2} {:>5} -> {:>4}   {} -> {}{levels}",
            tick.tick,
            tick.time_s,
            tick.phase,
            angles(&then.gimbal_rad),
            angles(&now.gimbal_rad),
            then.cost,
            now.cost,
            then.iterations,
            now.iterations,
            yes_no(then.plan_lands),
            yes_no(now.plan_lands),
        )?;
    }
    Ok(())
}

/// Writes every tick of an evaluation as CSV.
///
/// # Errors
/// The output failed.
pub fn print_evaluate_csv(report: &EvaluateReport, output: &mut impl Write) -> io::Result<()> {
    let lists = report
        .ticks
        .first()
        .map_or((0, 0), |tick| (tick.recorded.gimbal_rad.len(), tick.recorded.fins_rad.len()));
    let mut columns = vec!["tick".to_owned(), "time_s".to_owned()];
    for side in ["recorded", "evaluated"] {
        columns.extend(["phase", "level", "cost", "iterations"].map(|name| format!("{side}_{name}")));
        // A single gimbal angle has no index in its name.
        let gimbal = (0..lists.0).map(|axis| match lists.0 {
            1 => format!("{side}_gimbal_rad"),
            _ => format!("{side}_gimbal_rad_{axis}"),
        });
        columns.extend(gimbal);
        columns.extend((0..lists.1).map(|fin| format!("{side}_fins_rad_{fin}")));
    }
    writeln!(output, "{}", columns.join(","))?;
    for tick in &report.ticks {
        let mut cells = vec![tick.tick.to_string(), format!("{:?}", tick.time_s)];
        for decided in [&tick.recorded, &tick.evaluated] {
            let Decided { gimbal_rad, fins_rad, phase, level, cost, iterations, plan_lands: _ } = decided;
            cells.extend([(*phase).to_owned(), (*level).to_owned()]);
            cells.extend([format!("{cost:?}"), iterations.to_string()]);
            cells.extend(gimbal_rad.iter().chain(fins_rad).map(|angle| format!("{angle:?}")));
        }
        writeln!(output, "{}", cells.join(","))?;
    }
    Ok(())
}

/// One angle, or pitch and yaw.
fn angles(rad: &[f64]) -> String {
    rad.iter().map(|rad| format!("{:.3}", rad.to_degrees())).collect::<Vec<_>>().join(" ")
}

fn yes_no(answer: Option<bool>) -> &'static str {
    match answer {
        None => "-",
        Some(true) => "yes",
        Some(false) => "no",
    }
}

#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The log, an MCAP file.
    file: PathBuf,
    #[command(flatten)]
    settings: SettingArguments,
    /// Answer in JSON, with every tick.
    #[arg(long, conflicts_with = "csv")]
    json: bool,
    /// Answer as CSV, with every tick.
    #[arg(long)]
    csv: bool,
}

impl Args {
    pub(crate) fn run(self) -> Result<Outcome> {
        let recording = Recording::open(&self.file)?;
        warn_of_what_is_missing(&recording);
        let report = evaluate(&recording, &self.settings.all()?)?;
        answer(|output| {
            if self.json {
                print_json(&report, output)
            } else if self.csv {
                print_evaluate_csv(&report, output)
            } else {
                print_evaluate(&report, output)
            }
        })?;
        Ok(Outcome::Given)
    }
}
