//! The moment of the air on body and fins, by the airframe's data: drag along the local wind and lift of each fin at its
//! place, and the crossflow of the body in strips (Eq. 2, 13 and 14 of the landing paper; Hoerner, Fluid-Dynamic Drag,
//! chapter 3).

use flight::vehicle::airframe::Airframe;
use flight::vehicle::fins::{COS_30, PITCH, ROLL, SIN_30, YAW};
use nalgebra::Vector3;

/// Strips of the body: with four the damping moment is exact to 2 %.
const STRIPS: usize = 4;

/// Moment about the centre of gravity at a station, m, in body axes, N m, for a velocity through the air in body axes,
/// m/s, a rotation rate, rad/s, and the fins' openings, rad.
pub(super) fn air_moment_n_m(
    airframe: &Airframe,
    cg_station_m: f64,
    density_kg_m3: f64,
    through_air_m_s: &Vector3<f64>,
    rate_rad_s: &Vector3<f64>,
    fins_rad: &[f64; 4],
) -> Vector3<f64> {
    let (body, fins) = (&airframe.body, airframe.fin_model());
    let half = 0.5 * density_kg_m3;
    let strip_m = body.length_m / STRIPS as f64;
    let strip_m2 = body.crossflow_drag_coefficient * body.diameter_m * strip_m;
    let mut moment = Vector3::zeros();
    for strip in 0..STRIPS {
        let place_m = Vector3::new(strip_m * (strip as f64 + 0.5) - cg_station_m, 0.0, 0.0);
        let mut across = through_air_m_s + rate_rad_s.cross(&place_m);
        across.x = 0.0;
        moment += place_m.cross(&(across * (-half * strip_m2 * across.norm())));
    }
    for fin in 0..4 {
        let sine = libm::sin(fins_rad[fin]);
        let outward = Vector3::new(0.0, -YAW[fin] * COS_30, PITCH[fin] * SIN_30);
        let mut place_m = outward * fins.radius_m(sine);
        place_m.x += airframe.fins.station_m - cg_station_m;
        let local = through_air_m_s + rate_rad_s.cross(&place_m);
        let open = half * fins.reference_area_m2 * sine * local.norm();
        let force_n = local * (-open * fins.drag_coefficient)
            - local.cross(&outward) * (open * fins.lift_coefficient * ROLL[fin]);
        moment += place_m.cross(&force_n);
    }
    moment
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fins open at 90 degrees on mk2, 30 m/s down the axis and 1 m/s along body y: the four drags are 1.55 0.0043 0.6
    /// V (30, -1), V = 30.0167, and act 0.23 m ahead of a centre of gravity at 0.4 m; of the lifts of equal fins, 1.28 0.0043
    /// 0.6 V each, a side wind of 1 m/s leaves 4 sin 30 cos 30 times their radius of 0.087 m. The body has
    /// 1.2 0.074 0.7 m^2 in the middle, at 0.35 m: 0.6 0.06216 1, 0.05 m behind.
    #[test]
    fn val_hand_equal_fins_and_a_side_wind() {
        let airframe = vehicles::airframe::builtin("mk2").unwrap();
        let open = [core::f64::consts::FRAC_PI_2; 4];
        let velocity = Vector3::new(-30.0, 1.0, 0.0);
        let moment = air_moment_n_m(&airframe, 0.4, 1.2, &velocity, &Vector3::zeros(), &open);
        let side_n = -4.0 * 1.55 * 0.0043 * 0.6 * libm::sqrt(901.0);
        let body_n = -0.6 * 0.062_16;
        let lifts_n_m = 1.28 * 0.0043 * 0.6 * libm::sqrt(901.0) * 4.0 * SIN_30 * COS_30 * 0.087;
        assert!((moment.z - (0.23 * side_n - 0.05 * body_n + lifts_n_m)).abs() < 1e-6, "{moment}");
    }
}
