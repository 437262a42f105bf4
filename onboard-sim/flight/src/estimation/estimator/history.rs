//! The vehicle's recent motion, for measurements that arrive late.
//!
//! The history holds the velocity gained and its integral, not past estimates. The past state is the present estimate
//! run backwards, so it contains every correction made since. (This is the recalculation of Larsen and others,
//! "Incorporation of time delayed measurements in a discrete-time Kalman filter", CDC 1998, for a system whose motion
//! in between is known better than the measurement.)

use nalgebra::Vector3;

use crate::computer::memory::remembers;

/// Frames kept: 320 ms at 200 Hz.
const LENGTH: usize = 64;

#[derive(Debug, Clone, Copy, PartialEq)]
struct Sums {
    time_s: f64,
    /// Velocity gained since the start, world, m/s.
    velocity_m_s: Vector3<f64>,
    /// Its integral, m.
    position_m: Vector3<f64>,
}

remembers!(Sums { time_s, velocity_m_s, position_m });

/// The motion since a measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Since {
    pub(super) age_s: f64,
    /// Velocity gained since, gravity included, m/s.
    pub(super) gained_m_s: Vector3<f64>,
    /// Distance moved since, m.
    pub(super) moved_m: Vector3<f64>,
    /// Acceleration then, m/s^2.
    pub(super) acceleration_m_s2: Vector3<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct History {
    ring: [Sums; LENGTH],
    filled: usize,
    newest: usize,
}

remembers!(History { ring, filled, newest });

impl History {
    pub(super) fn new(time_s: f64) -> Self {
        let start = Sums { time_s, velocity_m_s: Vector3::zeros(), position_m: Vector3::zeros() };
        Self { ring: [start; LENGTH], filled: 1, newest: 0 }
    }

    /// Adds one frame.
    pub(super) fn push(&mut self, time_s: f64, interval_s: f64, gained_m_s: &Vector3<f64>) {
        let before = self.ring[self.newest];
        self.newest = (self.newest + 1) % LENGTH;
        self.filled = (self.filled + 1).min(LENGTH);
        self.ring[self.newest] = Sums {
            time_s,
            velocity_m_s: before.velocity_m_s + gained_m_s,
            position_m: before.position_m + (before.velocity_m_s + gained_m_s * 0.5) * interval_s,
        };
    }

    /// The motion since a time, for a vehicle that now has this velocity. `None` for a time in the future or too long
    /// ago.
    pub(super) fn since(&self, valid_at_s: f64, velocity_m_s: &Vector3<f64>) -> Option<Since> {
        let now = self.ring[self.newest];
        let age_s = now.time_s - valid_at_s;
        if age_s.is_nan() || age_s < -1e-9 {
            return None;
        }
        let mut later = now;
        for back in 0..self.filled {
            let sums = self.ring[(self.newest + LENGTH - back) % LENGTH];
            // The time of a fix may equal a frame's time except for rounding.
            if sums.time_s <= valid_at_s + 1e-9 {
                let gap_s = later.time_s - sums.time_s;
                let share = if gap_s > 0.0 { (valid_at_s - sums.time_s) / gap_s } else { 0.0 };
                let then_m_s = sums.velocity_m_s + (later.velocity_m_s - sums.velocity_m_s) * share;
                let then_m = sums.position_m + (later.position_m - sums.position_m) * share;
                return Some(Since {
                    age_s: age_s.max(0.0),
                    gained_m_s: now.velocity_m_s - then_m_s,
                    moved_m: (velocity_m_s - now.velocity_m_s) * age_s + now.position_m - then_m,
                    acceleration_m_s2: if gap_s > 0.0 {
                        (later.velocity_m_s - sums.velocity_m_s) / gap_s
                    } else {
                        Vector3::zeros()
                    },
                });
            }
            later = sums;
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fall_runs_backwards_exactly() {
        let (dt, g) = (0.005, Vector3::new(0.4, 0.0, -9.8));
        let mut history = History::new(0.0);
        for frame in 1..=200 {
            history.push(f64::from(frame) * dt, dt, &(g * dt));
        }
        // The time is 1 s. The velocity at the start, which the history does not contain, was (3, 0, -5).
        let start = Vector3::new(3.0, 0.0, -5.0);
        let now = start + g;
        for age in [0.0, 0.005, 0.12, 0.2] {
            let since = history.since(1.0 - age, &now).unwrap();
            let moved = now * age - g * (age * age / 2.0);
            assert!((since.moved_m - moved).norm() < 1e-12, "{age}: {} {moved}", since.moved_m);
            assert!((since.gained_m_s - g * age).norm() < 1e-12);
        }
        // Between frames the velocity is exact; the error of the position is below its curvature over a frame.
        let since = history.since(1.0 - 0.1234, &now).unwrap();
        assert!((since.gained_m_s - g * 0.1234).norm() < 1e-12);
        assert!(history.since(1.1, &now).is_none(), "to come");
        assert!(history.since(0.5, &now).is_none(), "forgotten");
        assert!(history.since(f64::NAN, &now).is_none());
    }
}
