//! This crate solves the landing problem a second time, to check the fast solver of [`nmpc`].
//!
//! It is slow and generic, and shares only the equations of motion with the fast solver. It uses sequential quadratic
//! programming with exact second derivatives. The states are not variables: they are rolled out from the inputs, so
//! every iterate is a flyable path. One iteration:
//!
//! 1. [`nmpc::rollout`]: states and cost of the inputs, with one RK4 step per interval.
//! 2. `linearised`: tangents of every interval, and adjoint-weighted second derivatives over its RK4 stages, condensed onto
//!    the inputs, which gives gradient, Hessian and one row per end or path condition.
//! 3. `subproblem`: makes the Hessian positive definite, if possible without changing the Newton step, and solves the
//!    quadratic subproblem with elastic conditions exactly, from the last active set. If that set is too far from the
//!    right one, Clarabel finds it.
//! 4. `sqp`: searches along the step on cost plus exact penalty, with a second-order correction.
//!
//! `sqp` is also the loop around the steps, with the optimality residual and the initial inputs. A solve allocates, and
//! takes tens of milliseconds where the fast solver takes tenths of a millisecond.

mod linearised;
mod sqp;
mod subproblem;

use nmpc::{Problem, Solution, WarmStart};

/// Solves the landing problem.
pub fn solve(problem: &Problem, warm: Option<&WarmStart>) -> Solution {
    let solution = match warm.filter(|start| start.inputs_rad.len() == problem.intervals()) {
        Some(start) => sqp::solve_from(problem, start),
        None => cold(problem),
    };
    Solution { step_s: problem.step_s, ..solution }
}

fn cold(problem: &Problem) -> Solution {
    let amplitude_rad = problem.solver.guess_amplitude_rad;
    let [left, right] = [amplitude_rad, -amplitude_rad].map(|amplitude_rad| {
        let inputs_rad = sqp::bent(problem, amplitude_rad);
        sqp::solve_from(problem, &WarmStart { inputs_rad, ..WarmStart::default() })
    });
    let iterations = left.iterations + right.iterations;
    let qp_iterations = left.qp_iterations + right.qp_iterations;
    let merit = |solution: &Solution| {
        let merit = solution.cost + problem.solver.terminal_penalty * solution.condition_miss;
        if merit.is_finite() { merit } else { f64::INFINITY }
    };
    let better = if merit(&right) < merit(&left) { right } else { left };
    Solution { iterations, qp_iterations, ..better }
}

#[cfg(test)]
mod tests {
    use nalgebra::DVector;
    use proptest::prelude::*;

    use super::linearised::Linearised;
    use super::*;
    use nmpc::dynamics::PlanarState;
    use nmpc::paper::{HORIZON, problem, settled, start};
    use nmpc::rollout::Trajectory;

    /// The landing that a start with 5 deg/s does not converge to: the second cost in the solver study.
    #[test]
    fn val_solver_study_the_other_branch_from_a_turning_start() {
        let turning = PlanarState { q_rad_s: 5.0_f64.to_radians(), ..start() };
        let problem = problem(turning, HORIZON);
        let inputs_rad = sqp::bent(&problem, 0.3);
        let solution = sqp::solve_from(&problem, &WarmStart { inputs_rad, ..WarmStart::default() });
        assert!((solution.cost - 8467.22).abs() < 0.006, "{}", solution.cost);
    }

    /// Cost minus conditions times multipliers, rolled out.
    fn lagrangian(problem: &Problem, inputs_rad: &[f64], multipliers: &[f64]) -> f64 {
        let trajectory = Trajectory::of(problem, inputs_rad);
        let conditions = problem.conditions();
        let penalties: f64 =
            conditions.iter().zip(multipliers).map(|(row, y)| y * row.value(&trajectory.states)).sum();
        trajectory.cost - penalties
    }

    fn lagrangian_gradient(problem: &Problem, inputs_rad: &[f64], multipliers: &[f64]) -> DVector<f64> {
        let trajectory = Trajectory::of(problem, inputs_rad);
        Linearised::about(problem, &problem.conditions(), &trajectory, inputs_rad)
            .lagrangian_gradient(multipliers)
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 32, ..ProptestConfig::default() })]

        #[test]
        fn val_finite_differences_condensed_gradient_and_hessian(
            inputs_rad in prop::collection::vec(-0.3..0.3_f64, 6),
            multipliers in prop::collection::vec(-100.0..100.0_f64, 26),
            theta_deg in 60.0..120.0_f64,
        ) {
            let tilted = PlanarState { theta_rad: theta_deg.to_radians(), ..start() };
            let problem = Problem { altitude_min_m: Some(0.0), ..settled(tilted, 6) };
            let conditions = problem.conditions();
            prop_assert!(conditions.len() <= multipliers.len() + 5);
            let trajectory = Trajectory::of(&problem, &inputs_rad);
            let linear = Linearised::about(&problem, &conditions, &trajectory, &inputs_rad);
            let gradient = linear.lagrangian_gradient(&multipliers);
            let hessian = linear.lagrangian_hessian(&problem, &conditions, &multipliers);
            let step = 1e-5;
            for j in 0..inputs_rad.len() {
                let moved = |by: f64| {
                    let mut inputs_rad = inputs_rad.clone();
                    inputs_rad[j] += by;
                    inputs_rad
                };
                let (ahead, behind) = (moved(step), moved(-step));
                let expected =
                    (lagrangian(&problem, &ahead, &multipliers) - lagrangian(&problem, &behind, &multipliers))
                        / (2.0 * step);
                prop_assert!((gradient[j] - expected).abs() < 1e-4 * (1.0 + expected.abs()), "{} {expected}", gradient[j]);
                let column = (lagrangian_gradient(&problem, &ahead, &multipliers)
                    - lagrangian_gradient(&problem, &behind, &multipliers)) / (2.0 * step);
                for i in 0..inputs_rad.len() {
                    let error = (hessian[(i, j)] - column[i]).abs();
                    prop_assert!(error < 1e-5 * (1.0 + column.amax()), "[{i}][{j}] {} {}", hessian[(i, j)], column[i]);
                }
            }
        }
    }
}
