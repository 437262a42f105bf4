//! A tick of the planar landing's controller.

use flight::guidance::controller::ControlLevel;
use nmpc::{SolveStatus, solve};
use protocol::log::v1;
use tick_log::input_from_log;

use super::{InputFacts, PathPoint, TickError, TickReport, active_constraints, nearest, solved_facts};
use crate::controller::{LoggedController, Replayed as _};
use crate::log::Recording;

pub(super) fn tick(recording: &Recording, number: u64) -> Result<TickReport, TickError> {
    let ticks = recording.replayable_ticks()?;
    let profile = recording.profile()?;
    let place = usize::try_from(number).ok().filter(|place| *place < ticks.len()).ok_or_else(|| {
        TickError::NoTick {
            name: recording.name.clone(),
            tick: number,
            first: 0,
            last: ticks.len() as u64 - 1,
        }
    })?;
    let mut controller =
        LoggedController::recorded(&profile, recording.profile_toml()?, &recording.head.run)?;
    for before in ticks.iter().take(place) {
        controller.run_again(before)?;
    }
    let recorded = &ticks[place];
    let input = input_from_log(&recorded.input)?;
    let again = controller.run_again(recorded)?;
    let solved = solves(&again);
    let problem = controller.state().last_problem();
    let kept = controller.state().kept_solution().filter(|_| solved && is_kept(&again));
    let cold = solved.then(|| solve(problem, None));
    let level = u8::try_from(again.output.level).ok().and_then(ControlLevel::from_index);
    Ok(TickReport {
        file: recording.name.clone(),
        tick: number,
        time_s: input.time_s,
        phase: input.phase.name(),
        input: InputFacts {
            state: input.state.to_array(),
            time_since_ignition_s: input.time_since_ignition_s,
            gimbal_applied_rad: vec![input.gimbal_applied_rad],
            thrust_scale: input.thrust_scale,
        },
        level: level.map_or("unknown", ControlLevel::name),
        recorded_gimbal_rad: vec![recorded.output.gimbal_command_rad],
        gimbal_rad: vec![again.output.gimbal_command_rad],
        identical: identical(recorded, &again),
        warm: kept.map(solved_facts),
        cold: cold.as_ref().map(solved_facts),
        nearest_solved: nearest(number, ticks.iter().filter(|tick| solves(tick)).map(|tick| tick.input.tick)),
        active: kept.map(|solution| active_constraints(problem, solution)).unwrap_or_default(),
        path: path(&again.output.plan),
    })
}

/// Whether a landing problem was solved.
fn solves(tick: &v1::ControllerTick) -> bool {
    tick.output.solver.status != u32::from(SolveStatus::NotRun.index())
}

/// The controller keeps the plan that it flies or rehearses.
fn is_kept(tick: &v1::ControllerTick) -> bool {
    let level = u8::try_from(tick.output.level).ok().and_then(ControlLevel::from_index);
    matches!(level, Some(ControlLevel::Rehearsal | ControlLevel::Converged | ControlLevel::BestFeasible))
}

/// Compares everything but the plan, which a recording does not hold; the digest of the memory covers it.
fn identical(recorded: &v1::ControllerTick, again: &v1::ControllerTick) -> bool {
    let mut again = again.clone();
    again.output.plan.states = Vec::new();
    again.output.plan.gimbal_rad = Vec::new();
    prost::Message::encode_to_vec(recorded) == prost::Message::encode_to_vec(&again)
}

fn path(plan: &v1::Plan) -> Vec<PathPoint> {
    let inputs = plan.gimbal_rad.iter().copied().map(Some).chain(std::iter::repeat(None));
    plan.states
        .iter()
        .zip(inputs)
        .enumerate()
        .map(|(node, (state, gimbal_rad))| PathPoint {
            time_s: plan.starts_in_s + node as f64 * plan.step_s,
            state: [state.x_m, state.z_m, state.theta_rad, state.u_m_s, state.w_m_s, state.q_rad_s],
            gimbal_rad,
        })
        .collect()
}
