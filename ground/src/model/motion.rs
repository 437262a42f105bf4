//! The trend of the vehicle's motion, and the path flown.

use std::collections::VecDeque;

use protocol::dialect::TdPhase;
pub use protocol::motion::{Attitude, BodySpeed, Deflection, Motion, NorthEastUp};

/// Standard gravity, m/s2 (CGPM 1901).
pub const GRAVITY_M_S2: f64 = 9.806_65;

// The mean acceleration over the last second of telemetry, gravity included.

/// Older velocities are dropped.
const SPAN_MS: u32 = 1_000;
/// Over a shorter time the difference of two velocities is mostly noise.
const SPAN_MIN_MS: u32 = 300;
/// Maximum number of samples.
const TREND_MAX: usize = 64;

/// The velocities of the last second under the same forces, by the vehicle's clock, so that radio
/// delays do not look like accelerations.
#[derive(Debug, Clone, Default)]
pub struct Trend {
    acting: Option<TdPhase>,
    velocities: VecDeque<(u32, NorthEastUp)>,
}

impl Trend {
    /// Adds a velocity. When a phase with other forces begins, older velocities are dropped.
    pub(crate) fn note(&mut self, boot_ms: u32, motion: &Motion, phase: Option<TdPhase>) {
        let acting = phase.map(phase_by_forces);
        if acting != self.acting {
            *self = Self { acting, ..Self::default() };
        }
        let velocity = [motion.vx_m_s, motion.vy_m_s, motion.climb_m_s];
        let newest = self.velocities.back().map(|(at_ms, _)| *at_ms);
        if newest.is_some_and(|newest| boot_ms <= newest) || velocity.iter().any(|part| !part.is_finite()) {
            return;
        }
        let is_old = |at_ms: u32| boot_ms - at_ms > SPAN_MS;
        while self.velocities.front().is_some_and(|(at_ms, _)| is_old(*at_ms))
            || self.velocities.len() >= TREND_MAX
        {
            self.velocities.pop_front();
        }
        self.velocities.push_back((boot_ms, velocity));
    }

