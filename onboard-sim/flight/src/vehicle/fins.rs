//! The four fins of the landing paper: drag, lift and moments as functions of the opening angle
//! (section 2, Eq. 1-17).
//!
//! Each fin is a quarter of the fuselage's skin, with its hinge near the nose; `kappa` is its
//! opening angle, 0 closed against the body and pi/2 fully open. (Eq. 1 prints `pi - X_b . Y_f`,
//! which is no angle.) Body axes are those of [`crate::vehicle::rigid`]: x to the nose, moments
//! about x roll, y pitch, z yaw. The middles of the closed fins are 45 degrees from the y axis, so
//! that the four quarters close into a cylinder. The hinge is 15 degrees off the fin's middle,
//! towards the y axis ("the fins' links are rotated at an angle of 15 degrees", section 2.1): an
//! open fin stands at its hinge, 30 degrees from y, and its skin reaches further to one side of it.
//! From that comes its lift: a fin hinged at its middle has none. Seen
//! along the body, an open fin `i` is at
//!
//! ```text
//! (y, z) = r (-YAW[i] cos h, PITCH[i] sin h),   r = (D + L_f sin kappa) / 2,   h = 30 deg
//! ```
//!
//! At this place a drag towards the nose has the moments of Eq. 16 and 17. `h` is the angle of Eq.
//! 9-12, too, and another airframe may have another. As in the paper the force acts at the hinge's
//! angle: that the middle of an open fin is `D/2 sin 15 deg`, 10 mm, beside it, is left out.
//!
//! Errors of the printed equations, and their corrections:
//! * Eq. 3 and Eq. 13-14 each have a sine of kappa; it is one and the same, and the force goes as
//!   `sin kappa`.
//! * Eq. 16 and 17 multiply the bracket by one force, but each fin has its own force, so the sum is
//!   taken fin by fin.
//! * Eq. 15 sums four lift moments of one sign: four equal openings would spin the vehicle. The
//!   text's "chosen symmetries" need neighbours that mirror each other, so the signs alternate
//!   ([`ROLL`]). The patterns of roll, pitch, yaw and drag are then orthogonal, which is the
//!   decoupling that section 2.1 claims.

/// Signs of the fins' roll moments. The hinges are on the side where the side force of the lift
/// acts with the drag in yaw, and against it, but more strongly, in pitch. With hinges on the other
/// side the two would almost cancel in yaw.
pub const ROLL: [f64; 4] = [-1.0, 1.0, -1.0, 1.0];
/// Signs of the fins' pitch moments (Eq. 16).
pub const PITCH: [f64; 4] = [1.0, -1.0, -1.0, 1.0];
/// Signs of the fins' yaw moments (Eq. 17).
pub const YAW: [f64; 4] = [1.0, 1.0, -1.0, -1.0];

/// Coefficients and size of the fins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FinModel {
    /// Reference area of the coefficients (the paper's S_b), m^2.
    pub reference_area_m2: f64,
    /// Drag coefficient of an open fin (C_xf).
    pub drag_coefficient: f64,
    /// Lift coefficient of an open fin (C_zf).
    pub lift_coefficient: f64,
    /// Length of a fin (L_f), m.
    pub length_m: f64,
    /// Diameter of the body (D), m.
    pub body_diameter_m: f64,
    /// Sine and cosine of the angle between the y axis and an open fin.
    pub from_y: (f64, f64),
}

/// Sine and cosine of an angle in degrees; those of the paper's 30 degrees exactly, of which no
/// `f64` in radians has the sine.
pub fn sin_cos_deg(angle_deg: f64) -> (f64, f64) {
    const COS_30: f64 = 0.866_025_403_784_438_6;
    if (angle_deg - 30.0).abs() < 1e-9 { (0.5, COS_30) } else { libm::sincos(angle_deg.to_radians()) }
}

impl FinModel {
    /// Direction from the axis to an open fin, body y and z.
    pub fn outward(&self, fin: usize) -> [f64; 2] {
        let (sin, cos) = self.from_y;
        [-YAW[fin] * cos, PITCH[fin] * sin]
    }

    /// Distance of a fin's force from the axis, m, from the sine of its opening angle.
    pub fn radius_m(&self, sin_kappa: f64) -> f64 {
        0.5 * (self.body_diameter_m + self.length_m * sin_kappa)
    }
}

#[cfg(test)]
mod tests {
    use core::f64::consts::FRAC_PI_2;

