//! Newton's method that treats the active limits and conditions as equations: the fast way to an
//! optimum that is close.
//!
//! A barrier must be raised and lowered again when a limit or condition changes sides. Here each
//! has a side, and one Newton step of the equations for these sides moves directly to the point
//! where they would hold:
//!
//! ```text
//! input      free, or at its lower or upper limit
//! condition  held at zero, its multiplier free;
//!            or the multiplier at an end of its range (`barrier`), the value free
//! ```
//!
//! After each step an input beyond its limit is put on the limit, and an input that pulls away from
//! its limit is released. If the multiplier of a held condition leaves its range, it is put at that
//! end of the range; a condition that comes back to zero is held again. With the right sides, this
//! is Newton's method on the optimality conditions. It is the primal-dual active set strategy
//! (Hintermueller, Ito, Kunisch, SIAM J. Optim. 13, 2003) and needs no line search.
//!
//! Where inputs change a held condition only to second order, its equation gives a step that is far
//! too long. Therefore `bend` shortens a long first step with its second-order terms. If that is
//! not possible, held conditions are springs at first (the method of multipliers: Bertsekas,
//! *Constrained Optimization and Lagrange Multiplier Methods*, 1982), which get stiffer with every
//! step.
//!
//! The last one or two steps are so short that the second derivatives of the previous step are good
//! enough (a chord instead of a tangent, Ortega and Rheinboldt, *Iterative Solution of Nonlinear
//! Equations in Several Variables*, 1970, section 7.1). Such a step costs only the sweeps of the
//! slopes.
//!
//! This method need not converge from a distant start. So it stops after some steps, and the
//! barrier method starts from the same point. `sides` has the parts of a step.

use crate::barrier::LAST_BARRIER;
use crate::model::Model;
use crate::sides::Role;
use crate::solver::{CURVATURE_SHARES, Workspace};
use crate::start;
use crate::start::{SolveEnd, Start, Status};

/// Largest number of steps; sides that still change after it are cycling.
const MOST_STEPS: usize = 12;

/// After this many steps, a residual this large means that the method does not converge.
const STRAY_STEPS: usize = 8;
const STRAY: f64 = 100.0;

/// Second derivative by a held condition's value: so stiff that after a step the value is zero
/// except for rounding.
const STIFF: f64 = 1e9;

/// The same if a stiff step is long, because the path bends before its end.
const SOFT: f64 = 3e3;

/// Its largest value when a limit or condition has just changed sides.
const CHANGED: f64 = 1e5;

/// Its growth factor from step to step.
const HARDENING: f64 = 30.0;

/// A first step of the inputs this long, in their units, counts as long.
const CAREFUL_STEP: f64 = 0.03;

/// A step of the inputs this small, in their units, is probably the last one, so derivatives are
/// only evaluated if it is not.
const LAST_STEP: f64 = 1e-3;

/// How much more than the ratio of the step lengths a step with old second derivatives reduces the
/// residual.
const CHORD_LOSS: f64 = 2.0;

/// After a step of the inputs this large, in their units, the solution is not close.
const LARGEST_STEP: f64 = 3.0;