    /// The mean acceleration; `None` while too little has been received under the present forces.
    pub fn mean_change(&self) -> Option<Change> {
        let ((from_ms, from), (to_ms, to)) = (self.velocities.front()?, self.velocities.back()?);
        let span_ms = to_ms - from_ms;
        let span_s = f64::from(span_ms) / 1_000.0;
        (span_ms >= SPAN_MIN_MS).then(|| Change {
            acceleration_m_s2: std::array::from_fn(|axis| (to[axis] - from[axis]) / span_s),
            velocity_m_s: std::array::from_fn(|axis| f64::midpoint(from[axis], to[axis])),
        })
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Change {
    pub acceleration_m_s2: NorthEastUp,
    /// The mean velocity, m/s.
    pub velocity_m_s: NorthEastUp,
}

/// Maps phases with the same forces to one phase: arming the motor changes no force.
fn phase_by_forces(phase: TdPhase) -> TdPhase {
    match phase {
        TdPhase::TD_PHASE_LAND_ARMED | TdPhase::TD_PHASE_IGNITION => TdPhase::TD_PHASE_AERO_DESCENT,
        other => other,
    }
}

// The path that the vehicle flew, in a bounded number of points.

const PATH_POINTS_MAX: usize = 512;
/// Maximum distance of a plausible position, m.
const POSITION_MAX_M: f64 = 1e5;

/// Adds a position to a path. When the path gets too long, every second point is dropped.
pub(super) fn extend_path(path: &mut Vec<NorthEastUp>, motion: &Motion) {
    let point = [motion.x_m, motion.y_m, motion.altitude_m];
    let is_position = point.iter().all(|value| value.abs() < POSITION_MAX_M);
    if !is_position || path.last() == Some(&point) {
        return;
    }
    if path.len() >= PATH_POINTS_MAX {
        every_second(path);
    }
    path.push(point);
}

/// Drops every second element.
pub(super) fn every_second<T>(list: &mut Vec<T>) {
    let mut keep = false;
    list.retain(|_| {
        keep = !keep;
        keep
    });
}

#[cfg(test)]
mod trend_tests {
    use super::*;

    fn falling(speed_m_s: f64) -> Motion {
        Motion { vx_m_s: 1.0, vy_m_s: 0.0, ..Motion::vertical(100.0, -speed_m_s) }
    }

    fn noted(velocities: &[(u32, f64)], phase: TdPhase) -> Trend {
        let mut trend = Trend::default();
        for (boot_ms, speed_m_s) in velocities {
            trend.note(*boot_ms, &falling(*speed_m_s), Some(phase));
        }
        trend
    }

    fn acceleration(trend: &Trend) -> Option<NorthEastUp> {
        trend.mean_change().map(|change| change.acceleration_m_s2)
    }

    #[test]
    fn it_is_the_change_over_the_last_second() {
        let trend = noted(&[(0, 90.0), (1_000, 10.0), (1_500, 14.0), (2_000, 18.0)], TdPhase::TD_PHASE_COAST);
        assert_eq!(acceleration(&trend), Some([0.0, 0.0, -8.0]));
        assert_eq!(trend.mean_change().map(|change| change.velocity_m_s), Some([1.0, 0.0, -14.0]));
    }

    #[test]
    fn too_short_a_time_gives_nothing_and_other_forces_start_over() {
        let mut trend = noted(&[(1_000, 10.0), (1_200, 12.0)], TdPhase::TD_PHASE_COAST);
        assert_eq!(acceleration(&trend), None);
        trend.note(1_400, &falling(14.0), Some(TdPhase::TD_PHASE_COAST));
        assert_eq!(acceleration(&trend), Some([0.0, 0.0, -10.0]));
        trend.note(1_500, &falling(14.0), Some(TdPhase::TD_PHASE_POWERED));
        assert_eq!(acceleration(&trend), None);
        let mut descending = noted(&[(1_000, 10.0), (1_200, 11.0)], TdPhase::TD_PHASE_AERO_DESCENT);
        descending.note(1_400, &falling(12.0), Some(TdPhase::TD_PHASE_LAND_ARMED));
        assert_eq!(acceleration(&descending), Some([0.0, 0.0, -5.0]));
    }

    #[test]
    fn late_and_non_finite_velocities_are_ignored() {
        let mut trend = noted(&[(1_000, 10.0), (1_500, 15.0), (1_400, 99.0)], TdPhase::TD_PHASE_COAST);
        trend.note(1_600, &falling(f64::NAN), Some(TdPhase::TD_PHASE_COAST));
        assert_eq!(acceleration(&trend), Some([0.0, 0.0, -10.0]));
    }
}

#[cfg(test)]
mod flown_path_tests {
    use super::*;

    #[test]
    fn a_long_path_is_bounded_and_retains_its_ends() {
        let mut flown = Vec::new();
        for k in 0..10_000_u32 {
            let motion = Motion { x_m: f64::from(k), y_m: 0.0, ..Motion::vertical(f64::from(k), 0.0) };
            extend_path(&mut flown, &motion);
            extend_path(&mut flown, &motion);
        }
        extend_path(&mut flown, &Motion { x_m: f64::NAN, y_m: 0.0, ..Motion::vertical(1.0, 0.0) });
        extend_path(&mut flown, &Motion { x_m: 1e9, y_m: 0.0, ..Motion::vertical(1.0, 0.0) });
        let points = &flown;
        assert!(points.len() <= PATH_POINTS_MAX);
        assert_eq!((points.first(), points.last()), (Some(&[0.0; 3]), Some(&[9_999.0, 0.0, 9_999.0])));
        assert!(points.is_sorted_by(|before, after| before[0] < after[0]));
    }
}
