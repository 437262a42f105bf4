//! The search of a landing, apart from who flies it and when.

use alloc::vec::Vec;

use ocp::Outcome;
use ocp::landing::{Drag, End, Problem, Push, State, Weights, Workspace};

use super::plan::Plan;
use super::{PoweredSettings, PoweredSituation, here_m};
use crate::vehicle::atmosphere::STANDARD_GRAVITY_M_S2;
use crate::vehicle::rigid::RigidState;

/// Longest horizon, intervals: it sets the memory.
pub(super) const MOST_INTERVALS: usize = 60;
/// Shortest horizon, intervals: with fewer a plan cannot lean and return to vertical.
const LEAST_INTERVALS: usize = 6;

/// First change of the final time that is tried, s, the factor after one that was no better, and
/// the smallest change.
const FIRST_STEP_S: f64 = 0.1;
const SHORTER: f64 = 0.3;
const LEAST_STEP_S: f64 = 0.01;

/// Half the span of the central difference of the Lagrangian, s.
const DIFFERENCE_S: f64 = 1e-4;

/// The solver and the plans between which it searches.
#[derive(Debug, Clone, Default)]
pub struct Search {
    /// The plan flown at the time of the request.
    from: Plan,
    pub(super) found: Plan,
    // The search writes these before it reads them.
    pub(super) workspace: Workspace,
    problem: Option<Problem>,
    trial: Plan,
    warm: Plan,
    /// Intervals that all of these have room for. A landing that needs more gets longer ones, so
    /// that no flight allocates.
    room: Option<usize>,
}

/// A landing that was planned, with its problem.
#[derive(Debug, Clone, PartialEq)]
pub struct LandingSolved {
    /// The problem at the final time that was found, with its conditions, limits and motor.
    pub problem: Problem,
    /// How it ended; the iterations are those of all final times.
    pub outcome: Outcome,
    pub plan: Plan,
}

impl Search {
    /// The next search starts from this plan.
    pub(super) fn begin(&mut self, flown: &Plan) {
        self.from.copy(flown);
    }

    /// No plan will have more intervals than this one.
    pub(super) fn reserve(&mut self, longest: &Plan) {
        self.room = Some(longest.intervals());
        self.trial = longest.clone();
    }

    /// The plan that is flown once the search is taken over.
    pub(crate) fn to_be_flown(&self, outcome: Option<&Outcome>) -> &Plan {
        if outcome.is_some() && self.found.is_finite() { &self.found } else { &self.from }
    }

    /// Whether the plan it starts from is flown to its end.
    pub(crate) fn is_flown_out(&self, settings: &PoweredSettings, time_s: f64) -> bool {
        self.from.is_flown_out(settings, time_s)
    }

    /// The plan flown at the time of the request; without intervals if there was none.
    pub(crate) fn from(&self) -> &Plan {
        &self.from
    }

    /// Starts the next search from the result, if it is finite.
    pub(crate) fn fly_on(&mut self) {
        if self.found.is_finite() {
            self.from.copy(&self.found);
        }
    }

    /// Passes of the last search.
    pub(crate) fn passes(&self) -> usize {
        self.workspace.passes()
    }

