//! The path that the vehicle flew, in a bounded number of points.

use std::time::Duration;

use super::motion::{Motion, NorthEastUp};

const KEPT: usize = 512;
/// A position further away than this is not believed.
const POSITION_MAX_M: f64 = 1e5;

/// A path: positions north, east and up from the pad, m.
#[derive(Debug, Clone, Default)]
pub struct FlownPath {
    points: Vec<NorthEastUp>,
    /// When each was received.
    times: Vec<Duration>,
}

impl FlownPath {
    /// The points, oldest first.
    pub fn points(&self) -> &[NorthEastUp] {
        &self.points
    }

    /// The path up to a time.
    pub(crate) fn until(&self, at: Duration) -> Self {
        let count = self.times.partition_point(|time| *time <= at);
        Self { points: self.points[..count].to_vec(), times: self.times[..count].to_vec() }
    }

    /// Adds a position. When the path gets too long, every second point is dropped.
    pub(crate) fn extend(&mut self, motion: &Motion, now: Duration) {
        let point = [motion.x_m, motion.y_m, motion.altitude_m];
        let is_position = point.iter().all(|value| value.abs() < POSITION_MAX_M);
        if !is_position || self.points.last() == Some(&point) {
            return;
        }
        if self.points.len() >= KEPT {
            every_second(&mut self.points);
            every_second(&mut self.times);
        }
        self.points.push(point);
        self.times.push(now);
    }
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
mod tests {
    use super::*;

    #[test]
    fn a_long_path_keeps_its_ends_and_stays_bounded() {
        let mut flown = FlownPath::default();
        for k in 0..10_000_u32 {
            let motion = Motion { x_m: f64::from(k), y_m: 0.0, ..Motion::vertical(f64::from(k), 0.0) };
            flown.extend(&motion, Duration::from_secs(k.into()));
            flown.extend(&motion, Duration::from_secs(k.into()));
        }
        flown.extend(&Motion { x_m: f64::NAN, y_m: 0.0, ..Motion::vertical(1.0, 0.0) }, Duration::MAX);
        flown.extend(&Motion { x_m: 1e9, y_m: 0.0, ..Motion::vertical(1.0, 0.0) }, Duration::MAX);
        let points = flown.points();
        assert!(points.len() <= KEPT);
        assert_eq!((points.first(), points.last()), (Some(&[0.0; 3]), Some(&[9_999.0, 0.0, 9_999.0])));
        assert!(points.is_sorted_by(|before, after| before[0] < after[0]));
        let half = flown.until(Duration::from_secs(5_000));
        assert!(half.points().last().is_some_and(|point| point[0] <= 5_000.0));
        assert!(half.points().len() < points.len());
        assert!(flown.until(Duration::ZERO).points().len() == 1);
    }
}
