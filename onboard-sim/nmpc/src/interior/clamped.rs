//! Newton's method that treats the active limits and conditions as equations: the fast way to an optimum that is close.
//!
//! A barrier must be raised and lowered again when a limit or condition changes sides. Here each has a side, and one
//! Newton step of the equations for these sides moves directly to the point where they would hold:
//!
//! ```text
//! input      free, or at its lower or upper limit
//! condition  held at zero, its multiplier free; or the multiplier at an end of its range (`barrier`), the value free
//! ```
//!
//! After each step an input beyond its limit is put on the limit, and an input that pulls away from its limit is
//! released. If the multiplier of a held condition leaves its range, it is put at that end of the range; a condition
//! that comes back to zero is held again. With the right sides, this is Newton's method on the optimality conditions.
//! It is the primal-dual active set strategy (Hintermueller, Ito, Kunisch, SIAM J. Optim. 13, 2003) and needs no line
//! search.
//!
//! Near upright, tilt changes the end height only to second order, so the equation for the height gives a step that is
//! far too long. Therefore `bend` shortens a long first step with its second-order terms. If that is not possible, held
//! conditions are springs at first (the method of multipliers: Bertsekas, *Constrained Optimization and Lagrange
//! Multiplier Methods*, 1982), which get stiffer with every step.
//!
//! The last one or two steps are so short that the second derivatives of the previous step are good enough (a chord
//! instead of a tangent, Ortega and Rheinboldt, *Iterative Solution of Nonlinear Equations in Several Variables*, 1970,
//! section 7.1). Such a step costs only the sweeps of the slopes.
//!
//! This method need not converge from a distant start. So it stops after some steps, and the barrier method starts from
//! the same point. `sides` has the parts of a step.

use super::Workspace;
use super::block::Constants;
use super::solver::{CURVATURE_SHARES, SolveEnd};
use crate::{Problem, SolveStatus};

/// Largest number of steps; sides that still change after it are cycling.
const MOST_STEPS: usize = 12;

/// After this many steps, a residual this large means that the method does not converge.
const STRAY_STEPS: usize = 8;
const STRAY: f64 = 100.0;

/// Second derivative by a held condition's value: so stiff that after a step the value is zero except for rounding.
const STIFF: f64 = 1e9;

/// The same if a stiff step is long, because the path bends before its end.
const SOFT: f64 = 3e3;

/// Its largest value when a limit or condition has just changed sides.
const CHANGED: f64 = 1e5;

/// Its growth factor from step to step.
const HARDENING: f64 = 30.0;

/// A first step of the inputs this long (rad) counts as long.
const CAREFUL_STEP_RAD: f64 = 0.03;

/// A step of the inputs this small (rad) is probably the last one, so derivatives are only evaluated if it is not.
const LAST_STEP_RAD: f64 = 1e-3;

/// How much more than the ratio of the step lengths a step with old second derivatives reduces the residual.
const CHORD_LOSS: f64 = 2.0;

/// After a step of the inputs this large (rad) the solution is not close.
const LARGEST_STEP_RAD: f64 = 3.0;

impl Workspace {
    /// Iterates from `current`, a complete warm start, to the optimum.
    ///
    /// # Errors
    /// The numbers of steps and sweeps, if the optimum is not close; `current` must then not be used.
    pub(super) fn pursue(
        &mut self,
        problem: &Problem,
        constants: &Constants,
        cap: usize,
    ) -> Result<SolveEnd, (usize, u32)> {
        self.take_sides(problem);
        let tolerance = problem.solver.kkt_tolerance;
        let mut likely_last = false;
        // The step whose second derivatives are still valid for the sides.
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
                    Ok(SolveEnd {
                        status: SolveStatus::Converged,
                        iterations: steps,
                        sweeps,
                        residual,
                        ..SolveEnd::BAD
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
