//! Converts a solution into a start for a problem with other nodes: if the horizon ends earlier or later, its intervals
//! are at other times.
//!
//! States and costates are interpolated between nodes, and gimbal angles are averaged over each new interval.
//! Multipliers of input limits and of the floor are proportional to the length of an interval, like the running cost. A
//! limit's multiplier is the smallest of the intervals that a new one covers, because an input that was on the limit
//! for part of the new interval is off it on average. Conditions at the end keep their multipliers, because they count
//! nodes from the end.

use super::{Solution, WarmStart};
use crate::dynamics::PlanarState;

/// A node this close to an old node, in intervals, counts as the same node.
const SAME_NODE: f64 = 1e-6;

impl Solution {
    /// This solution as a start for a problem that begins `from_s` after its own problem and has `intervals` intervals
    /// of `step_s`. Beyond the solution's end its last values are held. If nothing was solved or the times are not
    /// finite, the start is empty, so that it fits no problem.
    pub fn resampled(&self, from_s: f64, step_s: f64, intervals: usize) -> WarmStart {
        let mut warm = WarmStart::default();
        self.resample_into(from_s, step_s, intervals, &mut warm);
        warm
    }

    /// [`resampled`](Self::resampled) without allocation, if the warm start was this long before.
    pub fn resample_into(&self, from_s: f64, step_s: f64, intervals: usize, warm: &mut WarmStart) {
        warm.clear();
        let count = self.inputs_rad.len();
        let ratio = step_s / self.step_s;
        let from = from_s / self.step_s;
        if count == 0 || self.states.len() != count + 1 || !(from.is_finite() && ratio > 0.0) {
            return;
        }
        let place = |node: usize| {
            let place = (from + ratio * node as f64).clamp(0.0, count as f64);
            let nearest = libm::round(place);
            if (place - nearest).abs() <= SAME_NODE { nearest } else { place }
        };
        for node in 0..=intervals {
            let at = place(node);
            warm.states.push(PlanarState::from_array(between(&self.states, at, PlanarState::to_array)));
            // The costate of the first node has no meaning.
            if self.costates.len() == count + 1 {
                warm.costates.push(between(&self.costates, at.max(1.0), |costate| costate));
            }
        }
        for interval in 0..intervals {
            let (begins, ends) = (place(interval), place(interval + 1));
            let covered = covered(begins, ends, count);
            let mut sum = 0.0;
            let mut least = [f64::INFINITY; 2];
            for k in covered.clone() {
                let share = (ends.min((k + 1) as f64) - begins.max(k as f64)).max(0.0);
                sum += share * self.inputs_rad[k];
                if let Some(limits) = self.limit_multipliers.get(k) {
                    least = [least[0].min(limits[0]), least[1].min(limits[1])];
                }
            }
            let alone = self.inputs_rad[covered.start];
            warm.inputs_rad.push(if covered.len() == 1 { alone } else { sum / (ends - begins) });
            if self.limit_multipliers.len() == count {
                warm.limit_multipliers.push(least.map(|multiplier| ratio * multiplier));
            }
        }
        warm.end_multipliers.extend_from_slice(&self.end_multipliers);
        if !self.floor_multipliers.is_empty() {
            let floor = |node: usize| {
                node.checked_sub(1).and_then(|row| self.floor_multipliers.get(row)).copied().unwrap_or(0.0)
            };
            warm.floor_multipliers.extend((1..intervals).map(|node| {
                let at = place(node);
                let before = at as usize;
                let along = at - before as f64;
                ratio * (floor(before) + along * (floor(before + 1) - floor(before)))
            }));
        }
    }
}

impl WarmStart {
    /// Clears the start and keeps its capacity.
    fn clear(&mut self) {
        let Self { states, costates, limit_multipliers, inputs_rad, end_multipliers, floor_multipliers } =
            self;
        states.clear();
        costates.clear();
        limit_multipliers.clear();
        inputs_rad.clear();
        end_multipliers.clear();
        floor_multipliers.clear();
    }
}

/// The values at a place between nodes.
fn between<T: Copy>(nodes: &[T], at: f64, values: impl Fn(T) -> [f64; 6]) -> [f64; 6] {
    let before = (at as usize).min(nodes.len() - 1);
    let (one, other) = (values(nodes[before]), values(nodes[(before + 1).min(nodes.len() - 1)]));
    let along = at - before as f64;
    core::array::from_fn(|i| one[i] + along * (other[i] - one[i]))
}

/// The intervals, of `count`, that a span between two places covers; at least one.
fn covered(begins: f64, ends: f64, count: usize) -> core::ops::Range<usize> {
    let first = (begins as usize).min(count - 1);
    first..(libm::ceil(ends) as usize).clamp(first + 1, count)
}
