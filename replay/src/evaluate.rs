//! Open loop: runs the controller alone on the recorded inputs, with other settings.
//!
//! Every frame gets its recorded input, so the vehicle moves as it did in flight, for any command.
//! The answer is what the controller *would have commanded*, beside what it did command. What
//! *would have happened* is a question for the [closed loop](mod@crate::refly). For example, a
//! flight computer that lights its motor earlier than in flight measures no thrust until the
//! recorded ignition.

use anyhow::Result;
use protocol::program::Exit;
use serde::Serialize;

use crate::cli::{Answer, WithSettings, give};
pub use crate::controller::Decided;
use crate::controller::{AgainError, LoggedComputer, phase_name, refuse};
use crate::log::Recording;
use crate::settings::Setting;

/// Sections that a flight computer never sees: the limits of the verdict, and the random draw.
const NOT_THE_PILOTS: [&str; 2] = ["leg_limits.", "truth."];

/// The time between frames.
const FRAME: &str = "estimator.frame_s";

/// A frame: the recorded decision, and the decision with other settings.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EvaluatedFrame {
    pub frame: u64,
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
    /// Frames that this build decides differently from the record even with nothing changed:
    /// differences there may come from the build and not from the settings.
    pub unchanged_different: usize,
    /// Number of frames whose gimbal command differs in any bit.
    pub commands_different: usize,
    /// The largest difference of a gimbal command, rad.
    pub gimbal_difference_max_rad: f64,
    /// The largest difference of a fin command, rad.
    pub fins_difference_max_rad: f64,
    /// Number of frames on which another control level decides.
    pub levels_different: usize,
    /// When each phase was entered, as recorded and with the other settings.
    pub phases: Vec<PhaseEntered>,
    /// Number of frames compared.
    pub frames_compared: usize,
    /// Thousands.
    pub frames: Vec<EvaluatedFrame>,
}

/// Evaluates a recorded flight under other settings: two flight computers run on every frame. The
/// recorded decision comes from the record; what the record leaves out (cost and iterations of a
/// plan) comes from `then`, which runs with the recorded settings.
///
/// # Errors
/// See [`AgainError`].
pub fn evaluate(recording: &Recording, settings: &[Setting]) -> Result<EvaluateReport, AgainError> {
    let (start, recorded) = recording.replayable_frames()?;
    let toml = recording.profile_toml()?;
    let run = &recording.head.run;
    let mut then = LoggedComputer::recorded(toml, start, run, &[])?;
    let last_s = recorded.last().map_or(0.0, |frame| frame.input.time_s);
    refuse_unusable(settings, &recording.name, then.pilot().mission().estimator.frame_s, last_s)?;
    let mut now = LoggedComputer::recorded(toml, start, run, settings)?;
    let mut frames = Vec::with_capacity(recorded.len());
    let mut unchanged_different = 0;
    for frame in recorded {
        let unchanged = then.run_again(frame)?;
        let again = now.run_again(frame)?;
        let recorded = then.decided(frame);
        unchanged_different += usize::from(then.decided(&unchanged) != recorded);
        frames.push(EvaluatedFrame {
            frame: recording.release_frame + frame.input.frame,
            time_s: frame.input.time_s,
            phase: phase_name(&frame.output),
            recorded,
            evaluated: now.decided(&again),
        });
    }
    let apart = |frame: &EvaluatedFrame| apart_rad(&frame.recorded.gimbal_rad, &frame.evaluated.gimbal_rad);
    let count = |differs: &dyn Fn(&Decided, &Decided) -> bool| {
        frames.iter().filter(|frame| differs(&frame.recorded, &frame.evaluated)).count()
    };
    let bits =
        |decided: &Decided| [0, 1].map(|axis| decided.gimbal_rad.get(axis).map(|angle| angle.to_bits()));
    let fins_rad = |frame: &EvaluatedFrame| apart_rad(&frame.recorded.fins_rad, &frame.evaluated.fins_rad);
    Ok(EvaluateReport {
        kind: "open loop: the controller alone on recorded inputs",
        file: recording.name.clone(),
        settings: settings.iter().map(ToString::to_string).collect(),
        unchanged_different,
        commands_different: count(&|recorded, evaluated| bits(recorded) != bits(evaluated)),
        gimbal_difference_max_rad: frames.iter().map(apart).fold(0.0, f64::max),
        fins_difference_max_rad: frames.iter().map(fins_rad).fold(0.0, f64::max),
        levels_different: count(&|recorded, evaluated| recorded.level != evaluated.level),
        phases: phases(&frames),
        frames_compared: frames.len(),
        frames,
    })
}

