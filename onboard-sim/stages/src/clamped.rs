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
//! Where inputs change a held condition only to second order, its equation gives a step that is far too long. Therefore
//! `bend` shortens a long first step with its second-order terms. If that is not possible, held conditions are springs
//! at first (the method of multipliers: Bertsekas, *Constrained Optimization and Lagrange Multiplier Methods*, 1982),
//! which get stiffer with every step.
//!
//! The last one or two steps are so short that the second derivatives of the previous step are good enough (a chord
//! instead of a tangent, Ortega and Rheinboldt, *Iterative Solution of Nonlinear Equations in Several Variables*, 1970,
//! section 7.1). Such a step costs only the sweeps of the slopes.
//!
//! This method need not converge from a distant start. So it stops after some steps, and the barrier method starts from
//! the same point. `sides` has the parts of a step.

use crate::model::Model;
use crate::outcome::{SolveEnd, Status};
use crate::solver::{CURVATURE_SHARES, Workspace};

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

/// A first step of the inputs this long, in their units, counts as long.
const CAREFUL_STEP: f64 = 0.03;

/// A step of the inputs this small, in their units, is probably the last one, so derivatives are only evaluated if it
/// is not.
const LAST_STEP: f64 = 1e-3;

/// How much more than the ratio of the step lengths a step with old second derivatives reduces the residual.
const CHORD_LOSS: f64 = 2.0;

/// After a step of the inputs this large, in their units, the solution is not close.
const LARGEST_STEP: f64 = 3.0;

impl<M: Model<NX, NU>, const NX: usize, const NU: usize> Workspace<M, NX, NU> {
    /// Iterates from `current`, a complete warm start, to the optimum.
    ///
    /// With few iterations it may end at their limit, with `current` after so many steps.
    ///
    /// # Errors
    /// The numbers of steps and sweeps, if the optimum is not close; `current` must then not be used.
    pub(crate) fn pursue(&mut self, model: &M, cap: usize) -> Result<SolveEnd, (usize, u32)> {
        // Half of the iterations are reserved for the methods that can start from further away. Of few there is nothing to
        // reserve: none of those methods is nearer to the optimum after so few.
        let few = cap < MOST_STEPS;
        let most = if few { cap } else { MOST_STEPS.min(cap / 2) };
        self.take_sides(model);
        let tolerance = model.settings().tolerance;
        let mut likely_last = false;
        // The step whose second derivatives are still valid for the sides.
        let mut tangent_step: Option<f64> = None;
        let mut stiffness = STIFF;
        let mut softened = false;
        let mut sweeps = 0;
        for steps in 0..=most {
            if likely_last {
                self.current.evaluate(model, false);
            } else {
                self.differentiate(model);
            }
            let (settled, residual) = self.look(model);
            if !residual.is_finite() || steps >= STRAY_STEPS && residual > STRAY {
                return Err((steps, sweeps));
            }
            if settled && residual <= tolerance {
                let residual = self.settle(model);
                let close = residual.largest(0.0) <= tolerance;
                return if close {
                    Ok(SolveEnd {
                        status: Status::Converged,
                        iterations: steps,
                        sweeps,
                        residual,
                        ..SolveEnd::BAD
                    })
                } else {
                    Err((steps, sweeps))
                };
            }
            if self.allowance.is_spent() {
                return Err((steps, sweeps));
            }
            if few && steps == most {
                let residual = self.settle(model);
                let status = Status::IterationLimit;
                return Ok(SolveEnd { status, iterations: steps, sweeps, residual, ..SolveEnd::BAD });
            }
            if let Some(before) = tangent_step.filter(|_| settled) {
                self.assemble_sides(model, stiffness);
                self.newton.sweep.backward_again(&self.current);
                self.newton.sweep.forward(&self.current);
                let step = self.newton.largest_input_step(model);
                if residual * CHORD_LOSS * step <= tolerance * before {
                    likely_last = !self.step_sides(model, stiffness);
                    tangent_step = tangent_step.filter(|_| likely_last);
                    continue;
                }
            }
            if likely_last {
                self.differentiate(model);
            }
            if !settled {
                stiffness = stiffness.min(CHANGED);
            }
            let Some(mut whole) = self.step_for_sides(model, stiffness, &mut sweeps) else {
                return Err((steps, sweeps));
            };
            if !softened && self.newton.largest_input_step(model) > CAREFUL_STEP {
                softened = true;
                if self.bend(model, stiffness) {
                    (likely_last, tangent_step) = (false, None);
                    continue;
                }
                stiffness = SOFT;
                match self.step_for_sides(model, stiffness, &mut sweeps) {
                    Some(right) => whole = right,
                    None => return Err((steps, sweeps)),
                }
            }
            let largest = self.newton.largest_input_step(model);
            if largest.is_nan() || largest > LARGEST_STEP {
                return Err((steps, sweeps));
            }
            let changed = self.step_sides(model, stiffness);
            likely_last = !changed && largest <= LAST_STEP;
            tangent_step = (likely_last && whole && stiffness >= STIFF).then_some(largest);
            stiffness = (stiffness * HARDENING).min(STIFF);
        }
        Err((most, sweeps))
    }

    /// The Newton step that belongs to the sides; whether it has the whole curvature of the dynamics, `None` without
    /// the right inertia.
    fn step_for_sides(&mut self, model: &M, stiffness: f64, sweeps: &mut u32) -> Option<bool> {
        self.assemble_sides(model, stiffness);
        let share = CURVATURE_SHARES.into_iter().position(|share| {
            *sweeps += 1;
            self.allowance.spend(model.intervals());
            self.newton.sweep.backward(&self.current, share)
        })?;
        self.newton.sweep.forward(&self.current);
        Some(share == 0)
    }
}
