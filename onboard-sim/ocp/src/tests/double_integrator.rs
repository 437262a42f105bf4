//! A mass that is pushed along a line: position and speed, one force. Also a bound on the work of
//! several solves.

use super::polynomial::{Polynomial, Term, at_least, equals, within};
use super::{Optimality, Solution, solved};
use crate::{Status, Workspace};

pub(super) const INTERVALS: usize = 40;
const STEP_S: f64 = 0.1;

/// From rest to rest one unit further, with the least sum of squared forces.
pub(super) fn problem(limit: f64) -> Polynomial<2, 1> {
    let one = Polynomial::<2, 1>::ONE;
    Polynomial {
        intervals: INTERVALS,
        initial: [0.0; 2],
        target: [0.0; 2],
        step_s: STEP_S,
        rates: vec![
            Term { row: 0, factor: 1.0, of: [1, one] },
            Term { row: 0, factor: 0.5 * STEP_S, of: [2, one] },
            Term { row: 1, factor: 1.0, of: [2, one] },
        ],
        path_weights: [[0.0; 2]; 2],
        end_weights: [[0.0; 2]; 2],
        input_weights: [[STEP_S]],
        ranges: [within(limit)],
        conditions: vec![equals(INTERVALS, 0, 1.0), equals(INTERVALS, 1, 0.0)],
        penalty: 100.0,
    }
}

/// The forces fall along a straight line. With `sum of u = 0` and `h^2 sum of (N/2 - 1/2 - k) u_k =
/// 1` its slope is `12 / (h^2 N (N^2 - 1))`.
#[test]
fn val_closed_form_of_the_least_effort() {
    let (workspace, outcome) = solved(&problem(10.0));
    let count = INTERVALS as f64;
    let slope = 12.0 / (STEP_S * STEP_S * count * (count * count - 1.0));
    for (k, [force]) in workspace.inputs().iter().enumerate() {
        let expected = slope * (0.5 * (count - 1.0) - k as f64);
        assert!((force - expected).abs() < 1e-7, "{k}: {force} {expected}");
    }
    assert!(outcome.miss < 1e-8);
}

/// Backwards at most at 0.3: 1.1 in four seconds is possible, 2 is not.
#[test]
fn a_floor_on_the_speed_holds_before_the_end() {
    let mut model = problem(10.0);
    model.conditions.extend((1..INTERVALS).map(|node| at_least(node, 1, -0.3)));
    for (position, reached) in [(2.1, true), (3.0, false)] {
        model.initial = [position, 0.0];
        let (workspace, outcome) = solved(&model);
        let found = Optimality::of(&model, &workspace);
        found.assert_within(1e-6);
        assert!(found.held > 10 && (outcome.miss < 1e-8) == reached, "{found:?} {outcome:?}");
    }
}

/// Limits that do not include zero.
#[test]
fn a_force_in_one_direction_only_stays_in_its_range() {
    let mut model = problem(1.0);
    (model.ranges[0].lower, model.ranges[0].upper) = (0.05, 0.4);
    model.conditions.pop();
    let (workspace, outcome) = solved(&model);
    Optimality::of(&model, &workspace).assert_within(1e-6);
    assert!(workspace.inputs().iter().all(|[force]| (0.05..=0.4).contains(force)));
    assert!(outcome.miss < 1e-8, "{outcome:?}");
}

/// An unreachable condition is missed at its penalty.
#[test]
fn a_target_out_of_reach_costs_its_penalty() {
    let model = problem(0.2);
    let (workspace, outcome) = solved(&model);
    Optimality::of(&model, &workspace).assert_within(1e-6);
    assert!(outcome.miss > 0.1, "{outcome:?}");
    assert!(workspace.condition_multipliers().any(|multiplier| multiplier.abs() >= model.penalty));
}

// A bound on the work of several solves together.

/// With one pass a cold solve evaluates its guess and ends there; with many it has the same result
/// as without a bound, bit for bit.
#[test]
fn a_solve_ends_when_its_passes_are_spent() {
    let model = problem(0.27);
    let mut free = Workspace::default();
    let whole = free.solve(&model, None);
    assert!(whole.status == Status::Converged && whole.iterations > 3, "{whole:?}");

    let mut bounded = Workspace::default();
    let mut done = Vec::new();
    for iterations in 0..=3 * whole.iterations {
        bounded.allow(Some(1 + 2 * iterations * INTERVALS));
        done.push(bounded.solve(&model, None).iterations);
    }
    assert_eq!(done[0], 0, "the guess is evaluated, and that is more than a pass");
    assert!(done.is_sorted() && done.last() == Some(&whole.iterations), "{done:?}");
    assert_eq!(Solution::of(&bounded).farthest_input(&Solution::of(&free)).to_bits(), 0.0_f64.to_bits());
}

/// Passes used by a solve are missing in the next one.
#[test]
fn solves_share_their_passes() {
    let model = problem(0.27);
    let mut workspace = Workspace::default();
    workspace.allow(Some(6 * INTERVALS));
    let first = workspace.solve(&model, None);
    assert!(workspace.is_spent() && first.status == Status::WorkLimit, "{first:?}");
    let second = workspace.solve(&model, None);
    assert!(second.iterations == 0 && second.status == Status::WorkLimit, "{second:?}");
    workspace.allow(None);
    assert_eq!(workspace.solve(&model, None).status, Status::Converged);
    assert!(!workspace.is_spent());
}
