//! The structure-exploiting interior-point method.

mod barrier;
mod filter;
mod guess;
mod interval;
mod iterate;
mod lanes;
mod newton;
mod residual;
mod riccati;
mod solver;

pub use solver::{TRACE, Workspace};
