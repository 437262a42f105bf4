//! Solves the landing problem with a stage-structured primal-dual interior-point method with exact Hessians.
//!
//! # Formulation
//!
//! Over the nodes `k = 0..N` of the horizon, states `x_k = (x, z, theta, u, w, q)` and gimbal angles `delta_k` are
//! variables alike (multiple shooting), `F` one RK4 step with `delta` held, `Q`, `P` the weights of Eq. 28, `h` the
//! sampling time:
//!
//! ```text
//! minimise    sum over k = 1..N of  h (x^_k' Q x^_k + P delta_{k-1}^2) / 2  +  M (violations of the conditions)
//! subject to  x_{k+1} = F_k(x_k, delta_k),   x_0 given,   |delta_k| <= delta_max
//! ```
//!
//! `z_N = 0`, `|x_N| <= x_max` and the other conditions are exact penalties at the price `M` (`barrier`). So the
//! problem always has a solution, and an unreachable condition is missed by as little as the price allows.
//!
//! # Steps of an iteration
//!
//! 1. `block`, `interval`, `tangent`: compute `F`, its derivatives `A_k`, `b_k`, and the second derivative of
//!    `lambda_{k+1}' F_k` at all nodes, several at once in vector registers (`lanes`).
//! 2. `residual`: stops if the optimality conditions hold; lowers the barrier `mu` if its problem is solved.
//! 3. `newton`: eliminates slacks and limit multipliers, which leaves diagonal terms at the nodes.
//! 4. `riccati`: computes the Newton step by a backward and a forward sweep with the exact Hessian (rows from `rows`).
//!    With one input, the inertia is right exactly if one scalar per stage is positive. If it is not, the sweep runs
//!    again with half the dynamics' curvature, and then without it.
//! 5. `newton`: finds the longest fractions of the step that keep slacks and multipliers positive, primal and dual
//!    separately.
//! 6. `filter`: halves the step until defects or objective make progress.
//!
//! `solver` is the loop. A cold solve runs it from two bent guesses (`start`). A warm solve (`warm`) takes over states,
//! inputs and all multipliers, and first checks whether they are still optimal. If not, it treats the active limits and
//! conditions as equations (`clamped`), which needs no barrier and no line search. If that does not converge, the loop
//! starts at the last barrier, and raises it once if the first step shows that many limits and conditions must change
//! sides. Iterations are capped; there is no clock.
//!
//! Derivatives and sweeps are compiled twice, for plain and for wider vectors, and the program uses the widest that the
//! machine has (`pulp`). Both execute the same operations in the same order and fuse none, so the bits are the same.
//!
//! # References
//!
//! * Rawlings, Mayne, Diehl, *Model Predictive Control: Theory, Computation, and Design*, 2nd ed. 2017, chapter 8.
//! * Bock, Plitt, "A multiple shooting algorithm for direct solution of optimal control problems", IFAC 1984.
//! * Rao, Wright, Rawlings, "Application of interior-point methods to model predictive control", JOTA 99, 1998: the
//!   sweeps.
//! * Waechter, Biegler, "On the implementation of an interior-point filter line-search algorithm for large-scale
//!   nonlinear programming", Math. Program. 106, 2006: barrier updates, fractions, filter.
//! * Frison, Diehl, "HPIPM: a high-performance quadratic programming framework for model predictive control", IFAC
//!   2020: fixed-size stage kernels.

mod barrier;
mod bend;
mod block;
mod clamped;
mod filter;
mod interval;
mod iterate;
mod lagrangian;
mod lanes;
mod layers;
mod newton;
mod residual;
mod riccati;
mod rows;
mod sides;
mod solver;
mod start;
mod tangent;
mod warm;

pub use solver::Workspace;

#[cfg(test)]
mod tests;