    use nalgebra::{Vector2, Vector3};
    use proptest::prelude::*;

    use super::*;
    use crate::control::fins::{Allocation, FinCommand};

    /// Sine and cosine of the paper's 30 degrees.
    const PLACE: (f64, f64) = (0.5, 0.866_025_403_784_438_6);

    /// The paper's fins: section 2.1 and Eq. 2.
    fn model() -> FinModel {
        FinModel {
            reference_area_m2: 0.0043,
            drag_coefficient: 1.55,
            lift_coefficient: 1.28,
            length_m: 0.10,
            body_diameter_m: 0.074,
            from_y: PLACE,
        }
    }

    fn allocation() -> Allocation {
        Allocation { model: model(), arm_m: 0.23, min_rad: 20.0_f64.to_radians(), max_rad: FRAC_PI_2 }
    }

    fn close(found: f64, expected: f64, what: &str) {
        assert!(
            (found - expected).abs() <= 1e-9 * expected.abs().max(1.0),
            "{what}: {found}, expected {expected}"
        );
    }

    /// One open fin at 1,000 Pa, radius (0.074 + 0.1)/2 = 0.087 m: roll 0.087 x 5.504, pitch 0.087
    /// x 0.5 x 6.665, yaw 0.087 x 0.8660254 x 6.665. The arm of the lifts' side force is left out,
    /// as in the paper.
    #[test]
    fn val_hand_moments_of_one_fin() {
        for i in 0..4 {
            let mut kappa_rad = [0.0; 4];
            kappa_rad[i] = FRAC_PI_2;
            let moments = Allocation { arm_m: 0.0, ..allocation() }.moments_n_m(1000.0, kappa_rad);
            close(moments.x, ROLL[i] * 0.478_848, "roll");
            close(moments.y, PITCH[i] * 0.289_927_5, "pitch");
            close(moments.z, YAW[i] * 0.502_169_160_532, "yaw");
        }
    }

    /// The paper's decoupling: equal openings give no moment, and each pattern gives a moment about
    /// its own axis.
    #[test]
    fn patterns_are_decoupled() {
        let at = |amplitude: f64, signs: [f64; 4]| {
            let kappa_rad = signs.map(|sign| libm::asin(0.6 + sign * amplitude));
            let moments = allocation().moments_n_m(800.0, kappa_rad);
            [moments.x, moments.y, moments.z]
        };
        for (signs, axis) in [(ROLL, 0), (PITCH, 1), (YAW, 2)] {
            let found = at(0.2, signs);
            for (other, value) in found.into_iter().enumerate() {
                assert_eq!(value.abs() > 1e-3, other == axis, "pattern {axis}: {found:?}");
            }
            assert!(at(0.0, signs).map(f64::abs).iter().sum::<f64>() < 1e-12);
        }
    }

    /// Wherever the fins stand: drag along the axis and lift across it and the fin's direction, at
    /// their places, turn the vehicle by what the allocation counts on.
    #[test]
    fn at_any_place_the_allocation_has_the_moments_of_the_forces() {
        for open_deg in [20.0, 30.0, 45.0, 60.0] {
            let model = FinModel { from_y: sin_cos_deg(open_deg), ..model() };
            let allocation = Allocation { model, ..allocation() };
            let kappa_rad = [0.5, 0.9, 1.3, 0.7];
            let mut sum = Vector3::zeros();
            for (fin, kappa_rad) in kappa_rad.into_iter().enumerate() {
                let (sine, outward) =
                    (libm::sin(kappa_rad), Vector2::from(model.outward(fin)).insert_row(0, 0.0));
                assert!((libm::atan2(outward.z.abs(), outward.y.abs()).to_degrees() - open_deg).abs() < 1e-9);
                let force_n = Vector3::x() * (800.0 * 0.0043 * 1.55 * sine)
                    + Vector3::x().cross(&outward) * (800.0 * 0.0043 * 1.28 * sine * ROLL[fin]);
                sum += (Vector3::x() * 0.23 + outward * model.radius_m(sine)).cross(&force_n);
            }
            let found = allocation.moments_n_m(800.0, kappa_rad);
            close(found.x, sum.x, "roll");
            close(found.y, sum.y, "pitch");
            close(found.z, sum.z, "yaw");
        }
    }

