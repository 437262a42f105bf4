//! The landing planned in space ([`nmpc::space`]).
//!
//! A tick solves for gimbal, fins and final time at once, from the plan of the tick before. Between ticks the plan says
//! where the nose points and how far the fins are open.

mod plan;

use alloc::vec::Vec;
use nalgebra::Vector3;
use nmpc::SolveStatus;
use nmpc::free_time::Motor;
use nmpc::space::{Drag, End, INPUTS, Outcome, Push, SpaceProblem, SpaceWorkspace, State, Status, Weights};
use serde::{Deserialize, Serialize};

use self::plan::SpacePlan;
use super::{END_LEAN_MAX_RAD, HARD_M_S, LEAST_INTERVALS, MOST_INTERVALS, Plane, PoweredReport};
use crate::control::aim::Aim;
use crate::guidance::powered::situation::Ahead;
use crate::guidance::powered::{ControlLevel, PoweredSettings, PoweredSituation, here_m};
use crate::vehicle::dynamics::PlanarState;
use crate::vehicle::rigid::RigidState;

/// Settings of a landing that is planned in space.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SpaceSettings {
    /// Size of the lean of the cold guesses, degrees.
    pub guess_lean_deg: f64,
    /// Weight of the fins' distance from half open.
    pub fin_weight: f64,
}

/// A landing that is planned again outside the flight.
#[derive(Debug, Clone, PartialEq)]
pub struct SpaceSolved {
    /// The problem at the final time of the plan.
    pub problem: SpaceProblem,
    pub states: Vec<State>,
    pub inputs: Vec<[f64; INPUTS]>,
    pub outcome: Outcome,
}

/// First change of the final time that is tried, s, the factor after one that was no better, and the smallest change.
const FIRST_STEP_S: f64 = 0.1;
const SHORTER: f64 = 0.3;
const LEAST_STEP_S: f64 = 0.01;

/// Half the span of the central difference of the Lagrangian, s.
const DIFFERENCE_S: f64 = 1e-4;

/// Plans landings in space, and flies one.
#[derive(Debug, Clone, Default, Serialize)]
pub(super) struct SpaceGuidance {
    // The next search writes these before it reads them.
    #[serde(skip)]
    workspace: SpaceWorkspace,
    #[serde(skip)]
    problem: Option<SpaceProblem>,
    #[serde(skip)]
    trial: SpacePlan,
    #[serde(skip)]
    found: SpacePlan,
    #[serde(skip)]
    warm: SpacePlan,
    flown: Option<SpacePlan>,
    /// Becomes the flown plan with the first plan.
    #[serde(skip)]
    unused: SpacePlan,
    /// The flown plan's motion in the plane of the report.
    #[serde(skip)]
    projected: Vec<PlanarState>,
    /// Intervals that all of these have room for. A landing that needs more gets longer ones, so that no flight allocates.
    #[serde(skip)]
    room: Option<usize>,
}

impl SpaceGuidance {
    /// Forgets its plans, and keeps their room: no plan has more intervals than the last.
    pub(super) fn forget(&mut self) {
        if let Some(flown) = self.flown.take() {
            self.room = Some(flown.intervals());
            self.trial = flown.clone();
            self.unused = flown;
        }
    }

    /// Time until the flown plan ends, s.
    pub(super) fn left_s(&self, time_s: f64) -> Option<f64> {
        self.flown.as_ref().map(|plan| plan.left_s(time_s))
    }

    /// Plans the landing from a state at a time, and keeps the plan if it is finite. `None` if the thrust never carries the
    /// vehicle.
    pub(super) fn plan(
        &mut self,
        time_s: f64,
        plane: &Plane,
        state: &RigidState,
        situation: &PoweredSituation<'_>,
        settings: &PoweredSettings,
        space: &SpaceSettings,
    ) -> Option<PoweredReport> {
        let outcome = self.search(time_s, state, situation, settings, space)?;
        let usable = self.found.is_finite();
        // Too low for any landing: upright brakes just as well. High above the ground it would stop the vehicle there.
        let too_low = !situation.high && self.found.end_m_s() < HARD_M_S;
        let lands = outcome.status == Status::Converged && outcome.miss <= settings.landing_miss;
        let level = ControlLevel::of_plan(usable, self.left_s(time_s), too_low, lands);
        if usable {
            self.found.project(plane, situation.wind_m_s.dot(&plane.along), &mut self.projected);
        }
        let report = PoweredReport {
            level,
            status: status(outcome.status),
            iterations: outcome.iterations,
            passes: self.workspace.passes(),
            kkt_stationarity: outcome.stationarity,
            kkt_feasibility: outcome.feasibility,
            cost: outcome.cost,
            condition_miss: outcome.miss,
            touchdown_in_s: self.found.length_s(),
            touchdown: self.projected.last().copied().unwrap_or_default(),
            largest_tilt_rad: self.found.largest_tilt_rad(),
        };
        if usable {
            core::mem::swap(
                self.flown.get_or_insert_with(|| core::mem::take(&mut self.unused)),
                &mut self.found,
            );
        }
        Some(report)
    }

