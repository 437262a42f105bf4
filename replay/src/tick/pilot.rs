//! A frame of a flight computer: every tenth frame plans the landing while the motor burns.

use flight::computer::pilot::{FRAMES_PER_PLAN, Pilot};
use flight::guidance::controller::ControlLevel;
use flight::guidance::powered::Plane;
use flight::vehicle::dynamics::PlanarState;
use nalgebra::Vector3;
use nmpc::Solution;
use prost::Message as _;
use protocol::log::flight_v1;
use tick_log::pilot::{input_from_log, tick_to_log};

use super::{InputFacts, PathPoint, TickError, TickReport, active_constraints, nearest, solved_facts};
use crate::controller::{LoggedPilot, Replayed as _};
use crate::log::Recording;

pub(super) fn frame(recording: &Recording, number: u64) -> Result<TickReport, TickError> {
    let (start, frames) = recording.replayable_frames()?;
    let mut controller = LoggedPilot::recorded(recording.profile_toml()?, start, &recording.head.run, &[])?;
    let place = frames.iter().position(|tick| tick.input.frame == number).ok_or_else(|| {
        let bound = |tick: Option<&flight_v1::PilotTick>| tick.map_or(0, |tick| tick.input.frame);
        TickError::NoTick {
            name: recording.name.clone(),
            tick: number,
            first: bound(frames.first()),
            last: bound(frames.last()),
        }
    })?;
    for before in &frames[..place] {
        controller.run_again(before)?;
    }
    let recorded = &frames[place];
    let input = input_from_log(&recorded.input)?;
    let held = place.checked_sub(1).and_then(|before| frames.get(before));
    let (output, solved) = controller.step_inspected(&input)?;
    let pilot = controller.pilot();
    let again = tick_to_log(&input, &output, controller.digest());
    let warm = solved.as_ref().map(|solved| &solved.warm.solution);
    let state = match &solved {
        Some(solved) => solved.problem.initial,
        None => in_plane(pilot),
    };
    Ok(TickReport {
        file: recording.name.clone(),
        tick: number,
        time_s: input.time_s,
        phase: output.phase.name(),
        input: InputFacts {
            state: state.to_array(),
            time_since_ignition_s: pilot.burning_s(input.time_s).unwrap_or(0.0),
            gimbal_applied_rad: held.map_or_else(Vec::new, |held| held.output.gimbal_rad.clone()),
            thrust_scale: pilot.motor().impulse_scale(),
        },
        level: output.level.name(),
        recorded_gimbal_rad: recorded.output.gimbal_rad.clone(),
        gimbal_rad: output.gimbal_rad.to_vec(),
        identical: again.encode_to_vec() == recorded.encode_to_vec(),
        warm: warm.map(solved_facts),
        cold: solved.as_ref().map(|solved| solved_facts(&solved.cold.solution)),
        nearest_solved: nearest(
            number,
            frames.iter().filter(|tick| plans(tick)).map(|tick| tick.input.frame),
        ),
        active: solved
            .as_ref()
            .map(|solved| active_constraints(&solved.problem, &solved.warm.solution))
            .unwrap_or_default(),
        path: warm.map(path).unwrap_or_default(),
    })
}

/// Whether a landing is planned in a frame.
fn plans(tick: &flight_v1::PilotTick) -> bool {
    let idle = u32::from(ControlLevel::Idle.index());
    tick.input.frame.is_multiple_of(FRAMES_PER_PLAN) && tick.output.level != idle
}

/// The estimated motion in the plane of the landing; before such a plane exists, in the world's x-z plane.
fn in_plane(pilot: &Pilot) -> PlanarState {
    let nil = Vector3::zeros();
    let plane = pilot.plane().copied().unwrap_or_else(|| Plane::choose(&nil, &nil, &nil));
    pilot.estimate().map_or_else(PlanarState::default, |estimate| {
        let wind_m_s = estimate.wind_m_s.push(0.0).dot(&plane.along);
        plane.project(&estimate.state, 0.0, wind_m_s)
    })
}

fn path(solution: &Solution) -> Vec<PathPoint> {
    let inputs = solution.inputs_rad.iter().copied().map(Some).chain(std::iter::repeat(None));
    let points = solution.states.iter().zip(inputs).enumerate();
    points
        .map(|(node, (state, gimbal_rad))| PathPoint {
            time_s: node as f64 * solution.step_s,
            state: state.to_array(),
            gimbal_rad,
        })
        .collect()
}