    #[test]
    fn without_air_or_with_a_bad_command_the_fins_open() {
        let command = FinCommand { moments_n_m: Vector3::zeros(), drag_area_m2: 0.01 };
        let nonsense = FinCommand { drag_area_m2: f64::NAN, ..command };
        for (command, pressure_pa) in
            [(command, 0.0), (command, f64::NAN), (nonsense, 900.0), (command, -3.0)]
        {
            for kappa_rad in allocation().openings_rad(&command, pressure_pa) {
                close(kappa_rad, FRAC_PI_2, "open");
            }
        }
    }

    /// Pitch takes its share of the room, roll what is left, and no drag is wanted.
    #[test]
    fn pitch_has_priority_over_roll_and_drag() {
        let allocation = allocation();
        let moments_n_m = Vector3::new(50.0, 40.0, 0.0);
        let kappa_rad = allocation.openings_rad(&FinCommand { moments_n_m, drag_area_m2: 0.0 }, 900.0);
        let room = 1.0 - libm::sin(20.0_f64.to_radians());
        for (fin, found_rad) in kappa_rad.into_iter().enumerate() {
            // Here the side force of the lifts pitches more than their drag, and the other way.
            let sine = 1.0 - 0.5 * room + 0.5 * room * (0.15 * ROLL[fin] - 0.85 * PITCH[fin]);
            // A little of the tilt's share goes against the yaw that unequal fins make.
            assert!((libm::sin(found_rad) - sine).abs() < 0.001, "{fin}: {found_rad}");
        }
    }

    /// The moment of a tilt far beyond the fins' ability keeps its direction, within a degree.
    #[test]
    fn a_saturated_tilt_preserves_its_direction() {
        let allocation = allocation();
        for wanted_n_m in [1.0, 10.0, 1000.0] {
            for step in 0..36 {
                let (sin, cos) = libm::sincos(f64::from(step) * core::f64::consts::TAU / 36.0);
                let moments_n_m = Vector3::new(0.0, wanted_n_m * cos, wanted_n_m * sin);
                for drag_area_m2 in [0.0, 0.015, 1.0] {
                    let kappa_rad = allocation.openings_rad(&FinCommand { moments_n_m, drag_area_m2 }, 900.0);
                    let [_, pitch_n_m, yaw_n_m] = allocation.moments_n_m(900.0, kappa_rad).into();
                    let (along, across) = (cos * pitch_n_m + sin * yaw_n_m, cos * yaw_n_m - sin * pitch_n_m);
                    assert!(
                        along > 0.25 && across.abs() < 0.017 * along,
                        "{moments_n_m}: {pitch_n_m}, {yaw_n_m}"
                    );
                }
            }
        }
    }

    proptest! {
        /// For any command the fins stay between their stops.
        #[test]
        fn openings_stay_in_range(
            roll_n_m in proptest::num::f64::ANY,
            pitch_n_m in proptest::num::f64::ANY,
            yaw_n_m in proptest::num::f64::ANY,
            drag_area_m2 in proptest::num::f64::ANY,
            dynamic_pressure_pa in proptest::num::f64::ANY,
        ) {
            let command = FinCommand { moments_n_m: Vector3::new(roll_n_m, pitch_n_m, yaw_n_m), drag_area_m2 };
            let allocation = allocation();
            for kappa_rad in allocation.openings_rad(&command, dynamic_pressure_pa) {
                prop_assert!((allocation.min_rad..=allocation.max_rad).contains(&kappa_rad), "{kappa_rad}");
            }
        }

        /// A command that fits between the stops is met exactly: the allocation is the inverse of
        /// the model.
        #[test]
        fn what_fits_is_given(
            mean in 0.6..0.8_f64,
            roll in -0.06..0.06_f64,
            pitch in -0.06..0.06_f64,
            yaw in -0.06..0.06_f64,
            dynamic_pressure_pa in 100.0..1500.0_f64,
        ) {
            let allocation = allocation();
            let kappa_rad: [f64; 4] = core::array::from_fn(|i| {
                libm::asin(mean + roll * ROLL[i] + pitch * PITCH[i] + yaw * YAW[i])
            });
            let command = FinCommand {
                moments_n_m: allocation.moments_n_m(dynamic_pressure_pa, kappa_rad),
                drag_area_m2: allocation.drag_area_m2(kappa_rad),
            };
            let found_rad = allocation.openings_rad(&command, dynamic_pressure_pa);
            for (found, expected) in found_rad.into_iter().zip(kappa_rad) {
                prop_assert!((found - expected).abs() < 1e-6, "{found_rad:?}, wanted {kappa_rad:?}");
            }
        }
    }
}
