//! Phase 2 in space: from ignition to touchdown on a motor that cannot be throttled.
//!
//! A tick plans the landing in one vertical plane with the [NMPC](crate::nmpc), in the frame that moves with the wind,
//! with the real thrust curve as the [`Burn`](crate::burn::Burn) believes it, a mass that burns off, the body's and the fins' drag, a
//! floor above the ground and a free final time not before the thrust falls through the weight. Between ticks
//! [`PoweredGuidance::aim`] reads where the nose is to point from that plan, and leans it across the plane as the
//! velocity there and the wind ask. The fins open and close with the place in the
//! [band of feasible heights](crate::vertical): high in it there is too much motor left, so they close.
//!
//! When no plan can be had it degrades in announced steps, the [`ControlLevel`]s of the planar controller.

mod digest;
mod homing;
mod inspect;
mod plane;
mod situation;

pub use homing::Homing;
pub use inspect::LandingSolved;
pub use plane::Plane;
use situation::Ahead;
pub use situation::PoweredSituation;

use core::f64::consts::FRAC_PI_2;

use nalgebra::Vector3;
use serde::Deserialize;

use crate::aim::Aim;
use crate::controller::ControlLevel;
use crate::dynamics::PlanarState;
use crate::nmpc::free_time::{
    FreeTimeProblem, FreeTimeSolution, FreeTimeWorkspace, Motor, solve_free_time_into,
};
use crate::nmpc::{Problem, SolveStatus};
use crate::profile::{FinalBox, SolverLimits, StateWeights};
use crate::rigid::RigidState;

/// Longest and shortest horizons, intervals.
const MOST_INTERVALS: usize = 60;
const LEAST_INTERVALS: usize = 6;

/// How the landing burn is planned and flown.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PoweredSettings {
    /// Length of a planned interval at most, s.
    pub interval_s: f64,
    /// Weights of the plan.
    pub weights: StateWeights,
    /// A plan that tilts further than this is planned again with more weight on being upright, degrees.
    pub tilt_max_deg: f64,
    /// Largest planned gimbal angle on either side, degrees; the rest of the travel is the attitude loop's.
    pub gimbal_deg: f64,
    /// Where along the plane a plan is drawn to.
    pub homing: Homing,
    /// Largest horizontal distance at the end from there, m.
    pub x_final_m: f64,
    /// Box the plan ends in; its lateral speed is over the ground.
    #[serde(rename = "final")]
    pub final_box: FinalBox,
    /// Least height of the feet for each second before touchdown, m/s.
    pub floor_rise_m_s: f64,
    /// How long after thrust has fallen through the weight a plan may end, s.
    pub latest_after_s: f64,
    /// How long before touchdown a plan is inside the box but for its axial velocity, s.
    pub settled_s: f64,
    /// A plan that ends sooner than this is flown out, s.
    pub flown_out_s: f64,
    /// Most final times tried in a tick.
    pub max_solves: u32,
    /// Largest miss of a plan's end (m, rad, m/s or rad/s) that still counts as a landing.
    pub landing_miss: f64,
    /// Decay rate of the velocity across the plane, 1/s.
    pub across_decay_per_s: f64,
    /// Push towards the pad across the plane for each metre, 1/s^2.
    pub across_homing_per_s2: f64,
    /// Largest lean across the plane, degrees.
    pub across_lean_max_deg: f64,
    /// Limits of the solver.
    pub solver: SolverLimits,
}

/// Homing across the plane ends so long before touchdown, s, and never counts more than so many metres.
const HOMING_ENDS_S: f64 = 1.5;
const HOMING_MOST_M: f64 = 6.0;
/// Largest lean that holds a plan that is flown out to its velocity, rad.
const END_LEAN_MAX_RAD: f64 = 0.05;

/// How much dearer a tilt becomes when a plan tilts too far.
const UPRIGHT_DEARER: f64 = 8.0;

/// A plan that tilts further than this even so is not flown, rad.
const TILT_BELIEVED_RAD: f64 = 1.6;

