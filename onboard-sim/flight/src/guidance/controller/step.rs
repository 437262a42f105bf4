//! One tick of the controller.

use super::{
    ControlLevel, ControllerConfig, ControllerInput, ControllerOutput, ControllerState, FlownPlan,
    MAX_HORIZON_STEPS, Plan, PredictedTouchdown, Room, SolverReport,
};
use crate::guidance::landing::pose_again;
use crate::guidance::powered::here_m;
use crate::rules::phase::Phase;
use crate::vehicle::dynamics::PlanarState;
use nmpc::{LANDING_MISS, Solution, SolveStatus, solve_into};

/// Largest miss of an end or path condition of a plan that is flown, m, rad, m/s or rad/s. Close to the ground some
/// centimetres may be out of reach; a plan that misses by more does not land.
const USABLE_MISS: f64 = 0.3;

/// Largest distance of the vehicle from the previous plan at which its inputs are repeated: position m, pitch rad,
/// velocity m/s, pitch rate rad/s.
const NEAR_THE_PLAN: [f64; 6] = [0.5, 0.5, 0.1, 0.3, 0.3, 0.3];

/// Advances the controller by one tick.
///
/// Never fails and never returns a command that is not a number. Without a plan a lower [`ControlLevel`] flies.
pub fn step(state: &mut ControllerState, input: &ControllerInput) -> ControllerOutput {
    let decision = match input.phase {
        Phase::PadIdle | Phase::PadArmed => rehearse(state),
        phase if phase.is_landing() => land(state, input),
        _ => {
            state.flown = None;
            Decision::idle()
        }
    };
    let limit_rad = state.config.profile.gimbal.limit_rad();
    let command_rad = decision.gimbal_rad.clamp(-limit_rad, limit_rad);
    ControllerOutput {
        tick: input.tick,
        gimbal_command_rad: if command_rad.is_finite() { command_rad } else { 0.0 },
        fin_command_rad: [fin_rad(&state.config, input.phase); 4],
        level: decision.level,
        solver: decision.report,
        predicted_touchdown: decision.touchdown,
        plan: decision.plan,
    }
}

/// The decision of a branch of the tick.
struct Decision {
    gimbal_rad: f64,
    level: ControlLevel,
    report: SolverReport,
    touchdown: PredictedTouchdown,
    plan: Plan,
}

impl Decision {
    fn idle() -> Self {
        Self {
            gimbal_rad: 0.0,
            level: ControlLevel::Idle,
            report: SolverReport::NOT_RUN,
            touchdown: PredictedTouchdown::default(),
            plan: Plan::none(),
        }
    }
}

/// The fins' opening angle in a phase, rad: closed until apogee, deployed from then on.
fn fin_rad(config: &ControllerConfig, phase: Phase) -> f64 {
    let fins = &config.profile.fins;
    if phase.on_pad() || matches!(phase, Phase::Boost | Phase::Coast) {
        fins.closed_rad()
    } else {
        fins.deployed_rad()
    }
}

/// Solves the landing from the profile's start state as if released now; the gimbal stays centred.
fn rehearse(state: &mut ControllerState) -> Decision {
    let ControllerState { config, flown, room } = state;
    let start = config.profile.start.planar_state();
    let moment = Moment::of(config, 0.0);
    let thrust_n = config.profile.motor.mean_thrust_n(0.0, moment.sample_time_s);
    let predicted = config.model.rk4_step(&start, 0.0, thrust_n, moment.sample_time_s);
    moment.pose(config, predicted, 1.0, room);
    moment.solve(flown.as_ref(), room);
    let decision = planned(config, &moment, &room.solution);
    keep(&moment, flown, &mut room.solution);
    Decision { gimbal_rad: 0.0, level: ControlLevel::Rehearsal, ..decision }
}

/// Plans the rest of the landing and takes the plan's first input, or the best alternative.
fn land(state: &mut ControllerState, input: &ControllerInput) -> Decision {
    let moment = Moment::of(&state.config, input.time_since_ignition_s);
    if input.degraded {
        return stabilise(state, input, &moment, SolverReport::NOT_RUN);
    }
    let Some(predicted) = predict(&state.config, input, &moment) else {
        let report = SolverReport { status: SolveStatus::BadInput, ..SolverReport::NOT_RUN };
        return fall_back(state, input, &moment, report);
    };
    if moment.intervals == 0 {
        return after_the_plan(state, input, &moment, predicted);
    }
    let ControllerState { config, flown, room } = state;
    moment.pose(config, predicted, input.thrust_scale, room);
    if input.lands_here {
        room.problem.target.x_m = moment.here_m(&predicted);
    }
    if input.deadline_missed {
        room.problem.solver.max_iterations = room.problem.solver.max_iterations_after_miss;
    }
    moment.solve(flown.as_ref(), room);
    if is_usable(&room.solution) {
        let decision = planned(config, &moment, &room.solution);
        keep(&moment, flown, &mut room.solution);
        return decision;
    }
    let report = report_of(&room.solution);
    let decision = fall_back(state, input, &moment, report);
    // The result may still be a start for the next solve, unless the previous plan is better.
    if decision.level != ControlLevel::ShiftedPlan && !state.room.solution.inputs_rad.is_empty() {
        keep(&moment, &mut state.flown, &mut state.room.solution);
    }
    decision
}

