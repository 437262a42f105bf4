//! Shortens a long first step with its second-order terms.
//!
//! Near upright, tilt changes the end height only to second order, so the linear equation for the height gives a step
//! that is far too long. With the path rolled out at the whole step, the states are known to second order in the
//! fraction `t` of the step,
//!
//! ```text
//! x(t) = x + drift + t (step - drift) + t^2 (rolled out - x - step)
//! ```
//!
//! (`drift` is the effect of the defects alone), and so is the height, which has a root in `t`.

use super::Workspace;
use super::sides::{Role, range};
use crate::Problem;

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

impl Workspace {
    /// Takes the fraction of a long step at which the end height is met. Returns false if there is none, or if another
    /// condition is held, too.
    pub(super) fn bend(&mut self, problem: &Problem, stiffness: f64) -> bool {
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
        sweep.drift(current, problem.step_s, scratch);
        let limit = problem.gimbal_limit_rad;
        trial.states[0] = current.states[0];
        for ((input, now), step) in trial.inputs_rad.iter_mut().zip(&current.inputs_rad).zip(&sweep.inputs) {
            *input = (now + step).clamp(-limit, limit);
        }
        trial.roll_out(problem);
        let now = condition.value(&current.states);
        let before = now + condition.sign * scratch[condition.node][condition.component];
        let straight = now + condition.sign * sweep.states[condition.node][condition.component];
        let bent = condition.value(&trial.states) - straight;
        let Some(fraction) = first_root(before, straight - before, bent) else { return false };

        let (least, most) = range(condition, problem.solver.terminal_penalty);
        let multiplier = &mut sides.multipliers[index];
        *multiplier = (*multiplier - fraction * stiffness * straight).clamp(least, most);
        for ((input, step), place) in current.inputs_rad.iter_mut().zip(&sweep.inputs).zip(&mut sides.places)
        {
            (*input, *place) = place.moved(*input + fraction * step, limit);
        }
        for (costate, after) in current.costates.iter_mut().zip(&sweep.costates) {
            for (entry, new) in costate.iter_mut().zip(after) {
                *entry += fraction * (new - *entry);
            }
        }
        for (k, state) in current.states.iter_mut().enumerate() {
            let (drift, step, whole) = (&scratch[k], &sweep.states[k], &trial.states[k]);
            for i in 0..6 {
                let bent = whole[i] - state[i] - step[i];
                state[i] += drift[i] + fraction * (step[i] - drift[i]) + fraction * fraction * bent;
            }
        }
        true
    }
}
