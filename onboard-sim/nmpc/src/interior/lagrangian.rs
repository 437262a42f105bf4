//! The Lagrangian of a problem at the solution of another problem. By the envelope theorem, its derivative by a
//! parameter of dynamics, cost or conditions equals the derivative of the optimal price.

use super::Workspace;
use super::block::Constants;
use crate::{Problem, Solution};

impl Workspace {
    /// Running cost, plus costates times the defects of the dynamics, minus the conditions times their multipliers, at
    /// a solution of a problem with as many intervals; NaN if it has another number.
    pub(crate) fn lagrangian(&mut self, problem: &Problem, solution: &Solution) -> f64 {
        let count = problem.intervals();
        if solution.states.len() != count + 1 || solution.costates.len() != count + 1 {
            return f64::NAN;
        }
        self.resize(problem);
        let point = &mut self.trial;
        for (state, from) in point.states.iter_mut().zip(&solution.states) {
            *state = from.to_array();
        }
        point.inputs_rad.copy_from_slice(&solution.inputs_rad);
        point.costates.copy_from_slice(&solution.costates);
        point.evaluate::<false>(&Constants::of(&problem.model, problem.step_s), problem);
        let mut sum = point.cost(problem);
        for k in 0..count {
            for (gap, costate) in point.defect(k).iter().zip(&point.costates[k + 1]) {
                sum += gap * costate;
            }
        }
        let multipliers = solution.end_multipliers.iter().chain(&solution.floor_multipliers);
        for (condition, multiplier) in self.conditions.iter().zip(multipliers) {
            sum -= multiplier * condition.value(&point.states);
        }
        sum
    }
}