/// Holds the plan's last input, because nothing is left to plan. Without thrust the gimbal is centred.
fn after_the_plan(
    state: &ControllerState,
    input: &ControllerInput,
    moment: &Moment,
    predicted: PlanarState,
) -> Decision {
    if state.config.profile.motor.mean_thrust_n(moment.starts_s, moment.sample_time_s) > 0.0 {
        return stabilise(state, input, moment, SolverReport::NOT_RUN);
    }
    let touchdown = PredictedTouchdown { time_from_now_s: moment.sample_time_s, state: predicted };
    Decision { touchdown, ..Decision::idle() }
}

/// The position of a tick within the landing.
struct Moment {
    sample_time_s: f64,
    /// Samples between ignition and the instant when this tick's command is applied.
    first_interval: usize,
    /// Intervals from there to the end of the horizon.
    intervals: usize,
    /// Time since ignition at the beginning of the first interval, s.
    starts_s: f64,
}

impl Moment {
    fn of(config: &ControllerConfig, time_since_ignition_s: f64) -> Self {
        let sample_time_s = config.sample_time_s();
        let horizon = config.profile.nmpc.horizon_steps.min(MAX_HORIZON_STEPS);
        let elapsed = (time_since_ignition_s / sample_time_s).clamp(0.0, horizon as f64);
        // A time that is not a number gives 0 here; the state check handles it.
        let first_interval = libm::round(elapsed) as usize + 1;
        Self {
            sample_time_s,
            first_interval,
            intervals: horizon.saturating_sub(first_interval),
            starts_s: time_since_ignition_s.max(0.0) + sample_time_s,
        }
    }

    /// Writes the landing at the pad, from the predicted state, into the buffer.
    fn pose(&self, config: &ControllerConfig, predicted: PlanarState, thrust_scale: f64, room: &mut Room) {
        pose_again(
            &mut room.problem,
            &config.profile,
            predicted,
            self.starts_s,
            self.intervals,
            thrust_scale,
        );
        room.problem.target.x_m = 0.0;
    }

    /// The landing point below a state at this moment, m from the pad.
    fn here_m(&self, predicted: &PlanarState) -> f64 {
        let (along_m_s, _) = predicted.ground_velocity_m_s();
        here_m(predicted.x_m, along_m_s, self.intervals as f64 * self.sample_time_s)
    }

    /// Solves the problem in the buffer, from the flown plan shifted to this moment if it is long enough.
    fn solve(&self, flown: Option<&FlownPlan>, room: &mut Room) {
        let Room { workspace, problem, warm, solution } = room;
        let elapsed =
            flown.and_then(|flown| Some((flown, self.first_interval.checked_sub(flown.first_interval)?)));
        if let Some((flown, elapsed)) = elapsed {
            flown.solution.shift_into(elapsed, warm);
        }
        let warm = (elapsed.is_some() && warm.inputs_rad.len() == self.intervals).then_some(&*warm);
        solve_into(problem, warm, workspace, solution);
    }

    /// The flown plan's input for this moment, and its states from there on.
    fn shifted_plan<'a>(&self, flown: Option<&'a FlownPlan>) -> Option<(&'a [PlanarState], &'a [f64])> {
        let flown = flown?;
        let elapsed = self.first_interval.checked_sub(flown.first_interval)?;
        let inputs_rad = flown.solution.inputs_rad.get(elapsed..).filter(|inputs| !inputs.is_empty())?;
        Some((flown.solution.states.get(elapsed..)?, inputs_rad))
    }
}

/// The state one sample ahead with the angle that the actuator holds; `None` unless everything is finite.
fn predict(config: &ControllerConfig, input: &ControllerInput, moment: &Moment) -> Option<PlanarState> {
    let inputs = [input.gimbal_applied_rad, input.thrust_scale, input.time_since_ignition_s];
    if !(input.state.is_finite() && inputs.iter().all(|value| value.is_finite())) {
        return None;
    }
    let nominal_n = config.profile.motor.mean_thrust_n(input.time_since_ignition_s, moment.sample_time_s);
    let thrust_n = input.thrust_scale * nominal_n;
    let predicted =
        config.model.rk4_step(&input.state, input.gimbal_applied_rad, thrust_n, moment.sample_time_s);
    predicted.is_finite().then_some(predicted)
}

