//! The shape of the rocket, seen from its centre of gravity: cylinders about its x axis, which
//! points to the nose.

use flight::vehicle::airframe::{Airframe, MassModel};
use rerun::archetypes::{Cylinders3D, Ellipsoids3D, LineStrips3D};
use rerun::components::{FillMode, RotationAxisAngle};
use rerun::datatypes::{Angle, Rgba32};

const WHITE: Rgba32 = Rgba32::from_rgb(236, 238, 240);
const BAND: Rgba32 = Rgba32::from_rgb(226, 88, 34);
const METAL: Rgba32 = Rgba32::from_rgb(120, 126, 134);

/// Where the nose begins, over the length of the body.
const NOSE_BASE: f32 = 0.78;

/// Length of the nozzle's bell, in radii of the body.
const BELL_RADII: f32 = 1.2;

/// The measures of a rocket, m.
#[derive(Debug, Clone, Copy, PartialEq)]
#[expect(clippy::struct_field_names, reason = "each name ends in its unit")]
pub(crate) struct RocketShape {
    /// Front end of the body.
    nose_x_m: f32,
    /// Rear end of the body, where the nozzle turns.
    tail_x_m: f32,
    /// Where the feet are.
    foot_x_m: f32,
    /// Of the body.
    radius_m: f32,
}

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

    pub(crate) fn body(&self) -> Cylinders3D {
        let part = |from: f32, to: f32, color| {
            ([from, to].map(|share| self.tail_x_m + share * self.length_m()), self.radius_m, color)
        };
        cylinders([part(0.0, 0.55, WHITE), part(0.55, 0.62, BAND), part(0.62, NOSE_BASE, WHITE)])
    }

    pub(crate) fn nose(&self) -> Ellipsoids3D {
        let length_m = (1.0 - NOSE_BASE) * self.length_m();
        let (at, half) = ([self.nose_x_m - length_m, 0.0, 0.0], [length_m, self.radius_m, self.radius_m]);
        let nose = Ellipsoids3D::from_centers_and_half_sizes([at], [half]);
        nose.with_colors([BAND]).with_fill_mode(FillMode::Solid)
    }

    /// The bell of the nozzle, which widens to the rear.
    pub(crate) fn bell(&self) -> Cylinders3D {
        let bell_m = BELL_RADII * self.radius_m;
        cylinders([(0.0, 0.45), (0.5, 0.7)].map(|(from, radii): (f32, f32)| {
            let rear_m = self.tail_x_m - (from + 0.5) * bell_m;
            ([rear_m, rear_m + 0.5 * bell_m], radii * self.radius_m, METAL)
        }))
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

/// Solid cylinders along x: where each begins and ends, its radius, m, and its colour.
fn cylinders<const N: usize>(parts: [([f32; 2], f32, Rgba32); N]) -> Cylinders3D {
    // Without a rotation they stand along z.
    let along_x = RotationAxisAngle::new([0.0, 1.0, 0.0], Angle::from_degrees(90.0));
    Cylinders3D::from_lengths_and_radii(
        parts.map(|([rear, front], ..)| front - rear),
        parts.map(|part| part.1),
    )
    .with_centers(parts.map(|([rear, front], ..)| [0.5 * (rear + front), 0.0, 0.0]))
    .with_rotation_axis_angles([along_x; N])
    .with_colors(parts.map(|part| part.2))
    .with_fill_mode(FillMode::Solid)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_known_airframe_stands_on_its_feet_and_an_unknown_one_clear_of_its_nozzle() {
        let mission = flight::vehicles::mission::builtin("mk2").unwrap().unwrap();
        let airframe = &mission.airframe;
        let shape = RocketShape::of_airframe(airframe, mission.motor_curve.propellant_mass_kg());
        assert!((f64::from(shape.length_m()) - airframe.body.length_m).abs() < 1e-6);
        assert!((f64::from(shape.foot_x_m - shape.tail_x_m) - airframe.legs.foot_station_m).abs() < 1e-6);
        let unknown = RocketShape::unknown();
        assert!((unknown.length_m() - 1.0).abs() < 1e-6);
        assert!(unknown.foot_x_m < unknown.tail_x_m - BELL_RADII * unknown.radius_m);
    }
}
