//! The solver on problems of several sizes: 2 states and 1 input, 4 and 2, 5 and 3, 13 and 3.

mod allowance;
mod double_integrator;
mod linear_quadratic;
mod optimality;
mod polynomial;
mod rigid_body;
mod sweeps;

use crate::{Model, Outcome, Start, Status, Workspace};

/// Solves, and expects convergence.
fn solved<M: Model<NX, NU>, const NX: usize, const NU: usize>(model: &M) -> (Workspace<M, NX, NU>, Outcome) {
    let mut workspace = Workspace::default();
    let outcome = workspace.solve(model, None);
    assert_eq!(outcome.status, Status::Converged, "{outcome:?}");
    (workspace, outcome)
}

/// A solution, kept.
struct Kept<const NX: usize, const NU: usize> {
    states: Vec<[f64; NX]>,
    inputs: Vec<[f64; NU]>,
    costates: Vec<[f64; NX]>,
    limit_multipliers: Vec<[[f64; 2]; NU]>,
    condition_multipliers: Vec<f64>,
}

impl<const NX: usize, const NU: usize> Kept<NX, NU> {
    fn of<M: Model<NX, NU>>(workspace: &Workspace<M, NX, NU>) -> Self {
        Self {
            states: workspace.states().to_vec(),
            inputs: workspace.inputs().to_vec(),
            costates: workspace.costates().to_vec(),
            limit_multipliers: workspace.limit_multipliers().collect(),
            condition_multipliers: workspace.condition_multipliers().collect(),
        }
    }

    fn start(&self) -> Start<'_, NX, NU> {
        let Self { states, inputs, costates, limit_multipliers, condition_multipliers } = self;
        Start { states, inputs, costates, limit_multipliers, condition_multipliers }
    }

    /// Largest difference between the inputs.
    fn farthest_input(&self, other: &Self) -> f64 {
        let pairs = self.inputs.as_flattened().iter().zip(other.inputs.as_flattened());
        pairs.fold(0.0, |most, (one, other)| most.max((one - other).abs()))
    }
}
