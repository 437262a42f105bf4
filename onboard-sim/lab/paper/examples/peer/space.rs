//! A landing in space for the comparison: gimbal in two directions, fins, a box at the end, a given
//! final time.
//!
//! The vehicle is the one of the solver's own tests: 1.2 kg, a thrust that falls to the weight in
//! 3.8 s, a light wind.

use anyhow::{Result, ensure};
use ocp::Start;
use ocp::landing::{
    Drag, End, INPUTS, Problem, Push, STATES, SolverLimits, State, Weights, Workspace, last_multipliers,
};

use crate::timed;

const INTERVALS: usize = 38;
const GRAVITY_M_S2: f64 = 9.806_65;

/// Rotational acceleration of a radian of the gimbal over the thrust's acceleration, 1/m.
const TURNING_PER_THRUST: f64 = 6.0;

const MASS_KG: f64 = 1.2;

/// A plan, as the solver takes it again.
#[derive(Debug, Default)]
struct Plan {
    states: Vec<State>,
    inputs: Vec<[f64; INPUTS]>,
    costates: Vec<State>,
    limits: Vec<[[f64; 2]; INPUTS]>,
    conditions: Vec<f64>,
}

/// The solver in space, with the problem and the plan of its last solve.
pub(crate) struct Space {
    workspace: Workspace,
    problem: Problem,
    plan: Plan,
}

impl Space {
    pub(crate) fn new(penalty: f64) -> Self {
        Self { workspace: Workspace::default(), problem: landing(penalty), plan: Plan::default() }
    }

    pub(crate) fn set_penalty(&mut self, penalty: f64) {
        self.problem.solver.terminal_penalty = penalty;
    }

    /// Solves the whole horizon, with so much thrust over weight at its beginning.
    pub(crate) fn cold(&mut self, thrust_over_weight: f64, start: State) -> Result<String> {
        self.problem.initial = start;
        self.problem.pushes = pushes(thrust_over_weight);
        let Self { workspace, problem, .. } = self;
        Ok(timed(problem, workspace, None)?.1)
    }

    /// Makes the last solution the plan.
    pub(crate) fn hold(&mut self) {
        let Self { workspace, plan, .. } = self;
        *plan = Plan {
            states: workspace.states().to_vec(),
            inputs: workspace.inputs().to_vec(),
            costates: workspace.costates().to_vec(),
            limits: workspace.limit_multipliers().collect(),
            conditions: workspace.condition_multipliers().collect(),
        };
    }

    /// Solves what is left some samples after the plan began.
    pub(crate) fn warm(&mut self, samples: usize, start: State) -> Result<String> {
        let planned = self.plan.inputs.len();
        let settled = self.problem.end.settled_nodes;
        ensure!(
            samples + settled < planned,
            "the plan has {planned} intervals; samples must be fewer by {settled}"
        );
        let Self { workspace, problem, plan } = self;
        let mut rest = problem.clone();
        rest.initial = start;
        // The plan may be a later one than that of the whole horizon.
        rest.pushes.drain(..rest.pushes.len() - (planned - samples));
        let mut conditions = Vec::new();
        last_multipliers(&plan.conditions, settled, planned, planned - samples, &mut conditions);
        let from = Start {
            states: &plan.states[samples..],
            inputs: &plan.inputs[samples..],
            costates: &plan.costates[samples..],
            limit_multipliers: &plan.limits[samples..],
            condition_multipliers: &conditions,
        };
        Ok(timed(&rest, workspace, Some(&from))?.1)
    }
}

/// Thrust falls with the square of time to the weight.
fn pushes(thrust_over_weight: f64) -> Vec<Push> {
    let share = |k: usize| k as f64 / INTERVALS as f64;
    let thrust =
        |k: usize| GRAVITY_M_S2 * (thrust_over_weight - (thrust_over_weight - 1.0) * share(k) * share(k));
    let push = |thrust_m_s2: f64| Push {
        thrust_m_s2,
        turning_rad_s2: TURNING_PER_THRUST * thrust_m_s2,
        per_kg: 1.0 / MASS_KG,
    };
    (0..INTERVALS).map(|k| push(thrust(k))).collect()
}

/// Everything but start and thrust.
fn landing(terminal_penalty: f64) -> Problem {
    Problem {
        initial: [0.0; STATES],
        step_s: 0.1,
        pushes: Vec::new(),
        drag: Drag { fins: 0.05, axial: 0.003, crossflow: 0.04 },
        wind_m_s: [2.0, 0.5],
        gravity_m_s2: GRAVITY_M_S2,
        target_m: [0.0, 0.0],
        weights: Weights {
            place: 1.0,
            height: 0.0,
            velocity: [0.0; 2],
            lean: 1000.0,
            rate: 0.0,
            gimbal: 20_000.0,
            fins: 20.0,
        },
        gimbal_limit_rad: 4.5_f64.to_radians(),
        lean_max_rad: 50.0_f64.to_radians(),
        end: End {
            vertical_m_s: [-0.3, -0.05],
            lateral_m_s: 0.06,
            lean_rad: 1.0_f64.to_radians(),
            rate_rad_s: 1.0_f64.to_radians(),
            settled_nodes: 3,
        },
        floor_rise_m_s: 0.2,
        guess_lean_rad: 0.5,
        guess_towards_rad: 0.6,
        solver: SolverLimits { max_iterations: 200, kkt_tolerance: 1e-6, terminal_penalty },
    }
}
