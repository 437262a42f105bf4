//! Phase 2: from ignition to touchdown on a motor that cannot be throttled.
//!
//! A tick plans the landing with the [NMPC](nmpc): gimbal, fins and final time at once, from the plan of the tick before.
//! The nose may lean in any direction. The plan contains the thrust curve as estimated by
//! [`Burn`](crate::vehicle::burn::Burn), the burning mass, the drag of body and fins, a floor above the ground, and a free
//! final time that is not before the thrust falls through the weight. Between ticks the plan says where the nose points
//! and how far the fins are open.
//!
//! Without a plan the guidance degrades in reported steps, the [`ControlLevel`]s.

mod plan;
mod report;
mod situation;

use alloc::vec::Vec;
use nalgebra::Vector3;
use nmpc::{Drag, End, Outcome, Problem, Push, SolverLimits, State, Status, Weights, Workspace};
use serde::{Deserialize, Serialize};

pub use self::plan::Plan;
pub use self::report::{ControlLevel, PoweredReport, PoweredSettings};
pub use self::situation::PoweredSituation;
use crate::control::aim::Aim;
use crate::vehicle::rigid::RigidState;

/// Longest horizon, intervals: it sets the memory.
const MOST_INTERVALS: usize = 60;
/// Shortest horizon, intervals: with fewer a plan cannot lean and come upright again.
const LEAST_INTERVALS: usize = 6;

/// Largest lean that corrects the velocity when a plan is flown to its end, rad: 3 degrees,
/// well within what the legs take.
const END_LEAN_MAX_RAD: f64 = 0.05;

/// Largest lean with which a vehicle is brought to rest before contact, rad: 5 degrees, half of what the legs take.
const CONTACT_LEAN_RAD: f64 = 0.0873;

/// A plan that touches down faster than this is not flown unless the vehicle is high, m/s: the upright law brakes just as well.
const HARD_M_S: f64 = -1.2;

/// First change of the final time that is tried, s, the factor after one that was no better, and the smallest change.
const FIRST_STEP_S: f64 = 0.1;
const SHORTER: f64 = 0.3;
const LEAST_STEP_S: f64 = 0.01;

/// Half the span of the central difference of the Lagrangian, s.
const DIFFERENCE_S: f64 = 1e-4;

/// The guidance and its memory.
#[derive(Debug, Clone, Serialize)]
pub struct PoweredGuidance {
    #[serde(skip)]
    settings: PoweredSettings,
    report: PoweredReport,
    flown: Option<Plan>,
    // The next search writes these before it reads them.
    #[serde(skip)]
    workspace: Workspace,
    #[serde(skip)]
    problem: Option<Problem>,
    #[serde(skip)]
    trial: Plan,
    #[serde(skip)]
    found: Plan,
    #[serde(skip)]
    warm: Plan,
    /// Becomes the flown plan with the first plan.
    #[serde(skip)]
    unused: Plan,
    /// Intervals that all of these have room for. A landing that needs more gets longer ones, so that no flight allocates.
    #[serde(skip)]
    room: Option<usize>,
}

/// A landing that is planned again outside the flight.
#[derive(Debug, Clone, PartialEq)]
pub struct LandingSolved {
    /// The problem at the final time that was found, with its conditions, limits and motor.
    pub problem: Problem,
    /// How it ended, solved as in flight, from the previous plan; the iterations are those of all final times.
    pub outcome: Outcome,
    pub plan: Plan,
}

impl PoweredGuidance {
    /// Guidance without a plan, whose plans need no more memory than it has, however long the motor burns.
    ///
    /// It plans a landing with the most intervals and forgets the plans, so that every buffer has its size.
    pub fn with_room(
        settings: PoweredSettings,
        state: &RigidState,
        situation: &PoweredSituation<'_>,
    ) -> Self {
        let solver = SolverLimits { max_iterations: 1, ..settings.solver };
        // As many intervals as there can be, and no longer than in flight: of longer ones fewer would be settled.
        let carried_s = situation.ends_s(0.0, 0.0).map_or(0.0, |(earliest_s, _)| earliest_s);
        let latest_after_s = MOST_INTERVALS as f64 * settings.interval_s - carried_s;
        let mut planned = Self::new(PoweredSettings { solver, max_solves: 1, latest_after_s, ..settings });
        // Cold, warm, and cold again: the search swaps its buffers, and a warm plan is shorter.
        planned.plan(0.0, state, situation);
        planned.plan(0.0, state, situation);
        planned.forget();
        planned.plan(0.0, state, situation);
        planned.forget();
        Self { settings, report: PoweredReport::idle(), ..planned }
    }

