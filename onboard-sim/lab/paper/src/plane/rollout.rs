//! States and cost of a sequence of inputs.


use super::Problem;
use super::problem::Condition;
use crate::plane::dynamics::along;

/// Weights of the four RK4 stages.
pub const STAGE_WEIGHTS: [f64; 4] = [1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0];

/// Position of each RK4 stage after the first along the slope of the previous stage.
pub const STAGE_STEPS: [f64; 3] = [0.5, 0.5, 1.0];

/// The path of a sequence of inputs.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    /// States at the nodes, one more than inputs, in state order, SI and radians.
    pub states: Vec<[f64; 6]>,
    /// Running cost: each interval's length times the cost rate at its final state and its input. A sum over the ends
    /// of the intervals leaves out the initial state, which no input can change, and includes the touchdown.
    pub cost: f64,
}

/// The states of the four RK4 stages of interval `k` and the state after it.
pub fn stages(problem: &Problem, k: usize, state: &[f64; 6], gimbal_rad: f64) -> ([[f64; 6]; 4], [f64; 6]) {
    let (step_s, thrust_n, model) = (problem.step_s, problem.thrust_n[k], problem.model_at(k));
    let mut points = [*state; 4];
    let mut next = *state;
    for stage in 0..4 {
        let slope = model.derivative(&points[stage], gimbal_rad, thrust_n);
        if let Some(along_step) = STAGE_STEPS.get(stage) {
            points[stage + 1] = along(state, &slope, along_step * step_s);
        }
        next = along(&next, &slope, STAGE_WEIGHTS[stage] * step_s);
    }
    (points, next)
}

impl Trajectory {
    /// Rolls the inputs out from the problem's initial state.
    pub fn of(problem: &Problem, inputs_rad: &[f64]) -> Self {
        let mut state = problem.initial.to_array();
        let mut states = Vec::with_capacity(inputs_rad.len() + 1);
        states.push(state);
        let mut cost = 0.0;
        for (k, gimbal_rad) in inputs_rad.iter().enumerate().take(problem.intervals()) {
            let (_, next) = stages(problem, k, &state, *gimbal_rad);
            cost += problem.step_s * problem.cost_rate(&next, *gimbal_rad);
            state = next;
            states.push(state);
        }
        Self { states, cost }
    }

    /// Cost plus the penalty of every broken condition; infinite if the path is not finite.
    pub fn merit(&self, conditions: &[Condition], penalty: f64) -> f64 {
        let broken: f64 = conditions.iter().map(|row| row.violation(row.value(&self.states))).sum();
        let merit = self.cost + penalty * broken;
        if merit.is_finite() { merit } else { f64::INFINITY }
    }

    /// The largest violation of any condition, m.
    pub fn worst_violation(&self, conditions: &[Condition]) -> f64 {
        conditions.iter().map(|row| row.violation(row.value(&self.states))).fold(0.0, f64::max)
    }
}
