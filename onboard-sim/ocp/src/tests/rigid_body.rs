//! A rigid body under a constant thrust along its axis, turned by three torques: 13 states, 3
//! inputs. Also the sweeps alone.

use super::polynomial::{Polynomial, Term, diagonal, equals, within};
use super::{Optimality, Solution, solved};
use crate::{Status, Workspace};

/// Positions, velocities, the quaternion (scalar first) from body to ground, and the rates of the
/// body.
const R: usize = 0;
const V: usize = 3;
const Q: usize = 6;
const W: usize = 10;
/// The torques, and the 1.
const T: usize = 13;
const ONE: usize = 16;

const INTERVALS: usize = 40;
const GRAVITY_M_S2: f64 = 9.81;
const INERTIA_KG_M2: [f64; 3] = [0.12, 0.15, 0.03];

/// Flies to a place in front and to the side in two seconds, and arrives upright and at rest there.
pub(super) fn problem(limit_n_m: f64) -> Polynomial<13, 3> {
    let mut rates = Vec::new();
    let mut add = |row, factor, of| rates.push(Term { row, factor, of });
    for (i, inertia) in INERTIA_KG_M2.into_iter().enumerate() {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        add(R + i, 1.0, [V + i, ONE]);
        // q' = q (0, w) / 2.
        add(Q, -0.5, [Q + 1 + i, W + i]);
        add(Q + 1 + i, 0.5, [Q, W + i]);
        add(Q + 1 + i, 0.5, [Q + 1 + j, W + k]);
        add(Q + 1 + i, -0.5, [Q + 1 + k, W + j]);
        // Euler's equations.
        add(W + i, (INERTIA_KG_M2[j] - INERTIA_KG_M2[k]) / inertia, [W + j, W + k]);
        add(W + i, 1.0 / inertia, [T + i, ONE]);
    }
    // The thrust acts along the body's third axis.
    let thrust_m_s2 = 1.02 * GRAVITY_M_S2;
    add(V, 2.0 * thrust_m_s2, [Q + 1, Q + 3]);
    add(V, 2.0 * thrust_m_s2, [Q, Q + 2]);
    add(V + 1, 2.0 * thrust_m_s2, [Q + 2, Q + 3]);
    add(V + 1, -2.0 * thrust_m_s2, [Q, Q + 1]);
    for (component, sign) in [(0, 1.0), (1, -1.0), (2, -1.0), (3, 1.0)] {
        add(V + 2, sign * thrust_m_s2, [Q + component, Q + component]);
    }
    add(V + 2, -GRAVITY_M_S2, [ONE, ONE]);

    let mut upright = [0.0; 13];
    upright[Q] = 1.0;
    let mut target = upright;
    (target[R], target[R + 1]) = (0.6, -0.4);
    let weights = [1.0, 1.0, 4.0, 0.5, 0.5, 2.0, 0.0, 1.0, 1.0, 2.0, 0.2, 0.2, 0.2];
    let mut conditions: Vec<_> = [R, R + 1, V, V + 1].map(|i| equals(INTERVALS, i, target[i])).to_vec();
    conditions.extend([Q + 1, Q + 2, W, W + 1].map(|i| equals(INTERVALS, i, 0.0)));
    Polynomial {
        intervals: INTERVALS,
        initial: upright,
        target,
        step_s: 0.05,
        rates,
        path_weights: diagonal(&weights.map(|weight| 0.05 * weight)),
        end_weights: diagonal(&weights),
        input_weights: diagonal(&[0.5; 3]),
        ranges: [within(limit_n_m); 3],
        conditions,
        penalty: 1e3,
    }
}

#[test]
fn a_turning_flight_meets_the_optimality_conditions() {
    for (limit_n_m, limited) in [(5.0, false), (0.2, true)] {
        let model = problem(limit_n_m);
        let (workspace, outcome) = solved(&model);
        let found = Optimality::of(&model, &workspace);
        println!("{limit_n_m} N m: {outcome:?} {found:?}");
        found.assert_within(1e-6);
        assert!(outcome.miss < 1e-6, "{outcome:?}");
        assert_eq!(found.at_limit > 5, limited, "{found:?}");
    }
}

#[test]
fn inputs_alone_are_a_start() {
    let model = problem(0.2);
    let (mut workspace, _) = solved(&model);
    let cold = Solution::of(&workspace);
    let start = crate::Start {
        states: &[],
        costates: &[],
        limit_multipliers: &[],
        condition_multipliers: &[],
        ..cold.start()
    };
    let outcome = workspace.solve(&model, Some(&start));
    assert_eq!(outcome.status, Status::Converged, "{outcome:?}");
    assert!(Solution::of(&workspace).farthest_input(&cold) < 1e-4);
}

#[test]
fn a_used_workspace_gives_the_same_bits_and_does_not_allocate() {
    let model = problem(0.2);
    let (fresh, _) = solved(&model);
    let plan = Solution::of(&fresh);
    let mut other = model.clone();
    other.initial[V] = 0.3;
    let mut used = Workspace::default();
    used.solve(&other, None);
    let allocated = allocation_counter::measure(|| {
        used.solve(&other, Some(&plan.start()));
        used.lagrangian(&other, &plan.start());
        used.solve(&model, None);
    });
    assert_eq!(allocated.count_total, 0);
    assert_eq!(format!("{:?}", used.states()), format!("{:?}", fresh.states()));
    assert_eq!(used.inputs(), fresh.inputs());
    assert_eq!(used.costates(), fresh.costates());
}

#[test]
fn numbers_that_are_not_finite_give_a_status_and_not_a_panic() {
    for bad in [f64::NAN, f64::INFINITY, 1e300] {
        let mut model = problem(0.2);
        model.initial[V] = bad;
        assert_ne!(Workspace::default().solve(&model, None).status, Status::Converged);
    }
}

// The sweeps alone.

/// States and costates satisfy their equations by construction of the sweeps. If the inputs satisfy
/// theirs, too, the step solves the complete Newton system.
#[test]
fn the_sweeps_solve_the_newton_system() {
    let mut model = problem(0.2);
    let plan = Solution::of(&solved(&model).0);
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
    let plan = Solution::of(&solved(&model).0);
    let mut workspace = Workspace::default();
    workspace.load(&model, &plan.start());
    workspace.evaluate_intervals(&model);
    workspace.sweep(&model);
    let (sweep, current) = (&mut workspace.newton.sweep, &workspace.current);
    let wide = (sweep.states.clone(), sweep.inputs.clone(), sweep.costates.clone());
    assert!(sweep.eliminate(current));
    sweep.substitute(current);
    assert_eq!(wide, (sweep.states.clone(), sweep.inputs.clone(), sweep.costates.clone()));
    sweep.backward_again(current);
    sweep.forward(current);
    let wide = (sweep.states.clone(), sweep.inputs.clone(), sweep.costates.clone());
    sweep.eliminate_again(current);
    sweep.substitute(current);
    assert_eq!(wide, (sweep.states.clone(), sweep.inputs.clone(), sweep.costates.clone()));
}
