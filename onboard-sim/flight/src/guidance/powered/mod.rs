//! Phase 2 in space: from ignition to touchdown on a motor that cannot be throttled.
//!
//! A tick plans the landing in one vertical plane with the [NMPC](nmpc), in the frame that moves with the wind. The
//! plan contains the thrust curve as estimated by [`Burn`](crate::vehicle::burn::Burn), the burning mass, the drag of
//! body and fins, a floor above the ground, and a free final time that is not before the thrust falls through the
//! weight. Between ticks [`PoweredGuidance::aim`] reads the wanted direction of the nose from that plan, and leans it
//! across the plane for the velocity there and the wind. The fins open and close with the place in the
//! [band of feasible heights](crate::guidance::vertical): high in the band too much impulse is left, so they close.
//!
//! A mission with `[powered.space]` plans in `space` instead: the nose may lean in any direction, and the plan has the
//! fins as well.
//!
//! Without a plan the guidance degrades in reported steps, the [`ControlLevel`]s.

mod report;
mod situation;
mod space;

use alloc::vec::Vec;
use nalgebra::Vector3;
use nmpc::free_time::{FreeTimeProblem, FreeTimeSolution, FreeTimeWorkspace, Motor, solve_free_time_into};
use nmpc::{Problem, SolveStatus};
use serde::{Deserialize, Serialize};

pub use self::report::{ControlLevel, LandingSolved, PoweredReport, PoweredSettings};
use self::situation::{Ahead, Flown, largest_tilt_rad};
pub use self::situation::{Plane, PoweredSituation};
use self::space::SpaceGuidance;
pub use self::space::{SpaceSettings, SpaceSolved};
use crate::control::aim::Aim;
use crate::vehicle::dynamics::PlanarState;
use crate::vehicle::mission::{FinalBox, SolverLimits};
use crate::vehicle::rigid::RigidState;

/// Longest horizon, intervals: it sets the memory.
const MOST_INTERVALS: usize = 60;
/// Shortest horizon, intervals: with fewer a plan cannot lean and come upright again.
const LEAST_INTERVALS: usize = 6;

/// Homing across the plane ends this long before touchdown, s: what leans later does not come upright in time.
const HOMING_ENDS_S: f64 = 1.5;
/// The distance for which it leans is limited to this, m.
const HOMING_MOST_M: f64 = 6.0;
/// Largest lean that corrects the velocity when a plan is flown to its end, rad: 3 degrees,
/// well within what the legs take.
const END_LEAN_MAX_RAD: f64 = 0.05;

/// Largest lean with which a vehicle is brought to rest before contact, rad: 5 degrees, half of what the legs take.
const CONTACT_LEAN_RAD: f64 = 0.0873;

/// Factor on the cost of tilt when a plan tilts too far. It holds for a vehicle that is high, too: with its far leans an abort
/// that lights the motor high comes down hard even in a world without errors.
const UPRIGHT_COST_FACTOR: f64 = 8.0;

/// If the preferred plan touches down faster than this, m/s, the fallback is tried if there is one.
const SOFT_M_S: f64 = -0.7;

/// A plan that touches down faster than this is not flown unless the vehicle is high, m/s: the upright law brakes just as well.
const HARD_M_S: f64 = -1.2;

/// A plan that still tilts further than this is not flown, rad: its nose points below the horizon.
const PLAN_TILT_MAX_RAD: f64 = 1.6;

/// Velocity along the nose at the plan's touchdown, m/s; minus infinity without a plan.
fn ended_m_s(plan: &FreeTimeSolution) -> f64 {
    let finite = plan.solution.states.iter().all(PlanarState::is_finite);
    plan.solution.states.last().filter(|_| finite).map_or(f64::NEG_INFINITY, |last| last.u_m_s)
}

/// The guidance and its memory.
#[derive(Debug, Clone, Serialize)]
pub struct PoweredGuidance {
    #[serde(skip)]
    settings: PoweredSettings,
    plane: Option<Plane>,
    flown: Option<Flown>,
    report: PoweredReport,
    // The next search writes all of these before it reads them. (If a problem cannot be posed, the trial keeps an older
    // final time, which is reported but decides nothing.)
    #[serde(skip)]
    workspace: FreeTimeWorkspace,
    #[serde(skip)]
    trial: FreeTimeSolution,
    #[serde(skip)]
    set_aside: FreeTimeSolution,
    /// Becomes the flown plan with the first plan.
    #[serde(skip)]
    unused: Flown,
    space: SpaceGuidance,
}

