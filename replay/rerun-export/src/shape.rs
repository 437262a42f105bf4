//! The shape of the rocket: bodies of revolution about its x axis, which points to the nose.

use flight::vehicle::airframe::{Airframe, MassModel};
use rerun::archetypes::{LineStrips3D, Mesh3D};
use rerun::components::Color;
use rerun::datatypes::{Rgba32, UVec3D, Vec3D};

/// Number of edges of a circle.
const SEGMENTS: u32 = 32;

/// Where the nose begins, over the length.
const NOSE_BASE: f32 = 0.78;

/// Number of rings along the nose.
const NOSE_RINGS: u8 = 8;

const WHITE: Rgba32 = Rgba32::from_rgb(236, 238, 240);
const BAND: Rgba32 = Rgba32::from_rgb(226, 88, 34);
const METAL: Rgba32 = Rgba32::from_rgb(120, 126, 134);

/// The measures of a rocket, seen from its centre of gravity.
#[derive(Debug, Clone, Copy, PartialEq)]
#[expect(clippy::struct_field_names, reason = "each name ends in its unit")]
pub(crate) struct RocketShape {
    /// Front end of the body, m.
    nose_x_m: f32,
    /// Rear end of the body, m.
    tail_x_m: f32,
    /// Where the feet are, m.
    foot_x_m: f32,
    /// Radius of the body, m.
    radius_m: f32,
}

/// Length of the nozzle's bell, in radii of the body.
const BELL_RADII: f32 = 1.2;

impl RocketShape {
    /// An airframe with its landing motor burnt out, as it touches down.
    pub(crate) fn of_airframe(airframe: &Airframe, propellant_mass_kg: f64) -> Self {
        let cg_station_m =
            MassModel::new(&airframe.mass, propellant_mass_kg).at(propellant_mass_kg).cg_station_m;
        Self {
            nose_x_m: (airframe.body.length_m - cg_station_m) as f32,
            tail_x_m: -cg_station_m as f32,
            foot_x_m: -airframe.above_feet_m(cg_station_m) as f32,
            radius_m: (airframe.body.diameter_m / 2.0) as f32,
        }
    }

    /// For logs without this data: one metre long, its feet clear of the bell.
    pub(crate) fn unknown() -> Self {
        Self { nose_x_m: 0.5, tail_x_m: -0.5, foot_x_m: -0.584, radius_m: 0.05 }
    }

    /// Length of the body, m.
    pub(crate) fn length_m(&self) -> f32 {
        self.nose_x_m - self.tail_x_m
    }

    /// Length of the nozzle's bell, m.
    fn bell_m(&self) -> f32 {
        BELL_RADII * self.radius_m
    }

    pub(crate) fn body(&self) -> Mesh3D {
        let along = |part: f32| self.tail_x_m + part * self.length_m();
        let cylinder = [
            (along(0.0), 0.0, METAL),
            (along(0.0), 1.0, WHITE),
            (along(0.55), 1.0, WHITE),
            (along(0.55), 1.0, BAND),
            (along(0.62), 1.0, BAND),
            (along(0.62), 1.0, WHITE),
            (along(NOSE_BASE), 1.0, WHITE),
        ];
        let nose = (0..=NOSE_RINGS).map(|ring| {
            let part = f32::from(ring) / f32::from(NOSE_RINGS);
            (along(NOSE_BASE + part * (1.0 - NOSE_BASE)), (1.0 - part * part).sqrt(), BAND)
        });
        self.of_rings(cylinder.into_iter().chain(nose))
    }

    /// The bell of the nozzle, at the tail.
    pub(crate) fn bell(&self) -> Mesh3D {
        let rings = [(1.0, 0.0), (1.0, 0.75), (0.5, 0.6), (0.0, 0.3), (0.0, 0.0)];
        self.of_rings(
            rings.into_iter().map(|(along, part)| (self.tail_x_m - along * self.bell_m(), part, METAL)),
        )
    }

