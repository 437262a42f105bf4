//! A plan of a landing, and its evaluation.

use alloc::borrow::ToOwned as _;
use alloc::vec::Vec;
use serde::Serialize;

use nalgebra::Vector3;
use ocp::Start;
use ocp::landing::{INPUTS, Nose, Problem, STATES, State, Workspace, last_multipliers};

use super::PoweredSettings;
use crate::control::aim::Aim;
use crate::rules::verdict::Touchdown;

/// Angle between the nose and the vertical, rad.
fn tilt_rad(state: &State) -> f64 {
    libm::acos((libm::cos(state[6]) * libm::cos(state[7])).clamp(-1.0, 1.0))
}

/// A plan, with the multipliers from which the next solve starts.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Plan {
    begins_s: f64,
    step_s: f64,
    states: Vec<State>,
    inputs: Vec<[f64; INPUTS]>,
    costates: Vec<State>,
    limits: Vec<[[f64; 2]; INPUTS]>,
    conditions: Vec<f64>,
    turning_rad_s2: Vec<f64>,
    settled_nodes: usize,
}

impl Plan {
    /// When it begins, s.
    pub fn begins_s(&self) -> f64 {
        self.begins_s
    }

    /// Length of an interval, s.
    pub fn step_s(&self) -> f64 {
        self.step_s
    }

    /// The states at its nodes, over the ground ([`ocp::landing::State`]): one more than intervals.
    pub fn states(&self) -> &[State] {
        &self.states
    }

    /// The inputs held in its intervals: gimbal towards growing `p` and `r`, rad, and the fins'
    /// share.
    pub fn inputs(&self) -> &[[f64; INPUTS]] {
        &self.inputs
    }

    pub(super) fn intervals(&self) -> usize {
        self.inputs.len()
    }

    pub(super) fn length_s(&self) -> f64 {
        self.step_s * self.intervals() as f64
    }

    /// Whether it is flown to its end without another plan, because it ends so soon.
    pub(super) fn is_flown_out(&self, settings: &PoweredSettings, time_s: f64) -> bool {
        self.intervals() > 0 && self.left_s(time_s) < settings.flown_out_s
    }

    /// From a time to its end, s.
    pub fn left_s(&self, time_s: f64) -> f64 {
        self.begins_s + self.length_s() - time_s
    }

    /// Vertical velocity at the end, m/s; minus infinity without an end.
    pub(super) fn end_m_s(&self) -> f64 {
        self.states.last().map_or(f64::NEG_INFINITY, |end| end[5])
    }

    /// Its end, over the ground.
    pub fn touchdown(&self) -> Touchdown {
        let [x_m, y_m, height_m, north_m_s, west_m_s, up_m_s, p, _, p_rate, r_rate] =
            self.states.last().copied().unwrap_or_default();
        Touchdown {
            distance_m: libm::hypot(x_m, y_m),
            height_m,
            vertical_m_s: up_m_s,
            lateral_m_s: libm::hypot(north_m_s, west_m_s),
            tilt_rad: self.states.last().map_or(0.0, tilt_rad),
            rate_rad_s: libm::hypot(p_rate, libm::cos(p) * r_rate),
        }
    }

    pub(super) fn is_finite(&self) -> bool {
        !self.inputs.is_empty() && self.states.as_flattened().iter().all(|value| value.is_finite())
    }

    pub(super) fn largest_tilt_rad(&self) -> f64 {
        self.states.iter().map(tilt_rad).fold(0.0, f64::max)
    }

