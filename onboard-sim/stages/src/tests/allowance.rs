//! A bound on the work of several solves together.

use super::Kept;
use super::double_integrator::{INTERVALS, problem};
use crate::{Status, Workspace};

/// With one pass a cold solve evaluates its guess and ends there; with many it finds what it finds without a bound, bit for bit.
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
    assert_eq!(Kept::of(&bounded).farthest_input(&Kept::of(&free)).to_bits(), 0.0_f64.to_bits());
}

/// What a solve has spent is missing in the next one.
#[test]
fn solves_share_their_passes() {
    let model = problem(0.27);
    let mut workspace = Workspace::default();
    workspace.allow(Some(6 * INTERVALS));
    let first = workspace.solve(&model, None);
    assert!(workspace.is_spent() && first.status == Status::IterationLimit, "{first:?}");
    let second = workspace.solve(&model, None);
    assert!(second.iterations == 0 && second.status == Status::IterationLimit, "{second:?}");
    workspace.allow(None);
    assert_eq!(workspace.solve(&model, None).status, Status::Converged);
    assert!(!workspace.is_spent());
}