    /// Guidance without a plan.
    pub fn new(settings: PoweredSettings) -> Self {
        Self {
            settings,
            report: PoweredReport::idle(),
            flown: None,
            workspace: Workspace::default(),
            problem: None,
            trial: Plan::default(),
            found: Plan::default(),
            warm: Plan::default(),
            unused: Plan::default(),
            room: None,
        }
    }

    /// Forgets its plans, and keeps their room: no plan has more intervals than the last.
    fn forget(&mut self) {
        if let Some(flown) = self.flown.take() {
            self.room = Some(flown.intervals());
            self.trial = flown.clone();
            self.unused = flown;
        }
    }

    /// The same memory with other settings.
    #[must_use]
    pub(crate) fn reconfigured(&self, settings: &PoweredSettings) -> Self {
        Self { settings: *settings, ..self.clone() }
    }

    /// The report of the last tick.
    pub fn report(&self) -> &PoweredReport {
        &self.report
    }

    /// The plan that is flown.
    pub fn planned(&self) -> Option<&Plan> {
        self.flown.as_ref()
    }

    /// Time until the flown plan ends, s.
    pub fn left_s(&self, time_s: f64) -> Option<f64> {
        self.flown.as_ref().map(|plan| plan.left_s(time_s))
    }

    /// Whether the plan ends so soon that it is flown to its end without a new plan.
    fn is_flown_out(&self, time_s: f64) -> bool {
        self.left_s(time_s).is_some_and(|left_s| left_s < self.settings.flown_out_s)
    }

    /// Plans the landing from a state at a time, and keeps the plan if it is finite.
    pub fn plan(&mut self, time_s: f64, state: &RigidState, situation: &PoweredSituation<'_>) {
        if self.is_flown_out(time_s) {
            return;
        }
        let Some(outcome) = self.search(time_s, state, situation) else {
            self.report = PoweredReport { level: ControlLevel::Stabiliser, ..PoweredReport::idle() };
            return;
        };
        let usable = self.found.is_finite();
        // Too low for any landing: upright brakes just as well. High above the ground it would stop the vehicle there.
        let too_low = !situation.high && self.found.end_m_s() < HARD_M_S;
        let lands = outcome.status == Status::Converged && outcome.miss <= self.settings.landing_miss;
        self.report = PoweredReport {
            level: ControlLevel::of_plan(usable, self.left_s(time_s), too_low, lands),
            status: outcome.status,
            iterations: outcome.iterations,
            passes: self.workspace.passes(),
            kkt_stationarity: outcome.stationarity,
            kkt_feasibility: outcome.feasibility,
            cost: outcome.cost,
            condition_miss: outcome.miss,
            touchdown_in_s: self.found.length_s(),
            touchdown_m_s: self.found.end_m_s(),
            largest_tilt_rad: self.found.largest_tilt_rad(),
        };
        if usable {
            core::mem::swap(
                self.flown.get_or_insert_with(|| core::mem::take(&mut self.unused)),
                &mut self.found,
            );
        }
    }

