//! Random linear dynamics with random costs of full matrices, against a dense solve.

use core::array::from_fn;

use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;

use super::polynomial::{Polynomial, Term, at_least, equals, within};
use super::{Optimality, Solution, solved};
use crate::{Model, Status};

const INTERVALS: usize = 12;

/// Least curvature of the cost, by which an error of the optimality conditions bounds the distance
/// from the optimum.
const LEAST_WEIGHT: f64 = 0.2;

/// Numbers from -1 to 1.
struct Draw(u64);

impl Draw {
    fn number(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    /// A positive definite matrix whose eigenvalues are at least [`LEAST_WEIGHT`].
    fn weights<const N: usize>(&mut self) -> [[f64; N]; N] {
        let root: [[f64; N]; N] = from_fn(|_| from_fn(|_| self.number()));
        from_fn(|i| {
            from_fn(|j| {
                let product: f64 = root[i].iter().zip(&root[j]).map(|(a, b)| a * b).sum();
                product + if i == j { LEAST_WEIGHT } else { 0.0 }
            })
        })
    }
}

fn problem<const NX: usize, const NU: usize>(seed: u64, limit: f64) -> Polynomial<NX, NU> {
    let mut draw = Draw(seed);
    let one = Polynomial::<NX, NU>::ONE;
    let mut rates = Vec::new();
    for row in 0..NX {
        for column in 0..=one {
            rates.push(Term { row, factor: draw.number(), of: [column, one] });
        }
    }
    Polynomial {
        intervals: INTERVALS,
        initial: from_fn(|_| draw.number()),
        target: from_fn(|_| draw.number()),
        step_s: 0.2,
        rates,
        path_weights: draw.weights(),
        end_weights: draw.weights(),
        input_weights: draw.weights(),
        ranges: [within(limit); NU],
        conditions: vec![equals(INTERVALS, 0, 0.3)],
        penalty: 1e4,
    }
}

/// Inputs, states and multipliers by one dense linear system: the conditions are equations, the
/// limits are left out.
fn dense<const NX: usize, const NU: usize>(model: &Polynomial<NX, NU>) -> Vec<[f64; NU]> {
    let (n, m) = (INTERVALS * (NX + NU), INTERVALS * NX + model.conditions.len());
    let (mut matrix, mut right) = (DMatrix::zeros(n + m, n + m), DVector::zeros(n + m));
    let input_at = |k: usize| k * NU;
    let state_at = |node: usize| INTERVALS * NU + (node - 1) * NX;
    let (zero, a, b) = model.step(&[0.0; NX], &[0.0; NU]);
    let mut equation = |row: usize, column: usize, value: f64| {
        matrix[(row, column)] += value;
        if row != column {
            matrix[(column, row)] += value;
        }
    };
    for k in 0..INTERVALS {
        for i in 0..NU {
            for j in 0..=i {
                equation(input_at(k) + i, input_at(k) + j, model.input_weights[i][j]);
            }
        }
        let (node, row) = (k + 1, n + k * NX);
        let weights = model.weights(node);
        let push = model.state_slope(node, &[0.0; NX]);
        for i in 0..NX {
            for (j, weight) in weights[i].iter().enumerate().take(i + 1) {
                equation(state_at(node) + i, state_at(node) + j, *weight);
            }
            right[state_at(node) + i] = -push[i];
            right[row + i] = -zero[i];
            equation(row + i, state_at(node) + i, -1.0);
            for (j, entry) in a[i].iter().enumerate() {
                if k == 0 {
                    right[row + i] -= entry * model.initial[j];
                } else {
                    equation(row + i, state_at(k) + j, *entry);
                }
            }
            for (j, entry) in b[i].iter().enumerate() {
                equation(row + i, input_at(k) + j, *entry);
            }
        }
    }
    for (index, condition) in model.conditions.iter().enumerate() {
        let row = n + INTERVALS * NX + index;
        equation(row, state_at(condition.node) + condition.component, condition.sign);
        right[row] = condition.offset;
    }
    let solution = matrix.lu().solve(&right).unwrap();
    (0..INTERVALS).map(|k| from_fn(|i| solution[input_at(k) + i])).collect()
}

fn compare<const NX: usize, const NU: usize>(seed: u64) {
    let model = problem::<NX, NU>(seed, 1e3);
    let (workspace, outcome) = solved(&model);
    assert!(outcome.miss < 1e-8, "{outcome:?}");
    for (inputs, expected) in workspace.inputs().iter().zip(dense(&model)) {
        for (one, other) in inputs.iter().zip(&expected) {
            assert!((one - other).abs() < 1e-6, "{inputs:?} {expected:?}");
        }
    }
}

fn limited<const NX: usize, const NU: usize>(seed: u64) -> usize {
    let mut model = problem::<NX, NU>(seed, 0.25);
    model.conditions.extend((1..=INTERVALS).map(|node| at_least(node, 1, -0.2)));
    let (workspace, _) = solved(&model);
    let found = Optimality::of(&model, &workspace);
    found.assert_within(1e-5);

    // A little further away, the warm solve finds the optimum, too, which is the only one.
    let solution = Solution::of(&workspace);
    model.initial[0] += 0.02;
    let (mut workspace, _) = solved(&model);
    let (cold, cold_errors) = (Solution::of(&workspace), Optimality::of(&model, &workspace));
    let outcome = workspace.solve(&model, Some(&solution.start()));
    assert_eq!(outcome.status, Status::Converged, "{outcome:?}");
    let warm_errors = Optimality::of(&model, &workspace);
    warm_errors.assert_within(1e-5);
    // Strong convexity with curvature w: for two points z whose gradients are off by at most r in
    // each of n components and whose slacks times multipliers sum up to g, w |dz|^2 <= g + r
    // sqrt(n) |dz|. A limit whose multiplier is almost zero makes use of it: there an interior
    // point is off by the root of the barrier, here by up to 1e-4.
    let components = (INTERVALS * (NX + NU)) as f64;
    let gradient = cold_errors.gradient + warm_errors.gradient;
    let bound = ((cold_errors.gap + warm_errors.gap) / LEAST_WEIGHT).sqrt()
        + gradient * components.sqrt() / LEAST_WEIGHT;
    let apart = Solution::of(&workspace).farthest_input(&cold);
    assert!(apart < bound, "{apart} {bound}");
    assert!(bound < 0.01, "the bound says something: {bound}");
    found.at_limit + found.held
}

proptest! {
    #[test]
    fn val_dense_solve_with_two_inputs(seed in any::<u64>()) {
        compare::<4, 2>(seed);
    }

    #[test]
    fn val_dense_solve_with_three_inputs(seed in any::<u64>()) {
        compare::<5, 3>(seed);
    }

    #[test]
    fn limited_inputs_and_states_meet_the_optimality_conditions(seed in any::<u64>()) {
        limited::<4, 2>(seed);
        limited::<5, 3>(seed);
    }
}

/// A limit whose multiplier is almost zero: the cold solve's inputs are 1.06e-4 from the warm
/// one's.
#[test]
fn limits_that_are_hardly_active() {
    limited::<5, 3>(17_605_430_316_556_728_362);
}

#[test]
fn the_random_limits_are_reached() {
    assert!((0..20).map(limited::<4, 2>).sum::<usize>() > 100);
}
