//! The path that the vehicle flew, in a bounded number of points.

use super::motion::{Motion, NorthEastUp};

const KEPT: usize = 512;
/// A position further away than this is not believed.
const POSITION_MAX_M: f64 = 1e5;

/// A path: positions north, east and up from the pad, m.
#[derive(Debug, Clone, Default)]
pub struct FlownPath {
    points: Vec<NorthEastUp>,
}

impl FlownPath {
    /// The points, oldest first.
    pub fn points(&self) -> &[NorthEastUp] {
        &self.points
    }

    /// Adds a position. When the path gets too long, every second point is dropped.
    pub(crate) fn extend(&mut self, motion: &Motion) {
        let point = [motion.x_m, motion.y_m, motion.altitude_m];
        let is_position = point.iter().all(|value| value.abs() < POSITION_MAX_M);
        if !is_position || self.points.last() == Some(&point) {
            return;
        }
        if self.points.len() >= KEPT {
            let mut keep = false;
            self.points.retain(|_| {
                keep = !keep;
                keep
            });
        }
        self.points.push(point);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_path_keeps_its_ends_and_stays_bounded() {
        let mut flown = FlownPath::default();
        for k in 0..10_000_u32 {
            let motion = Motion { x_m: f64::from(k), y_m: 0.0, ..Motion::vertical(f64::from(k), 0.0) };
            flown.extend(&motion);
            flown.extend(&motion);
        }
        flown.extend(&Motion { x_m: f64::NAN, y_m: 0.0, ..Motion::vertical(1.0, 0.0) });
        flown.extend(&Motion { x_m: 1e9, y_m: 0.0, ..Motion::vertical(1.0, 0.0) });
        let points = flown.points();
        assert!(points.len() <= KEPT);
        assert_eq!((points.first(), points.last()), (Some(&[0.0; 3]), Some(&[9_999.0, 0.0, 9_999.0])));
        assert!(points.is_sorted_by(|before, after| before[0] < after[0]));
    }
}
