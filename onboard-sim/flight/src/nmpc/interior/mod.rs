//! The landing problem solved along its stages: a primal-dual interior-point Newton method with exact Hessians.
//!
//! # Formulation
//!
//! Over the nodes `k = 0..N` of the horizon, states `x_k = (x, z, theta, u, w, q)` and gimbal angles `delta_k` are
//! variables alike (multiple shooting), `F` one RK4 step with `delta` held, `Q`, `P` the weights of Eq. 28, `h` the
//! sampling time:
//!
//! ```text
//! minimise    sum over k = 1..N of  h (x^_k' Q x^_k + P delta_{k-1}^2) / 2  +  M (what conditions are broken by)
//! subject to  x_{k+1} = F_k(x_k, delta_k),   x_0 given,   |delta_k| <= delta_max
//! ```
//!
//! `z_N = 0`, `|x_N| <= x_max` and the other conditions are exact penalties at the price `M` (`barrier`): the problem
//! always has a solution, and what is out of reach is missed by as little as the price allows.
//!
//! # Steps of an iteration
//!
//! 1. `block`, `interval`, `tangent`: `F`, its derivatives `A_k`, `b_k`, and the second derivative of `lambda_{k+1}' F_k`, all
//!    nodes, several at once in vector registers (`lanes`).
//! 2. `residual`: stop if the optimality conditions hold; lower the barrier `mu` if its problem is solved.
//! 3. `newton`: slacks and limit multipliers eliminated, which leaves diagonal terms at the nodes.
//! 4. `riccati`: the Newton step by a backward and a forward sweep, exact Hessian. With one input, the inertia is
//!    right exactly if one scalar a stage is positive; if not, again with half the dynamics' curvature, then without.
//! 5. `newton`: the longest fractions of the step that keep slacks and multipliers positive, primal and dual apart.
//! 6. `filter`: the step is halved until defects or objective make progress.
//!
//! `solver` is the loop. A cold solve runs it from two bent guesses (`start`). A warm one (`warm`) carries states,
//! inputs and every multiplier over and first looks whether they are still optimal. If not, it takes the limits and
//! conditions that hold for equations (`clamped`), which needs no barrier and no line search; where that does not
//! converge, the loop starts at the last barrier, and raises it once if the first step shows that many limits and
//! conditions must change sides. Iterations are capped; there is no clock.
//!
//! Derivatives and sweeps are compiled twice, for plain vectors and for wider ones, and the program takes what the
//! machine has (`pulp`). Both do the same operations in the same order and fuse none, so the bits are the same.
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
