//! The start of a re-flown flight, and the state at that moment.

use flight::guidance::controller::ControllerInput;
use flight::rules::phase::Phase;
use flight::vehicle::dynamics::PlanarState;
use protocol::log::v1;
use serde::Serialize;
use tick_log::{input_from_log, state_from_log};

use super::{ReflyError, ReflyOptions};
use crate::log::Recording;

/// Where to begin.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum StartAt {
    /// The first tick of the landing.
    #[default]
    Landing,
    Tick(u64),
    /// The first tick at or after this vehicle time, s.
    Time(f64),
    /// The first tick of this phase.
    Phase(Phase),
}

/// Which recorded state to begin from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum From {
    /// The simulated plant's, where the log has it; else the estimate.
    #[default]
    Truth,
    /// The controller's estimate.
    Estimate,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct StartState {
    /// The first tick flown again.
    pub tick: u64,
    /// Its vehicle time, s.
    pub time_s: f64,
    pub phase: &'static str,
    /// The recorded state that was used.
    pub from: From,
    /// Horizontal position, m.
    pub x_m: f64,
    /// Altitude, m.
    pub z_m: f64,
}

/// Everything the simulation starts from.
pub(super) struct Start {
    /// Index of the first tick in the recording.
    pub(super) index: usize,
    /// Its recorded input.
    pub(super) input: ControllerInput,
    pub(super) plant: PlanarState,
    pub(super) gimbal_rad: f64,
    pub(super) fins_rad: [f64; 4],
    pub(super) fins_commanded_rad: Option<[f64; 4]>,
    pub(super) state: StartState,
}

/// A record of the plant this close to a tick belongs to the same moment, s.
const SAME_MOMENT_S: f64 = 1e-4;

/// Latest vehicle time at which a simulation may start: a day, s.
const LONGEST_S: f64 = 86_400.0;

pub(super) fn find(
    recording: &Recording,
    ticks: &[v1::ControllerTick],
    options: &ReflyOptions,
) -> Result<Start, ReflyError> {
    let refused = |reason: String| ReflyError::Start { name: recording.name.clone(), reason };
    let phase_of =
        |tick: &v1::ControllerTick| u8::try_from(tick.input.phase).ok().and_then(Phase::from_index);
    let found = match &options.start {
        StartAt::Landing => ticks.iter().position(|tick| phase_of(tick).is_some_and(Phase::is_landing)),
        StartAt::Tick(number) => ticks.iter().position(|tick| tick.input.tick == *number),
        StartAt::Time(time_s) => ticks.iter().position(|tick| tick.input.time_s >= *time_s - SAME_MOMENT_S),
        StartAt::Phase(phase) => ticks.iter().position(|tick| phase_of(tick) == Some(*phase)),
    };
    let (index, tick) = found.and_then(|index| Some((index, ticks.get(index)?))).ok_or_else(|| {
        refused(match &options.start {
            StartAt::Landing => "no tick of a landing to start from".to_owned(),
            StartAt::Tick(number) => format!("no tick {number}; there are 0 to {}", ticks.len() - 1),
            StartAt::Time(time_s) => {
                let last_s = ticks.last().map_or(0.0, |tick| tick.input.time_s);
                format!("no tick at or after {time_s} s; the last is at {last_s:.3} s")
            }
            StartAt::Phase(phase) => format!("no tick in phase {}", phase.name()),
        })
    })?;
    let input = input_from_log(&tick.input)?;
    if !input.phase.is_landing() {
        let phase = input.phase.name();
        return Err(refused(format!(
            "tick {} is in {phase}; the simulation starts in LAND_ARMED, IGNITION or POWERED",
            input.tick
        )));
    }
    if !(0.0..=LONGEST_S).contains(&input.time_s) {
        return Err(refused(format!(
            "tick {} is at {} s; the simulation starts between 0 and {LONGEST_S} s",
            input.tick, input.time_s
        )));
    }
    let near = recording.truth.iter().find(|truth| (truth.time_s - input.time_s).abs() < SAME_MOMENT_S);
    // At the release the last record of the plant shows the rig: its servo positions are right, its state is not.
    let moving = near.filter(|truth| {
        u8::try_from(truth.phase).ok().and_then(Phase::from_index).is_some_and(|phase| !phase.on_pad())
    });
    let (from, plant) = match (options.from, moving) {
        (From::Truth, Some(truth)) => (From::Truth, state_from_log(&truth.state)),
        _ => (From::Estimate, input.state),
    };
    if !plant.is_finite() {
        return Err(refused(format!("the state at tick {} is not finite", input.tick)));
    }
    let four = |angles: &Vec<f64>| <[f64; 4]>::try_from(angles.as_slice()).ok();
    // The fins receive at a tick the command of the tick before. A waiting vehicle is recorded only once a second.
    let before = index.checked_sub(1).and_then(|before| four(&ticks.get(before)?.output.fin_command_rad));
    Ok(Start {
        index,
        input,
        plant,
        gimbal_rad: near.map_or(input.gimbal_applied_rad, |truth| truth.gimbal_actual_rad),
        fins_rad: near.and_then(|truth| four(&truth.fin_actual_rad)).or(before).unwrap_or([0.0; 4]),
        fins_commanded_rad: before,
        state: StartState {
            tick: input.tick,
            time_s: input.time_s,
            phase: input.phase.name(),
            from,
            x_m: plant.x_m,
            z_m: plant.z_m,
        },
    })
}
