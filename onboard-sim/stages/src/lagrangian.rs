//! The Lagrangian of a problem at the solution of another problem. By the envelope theorem, its derivative by a
//! parameter of dynamics, cost or conditions equals the derivative of the optimal price.

use crate::model::Model;
use crate::solver::Workspace;
use crate::start::Start;

impl<M: Model<NX, NU>, const NX: usize, const NU: usize> Workspace<M, NX, NU> {
    /// Cost, plus costates times the defects of the dynamics, minus the conditions times their multipliers, at a
    /// solution of a problem with as many intervals; NaN if it has another number.
    pub fn lagrangian(&mut self, model: &M, solution: &Start<NX, NU>) -> f64 {
        let count = model.intervals();
        if solution.states.len() != count + 1 || solution.costates.len() != count + 1 {
            return f64::NAN;
        }
        self.resize(model);
        let point = &mut self.trial;
        point.states.copy_from_slice(solution.states);
        point.inputs.copy_from_slice(solution.inputs);
        point.costates.copy_from_slice(solution.costates);
        point.evaluate(model, false);
        let mut sum = point.cost(model);
        for k in 0..count {
            for (gap, costate) in point.defect(k).iter().zip(&point.costates[k + 1]) {
                sum += gap * costate;
            }
        }
        for (condition, multiplier) in self.conditions.iter().zip(solution.condition_multipliers) {
            sum -= multiplier * condition.value(&point.states);
        }
        sum
    }
}