    /// Searches the path and the final time of a landing into `found`. The outcome has the
    /// iterations of all solves; there is none if the thrust never carries the vehicle.
    ///
    /// By the envelope theorem the derivative of the Lagrangian by the final time gives the side on
    /// which a better one lies.
    pub(crate) fn search(
        &mut self,
        settings: &PoweredSettings,
        time_s: f64,
        state: &RigidState,
        situation: &PoweredSituation<'_>,
    ) -> Option<Outcome> {
        let height_m = state.position_m.z - situation.feet_below_cg_m;
        let (earliest_s, latest_s) = situation.ends_s(settings.latest_after_s, height_m)?;
        let mut final_time_s = if self.from.intervals() > 0 { self.from.left_s(time_s) } else { earliest_s }
            .clamp(earliest_s, latest_s);
        let most = self.room.unwrap_or(MOST_INTERVALS);
        let intervals =
            (libm::round(final_time_s / settings.interval_s) as usize).clamp(LEAST_INTERVALS, most);

        let pushes = self.problem.take().map_or_else(|| Vec::with_capacity(MOST_INTERVALS), |old| old.pushes);
        let mut problem = Problem { pushes, ..posed(situation, settings, state) };
        let stretch = |problem: &mut Problem, to_s: f64| {
            stretch(problem, situation, settings, to_s, intervals);
        };
        stretch(&mut problem, final_time_s);
        let is_warm = self.warm.take_last(&self.from, intervals, problem.end.settled_nodes);
        let warm = is_warm.then(|| self.warm.start());
        self.workspace.allow(settings.max_passes);
        let mut best = ocp::landing::solve(&mut self.workspace, &problem, warm.as_ref());
        self.found.read(&self.workspace, &problem, time_s);

        let mut iterations = best.iterations;
        let mut step_s = FIRST_STEP_S;
        for _ in 1..settings.max_solves {
            if self.workspace.is_spent() {
                break;
            }
            let mut lagrangian = |at_s: f64| {
                stretch(&mut problem, at_s);
                ocp::landing::lagrangian(&mut self.workspace, &problem, &self.found.start())
            };
            let slope = lagrangian(final_time_s + DIFFERENCE_S) - lagrangian(final_time_s - DIFFERENCE_S);
            let to_s = if slope > 0.0 { final_time_s - step_s } else { final_time_s + step_s };
            let to_s = to_s.clamp(earliest_s, latest_s);
            if !slope.is_finite() || (to_s - final_time_s).abs() < LEAST_STEP_S {
                break;
            }
            stretch(&mut problem, to_s);
            let outcome = ocp::landing::solve(&mut self.workspace, &problem, Some(&self.found.start()));
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

    /// The landing that was searched at a time from this situation; if it was usable, `flown` is
    /// its plan.
    pub(crate) fn solved(
        &self,
        settings: &PoweredSettings,
        time_s: f64,
        outcome: &Outcome,
        flown: &Plan,
        situation: &PoweredSituation<'_>,
    ) -> Option<LandingSolved> {
        let plan = if flown.begins_s().to_bits() == time_s.to_bits() { flown } else { &self.found }.clone();
        let mut problem = self.problem.clone()?;
        stretch(&mut problem, situation, settings, plan.length_s(), plan.intervals());
        Some(LandingSolved { problem, outcome: *outcome, plan })
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

/// The landing problem of a tick, except the parts that depend on its final time.
fn posed(situation: &PoweredSituation<'_>, settings: &PoweredSettings, state: &RigidState) -> Problem {
    let per_m = 0.5 * situation.air_density_kg_m3;
    let end = &settings.final_box;
    let initial = initial(state, situation.feet_below_cg_m);
    Problem {
        initial,
        step_s: settings.interval_s,
        pushes: Vec::new(),
        drag: Drag {
            fins: per_m * situation.fin_drag_area_m2,
            axial: per_m * situation.body_drag_area_m2,
            crossflow: per_m * situation.crossflow_area_m2,
        },
        wind_m_s: [situation.wind_m_s.x, situation.wind_m_s.y],
        gravity_m_s2: STANDARD_GRAVITY_M_S2,
        target_m: [0.0; 2],
        weights: Weights {
            place: settings.weights.x,
            height: settings.weights.z,
            velocity: [settings.weights.w, settings.weights.u],
            lean: settings.weights.theta,
            rate: settings.weights.q,
            gimbal: settings.weights.delta,
            fins: settings.weights.fins,
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
        guess_lean_rad: settings.guess_lean_deg.to_radians(),
        // The first quarter of the turn brakes the motion sideways.
        guess_towards_rad: libm::atan2(-initial[4], -initial[3]),
        solver: settings.solver,
    }
}

/// Fills in the parts that depend on the final time, s from now, and the number of intervals. It
/// allocates only for a new largest number.
fn stretch(
    problem: &mut Problem,
    situation: &PoweredSituation<'_>,
    settings: &PoweredSettings,
    final_time_s: f64,
    intervals: usize,
) {
    let step_s = final_time_s / intervals as f64;
    problem.step_s = step_s;
    problem.pushes.clear();
    problem.pushes.extend((0..intervals).map(|k| {
        let (from_s, to_s) = (k as f64 * step_s, (k + 1) as f64 * step_s);
        let (thrust_n, mass_kg) =
            (situation.mean_thrust_n(from_s, to_s), situation.mean_mass_kg(from_s, to_s));
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