    pub(super) fn start(&self) -> Start<'_, STATES, INPUTS> {
        Start {
            states: &self.states,
            inputs: &self.inputs,
            costates: &self.costates,
            limit_multipliers: &self.limits,
            condition_multipliers: &self.conditions,
        }
    }

    /// No plan, with the same room.
    pub(super) fn clear(&mut self) {
        self.copy(&Self::default());
    }

    /// Becomes another plan, in the room that it has.
    pub(super) fn copy(&mut self, from: &Self) {
        self.states.clone_from(&from.states);
        self.inputs.clone_from(&from.inputs);
        self.costates.clone_from(&from.costates);
        self.limits.clone_from(&from.limits);
        self.conditions.clone_from(&from.conditions);
        self.turning_rad_s2.clone_from(&from.turning_rad_s2);
        (self.begins_s, self.step_s, self.settled_nodes) = (from.begins_s, from.step_s, from.settled_nodes);
    }

    /// The last `intervals` intervals of an earlier plan. The conditions' multipliers are retained
    /// if their order is available.
    pub(super) fn take_last(&mut self, from: &Self, intervals: usize, settled_nodes: usize) -> bool {
        let Some(gone) = from.inputs.len().checked_sub(intervals) else { return false };
        from.states[gone..].clone_into(&mut self.states);
        from.costates[gone..].clone_into(&mut self.costates);
        from.inputs[gone..].clone_into(&mut self.inputs);
        from.limits[gone..].clone_into(&mut self.limits);
        self.conditions.clear();
        if settled_nodes == from.settled_nodes {
            let before = from.inputs.len();
            last_multipliers(&from.conditions, settled_nodes, before, intervals, &mut self.conditions);
        }
        true
    }

    /// Reads the result of a solve.
    pub(super) fn read(&mut self, workspace: &Workspace, problem: &Problem, begins_s: f64) {
        workspace.states().clone_into(&mut self.states);
        workspace.costates().clone_into(&mut self.costates);
        workspace.inputs().clone_into(&mut self.inputs);
        self.limits.clear();
        self.limits.extend(workspace.limit_multipliers());
        self.conditions.clear();
        self.conditions.extend(workspace.condition_multipliers());
        self.turning_rad_s2.clear();
        self.turning_rad_s2.extend(problem.pushes.iter().map(|push| push.turning_rad_s2));
        self.begins_s = begins_s;
        self.step_s = problem.step_s;
        self.settled_nodes = problem.end.settled_nodes;
    }

    /// Planned velocity over the ground, m/s, and the direction of the nose at a time; `None` after
    /// the end.
    pub(crate) fn at(&self, time_s: f64) -> Option<(Vector3<f64>, Aim)> {
        let since = (time_s - self.begins_s).max(0.0) / self.step_s;
        let k = since as usize;
        // Without a plan `k` is the largest number.
        let [before, after, ..] = self.states.get(k..)? else { return None };
        let between = |i: usize| before[i] + (since - k as f64) * (after[i] - before[i]);
        Some((Vector3::new(between(3), between(4), between(5)), self.aim(time_s)?))
    }

    /// The commanded direction of the nose at a time; `None` after the end.
    pub(super) fn aim(&self, time_s: f64) -> Option<Aim> {
        let since_s = (time_s - self.begins_s).max(0.0);
        let k = (since_s / self.step_s) as usize;
        let (state, input) = self.states.get(k).zip(self.inputs.get(k))?;
        let turning = *self.turning_rad_s2.get(k)?;
        let t = since_s - k as f64 * self.step_s;
        // The accelerations of the plan's interval, in its middle.
        let rate_by_gimbal = 0.5 * self.step_s * turning;
        let (pd, rd) = (state[8] + rate_by_gimbal * input[0], state[9] + rate_by_gimbal * input[1]);
        let (sin_p, cos_p) = libm::sincos(state[6] + 0.5 * self.step_s * pd);
        let a_p = turning * input[0] - rd * rd * sin_p * cos_p;
        let a_r = (turning * input[1] + 2.0 * pd * rd * sin_p) / cos_p;
        let (p, r) = (state[6] + t * (state[8] + 0.5 * t * a_p), state[7] + t * (state[9] + 0.5 * t * a_r));
        let (pd, rd) = (state[8] + t * a_p, state[9] + t * a_r);
        let Nose { sin_p, cos_p, n, e_p, e_r, m } = Nose::at(p, r);
        let [nose, e_p, e_r, inwards] = [n, e_p, e_r, m].map(Vector3::from);
        let moving = e_p * pd + e_r * (cos_p * rd);
        let speeding = e_p * a_p + e_r * (cos_p * a_r - 2.0 * pd * rd * sin_p) - nose * (pd * pd)
            + inwards * (cos_p * rd * rd);
        Some(Aim {
            nose_in_world: nose,
            rate_in_world_rad_s: nose.cross(&moving),
            acceleration_in_world_rad_s2: nose.cross(&speeding),
        })
    }

    /// Planned share of the fins' drag area at a time; `None` after the end.
    pub(crate) fn fin_share(&self, time_s: f64) -> Option<f64> {
        let k = ((time_s - self.begins_s).max(0.0) / self.step_s) as usize;
        self.inputs.get(k).map(|input| input[2])
    }

    /// Planned level velocity over the ground at a time, m/s; zero after the end.
    pub(super) fn level_m_s(&self, time_s: f64) -> [f64; 2] {
        let since = (time_s - self.begins_s).max(0.0) / self.step_s;
        let k = since as usize;
        let share = since - k as f64;
        match (self.states.get(k), self.states.get(k + 1)) {
            (Some(before), Some(after)) => [3, 4].map(|i| (1.0 - share) * before[i] + share * after[i]),
            _ => [0.0; 2],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A lean that turns around, at 20 rad/s^2 of a radian of the gimbal.
    fn plan() -> Plan {
        let state = [1.0, -2.0, 3.0, 0.4, -0.2, -3.0, 0.3, -0.2, 0.5, 0.8];
        Plan {
            begins_s: 2.0,
            step_s: 0.1,
            states: vec![state; 3],
            inputs: vec![[0.05, -0.03, 0.7], [0.0, 0.0, 0.2]],
            turning_rad_s2: vec![20.0; 2],
            ..Plan::default()
        }
    }

    #[test]
    fn the_aims_rates_are_those_of_its_nose() {
        const CHANGE_S: f64 = 1e-5;
        let plan = plan();
        for time_s in [2.0 + CHANGE_S, 2.03, 2.08] {
            let [before, now, after] =
                [-1.0, 0.0, 1.0].map(|side| plan.aim(time_s + side * CHANGE_S).unwrap());
            let rate = (after.nose_in_world - before.nose_in_world) / (2.0 * CHANGE_S);
            let change = (after.rate_in_world_rad_s - before.rate_in_world_rad_s) / (2.0 * CHANGE_S);
            let nose = now.nose_in_world;
            assert!((nose.norm() - 1.0).abs() < 1e-12);
            assert!((nose.cross(&rate) - now.rate_in_world_rad_s).norm() < 1e-6, "{time_s}");
            // The lean's accelerations are those of the middle of the interval.
            assert!((change - now.acceleration_in_world_rad_s2).norm() < 1e-5, "{time_s}");
        }
        let first = plan.aim(1.9).unwrap().nose_in_world;
        assert!((first.x - libm::sin(0.3)).abs() < 1e-12, "{first}");
        assert_eq!(plan.aim(2.2001), None);
    }

    #[test]
    fn fins_and_velocity_follow_the_time() {
        let plan = plan();
        assert_eq!([2.05, 2.15, 2.25].map(|time_s| plan.fin_share(time_s)), [Some(0.7), Some(0.2), None]);
        let near = |time_s: f64, level_m_s: [f64; 2]| {
            plan.level_m_s(time_s).iter().zip(level_m_s).all(|(found, wanted)| (found - wanted).abs() < 1e-12)
        };
        assert!(near(2.05, [0.4, -0.2]) && near(2.5, [0.0; 2]));
        assert!((plan.left_s(2.05) - 0.15).abs() < 1e-12);
    }
}