/// Refuses settings that the flight computer does not have, or that cannot change on recorded
/// inputs.
fn refuse_unusable(settings: &[Setting], name: &str, recorded_s: f64, last_s: f64) -> Result<(), AgainError> {
    refuse(settings, |Setting { path, at_s, .. }| {
        let why = if NOT_THE_PILOTS.iter().any(|section| path.starts_with(section)) {
            "not a setting of the controller: on recorded inputs it changes nothing; use refly to fly with it"
                .to_owned()
        } else if path == FRAME {
            format!("cannot be changed on recorded inputs: there is one input every {recorded_s} s")
        } else if at_s.is_some() && path.starts_with("estimator.") {
            "the estimator's configuration holds from the beginning and cannot change in flight".to_owned()
        } else if at_s.is_some_and(|at_s| at_s > last_s) {
            format!("takes effect after the end of {name}, whose last frame is at T+{last_s:.3} s")
        } else {
            return None;
        };
        Some(why)
    })
}

/// The largest difference of two commands' angles, rad.
fn apart_rad(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Every phase in the order it was first entered.
fn phases(frames: &[EvaluatedFrame]) -> Vec<PhaseEntered> {
    let mut phases: Vec<PhaseEntered> = Vec::new();
    for frame in frames {
        for (phase, is_recorded) in [(frame.recorded.phase, true), (frame.evaluated.phase, false)] {
            let place = phases.iter().position(|known| known.phase == phase).unwrap_or_else(|| {
                phases.push(PhaseEntered { phase, recorded_s: None, evaluated_s: None });
                phases.len() - 1
            });
            let entered = &mut phases[place];
            let time_s = if is_recorded { &mut entered.recorded_s } else { &mut entered.evaluated_s };
            time_s.get_or_insert(frame.time_s);
        }
    }
    phases
}

impl Answer for EvaluateReport {
    fn sentences(&self) -> Vec<String> {
        let Self { file, kind, unchanged_different, commands_different, frames_compared, .. } = self;
        let (settings, compared) = (self.settings.join(" "), frames_compared);
        let mut lines = vec![format!("{file}: {kind}")];
        if !settings.is_empty() {
            lines.push(format!("with {settings}"));
        }
        if *unchanged_different > 0 {
            lines.push(format!(
                "with nothing changed this build decides {unchanged_different} of {compared} frames differently from the record"
            ));
        }
        let [gimbal_deg, fins_deg] =
            [self.gimbal_difference_max_rad, self.fins_difference_max_rad].map(f64::to_degrees);
        lines.push(format!(
            "{commands_different} of {compared} gimbal commands differ, by {gimbal_deg:.3} deg at most"
        ));
        lines.push(format!(
            "fin commands differ by {fins_deg:.3} deg at most; {} frames are decided by another level",
            self.levels_different
        ));
        let at = |time_s: Option<f64>| {
            time_s.map_or_else(|| "never".to_owned(), |time_s| format!("at {time_s:.3} s"))
        };
        let entered = self.phases.iter().filter(|phase| phase.recorded_s != phase.evaluated_s);
        lines.extend(entered.map(|PhaseEntered { phase, recorded_s, evaluated_s }| {
            format!("{phase}: entered {} -> {}", at(*recorded_s), at(*evaluated_s))
        }));
        let differing: Vec<&EvaluatedFrame> =
            self.frames.iter().filter(|frame| frame.recorded != frame.evaluated).collect();
        // To the gimbal, to the fins, or by its phase to igniter or parachute.
        let acts = differing.iter().any(|EvaluatedFrame { recorded, evaluated, .. }| {
            let [then, now] = [recorded, evaluated].map(|it| (&it.gimbal_rad, &it.fins_rad, it.phase));
            then != now
        });
        if !settings.is_empty() && !acts {
            let what = if differing.is_empty() { "did not act" } else { "changed plans only" };
            lines.push(format!("no command differs: {settings} {what} in this flight"));
        }
        let differ = || format!("{} frames differ; --json has every frame", differing.len());
        lines.extend((!differing.is_empty()).then(differ));
        lines
    }
}

pub(crate) fn run(given: &WithSettings) -> Result<Exit> {
    give(&evaluate(&given.recording()?, &given.settings)?, given.json)
}