    /// Searches the path and the final time into `found`. The outcome has the iterations of all solves.
    ///
    /// By the envelope theorem the derivative of the Lagrangian by the final time says on which side a better one lies.
    fn search(
        &mut self,
        time_s: f64,
        state: &RigidState,
        situation: &PoweredSituation<'_>,
        settings: &PoweredSettings,
        space: &SpaceSettings,
    ) -> Option<Outcome> {
        let height_m = state.position_m.z - situation.feet_below_cg_m;
        let (earliest_s, latest_s) = situation.ends_s(settings.latest_after_s, height_m)?;
        let mut final_time_s = self.left_s(time_s).unwrap_or(earliest_s).clamp(earliest_s, latest_s);
        let most = self.room.unwrap_or(MOST_INTERVALS);
        let intervals =
            (libm::round(final_time_s / settings.interval_s) as usize).clamp(LEAST_INTERVALS, most);

        let pushes = self.problem.take().map_or_else(|| Vec::with_capacity(MOST_INTERVALS), |old| old.pushes);
        let mut problem = SpaceProblem { pushes, ..posed(situation, settings, space, state) };
        let stretch = |problem: &mut SpaceProblem, to_s: f64| {
            stretch(problem, situation, settings, to_s, intervals);
        };
        stretch(&mut problem, final_time_s);
        let is_warm = self
            .flown
            .as_ref()
            .is_some_and(|flown| self.warm.take_last(flown, intervals, problem.end.settled_nodes));
        let warm = is_warm.then(|| self.warm.start());
        self.workspace.allow(settings.max_passes);
        let mut best = nmpc::space::solve(&mut self.workspace, &problem, warm.as_ref());
        self.found.read(&self.workspace, &problem, time_s);

        let mut iterations = best.iterations;
        let mut step_s = FIRST_STEP_S;
        for _ in 1..settings.max_solves {
            if self.workspace.is_spent() {
                break;
            }
            let mut lagrangian = |at_s: f64| {
                stretch(&mut problem, at_s);
                nmpc::space::lagrangian(&mut self.workspace, &problem, &self.found.start())
            };
            let slope = lagrangian(final_time_s + DIFFERENCE_S) - lagrangian(final_time_s - DIFFERENCE_S);
            let to_s = if slope > 0.0 { final_time_s - step_s } else { final_time_s + step_s };
            let to_s = to_s.clamp(earliest_s, latest_s);
            if !slope.is_finite() || (to_s - final_time_s).abs() < LEAST_STEP_S {
                break;
            }
            stretch(&mut problem, to_s);
            let outcome = nmpc::space::solve(&mut self.workspace, &problem, Some(&self.found.start()));
            iterations += outcome.iterations;
            if outcome.merit < best.merit {
                self.trial.read(&self.workspace, &problem, time_s);
                core::mem::swap(&mut self.trial, &mut self.found);
                (best, final_time_s) = (outcome, to_s);
            } else {
                step_s *= SHORTER;
            }
        }
        self.problem = Some(problem);
        Some(Outcome { iterations, ..best })
    }

    /// Solves what [`plan`](Self::plan) solves, outside the flight.
    pub(super) fn inspect(
        &self,
        time_s: f64,
        state: &RigidState,
        situation: &PoweredSituation<'_>,
        settings: &PoweredSettings,
        space: &SpaceSettings,
    ) -> Option<SpaceSolved> {
        let mut again = self.clone();
        let outcome = again.search(time_s, state, situation, settings, space)?;
        let (states, inputs) = again.found.path();
        let (states, inputs) = (states.to_vec(), inputs.to_vec());
        let mut problem = again.problem.take()?;
        stretch(&mut problem, situation, settings, again.found.length_s(), inputs.len());
        Some(SpaceSolved { problem, states, inputs, outcome })
    }

    /// The flown plan's motion in the plane of the report, and the step between its states, s.
    pub(super) fn projected(&self) -> Option<(&[PlanarState], f64)> {
        self.flown.as_ref().map(|plan| (&self.projected[..], plan.step_s()))
    }

    /// Planned share of the fins' drag area at a time.
    pub(super) fn fin_share(&self, time_s: f64) -> Option<f64> {
        self.flown.as_ref()?.fin_share(time_s)
    }

    /// The wanted direction of the nose at a time; `None` without a plan and after its end. `push` makes a lean, as a
    /// tangent, from a velocity to be lost.
    pub(super) fn aim(
        &self,
        time_s: f64,
        state: &RigidState,
        settings: &PoweredSettings,
        push: impl Fn(f64) -> f64,
    ) -> Option<Aim> {
        let plan = self.flown.as_ref()?;
        let aim = plan.aim(time_s)?;
        let left_s = plan.left_s(time_s);
        if left_s < settings.quiet_s {
            return Some(Aim::at(state.nose_in_world()));
        }
        if left_s >= settings.flown_out_s {
            return Some(aim);
        }
        // A plan that is flown to its end needs a correction of the velocity.
        let [x_m_s, y_m_s] = plan.level_m_s(time_s);
        let lean = |astray_m_s: f64| push(astray_m_s).clamp(-END_LEAN_MAX_RAD, END_LEAN_MAX_RAD);
        let nose = aim.nose_in_world
            + Vector3::x() * lean(state.velocity_m_s.x - x_m_s)
            + Vector3::y() * lean(state.velocity_m_s.y - y_m_s);
        Some(Aim { nose_in_world: nose / nose.norm(), ..aim })
    }
}