/// The decision from a solved plan.
fn planned(config: &ControllerConfig, moment: &Moment, solution: &Solution) -> Decision {
    let report = report_of(solution);
    let sample_time_s = config.sample_time_s();
    let level = if report.converged() { ControlLevel::Converged } else { ControlLevel::BestFeasible };
    Decision {
        gimbal_rad: solution.inputs_rad.first().copied().unwrap_or(0.0),
        level,
        report,
        touchdown: PredictedTouchdown {
            time_from_now_s: (1 + moment.intervals) as f64 * sample_time_s,
            state: solution.states.last().copied().unwrap_or_default(),
        },
        plan: Plan::through(&solution.states, &solution.inputs_rad, sample_time_s, sample_time_s),
    }
}

fn report_of(solution: &Solution) -> SolverReport {
    SolverReport {
        status: solution.status,
        iterations: u32::try_from(solution.iterations).unwrap_or(u32::MAX),
        qp_iterations: solution.qp_iterations,
        cost: solution.cost,
        kkt_stationarity: solution.kkt_stationarity,
        kkt_feasibility: solution.kkt_feasibility,
        landing_feasible: !solution.inputs_rad.is_empty() && solution.condition_miss <= LANDING_MISS,
        best_touchdown_speed_m_s: solution.best_touchdown_speed_m_s,
    }
}

/// Keeps a solution as the flown plan and swaps the previous plan into its place.
fn keep(moment: &Moment, flown: &mut Option<FlownPlan>, solution: &mut Solution) {
    if solution.inputs_rad.is_empty() {
        *flown = None;
        return;
    }
    let flown = flown.get_or_insert_default();
    flown.usable = is_usable(solution);
    flown.first_interval = moment.first_interval;
    core::mem::swap(&mut flown.solution, solution);
}

fn is_usable(solution: &Solution) -> bool {
    !solution.inputs_rad.is_empty() && solution.condition_miss <= USABLE_MISS
}

/// Without a good new plan: the previous plan if it is long enough and the vehicle is close to it, else upright.
fn fall_back(
    state: &ControllerState,
    input: &ControllerInput,
    moment: &Moment,
    report: SolverReport,
) -> Decision {
    let near = |planned: &PlanarState| match predict(&state.config, input, moment) {
        Some(predicted) => predicted
            .to_array()
            .iter()
            .zip(planned.to_array())
            .zip(NEAR_THE_PLAN)
            .all(|((value, planned), tolerance)| (value - planned).abs() <= tolerance),
        // The vehicle's state is unknown, so the plan is the best guess.
        None => true,
    };
    let previous = state.flown.as_ref().filter(|flown| flown.usable);
    if let Some((states, inputs_rad)) = moment.shifted_plan(previous)
        && report.status != SolveStatus::NotLandable
        && states.first().is_some_and(near)
    {
        return Decision {
            gimbal_rad: inputs_rad.first().copied().unwrap_or(0.0),
            level: ControlLevel::ShiftedPlan,
            report,
            touchdown: PredictedTouchdown {
                time_from_now_s: (1 + inputs_rad.len()) as f64 * moment.sample_time_s,
                state: states.last().copied().unwrap_or_default(),
            },
            plan: Plan::through(states, inputs_rad, moment.sample_time_s, moment.sample_time_s),
        };
    }
    stabilise(state, input, moment, report)
}

/// The upright law, and the path that it predicts.
fn stabilise(
    state: &ControllerState,
    input: &ControllerInput,
    moment: &Moment,
    report: SolverReport,
) -> Decision {
    let upright = Decision { level: ControlLevel::Stabiliser, report, ..Decision::idle() };
    let Some(predicted) = predict(&state.config, input, moment) else {
        return upright;
    };
    let config = &state.config;
    let limit_rad = config.profile.gimbal.limit_rad();
    let sample_time_s = moment.sample_time_s;
    let mut plan = Plan::starting(predicted, sample_time_s, sample_time_s);
    let mut command_rad = 0.0;
    let mut ahead = predicted;
    for k in 0..moment.intervals.max(1) {
        let nominal_n =
            config.profile.motor.mean_thrust_n(moment.starts_s + k as f64 * sample_time_s, sample_time_s);
        let thrust_n = input.thrust_scale * nominal_n;
        let gimbal_rad = config.stabiliser.gimbal(&ahead, thrust_n, limit_rad);
        if k == 0 {
            command_rad = gimbal_rad;
        }
        ahead = config.model.rk4_step(&ahead, gimbal_rad, thrust_n, sample_time_s);
        if !ahead.is_finite() {
            break;
        }
        plan.push(gimbal_rad, ahead);
        if ahead.z_m <= 0.0 {
            break;
        }
    }
    Decision {
        gimbal_rad: command_rad,
        touchdown: PredictedTouchdown {
            time_from_now_s: (1 + plan.len) as f64 * sample_time_s,
            state: plan.used_states().last().copied().unwrap_or(predicted),
        },
        plan,
        ..upright
    }
}
