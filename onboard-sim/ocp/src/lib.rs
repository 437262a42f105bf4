//! Solves optimal-control problems over a horizon of stages with a primal-dual interior-point
//! method with exact Hessians. A [`Model`] defines the problem. The numbers of states and inputs
//! are compile-time constants.
//!
//! # Formulation
//!
//! Over the nodes `k = 0..N` of the horizon, states `x_k` and inputs `u_k` are variables alike
//! (multiple shooting):
//!
//! ```text
//! minimise    sum over nodes of L_k(x_k)  +  sum over intervals of R_k(u_k)
//!             +  M (violations of the conditions)
//! subject to  x_{k+1} = F_k(x_k, u_k),   x_0 given,   lower <= u_k <= upper
//! ```
//!
//! [`Condition`]s on states (a floor, a box at the end) are exact penalties at the penalty `M`
//! (`barrier`). So the problem always has a solution, and an unreachable condition is missed by as
//! little as the penalty allows. A condition whose multiplier stays below the penalty holds
//! exactly, so a high penalty makes it a hard one.
//!
//! There is no cost of products of states and inputs, no condition on several components at once,
//! and input limits are the same in all intervals. An additional state can replace a missing
//! feature.
//!
//! [`Dense`] intervals are enough for a new model; the tests' `polynomial` is one. [`landing`] has
//! one whose matrices have a structure.
//!
//! The built-in tolerances suit states, and inputs in their [`unit`](InputRange::unit), whose
//! changes are of the order of one.
//!
//! # Steps of an iteration
//!
//! 1. [`Model::evaluate`]: compute `F`, its derivatives `A_k`, `B_k`, and the second derivative of
//!    `lambda_{k+1}' F_k` in all intervals.
//! 2. `iterate`: stops if the optimality conditions hold; lowers the barrier `mu` if its problem is
//!    solved.
//! 3. `newton`: eliminates slacks and limit multipliers, which leaves diagonal terms at the nodes.
//! 4. `riccati`: computes the Newton step by a backward and a forward sweep with the exact Hessian.
//!    In the backward sweep an interval eliminates itself ([`Interval::eliminate`]). The inertia is
//!    right exactly if one matrix per stage, with a row for each input, is positive definite. If it
//!    is not, the sweep runs again with less of the dynamics' curvature, and last without it.
//! 5. `newton`: finds the longest fractions of the step that keep slacks and multipliers positive,
//!    primal and dual separately.
//! 6. `newton`: halves the step until defects or objective make progress. At each barrier it takes
//!    a few whole steps without progress.
//!
//! `solver` is the loop. A cold solve runs it from the model's guesses (`start`). A warm solve
//! takes over states, inputs and all multipliers, and first checks whether they are still optimal.
//! If not, it treats the active limits and conditions as equations (`clamped`), which needs no
//! barrier and no line search. A solve that may take only a few iterations ends with that. If it
//! does not converge, the loop starts from the earlier solution at a barrier of 1. If a step is
//! nearly blocked at a small barrier, the barrier is raised once. Iterations are capped; there is
//! no clock.
//!
//! The sweeps are compiled twice, for plain and for wider vectors, and the program uses the widest
//! that the machine has (`pulp`). Both execute the same operations in the same order and fuse none,
//! so the bits are the same.
//!
//! # References
//!
//! * Rawlings, Mayne, Diehl, *Model Predictive Control: Theory, Computation, and Design*, 2nd ed.
//!   2017, chapter 8.
//! * Bock, Plitt, "A multiple shooting algorithm for direct solution of optimal control problems",
//!   IFAC 1984.
//! * Rao, Wright, Rawlings, "Application of interior-point methods to model predictive control",
//!   JOTA 99, 1998: the sweeps.
//! * Waechter, Biegler, "On the implementation of an interior-point filter line-search algorithm
//!   for large-scale nonlinear programming", Math. Program. 106, 2006: barrier updates, fractions,
//!   filter.
//! * Frison, Diehl, "HPIPM: a high-performance quadratic programming framework for model predictive
//!   control", IFAC 2020: fixed-size stage kernels.

#![cfg_attr(not(test), no_std)]

extern crate alloc;

/// Empty buffers, for any model: a derived default would require one of the model, too.
macro_rules! empty {
    ($name:ident { $($field:ident),+ }) => {
        impl<M: Model<NX, NU>, const NX: usize, const NU: usize> Default for $name<M, NX, NU> {
            fn default() -> Self {
                Self { $($field: Default::default()),+ }
            }
        }
    };
}

mod barrier;
mod clamped;
mod dense;
mod intervals;
mod iterate;
pub mod landing;
mod model;
mod newton;
mod riccati;
mod sides;
mod solver;
mod start;

pub use dense::{Dense, DenseIntervals, Factor, add_multiple};
pub use intervals::{Curvature, Feedback, Hessian, Interval, Intervals, Stage};
pub use iterate::{larger, smaller};
pub use model::{Condition, InputRange, Model, Settings};
pub use solver::Workspace;
pub use start::{Outcome, Start, Status};

#[cfg(test)]
mod tests;