/// How a solve ended, in the words of the planar solver.
fn status(status: Status) -> SolveStatus {
    match status {
        Status::Converged => SolveStatus::Converged,
        Status::IterationLimit => SolveStatus::IterationLimit,
        Status::WorkLimit => SolveStatus::WorkLimit,
        Status::Stalled => SolveStatus::Stalled,
        Status::SubproblemFailed => SolveStatus::SubproblemFailed,
        Status::NotFinite => SolveStatus::BadInput,
    }
}

// Poses the landing of a tick for the solver.

/// The state of a landing in space.
fn initial(state: &RigidState, feet_below_cg_m: f64) -> State {
    let nose = state.nose_in_world();
    let p = libm::asin(nose.x.clamp(-1.0, 1.0));
    let r = libm::atan2(nose.y, nose.z);
    let moving = (state.world_from_body * state.rate_rad_s).cross(&nose);
    let (sin_r, cos_r) = libm::sincos(r);
    let cos_p = libm::cos(p).max(1e-3);
    let (position, velocity) = (&state.position_m, &state.velocity_m_s);
    [
        position.x,
        position.y,
        position.z - feet_below_cg_m,
        velocity.x,
        velocity.y,
        velocity.z,
        p,
        r,
        moving.x / cos_p,
        (moving.y * cos_r - moving.z * sin_r) / cos_p,
    ]
}

/// The landing of a tick, except what follows from its final time.
fn posed(
    situation: &PoweredSituation<'_>,
    settings: &PoweredSettings,
    space: &SpaceSettings,
    state: &RigidState,
) -> SpaceProblem {
    let per_m = 0.5 * situation.air_density_kg_m3;
    let end = &settings.final_box;
    let initial = initial(state, situation.feet_below_cg_m);
    SpaceProblem {
        initial,
        step_s: settings.interval_s,
        pushes: Vec::new(),
        drag: Drag {
            fins: per_m * situation.fin_drag_area_m2,
            axial: per_m * situation.body_drag_area_m2,
            crossflow: per_m * situation.crossflow_area_m2,
        },
        wind_m_s: [situation.wind_m_s.x, situation.wind_m_s.y],
        gravity_m_s2: situation.gravity_m_s2,
        target_m: [0.0; 2],
        weights: Weights {
            place: settings.weights.x,
            lean: settings.weights.theta,
            rate: settings.weights.q,
            gimbal: settings.weights.delta,
            fins: space.fin_weight,
        },
        gimbal_limit_rad: settings.gimbal_deg.to_radians().min(situation.gimbal_limit_rad),
        lean_max_rad: settings.tilt_max_deg.to_radians(),
        end: End {
            vertical_m_s: [end.u_min_m_s, end.u_max_m_s],
            lateral_m_s: end.w_m_s,
            lean_rad: end.pitch_error_deg.to_radians(),
            rate_rad_s: end.pitch_rate_deg_s.to_radians(),
            settled_nodes: 1,
        },
        floor_rise_m_s: settings.floor_rise_m_s,
        guess_lean_rad: space.guess_lean_deg.to_radians(),
        // The first quarter of the turn brakes the motion sideways.
        guess_towards_rad: libm::atan2(-initial[4], -initial[3]),
        solver: settings.solver,
    }
}

/// Fills in what follows from the final time, s from now, and the number of intervals. It allocates only if there never
/// were as many.
fn stretch(
    problem: &mut SpaceProblem,
    situation: &PoweredSituation<'_>,
    settings: &PoweredSettings,
    final_time_s: f64,
    intervals: usize,
) {
    let ahead = Ahead(situation);
    let step_s = final_time_s / intervals as f64;
    problem.step_s = step_s;
    problem.pushes.clear();
    problem.pushes.extend((0..intervals).map(|k| {
        let (from_s, to_s) = (k as f64 * step_s, (k + 1) as f64 * step_s);
        let (thrust_n, mass_kg) = (ahead.mean_thrust_n(from_s, to_s), ahead.mean_mass_kg(from_s, to_s));
        Push {
            thrust_m_s2: thrust_n / mass_kg,
            turning_rad_s2: thrust_n * situation.arm_m / situation.inertia_kg_m2,
            per_kg: 1.0 / mass_kg,
        }
    }));
    let target_m = |place_m: f64, velocity_m_s: f64| {
        if situation.lands_in_place {
            here_m(place_m, velocity_m_s, final_time_s)
        } else {
            settings.homing.target_m(place_m, velocity_m_s, final_time_s)
        }
    };
    let from = &problem.initial;
    problem.target_m = [target_m(from[0], from[3]), target_m(from[1], from[4])];
    problem.end.settled_nodes =
        (libm::round(settings.settled_s / step_s) as usize + 1).min(intervals / 2).max(1);
}
