//! The sweeps alone.

use super::rigid_body::problem;
use super::{Kept, solved};
use crate::Workspace;

/// States and costates satisfy their equations by construction of the sweeps. If the inputs satisfy theirs, too, the
/// step solves the whole Newton system.
#[test]
fn the_sweeps_solve_the_newton_system() {
    let mut model = problem(0.2);
    let plan = Kept::of(&solved(&model).0);
    for kick in [0.0, 0.3, -0.5] {
        model.initial[3] = kick;
        let mut workspace = Workspace::default();
        workspace.load(&model, &plan.start());
        workspace.evaluate_intervals(&model);
        assert!(workspace.sweep(&model));
        for k in 0..model.intervals {
            for left in workspace.newton.sweep.input_residual(&workspace.current, k) {
                assert!(left.abs() < 1e-6, "{k}: {left}");
            }
        }
    }
}

/// Compares the sweeps in this machine's widest vectors with those in plain vectors.
#[test]
fn the_width_of_the_vectors_does_not_change_any_bit() {
    let model = problem(0.2);
    let plan = Kept::of(&solved(&model).0);
    let mut workspace = Workspace::default();
    workspace.load(&model, &plan.start());
    workspace.evaluate_intervals(&model);
    workspace.sweep(&model);
    let (sweep, current) = (&mut workspace.newton.sweep, &workspace.current);
    let wide = (sweep.states.clone(), sweep.inputs.clone(), sweep.costates.clone());
    assert!(sweep.eliminate(pulp::Scalar, current));
    sweep.substitute(current);
    assert_eq!(wide, (sweep.states.clone(), sweep.inputs.clone(), sweep.costates.clone()));
    sweep.backward_again(current);
    sweep.forward(current);
    let wide = (sweep.states.clone(), sweep.inputs.clone(), sweep.costates.clone());
    sweep.eliminate_again(current);
    sweep.substitute(current);
    assert_eq!(wide, (sweep.states.clone(), sweep.inputs.clone(), sweep.costates.clone()));
}
