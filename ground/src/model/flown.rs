//! Where the vehicle flew, in a bounded number of points.

use super::motion::Motion;

/// Points kept.
const KEPT: usize = 512;
/// Positions beyond this are no positions.
const POSITION_MAX_M: f64 = 1e5;

/// A path as it looks from the east: north of the pad and altitude, m.
#[derive(Debug, Clone, Default)]
pub struct Flown {
    points: Vec<(f64, f64)>,
}

impl Flown {
    /// The points, oldest first.
    pub fn points(&self) -> &[(f64, f64)] {
        &self.points
    }

    /// Notes where it is; thins the path out when it grows too long.
    pub(crate) fn extend(&mut self, motion: &Motion) {
        let point = (motion.x_m, motion.altitude_m);
        let is_position = |value: f64| value.abs() < POSITION_MAX_M;
        if !is_position(point.0) || !is_position(point.1) || self.points.last() == Some(&point) {
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
    fn a_long_path_keeps_its_ends_and_its_bounds() {
        let mut flown = Flown::default();
        for k in 0..10_000_u32 {
            let motion = Motion { x_m: f64::from(k), ..Motion::vertical(f64::from(k), 0.0) };
            flown.extend(&motion);
            flown.extend(&motion);
        }
        flown.extend(&Motion { x_m: f64::NAN, ..Motion::vertical(1.0, 0.0) });
        flown.extend(&Motion { x_m: 1e9, ..Motion::vertical(1.0, 0.0) });
        let points = flown.points();
        assert!(points.len() <= KEPT);
        assert_eq!((points.first(), points.last()), (Some(&(0.0, 0.0)), Some(&(9_999.0, 9_999.0))));
        assert!(points.is_sorted_by(|before, after| before.0 < after.0));
    }
}