/// What a tick found, in brief.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoweredReport {
    /// What decides where the nose points.
    pub level: ControlLevel,
    /// How the last solve ended.
    pub status: SolveStatus,
    /// Iterations over all final times tried.
    pub iterations: usize,
    /// Residuals of the optimality conditions.
    pub kkt_stationarity: f64,
    /// Largest defect or complementarity.
    pub kkt_feasibility: f64,
    /// Cost of the plan.
    pub cost: f64,
    /// By how much the plan misses its end at worst.
    pub condition_miss: f64,
    /// Time to the planned touchdown, s.
    pub touchdown_in_s: f64,
    /// The planned state at touchdown; velocities are through the air.
    pub touchdown: PlanarState,
    /// Largest planned tilt, rad.
    pub largest_tilt_rad: f64,
}

impl PoweredReport {
    /// Before the first tick.
    pub fn idle() -> Self {
        Self {
            level: ControlLevel::Idle,
            status: SolveStatus::NotRun,
            iterations: 0,
            kkt_stationarity: 0.0,
            kkt_feasibility: 0.0,
            cost: 0.0,
            condition_miss: 0.0,
            touchdown_in_s: 0.0,
            touchdown: PlanarState::default(),
            largest_tilt_rad: 0.0,
        }
    }
}

/// A plan being flown.
#[derive(Debug, Clone, PartialEq)]
struct Flown {
    plane: Plane,
    begins_s: f64,
    /// Rotational acceleration of a unit sine of the gimbal angle in each interval, rad/s^2.
    turning_rad_s2: Vec<f64>,
    plan: FreeTimeSolution,
}

/// The guidance and what it remembers.
#[derive(Debug, Clone)]
pub struct PoweredGuidance {
    settings: PoweredSettings,
    plane: Option<Plane>,
    flown: Option<Flown>,
    report: PoweredReport,
    workspace: FreeTimeWorkspace,
    trial: FreeTimeSolution,
}

impl PoweredGuidance {
    /// Guidance with nothing planned.
    pub fn new(settings: PoweredSettings) -> Self {
        Self {
            settings,
            plane: None,
            flown: None,
            report: PoweredReport::idle(),
            workspace: FreeTimeWorkspace::default(),
            trial: FreeTimeSolution::default(),
        }
    }

    /// What the last tick found.
    pub fn report(&self) -> &PoweredReport {
        &self.report
    }

    /// The plane of the landing, once there is one.
    pub fn plane(&self) -> Option<&Plane> {
        self.plane.as_ref()
    }

    /// The planned planar states, one step apart, if there is a plan: positions over the ground, velocities through
    /// the air.
    pub fn planned(&self) -> Option<(&[PlanarState], f64)> {
        let flown = self.flown.as_ref()?;
        Some((&flown.plan.solution.states, flown.plan.solution.step_s))
    }

    /// Plans the landing from a state at a time.
    pub fn plan(&mut self, time_s: f64, state: &RigidState, situation: &PoweredSituation<'_>) {
        let plane = *self.plane.get_or_insert_with(|| {
            Plane::choose(&state.position_m, &state.velocity_m_s, &situation.wind_m_s)
        });
        if self.flown.as_ref().is_some_and(|flown| flown.left_s(time_s) < self.settings.flown_out_s) {
            return;
        }
        let wind_m_s = situation.wind_m_s.dot(&plane.along);
        let initial = plane.project(state, situation.feet_below_cg_m, wind_m_s);
        let along_m_s = state.velocity_m_s.dot(&plane.along);
        let Some(mut problem) = self.pose(initial, along_m_s, wind_m_s, situation) else {
            self.report = PoweredReport { level: ControlLevel::Stabiliser, ..PoweredReport::idle() };
            return;
        };
        let earlier = self.flown.as_ref().map(|flown| (&flown.plan, time_s - flown.begins_s));
        solve_free_time_into(&problem, &Ahead(situation), earlier, &mut self.workspace, &mut self.trial);
        if largest_tilt_rad(&self.trial) > self.settings.tilt_max_deg.to_radians() {
            // A loop is a landing for the equations, not for a vehicle in air: ask again, upright dearer.
            problem.landing.state_weights[2] *= UPRIGHT_DEARER;
            solve_free_time_into(&problem, &Ahead(situation), None, &mut self.workspace, &mut self.trial);
        }
        self.take(time_s, plane, &problem, situation);
    }

