//! Newton's method with the limits and conditions that hold taken for equations: the fast way back to an optimum from
//! close by.
//!
//! A barrier must be raised and lowered again when a limit or condition changes sides. Here each has a side, and a
//! Newton step of the equations that belong to the sides moves straight to where they would hold:
//!
//! ```text
//! input      free, or at its lower or upper limit
//! condition  held at zero, its multiplier free; or the multiplier at an end of its range (`barrier`), the value free
//! ```
//!
//! After each step an input beyond its limit is put on it and one that pulls away from its limit is let go; a held
//! condition whose multiplier leaves its range stays at the end it left by, and one that comes back to zero is held
//! again. With the sides right, this is Newton's method on the optimality conditions. It is the primal-dual active set
//! strategy (Hintermueller, Ito, Kunisch, SIAM J. Optim. 13, 2003), and costs no line search.
//!
//! Near upright, tilting changes the end height to second order only, and an equation for the height asks for far too
//! long a step. A long first step is therefore followed as far as its second order says (`bend`). Where that says
//! nothing, held conditions are springs at first (the method of multipliers: Bertsekas, *Constrained Optimization and
//! Lagrange Multiplier Methods*, 1982), stiffer with every step.
//!
//! The last step or two are so short that the second derivatives of the one before serve as well (a chord instead of
//! a tangent, Ortega and Rheinboldt, *Iterative Solution of Nonlinear Equations in Several Variables*, 1970, section
//! 7.1): that costs the sweeps of the slopes alone.
//!
//! Nothing makes this converge from afar, so it is given up after some steps, and the barrier method starts where it
//! did. `sides` has the parts of a step.

use super::Workspace;
use super::block::Constants;
use super::solver::{CURVATURE_SHARES, Outcome};
use crate::nmpc::{Problem, SolveStatus};

/// Most steps; sides that have not settled by then are going round.
const MOST_STEPS: usize = 12;

/// After so many steps, a residual this large goes nowhere.
const STRAY_STEPS: usize = 8;
const STRAY: f64 = 100.0;

/// Second derivative by a held condition's value: so stiff that a step leaves it at zero to rounding.
const STIFF: f64 = 1e9;

/// The same where a stiff step is long: the path bends before it gets there.
const SOFT: f64 = 3e3;

/// The most where a limit or condition has just changed sides.
const CHANGED: f64 = 1e5;

/// By which factor it grows from step to step.
const HARDENING: f64 = 30.0;

/// A first step of the inputs this long (rad) is.
const CAREFUL_STEP_RAD: f64 = 0.03;

/// A step of the inputs this small (rad) is likely the last: derivatives wait until it is known not to be.
const LAST_STEP_RAD: f64 = 1e-3;

/// By how much more than the ratio of their lengths a step at the second derivatives of the step before shrinks the
/// residual.
const CHORD_LOSS: f64 = 2.0;

/// A step of the inputs this large (rad) is none of a solution close by.
const LARGEST_STEP_RAD: f64 = 3.0;

impl Workspace {
    /// From `current`, a complete warm start, to the optimum.
    ///
    /// # Errors
    /// The steps and sweeps made, if that is not close by; `current` is then of no use.
    pub(super) fn pursue(
        &mut self,
        problem: &Problem,
        constants: &Constants,
        cap: usize,
    ) -> Result<Outcome, (usize, u32)> {
        self.take_sides(problem);
        let tolerance = problem.solver.kkt_tolerance;
        let mut likely_last = false;
        // The step whose second derivatives are still those of the sides.
        let mut tangent_step_rad: Option<f64> = None;
        let mut stiffness = STIFF;
        let mut softened = false;
        let mut sweeps = 0;
        for steps in 0..=MOST_STEPS.min(cap) {
            if likely_last {
                self.current.evaluate::<false>(constants, problem);
            } else {
                self.current.evaluate::<true>(constants, problem);
            }
            let (settled, residual) = self.look(problem);
            if !residual.is_finite() || steps >= STRAY_STEPS && residual > STRAY {
                return Err((steps, sweeps));
            }
            if settled && residual <= tolerance {
                let residual = self.settle(problem);
                let close = residual.largest(0.0) <= tolerance;
                return if close {
                    Ok(Outcome {
                        status: SolveStatus::Converged,
                        iterations: steps,
                        sweeps,
                        residual,
                        ..Outcome::BAD
                    })
                } else {
                    Err((steps, sweeps))
                };
            }
            if let Some(before_rad) = tangent_step_rad.filter(|_| settled) {
                self.assemble_sides(problem, stiffness);
                self.newton.sweep.backward_again(&self.current, problem.step_s);
                self.newton.sweep.forward(&self.current, problem.step_s);
                let step_rad = self.newton.largest_input_step();
                if residual * CHORD_LOSS * step_rad <= tolerance * before_rad {
                    likely_last = !self.step_sides(problem, stiffness);
                    tangent_step_rad = tangent_step_rad.filter(|_| likely_last);
                    continue;
                }
            }
            if likely_last {
                self.current.evaluate::<true>(constants, problem);
            }
            if !settled {
                stiffness = stiffness.min(CHANGED);
            }
            let Some(mut whole) = self.step_for_sides(problem, stiffness, &mut sweeps) else {
                return Err((steps, sweeps));
            };
            if !softened && self.newton.largest_input_step() > CAREFUL_STEP_RAD {
                softened = true;
                if self.bend(problem, stiffness) {
                    (likely_last, tangent_step_rad) = (false, None);
                    continue;
                }
                stiffness = SOFT;
                match self.step_for_sides(problem, stiffness, &mut sweeps) {
                    Some(right) => whole = right,
                    None => return Err((steps, sweeps)),
                }
            }
            let largest = self.newton.largest_input_step();
            if largest.is_nan() || largest > LARGEST_STEP_RAD {
                return Err((steps, sweeps));
            }
            let changed = self.step_sides(problem, stiffness);
            likely_last = !changed && largest <= LAST_STEP_RAD;
            tangent_step_rad = (likely_last && whole && stiffness >= STIFF).then_some(largest);
            stiffness = (stiffness * HARDENING).min(STIFF);
        }
        Err((MOST_STEPS.min(cap), sweeps))
    }
    /// The Newton step that belongs to the sides; whether it has the whole curvature of the dynamics, `None` without
    /// the right inertia.
    fn step_for_sides(&mut self, problem: &Problem, stiffness: f64, sweeps: &mut u32) -> Option<bool> {
        self.assemble_sides(problem, stiffness);
        let share = CURVATURE_SHARES.into_iter().position(|share| {
            *sweeps += 1;
            self.newton.factorise(problem, &self.current, share)
        })?;
        self.newton.sweep.forward(&self.current, problem.step_s);
        Some(share == 0)
    }
}
