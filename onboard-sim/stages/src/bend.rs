//! Shortens a long first step with its second-order terms.
//!
//! Where inputs change a condition only to second order (a tilt near upright: the height), its linear equation gives a
//! step that is far too long. With the path rolled out at the whole step, the states are known to second order in the
//! fraction `t` of the step,
//!
//! ```text
//! x(t) = x + drift + t (step - drift) + t^2 (rolled out - x - step)
//! ```
//!
//! (`drift` is the effect of the defects alone), and so is the condition, which has a root in `t`.

use crate::model::Model;
use crate::sides::Role;
use crate::solver::Workspace;

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
    /// Takes the fraction of a long step at which the one held condition, an equality, is met. Returns false if there
    /// is none, or if another condition is held, too.
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

        let (least, most) = condition.range(model.settings().price);
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
