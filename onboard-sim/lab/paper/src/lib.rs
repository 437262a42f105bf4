//! The landing paper's problem, in a vertical plane, and its solver.
//!
//! The paper is *Definition of a Landing Strategy for a Model-Scale Reusable Rocket* (EuroGNC). The
//! program of this package repeats its experiments. Vehicles plan in space, with `ocp::landing`.
//!
//! * `plane`: the problem in general, and its solver.
//! * `problem`: the paper's numbers.

pub mod plane;
pub mod problem;