impl PoweredGuidance {
    /// Guidance without a plan, whose plans in a plane need no more memory than it has, however long the motor burns.
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
        planned.plan(0.0, state, situation, None);
        planned.plan(0.0, state, situation, None);
        planned.flown = None;
        planned.space.forget();
        planned.plan(0.0, state, situation, None);
        planned.space.forget();
        let Self { workspace, flown, space, .. } = planned;
        let unused = flown.unwrap_or_default();
        let set_aside =
            FreeTimeSolution { solution: unused.plan.solution.clone(), ..FreeTimeSolution::default() };
        let trial = set_aside.clone();
        Self { workspace, trial, set_aside, unused, space, ..Self::new(settings) }
    }

    /// Guidance without a plan.
    pub fn new(settings: PoweredSettings) -> Self {
        Self {
            settings,
            plane: None,
            flown: None,
            report: PoweredReport::idle(),
            workspace: FreeTimeWorkspace::default(),
            trial: FreeTimeSolution::default(),
            set_aside: FreeTimeSolution::default(),
            unused: Flown::default(),
            space: SpaceGuidance::default(),
        }
    }

    /// The report of the last tick.
    pub fn report(&self) -> &PoweredReport {
        &self.report
    }

    /// Time until the flown plan ends, s.
    pub fn left_s(&self, time_s: f64) -> Option<f64> {
        self.space.left_s(time_s).or_else(|| self.flown.as_ref().map(|flown| flown.left_s(time_s)))
    }

    /// Plans the landing from a state at a time. If the preferred problem ends in a hard landing, it tries the
    /// fallback.
    pub fn plan(
        &mut self,
        time_s: f64,
        state: &RigidState,
        preferred: &PoweredSituation<'_>,
        fallback: Option<&PoweredSituation<'_>>,
    ) {
        let plane = *self.plane.get_or_insert_with(|| {
            Plane::choose(&state.position_m, &state.velocity_m_s, &preferred.wind_m_s)
        });
        if self.is_flown_out(time_s) {
            return;
        }
        let nothing = PoweredReport { level: ControlLevel::Stabiliser, ..PoweredReport::idle() };
        if let Some(space) = &self.settings.space {
            let planned = self.space.plan(time_s, &plane, state, preferred, &self.settings, space);
            self.report = planned.unwrap_or(nothing);
            return;
        }
        let Some((problem, situation)) = self.solve_either(time_s, &plane, state, preferred, fallback) else {
            self.report = nothing;
            return;
        };
        self.take(time_s, &problem, situation);
    }

    /// Solves the landing into the trial: the preferred problem, unless it ends hard and the fallback ends softer.
    fn solve_either<'s, 'a>(
        &mut self,
        time_s: f64,
        plane: &Plane,
        state: &RigidState,
        preferred: &'s PoweredSituation<'a>,
        fallback: Option<&'s PoweredSituation<'a>>,
    ) -> Option<(FreeTimeProblem, &'s PoweredSituation<'a>)> {
        self.workspace.allow(self.settings.max_passes);
        let mut problem = self.pose(plane, state, preferred)?;
        self.solve(time_s, &mut problem, preferred);
        let ended_m_s = ended_m_s(&self.trial);
        let posed = fallback
            .filter(|_| ended_m_s < SOFT_M_S && !self.workspace.is_spent())
            .and_then(|fallback| Some((self.pose(plane, state, fallback)?, fallback)));
        let Some((mut other, fallback)) = posed else { return Some((problem, preferred)) };
        core::mem::swap(&mut self.trial, &mut self.set_aside);
        self.solve(time_s, &mut other, fallback);
        if ended_m_s < self::ended_m_s(&self.trial) {
            return Some((other, fallback));
        }
        core::mem::swap(&mut self.trial, &mut self.set_aside);
        Some((problem, preferred))
    }

    /// Whether the plan ends so soon that it is flown to its end without a new plan.
    fn is_flown_out(&self, time_s: f64) -> bool {
        self.left_s(time_s).is_some_and(|left_s| left_s < self.settings.flown_out_s)
    }

    /// Solves a problem into the trial, from the flown plan.
    fn solve(&mut self, time_s: f64, problem: &mut FreeTimeProblem, situation: &PoweredSituation<'_>) {
        let earlier = self.flown.as_ref().map(|flown| (&flown.plan, time_s - flown.begins_s));
        if !self.flown.as_ref().is_some_and(|flown| flown.upright) {
            solve_free_time_into(problem, &Ahead(situation), earlier, &mut self.workspace, &mut self.trial);
            let tilts = largest_tilt_rad(&self.trial) > self.settings.tilt_max_deg.to_radians();
            if !tilts || self.workspace.is_spent() {
                return;
            }
        }
        // A loop satisfies the equations, but no vehicle can fly it in air. Solve with a higher cost of tilt. While that
        // lands it is kept: the other cost would lead back to the loop, in each tick.
        problem.landing.state_weights[2] *= UPRIGHT_COST_FACTOR;
        solve_free_time_into(problem, &Ahead(situation), earlier, &mut self.workspace, &mut self.trial);
    }

    fn pose(
        &self,
        plane: &Plane,
        state: &RigidState,
        situation: &PoweredSituation<'_>,
    ) -> Option<FreeTimeProblem> {
        let wind_m_s = situation.wind_m_s.dot(&plane.along);
        let initial = plane.project(state, situation.feet_below_cg_m, wind_m_s);
        let along_m_s = state.velocity_m_s.dot(&plane.along);
        let settings = &self.settings;
        let (earliest_s, latest_s) = situation.ends_s(settings.latest_after_s, initial.z_m)?;
        let horizon_s = self.flown.as_ref().map_or(latest_s, |flown| flown.plan.final_time_s.min(latest_s));
        let intervals =
            (libm::ceil(horizon_s / settings.interval_s) as usize).clamp(LEAST_INTERVALS, MOST_INTERVALS);
        let step_s = horizon_s / intervals as f64;
        let target_x_m = if situation.lands_in_place {
            here_m(initial.x_m, along_m_s, horizon_s)
        } else {
            settings.homing.target_m(initial.x_m, along_m_s, horizon_s)
        };
        let settled_nodes = (libm::round(settings.settled_s / step_s) as usize + 1).min(intervals / 2).max(1);
        let landing = Problem {
            model: situation.model(),
            initial,
            step_s: settings.interval_s,
            thrust_n: Vec::new(),
            mass_kg: Vec::new(),
            target: PlanarState { x_m: target_x_m, ..Plane::rest(wind_m_s) },
            state_weights: settings.weights.state_diagonal(),
            input_weight: settings.weights.delta,
            gimbal_limit_rad: settings.gimbal_deg.to_radians().min(situation.gimbal_limit_rad),
            x_final_m: settings.x_final_m,
            final_box: Some(FinalBox { settled_nodes, ..settings.final_box }),
            altitude_min_m: Some(0.0),
            floor_rise_m_s: settings.floor_rise_m_s,
            // The plan itself shows how soft the landing can be; a bound from vertical thrust would only hide it.
            touchdown_speed_max_m_s: f64::MAX,
            solver: settings.solver,
        };
        Some(FreeTimeProblem {
            landing,
            intervals,
            earliest_s,
            latest_s,
            target_drift_m_s: -wind_m_s,
            max_solves: settings.max_solves,
        })
    }

    /// Keeps the trial as the flown plan if it is good enough.
    fn take(&mut self, time_s: f64, problem: &FreeTimeProblem, situation: &PoweredSituation<'_>) {
        let solution = &self.trial.solution;
        let largest_tilt_rad = largest_tilt_rad(&self.trial);
        let usable = !solution.inputs_rad.is_empty()
            && solution.states.iter().all(PlanarState::is_finite)
            && largest_tilt_rad < PLAN_TILT_MAX_RAD
            && solution.inputs_rad.iter().all(|input| input.is_finite());
        // Too low for any landing: a plan would turn the body across the air to brake, and gain the same speed sideways.
        let too_low = !situation.high && solution.states.last().is_some_and(|last| last.u_m_s < HARD_M_S);
        let lands = solution.status == SolveStatus::Converged
            && solution.condition_miss <= self.settings.landing_miss;
        let left_s = self.flown.as_ref().map(|flown| flown.left_s(time_s));
        let level = ControlLevel::of_plan(usable, left_s, too_low, lands);
        let touchdown = solution.states.last().copied().unwrap_or_default();
        self.report = PoweredReport {
            level,
            status: solution.status,
            iterations: solution.iterations,
            passes: self.workspace.passes(),
            kkt_stationarity: solution.kkt_stationarity,
            kkt_feasibility: solution.kkt_feasibility,
            cost: solution.cost,
            condition_miss: solution.condition_miss,
            touchdown_in_s: self.trial.final_time_s,
            touchdown,
            largest_tilt_rad,
        };
        if !usable {
            return;
        }
        let step_s = self.trial.final_time_s / problem.intervals as f64;
        let per_newton = situation.arm_m / situation.inertia_kg_m2;
        let ahead = Ahead(situation);
        let flown = self.flown.get_or_insert_with(|| core::mem::take(&mut self.unused));
        flown.begins_s = time_s;
        flown.upright = lands && problem.landing.state_weights[2] > self.settings.weights.theta;
        flown.turning_rad_s2.clear();
        flown.turning_rad_s2.extend(
            (0..problem.intervals)
                .map(|k| per_newton * ahead.mean_thrust_n(k as f64 * step_s, (k + 1) as f64 * step_s)),
        );
        core::mem::swap(&mut flown.plan, &mut self.trial);
    }

    /// Share of the fins' drag area that the plan has at a time, if it is one in space.
    pub fn fin_share(&self, time_s: f64) -> Option<f64> {
        let planned = self.space.fin_share(time_s)?;
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
        self.planned_aim(time_s, state, situation)
    }

    fn planned_aim(&self, time_s: f64, state: &RigidState, situation: &PoweredSituation<'_>) -> Aim {
        let thrust_n = situation.burn.thrust_n(situation.burning_s);
        let level_m_s2 = |push_m_s2: f64| {
            let most = self.settings.across_lean_max_deg.to_radians();
            libm::atan(push_m_s2 * situation.mass_kg() / thrust_n.max(1.0)).clamp(-most, most)
        };
        let air_m_s2 = situation.air_m_s2(state);
        let decay = self.settings.across_decay_per_s;
        let lean = |direction: &Vector3<f64>| {
            libm::tan(level_m_s2(-decay * state.velocity_m_s.dot(direction) - air_m_s2.dot(direction)))
        };
        if self.report.level != ControlLevel::Stabiliser
            && let Some(aim) =
                self.space.aim(time_s, state, &self.settings, |astray_m_s| level_m_s2(-decay * astray_m_s))
        {
            return aim;
        }
        let flown = self.flown.as_ref().filter(|_| self.report.level != ControlLevel::Stabiliser);
        let Some((flown, plane)) = flown.zip(self.plane.as_ref()) else {
            // Upright, with a lean against the sideways velocity.
            let nose = Vector3::z() + Vector3::x() * lean(&Vector3::x()) + Vector3::y() * lean(&Vector3::y());
            return Aim::at(nose / nose.norm());
        };
        let (theta_rad, q_rad_s, turning_rad_s2) = flown.elevation(time_s);
        let left_s = flown.left_s(time_s);
        if left_s < self.settings.quiet_s {
            return Aim::at(state.nose_in_world());
        }
        // Across the plane the vehicle homes to the pad while there is time, unless homing is off.
        let homing_per_s2 = if situation.lands_in_place { 0.0 } else { self.settings.across_homing_per_s2 };
        let homing = homing_per_s2
            * ((left_s - HOMING_ENDS_S) / HOMING_ENDS_S).clamp(0.0, 1.0)
            * state.position_m.dot(&plane.across).clamp(-HOMING_MOST_M, HOMING_MOST_M);
        let along = &plane.along;
        // A plan that is flown to its end needs a correction of the velocity.
        let along_rad = if left_s < self.settings.flown_out_s {
            let astray_m_s =
                state.velocity_m_s.dot(along) - flown.along_m_s(time_s, situation.wind_m_s.dot(along));
            level_m_s2(-decay * astray_m_s).clamp(-END_LEAN_MAX_RAD, END_LEAN_MAX_RAD)
        } else {
            0.0
        };
        let across = libm::tan(level_m_s2(
            -decay * state.velocity_m_s.dot(&plane.across) - air_m_s2.dot(&plane.across) - homing,
        ));
        Aim {
            nose_in_world: plane.nose(theta_rad - along_rad, across),
            rate_in_world_rad_s: plane.turning(q_rad_s),
            acceleration_in_world_rad_s2: plane.turning(turning_rad_s2),
        }
    }
}

// Chooses the landing point of a plan along its plane.

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
    /// The landing point along the plane, m from the pad, at a velocity of `along_m_s` with `left_s` to go.
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
    /// thrust than it can without hovering. mk2 plans in a plane, mk3 in space.
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
        guidance.plan(0.0, &state, &situation, None);
        guidance
    }

    #[test]
    fn a_vehicle_that_is_high_flies_a_hard_plan_and_does_not_brake_upright() {
        for mission in ["mk2", "mk3"] {
            let low = too_high(mission, false);
            assert!(low.report().touchdown.u_m_s < HARD_M_S, "{mission}: {:?}", low.report());
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