    fn pose(
        &self,
        initial: PlanarState,
        along_m_s: f64,
        wind_m_s: f64,
        situation: &PoweredSituation<'_>,
    ) -> Option<FreeTimeProblem> {
        let settings = &self.settings;
        let carried_until_s =
            situation.burn.falls_through_weight_s(situation.mass_at_ignition_kg, situation.gravity_m_s2)?;
        // Late in the burn there is no waiting for the thrust to fall any more, only for the ground.
        let to_ground_s = initial.z_m.max(0.0) / 2.0;
        let earliest_s = (carried_until_s - situation.burning_s).max(0.05);
        let latest_s = (carried_until_s + settings.latest_after_s - situation.burning_s)
            .max(earliest_s + to_ground_s.min(0.4));
        let horizon_s = self.flown.as_ref().map_or(latest_s, |flown| flown.plan.final_time_s.min(latest_s));
        let intervals =
            (libm::ceil(horizon_s / settings.interval_s) as usize).clamp(LEAST_INTERVALS, MOST_INTERVALS);
        let step_s = horizon_s / intervals as f64;
        let target_x_m = settings.homing.target_m(initial.x_m, along_m_s, horizon_s);
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
            // How soft it can be is the plan's to say; a bound from straight-up thrust would only hide it.
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

    /// Keeps the trial as the flown plan if it is worth flying.
    fn take(
        &mut self,
        time_s: f64,
        plane: Plane,
        problem: &FreeTimeProblem,
        situation: &PoweredSituation<'_>,
    ) {
        let solution = &self.trial.solution;
        let usable = !solution.inputs_rad.is_empty()
            && solution.states.iter().all(PlanarState::is_finite)
            && largest_tilt_rad(&self.trial) < TILT_BELIEVED_RAD
            && solution.inputs_rad.iter().all(|input| input.is_finite());
        let level = match () {
            () if !usable => match &self.flown {
                Some(flown) if flown.left_s(time_s) > 0.0 => ControlLevel::ShiftedPlan,
                _ => ControlLevel::Stabiliser,
            },
            () if solution.status == SolveStatus::Converged
                && solution.condition_miss <= self.settings.landing_miss =>
            {
                ControlLevel::Converged
            }
            () => ControlLevel::BestFeasible,
        };
        let touchdown = solution.states.last().copied().unwrap_or_default();
        self.report = PoweredReport {
            level,
            status: solution.status,
            iterations: solution.iterations,
            kkt_stationarity: solution.kkt_stationarity,
            kkt_feasibility: solution.kkt_feasibility,
            cost: solution.cost,
            condition_miss: solution.condition_miss,
            touchdown_in_s: self.trial.final_time_s,
            touchdown,
            largest_tilt_rad: largest_tilt_rad(&self.trial),
        };
        if !usable {
            return;
        }
        let step_s = self.trial.final_time_s / problem.intervals as f64;
        let per_newton = situation.arm_m / situation.inertia_kg_m2;
        let ahead = Ahead(situation);
        let flown = self.flown.get_or_insert_with(|| Flown {
            plane,
            begins_s: time_s,
            turning_rad_s2: Vec::with_capacity(MOST_INTERVALS),
            plan: FreeTimeSolution::default(),
        });
        flown.begins_s = time_s;
        flown.turning_rad_s2.clear();
        flown.turning_rad_s2.extend(
            (0..problem.intervals)
                .map(|k| per_newton * ahead.mean_thrust_n(k as f64 * step_s, (k + 1) as f64 * step_s)),
        );
        core::mem::swap(&mut flown.plan, &mut self.trial);
    }

    /// Where the nose is to point at a time.
    pub fn aim(&self, time_s: f64, state: &RigidState, situation: &PoweredSituation<'_>) -> Aim {
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
        let flown = self.flown.as_ref().filter(|_| self.report.level != ControlLevel::Stabiliser);
        let Some(flown) = flown else {
            // Upright, and no faster sideways than can be helped.
            let nose = Vector3::z() + Vector3::x() * lean(&Vector3::x()) + Vector3::y() * lean(&Vector3::y());
            return Aim::at(nose / nose.norm());
        };
        let (theta_rad, q_rad_s, turning_rad_s2) = flown.elevation(time_s);
        let left_s = flown.left_s(time_s);
        // Across the plane the pad is approached while there is time.
        let homing = self.settings.across_homing_per_s2
            * ((left_s - HOMING_ENDS_S) / HOMING_ENDS_S).clamp(0.0, 1.0)
            * state.position_m.dot(&flown.plane.across).clamp(-HOMING_MOST_M, HOMING_MOST_M);
        let along = &flown.plane.along;
        // A plan flown out to its end is held to its velocity.
        let along_rad = if left_s < self.settings.flown_out_s {
            let astray_m_s =
                state.velocity_m_s.dot(along) - flown.along_m_s(time_s, situation.wind_m_s.dot(along));
            level_m_s2(-decay * astray_m_s).clamp(-END_LEAN_MAX_RAD, END_LEAN_MAX_RAD)
        } else {
            0.0
        };
        let across = libm::tan(level_m_s2(
            -decay * state.velocity_m_s.dot(&flown.plane.across) - air_m_s2.dot(&flown.plane.across) - homing,
        ));
        Aim {
            nose_in_world: flown.plane.nose(theta_rad - along_rad, across),
            rate_in_world_rad_s: flown.plane.turning(q_rad_s),
            acceleration_in_world_rad_s2: flown.plane.turning(turning_rad_s2),
        }
    }

    /// From now on only the upright law flies.
    pub fn degrade(&mut self) {
        self.flown = None;
        self.report = PoweredReport { level: ControlLevel::Stabiliser, ..PoweredReport::idle() };
    }
}

fn largest_tilt_rad(plan: &FreeTimeSolution) -> f64 {
    plan.solution.states.iter().map(|planned| (planned.theta_rad - FRAC_PI_2).abs()).fold(0.0, f64::max)
}

impl Flown {
    fn left_s(&self, time_s: f64) -> f64 {
        self.begins_s + self.plan.final_time_s - time_s
    }

