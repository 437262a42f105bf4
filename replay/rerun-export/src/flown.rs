//! The path that was flown, thinned so that its memory stays bounded however long the log is.

/// Most points kept.
const POINTS_KEPT: usize = 20_000;

/// Least distance between two points of a fresh path, m.
const SPACING_M: f32 = 0.01;

/// A path, thinned.
#[derive(Debug)]
#[expect(clippy::struct_field_names, reason = "each name ends in its unit")]
pub(crate) struct FlownPath {
    points_m: Vec<[f32; 3]>,
    spacing_m: f32,
    last_m: Option<[f32; 3]>,
}

impl FlownPath {
    pub(crate) fn new() -> Self {
        Self { points_m: Vec::new(), spacing_m: SPACING_M, last_m: None }
    }

    /// Adds a point; returns the previous point if the path moved on.
    pub(crate) fn push(&mut self, point_m: [f32; 3]) -> Option<[f32; 3]> {
        if !point_m.iter().all(|value| value.is_finite()) {
            return None;
        }
        self.last_m = Some(point_m);
        let Some(&previous_m) = self.points_m.last() else {
            self.points_m.push(point_m);
            return None;
        };
        let moved = previous_m.iter().zip(point_m).any(|(from, to)| (to - from).abs() >= self.spacing_m);
        if !moved {
            return None;
        }
        if self.points_m.len() == POINTS_KEPT {
            self.thin();
        }
        self.points_m.push(point_m);
        Some(previous_m)
    }

    /// The whole path, including the last point.
    pub(crate) fn into_points_m(mut self) -> Vec<[f32; 3]> {
        if self.points_m.last() != self.last_m.as_ref() {
            self.points_m.extend(self.last_m);
        }
        self.points_m
    }

    fn thin(&mut self) {
        let mut index = 0_usize;
        self.points_m.retain(|_| {
            index += 1;
            index % 2 == 1
        });
        self.spacing_m *= 2.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_keeps_its_ends_and_stays_bounded() {
        let mut path = FlownPath::new();
        for step in 0..200_000_u32 {
            path.push([step as f32, 0.0, 1000.0]);
            assert!(path.points_m.len() <= POINTS_KEPT);
        }
        let points_m = path.into_points_m();
        assert_eq!(points_m.first(), Some(&[0.0, 0.0, 1000.0]));
        assert_eq!(points_m.last(), Some(&[199_999.0, 0.0, 1000.0]));
        assert!(points_m.len() > POINTS_KEPT / 3);
    }

    #[test]
    fn standing_still_adds_only_the_last_position() {
        let mut path = FlownPath::new();
        assert_eq!(path.push([0.0; 3]), None);
        assert_eq!(path.push([0.0, 0.0, 0.001]), None);
        assert_eq!(path.push([f32::NAN, 0.0, 0.0]), None);
        assert_eq!(path.push([0.0, 0.0, 1.0]), Some([0.0; 3]));
        assert_eq!(path.into_points_m(), [[0.0; 3], [0.0, 0.0, 1.0]]);
    }
}