impl<M: Model<NX, NU>, const NX: usize, const NU: usize> Workspace<M, NX, NU> {
    /// Iterates from `current`, a complete warm start, to the optimum.
    ///
    /// With few iterations it may end at their limit, with `current` after that many steps.
    ///
    /// # Errors
    /// The numbers of steps and sweeps, if the optimum is not close; `current` must then not be
    /// used.
    pub(crate) fn pursue(&mut self, model: &M, cap: usize) -> Result<SolveEnd, (usize, u32)> {
        // Half of the iterations are reserved for the methods that can start from further away. Of
        // few there is nothing to reserve: none of those methods is nearer to the optimum after so
        // few.
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
            let (settled, residual) = self.update_roles(model);
            if !residual.is_finite() || steps >= STRAY_STEPS && residual > STRAY {
                return Err((steps, sweeps));
            }
            if settled && residual <= tolerance {
                let (residual, status) = (self.settle(model), Status::Converged);
                let close = residual.largest(0.0) <= tolerance;
                let end = SolveEnd { status, iterations: steps, sweeps, residual, ..SolveEnd::BAD };
                return if close { Ok(end) } else { Err((steps, sweeps)) };
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

    /// The Newton step of the present sides; whether it has the full curvature of the dynamics,
    /// `None` without the right inertia.
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

// A solve from an earlier solution.

/// Largest difference between the start and the earlier solution's expected state at which that
/// solution may still be optimal.
const AS_EXPECTED: f64 = 1e-6;

/// First barrier of the barrier method in a warm solve. From `LAST_BARRIER`, limits that change
/// sides block three quarters of its steps.
const SECOND_BARRIER: f64 = 1.0;

impl<M: Model<NX, NU>, const NX: usize, const NU: usize> Workspace<M, NX, NU> {
    /// Solves from an earlier solution. It is returned unchanged if it is still optimal. Otherwise
    /// the steps of `clamped`, the barrier method and a cold solve are tried in this order until
    /// one succeeds, in at most `cap` iterations in total.
    pub(crate) fn warm(&mut self, model: &M, warm: &Start<NX, NU>, cap: usize) -> SolveEnd {
        let complete = start::warm(model, &self.conditions, warm, LAST_BARRIER, &mut self.current);
        let expected = warm.states.first().is_some_and(|state| {
            let pairs = state.iter().zip(model.initial());
            pairs.into_iter().all(|(one, other)| (one - other).abs() <= AS_EXPECTED)
        });
        if expected || !complete {
            self.current.evaluate(model, false);
            let residual = self.residual(model);
            if residual.largest(0.0) <= model.settings().tolerance {
                return SolveEnd { status: Status::Converged, residual, ..SolveEnd::BAD };
            }
        }
        let (mut iterations, mut sweeps) = (0, 0);
        if complete {
            match self.pursue(model, cap) {
                Ok(outcome) => return outcome,
                Err((made, swept)) => (iterations, sweeps) = (made, swept),
            }
            start::warm(model, &self.conditions, warm, LAST_BARRIER, &mut self.current);
        }
        start::raise(model, &self.conditions, SECOND_BARRIER, &mut self.current);
        let mut outcome = self.descend(model, SECOND_BARRIER, cap - iterations);
        iterations += outcome.iterations;
        sweeps += outcome.sweeps;
        let failed = matches!(outcome.status, Status::Stalled | Status::SubproblemFailed);
        if failed && iterations < cap && !self.allowance.is_spent() {
            outcome = self.cold(model, cap - iterations);
            iterations += outcome.iterations;
            sweeps += outcome.sweeps;
        }
        SolveEnd { iterations, sweeps, ..outcome }
    }
}

// Shortens a long first step with its second-order terms.
//
// Where inputs change a condition only to second order (a tilt near upright: the height), its
// linear equation gives a step that is far too long. With the path rolled out at the whole step,
// the states are known to second order in the fraction `t` of the step,
//
// ```text
// x(t) = x + drift + t (step - drift) + t^2 (rolled out - x - step)
// ```
//
// (`drift` is the effect of the defects alone), and so is the condition, which has a root in `t`.

/// The smallest root of `c + b t + a t^2` in (0, 1].
fn first_root(c: f64, b: f64, a: f64) -> Option<f64> {
    let discriminant = b * b - 4.0 * a * c;
    if discriminant.is_nan() || discriminant < 0.0 {
        return None;
    }
    let root = libm::sqrt(discriminant);
    let half = -0.5 * (b + root.copysign(b));
    let roots = [half / a, c / half];
    roots.into_iter().filter(|t| *t > 0.0 && *t <= 1.0).reduce(f64::min)
}

impl<M: Model<NX, NU>, const NX: usize, const NU: usize> Workspace<M, NX, NU> {
    /// Takes the fraction of a long step at which the one held condition, an equality, is met.
    /// Returns false if there is none, or if another condition is held, too.
    pub(crate) fn bend(&mut self, model: &M, stiffness: f64) -> bool {
        let Self { conditions, current, trial, newton, sides, scratch, .. } = self;
        let mut held =
            conditions.iter().enumerate().filter(|(index, _)| matches!(sides.roles[*index], Role::Held));
        let Some((index, condition)) = held.next().filter(|(_, condition)| condition.equality) else {
            return false;
        };
        if held.next().is_some() {
            return false;
        }
        let sweep = &newton.sweep;
        sweep.drift(current, scratch);
        let ranges = model.input_ranges();
        trial.states[0] = current.states[0];
        for (k, step) in sweep.inputs.iter().enumerate() {
            for (i, range) in ranges.iter().enumerate() {
                trial.inputs[k][i] = range.clamp(current.inputs[k][i] + step[i]);
            }
        }
        trial.roll_out(model);
        let now = condition.value(&current.states);
        let before = now + condition.sign * scratch[condition.node][condition.component];
        let straight = now + condition.sign * sweep.states[condition.node][condition.component];
        let bent = condition.value(&trial.states) - straight;
        let Some(fraction) = first_root(before, straight - before, bent) else { return false };

        let (least, most) = condition.range(model.settings().penalty);
        let multiplier = &mut sides.multipliers[index];
        *multiplier = (*multiplier - fraction * stiffness * straight).clamp(least, most);
        for (k, input) in current.inputs.iter_mut().enumerate() {
            for (i, place) in sides.places[k].iter_mut().enumerate() {
                (input[i], *place) = place.moved(input[i] + fraction * sweep.inputs[k][i], &ranges[i]);
            }
        }
        for (costate, after) in current.costates.iter_mut().zip(&sweep.costates) {
            for (entry, new) in costate.iter_mut().zip(after) {
                *entry += fraction * (new - *entry);
            }
        }
        for (k, state) in current.states.iter_mut().enumerate() {
            let (drift, step, whole) = (&scratch[k], &sweep.states[k], &trial.states[k]);
            for i in 0..NX {
                let bent = whole[i] - state[i] - step[i];
                state[i] += drift[i] + fraction * (step[i] - drift[i]) + fraction * fraction * bent;
            }
        }
        true
    }
}