    /// Planned velocity over the ground along the plane at a time, m/s; at rest after the plan's end.
    fn along_m_s(&self, time_s: f64, wind_m_s: f64) -> f64 {
        let solution = &self.plan.solution;
        let since = (time_s - self.begins_s).max(0.0) / solution.step_s;
        let k = since as usize;
        let along_m_s = |state: &PlanarState| {
            let (sin, cos) = libm::sincos(state.theta_rad);
            state.u_m_s * cos + state.w_m_s * sin + wind_m_s
        };
        match (solution.states.get(k), solution.states.get(k + 1)) {
            (Some(before), Some(after)) => {
                let share = since - k as f64;
                (1.0 - share) * along_m_s(before) + share * along_m_s(after)
            }
            _ => 0.0,
        }
    }

    /// Elevation, its rate and its acceleration at a time; upright at rest after the plan's end.
    fn elevation(&self, time_s: f64) -> (f64, f64, f64) {
        let solution = &self.plan.solution;
        let since_s = (time_s - self.begins_s).max(0.0);
        let k = (since_s / solution.step_s) as usize;
        let planned = solution.states.get(k).zip(solution.inputs_rad.get(k)).zip(self.turning_rad_s2.get(k));
        let Some(((state, input_rad), turning)) = planned else {
            return (FRAC_PI_2, 0.0, 0.0);
        };
        let along_s = since_s - k as f64 * solution.step_s;
        let acceleration = -turning * libm::sin(*input_rad);
        (
            state.theta_rad + along_s * (state.q_rad_s + 0.5 * along_s * acceleration),
            state.q_rad_s + along_s * acceleration,
            acceleration,
        )
    }
}