    /// The surface through rings: place, m, radius over the body's, and colour.
    fn of_rings(&self, rings: impl Iterator<Item = (f32, f32, Rgba32)>) -> Mesh3D {
        let ring = |(x_m, part, color)| Ring { x_m, radius_m: part * self.radius_m, color };
        body_of_revolution(&rings.map(ring).collect::<Vec<_>>())
    }

    /// Four legs from the body to the ground.
    pub(crate) fn legs(&self) -> LineStrips3D {
        let hip_x_m = self.tail_x_m + 0.2 * self.length_m();
        let out_m = 4.5 * self.radius_m;
        let strips = [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)].map(|(y, z): (f32, f32)| {
            [
                [hip_x_m, y * self.radius_m, z * self.radius_m],
                [self.foot_x_m, y * out_m, z * out_m],
                [self.tail_x_m, y * self.radius_m, z * self.radius_m],
            ]
        });
        LineStrips3D::new(strips).with_colors([METAL]).with_radii([0.1 * self.radius_m])
    }
}

/// A ring about the x axis.
#[derive(Debug, Clone, Copy)]
struct Ring {
    x_m: f32,
    radius_m: f32,
    color: Rgba32,
}

/// The surface between neighbouring rings, from the tail forward; each pair has its own normals, so that edges stay
/// sharp.
fn body_of_revolution(rings: &[Ring]) -> Mesh3D {
    let (mut positions, mut normals, mut colors) = (Vec::new(), Vec::<Vec3D>::new(), Vec::<Color>::new());
    let mut triangles = Vec::new();
    for (start, pair) in (0..).step_by(2 * SEGMENTS as usize).zip(rings.windows(2)) {
        let [rear, front] = [pair[0], pair[1]];
        let (along_m, outward_m) = (front.x_m - rear.x_m, front.radius_m - rear.radius_m);
        let slant_m = along_m.hypot(outward_m);
        let (normal_x, normal_out) =
            if slant_m > 0.0 { (-outward_m / slant_m, along_m / slant_m) } else { (-1.0, 0.0) };
        for segment in 0..SEGMENTS {
            let angle_rad = std::f64::consts::TAU * f64::from(segment) / f64::from(SEGMENTS);
            let (sin, cos) = libm::sincos(angle_rad);
            let (y, z) = (cos as f32, sin as f32);
            for ring in [rear, front] {
                positions.push([ring.x_m, ring.radius_m * y, ring.radius_m * z]);
                normals.push([normal_x, normal_out * y, normal_out * z].into());
                colors.push(ring.color.into());
            }
            let (here, next) = (start + 2 * segment, start + 2 * ((segment + 1) % SEGMENTS));
            triangles.push(UVec3D::new(here, here + 1, next));
            triangles.push(UVec3D::new(next, here + 1, next + 1));
        }
    }
    Mesh3D::new(positions)
        .with_triangle_indices(triangles)
        .with_vertex_normals(normals)
        .with_vertex_colors(colors)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_feet_are_below_the_nozzle() {
        let shape = RocketShape::unknown();
        assert!((shape.length_m() - 1.0).abs() < 1e-6);
        assert!(-shape.foot_x_m > 0.5 + shape.bell_m());
    }

    #[test]
    fn an_airframe_stands_on_its_own_feet() {
        let mission = flight::vehicles::mission::builtin("mk2").unwrap().unwrap();
        let propellant_kg = mission.motor_curve.propellant_mass_kg();
        let shape = RocketShape::of_airframe(&mission.airframe, propellant_kg);
        let airframe = &mission.airframe;
        assert!((f64::from(shape.length_m()) - airframe.body.length_m).abs() < 1e-6);
        assert!((f64::from(shape.foot_x_m - shape.tail_x_m) - airframe.legs.foot_station_m).abs() < 1e-6);
    }

    #[test]
    fn its_meshes_are_sound() {
        let shape = RocketShape::unknown();
        for mesh in [shape.body(), shape.bell()] {
            mesh.sanity_check().unwrap();
            assert!(mesh.num_triangles() > 100);
        }
    }
}
