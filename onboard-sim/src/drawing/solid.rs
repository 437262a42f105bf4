//! Solids between two stations, and whether two of them overlap.

use core::f64::consts::TAU;

/// Solids that share less than this touch, m.
const TOUCH_M: f64 = 5e-5;
/// Corners of a circle: its polygon is smaller by 0.1 % at most.
const CORNERS: u32 = 72;

/// A cross-section, m: body y and z.
#[derive(Debug, Clone, PartialEq)]
pub enum Section {
    /// Convex, its corners from y towards z.
    Polygon(Vec<[f64; 2]>),
    /// Radii about the axis.
    Ring { outside_m: f64, inside_m: f64 },
}

/// A cross-section between two stations, m above the nozzle.
#[derive(Debug, Clone, PartialEq)]
pub struct Solid {
    pub from_m: f64,
    pub to_m: f64,
    pub section: Section,
}

/// A point turned about the axis, from the y axis towards the z axis.
fn turned([y, z]: [f64; 2], angle_rad: f64) -> [f64; 2] {
    let (sin, cos) = libm::sincos(angle_rad);
    [y * cos - z * sin, y * sin + z * cos]
}

impl Section {
    /// A circle about a point.
    pub(super) fn disc([y, z]: [f64; 2], radius_m: f64) -> Self {
        let corner = |corner| turned([radius_m, 0.0], f64::from(corner) * TAU / f64::from(CORNERS));
        Self::Polygon((0..CORNERS).map(corner).map(|[dy, dz]| [y + dy, z + dz]).collect())
    }

    /// A rectangle, turned about the axis.
    pub(super) fn rectangle([y0, y1]: [f64; 2], [z0, z1]: [f64; 2], angle_rad: f64) -> Self {
        Self::Polygon(
            [[y0, z0], [y1, z0], [y1, z1], [y0, z1]].map(|corner| turned(corner, angle_rad)).to_vec(),
        )
    }

    /// Smallest or largest z, m.
    pub(super) fn end_m(&self, side: f64) -> f64 {
        match self {
            Self::Ring { outside_m, .. } => side * outside_m,
            Self::Polygon(corners) => -side * lowest(corners, [0.0, -side]),
        }
    }

    fn overlaps(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Polygon(one), Self::Polygon(two)) => {
                let apart = |a: &[[f64; 2]], b: &[[f64; 2]]| {
                    faces(a).any(|(normal, face_m)| lowest(b, normal) > face_m - TOUCH_M)
                };
                !apart(one, two) && !apart(two, one)
            }
            (one @ Self::Polygon(_), ring) => ring.overlaps(one),
            (Self::Ring { outside_m, inside_m }, other) => {
                let [nearest_m, farthest_m] = other.radii_m();
                nearest_m < outside_m - TOUCH_M && farthest_m > inside_m + TOUCH_M
            }
        }
    }

    /// Smallest and largest distance from the axis, m. The smallest is that of a polygon's nearest
    /// face, which may be less than that of a corner.
    fn radii_m(&self) -> [f64; 2] {
        match self {
            Self::Ring { outside_m, inside_m } => [*inside_m, *outside_m],
            Self::Polygon(corners) => [
                faces(corners).map(|(_, face_m)| -face_m).fold(0.0, f64::max),
                corners.iter().map(|[y, z]| libm::hypot(*y, *z)).fold(0.0, f64::max),
            ],
        }
    }
}

/// The outward normal of each face, and its distance from the axis along that.
fn faces(corners: &[[f64; 2]]) -> impl Iterator<Item = ([f64; 2], f64)> {
    corners.iter().zip(corners.iter().cycle().skip(1)).map(|([y0, z0], [y1, z1])| {
        let length_m = libm::hypot(y1 - y0, z1 - z0);
        let normal = [(z1 - z0) / length_m, (y0 - y1) / length_m];
        (normal, normal[0] * y0 + normal[1] * z0)
    })
}

/// Smallest coordinate of the corners along a direction.
fn lowest(corners: &[[f64; 2]], [y, z]: [f64; 2]) -> f64 {
    corners.iter().map(|corner| corner[0] * y + corner[1] * z).fold(f64::INFINITY, f64::min)
}

impl Solid {
    /// Whether a plane across a station cuts it.
    pub(super) fn is_at(&self, station_m: f64) -> bool {
        (self.from_m..self.to_m).contains(&station_m)
    }

    /// Whether both fill the same space.
    pub fn overlaps(&self, other: &Self) -> bool {
        let apart = self.from_m > other.to_m - TOUCH_M || other.from_m > self.to_m - TOUCH_M;
        !apart && self.section.overlaps(&other.section)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn solid(from_m: f64, to_m: f64, section: Section) -> Solid {
        Solid { from_m, to_m, section }
    }

    #[test]
    fn val_hand_boxes_discs_and_rings_overlap_where_they_share_space() {
        let square = |angle_rad| Section::rectangle([0.02, 0.04], [-0.01, 0.01], angle_rad);
        let disc = |y, radius_m| Section::disc([y, 0.0], radius_m);
        let ring = |outside_m, inside_m| Section::Ring { outside_m, inside_m };
        let quarter = TAU / 4.0;
        for (a, b, overlap) in [
            (square(0.0), disc(0.01, 0.0099), false),
            (square(0.0), disc(0.01, 0.0102), true),
            (square(0.0), square(quarter), false),
            (square(0.0), square(quarter / 4.0), true),
            // Corners at hypot(0.04, 0.01) = 0.0412; the nearest edge at 0.02.
            (square(0.0), ring(0.05, 0.0413), false),
            (square(0.0), ring(0.05, 0.0411), true),
            (square(0.0), ring(0.02, 0.01), false),
            (square(0.0), ring(0.021, 0.01), true),
            (disc(0.0, 0.01), ring(0.02, 0.0), true),
            (ring(0.03, 0.02), ring(0.02, 0.01), false),
            (ring(0.03, 0.02), ring(0.021, 0.01), true),
        ] {
            let solids = [solid(0.0, 0.1, a), solid(0.09, 0.2, b)];
            assert_eq!(solids[0].overlaps(&solids[1]), overlap, "{solids:?}");
            assert_eq!(solids[1].overlaps(&solids[0]), overlap, "{solids:?}");
            let above = Solid { from_m: 0.1, ..solids[1].clone() };
            assert!(!solids[0].overlaps(&above));
        }
    }
}