    /// Searches the path and the final time into `found`. The outcome has the iterations of all solves; there is none if the
    /// thrust never carries the vehicle.
    ///
    /// By the envelope theorem the derivative of the Lagrangian by the final time says on which side a better one lies.
    fn search(
        &mut self,
        time_s: f64,
        state: &RigidState,
        situation: &PoweredSituation<'_>,
    ) -> Option<Outcome> {
        let settings = self.settings;
        let height_m = state.position_m.z - situation.feet_below_cg_m;
        let (earliest_s, latest_s) = situation.ends_s(settings.latest_after_s, height_m)?;
        let mut final_time_s = self.left_s(time_s).unwrap_or(earliest_s).clamp(earliest_s, latest_s);
        let most = self.room.unwrap_or(MOST_INTERVALS);
        let intervals =
            (libm::round(final_time_s / settings.interval_s) as usize).clamp(LEAST_INTERVALS, most);

        let pushes = self.problem.take().map_or_else(|| Vec::with_capacity(MOST_INTERVALS), |old| old.pushes);
        let mut problem = Problem { pushes, ..posed(situation, &settings, state) };
        let stretch = |problem: &mut Problem, to_s: f64| {
            stretch(problem, situation, &settings, to_s, intervals);
        };
        stretch(&mut problem, final_time_s);
        let is_warm = self
            .flown
            .as_ref()
            .is_some_and(|flown| self.warm.take_last(flown, intervals, problem.end.settled_nodes));
        let warm = is_warm.then(|| self.warm.start());
        self.workspace.allow(settings.max_passes);
        let mut best = nmpc::solve(&mut self.workspace, &problem, warm.as_ref());
        self.found.read(&self.workspace, &problem, time_s);

        let mut iterations = best.iterations;
        let mut step_s = FIRST_STEP_S;
        for _ in 1..settings.max_solves {
            if self.workspace.is_spent() {
                break;
            }
            let mut lagrangian = |at_s: f64| {
                stretch(&mut problem, at_s);
                nmpc::lagrangian(&mut self.workspace, &problem, &self.found.start())
            };
            let slope = lagrangian(final_time_s + DIFFERENCE_S) - lagrangian(final_time_s - DIFFERENCE_S);
            let to_s = if slope > 0.0 { final_time_s - step_s } else { final_time_s + step_s };
            let to_s = to_s.clamp(earliest_s, latest_s);
            if !slope.is_finite() || (to_s - final_time_s).abs() < LEAST_STEP_S {
                break;
            }
            stretch(&mut problem, to_s);
            let outcome = nmpc::solve(&mut self.workspace, &problem, Some(&self.found.start()));
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

    /// Solves the landing that [`plan`](Self::plan) solves, outside the flight; `None` if there is none. `self` is the
    /// memory before the plan.
    pub(crate) fn inspect(
        &self,
        time_s: f64,
        state: &RigidState,
        situation: &PoweredSituation<'_>,
    ) -> Option<LandingSolved> {
        if self.is_flown_out(time_s) {
            return None;
        }
        let mut again = self.clone();
        let outcome = again.search(time_s, state, situation)?;
        let (mut problem, plan) = (again.problem?, again.found);
        stretch(&mut problem, situation, &self.settings, plan.length_s(), plan.intervals());
        Some(LandingSolved { problem, outcome, plan })
    }

    /// Share of the fins' drag area that the plan has at a time.
    pub fn fin_share(&self, time_s: f64) -> Option<f64> {
        let planned = self.flown.as_ref()?.fin_share(time_s)?;
        // Too low for any landing: brake.
        Some(if self.report.level == ControlLevel::Stabiliser { 1.0 } else { planned })
    }

    /// The wanted direction of the nose at a time.
    ///
    /// A vehicle whose foot is about to touch is only brought to rest, because it may touch before its plan ends: a lean of 10
    /// degrees lowers a foot of mk2 by 7 cm, which it sinks in 0.15 s.
    pub fn aim(&self, time_s: f64, state: &RigidState, situation: &PoweredSituation<'_>) -> Aim {
        let quiet_s = self.settings.contact_quiet_s;
        if quiet_s > 0.0 && situation.touches_within(quiet_s, state) {
            return Aim::leaning_at_most(&state.nose_in_world(), CONTACT_LEAN_RAD);
        }
        let thrust_n = situation.burn.thrust_n(situation.burning_s);
        let level_m_s2 = |push_m_s2: f64| {
            let most = self.settings.upright_lean_max_deg.to_radians();
            libm::atan(push_m_s2 * situation.mass_kg() / thrust_n.max(1.0)).clamp(-most, most)
        };
        let decay = self.settings.upright_decay_per_s;
        let flown = self.flown.as_ref().filter(|_| self.report.level != ControlLevel::Stabiliser);
        if let Some(aim) = flown.and_then(|plan| {
            self.planned_aim(plan, time_s, state, |astray_m_s| level_m_s2(-decay * astray_m_s))
        }) {
            return aim;
        }
        // Upright, with a lean against the sideways velocity.
        let air_m_s2 = situation.air_m_s2(state);
        let lean = |direction: &Vector3<f64>| {
            libm::tan(level_m_s2(-decay * state.velocity_m_s.dot(direction) - air_m_s2.dot(direction)))
        };
        let nose = Vector3::z() + Vector3::x() * lean(&Vector3::x()) + Vector3::y() * lean(&Vector3::y());
        Aim::at(nose / nose.norm())
    }

    /// The direction that a plan wants at a time; `None` after its end. `push` makes a lean, as a tangent, from a velocity to
    /// be lost.
    fn planned_aim(
        &self,
        plan: &Plan,
        time_s: f64,
        state: &RigidState,
        push: impl Fn(f64) -> f64,
    ) -> Option<Aim> {
        let settings = &self.settings;
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
        gravity_m_s2: situation.gravity_m_s2,
        target_m: [0.0; 2],
        weights: Weights {
            place: settings.weights.x,
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

/// Fills in what follows from the final time, s from now, and the number of intervals. It allocates only if there never
/// were as many.
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

// Chooses the landing point of a plan, in each level direction alone.

/// Limits of the homing to the pad: a plan lands only as near as necessary, and diverts no farther than a moderate lean
/// reaches.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Homing {
    /// Distance from the pad that counts as near enough, m.
    pub near_m: f64,
    /// Largest diversion of a plan, per squared second that is left, m/s^2.
    pub reach_m_s2: f64,
}

impl Homing {
    /// The landing point in one direction, m from the pad, at a velocity of `along_m_s` with `left_s` to go.
    fn target_m(&self, x_m: f64, along_m_s: f64, left_s: f64) -> f64 {
        let free_m = here_m(x_m, along_m_s, left_s);
        let reach_m = self.reach_m_s2 * left_s * left_s;
        free_m + (free_m.clamp(-self.near_m, self.near_m) - free_m).clamp(-reach_m, reach_m)
    }
}

/// The landing point without homing, m from the pad: the end of a constant deceleration from `along_m_s` in `left_s`.
/// It needs the smallest lean.
pub(crate) fn here_m(x_m: f64, along_m_s: f64, left_s: f64) -> f64 {
    x_m + 0.5 * along_m_s * left_s
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;

    use crate::vehicle::burn::Burn;
    use crate::vehicles::mission::builtin;

    // What the guidance flies when no plan is good.

    /// A vehicle in the middle of its burn, 7 m above the ground at 5 m/s and moving sideways at 3 m/s: it has to turn away more
    /// thrust than it can without hovering.
    fn too_high(mission: &str, high: bool) -> PoweredGuidance {
        let mission = builtin(mission).unwrap().unwrap();
        let feet_below_cg_m = 0.44;
        let situation = PoweredSituation {
            burn: Burn::nominal(&mission.motor_curve),
            burning_s: 2.5,
            mass_at_ignition_kg: 3.1,
            inertia_kg_m2: 0.12,
            arm_m: 0.4,
            feet_below_cg_m,
            foot_radius_m: 0.4,
            gravity_m_s2: 9.80665,
            air_density_kg_m3: 1.2,
            wind_m_s: Vector3::zeros(),
            body_drag_area_m2: 0.003,
            crossflow_area_m2: 0.062,
            fin_drag_area_m2: 0.0,
            gimbal_limit_rad: 5.0_f64.to_radians(),
            lands_in_place: false,
            high,
        };
        let state = RigidState {
            velocity_m_s: Vector3::new(3.0, 0.0, -5.0),
            world_from_body: UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -0.07)
                * RigidState::upright(0.0).world_from_body,
            ..RigidState::upright(7.0 + feet_below_cg_m)
        };
        // Without a bound: a cold search that is cut short has not found yet how hard this ends.
        let mut guidance = PoweredGuidance::new(PoweredSettings { max_passes: None, ..mission.powered });
        guidance.plan(0.0, &state, &situation);
        guidance
    }

    #[test]
    fn a_vehicle_that_is_high_flies_a_hard_plan_and_does_not_brake_upright() {
        for mission in ["mk2", "mk3"] {
            let low = too_high(mission, false);
            assert!(low.report().touchdown_m_s < HARD_M_S, "{mission}: {:?}", low.report());
            assert_eq!(low.report().level, ControlLevel::Stabiliser, "{mission}");

            let high = too_high(mission, true);
            assert_eq!(high.report().level, ControlLevel::BestFeasible, "{mission}: {:?}", high.report());
            let tilt_rad = high.report().largest_tilt_rad;
            assert!(tilt_rad > 45.0_f64.to_radians(), "{mission}: {:?}", high.report());
        }
    }

    #[test]
    fn a_plan_diverts_to_the_edge_of_the_pad_within_its_reach() {
        let homing = Homing { near_m: 6.0, reach_m_s2: 0.5 };
        assert!((homing.target_m(4.0, 0.0, 4.0) - 4.0).abs() < 1e-12, "near enough");
        assert!((homing.target_m(10.0, 0.0, 4.0) - 6.0).abs() < 1e-12, "to the edge");
        assert!((homing.target_m(-50.0, 0.0, 4.0) + 42.0).abs() < 1e-12, "8 m are in reach in 4 s");
        assert!((homing.target_m(10.0, -4.0, 4.0) - 2.0).abs() < 1e-12, "braking evenly ends there");
    }
}
