//! How the velocity changed of late: the acceleration that telemetry shows, gravity included.

use std::collections::VecDeque;

use protocol::dialect::TdPhase;

use super::motion::{Motion, NorthEastUp};

/// What is older than this is not of late.
const SPAN_MS: u32 = 1_000;
/// Over less than this a difference of speeds is noise.
const SPAN_MIN_MS: u32 = 300;
/// Samples kept; a vehicle that reports faster loses nothing by it.
const KEPT: usize = 64;

/// Velocities of the last second under the same forces, by the vehicle's own clock: a radio's hesitation is no acceleration.
#[derive(Debug, Clone, Default)]
pub struct Trend {
    acting: Option<TdPhase>,
    velocities: VecDeque<(u32, NorthEastUp)>,
}

impl Trend {
    /// Takes what was reported. Where other forces act from a phase on, it begins anew.
    pub(crate) fn note(&mut self, boot_ms: u32, motion: &Motion, phase: Option<TdPhase>) {
        let acting = phase.map(as_forces_go);
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
            || self.velocities.len() >= KEPT
        {
            self.velocities.pop_front();
        }
        self.velocities.push_back((boot_ms, velocity));
    }

    /// The change; `None` while too little was heard since other forces acted.
    pub fn of_late(&self) -> Option<Change> {
        let ((from_ms, from), (to_ms, to)) = (self.velocities.front()?, self.velocities.back()?);
        let span_ms = to_ms - from_ms;
        let span_s = f64::from(span_ms) / 1_000.0;
        (span_ms >= SPAN_MIN_MS).then(|| Change {
            acceleration_m_s2: std::array::from_fn(|axis| (to[axis] - from[axis]) / span_s),
            velocity_m_s: std::array::from_fn(|axis| f64::midpoint(from[axis], to[axis])),
        })
    }
}

/// A change of velocity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Change {
    /// How fast, m/s2.
    pub acceleration_m_s2: NorthEastUp,
    /// At which velocity, m/s: half-way between before and after.
    pub velocity_m_s: NorthEastUp,
}

/// One phase for those in which the same forces act: an armed motor pulls no more than an unarmed one.
fn as_forces_go(phase: TdPhase) -> TdPhase {
    match phase {
        TdPhase::TD_PHASE_LAND_ARMED | TdPhase::TD_PHASE_IGNITION => TdPhase::TD_PHASE_AERO_DESCENT,
        other => other,
    }
}

#[cfg(test)]
mod tests {
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
        trend.of_late().map(|change| change.acceleration_m_s2)
    }

    #[test]
    fn it_is_the_change_over_the_last_second() {
        let trend = noted(&[(0, 90.0), (1_000, 10.0), (1_500, 14.0), (2_000, 18.0)], TdPhase::TD_PHASE_COAST);
        assert_eq!(acceleration(&trend), Some([0.0, 0.0, -8.0]));
        assert_eq!(trend.of_late().map(|change| change.velocity_m_s), Some([1.0, 0.0, -14.0]));
    }

    #[test]
    fn too_short_a_time_says_nothing_and_neither_do_other_forces() {
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
    fn what_comes_late_or_is_no_number_is_passed_over() {
        let mut trend = noted(&[(1_000, 10.0), (1_500, 15.0), (1_400, 99.0)], TdPhase::TD_PHASE_COAST);
        trend.note(1_600, &falling(f64::NAN), Some(TdPhase::TD_PHASE_COAST));
        assert_eq!(acceleration(&trend), Some([0.0, 0.0, -10.0]));
    }
}
