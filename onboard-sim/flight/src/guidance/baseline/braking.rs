//! The vertical motion of an upright vehicle under its motor. The simple controllers compute it before the flight.

use crate::vehicle::burn::Burn;
use crate::vehicle::mission::Mission;

use super::mean_cosine;

/// Step of the integration, s.
const STEP_S: f64 = 0.002;
/// Halvings of an interval.
const HALVINGS: usize = 30;
/// Vertical velocity aimed for at contact, m/s.
const CONTACT_M_S: f64 = -0.2;

/// The vehicle and its motor during braking.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Brake {
    pub(crate) mass_at_ignition_kg: f64,
    pub(crate) gravity_m_s2: f64,
    pub(crate) air_density_kg_m3: f64,
    /// Drag area of body and fins, m^2.
    pub(crate) drag_area_m2: f64,
    /// Fraction of the thrust that acts along the vertical.
    pub(crate) thrust_share: f64,
}

/// The end of a fall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stop {
    /// Distance fallen, m.
    pub(crate) fallen_m: f64,
    /// Vertical velocity there, m/s: the target, or the velocity at which the thrust falls through the weight.
    pub(crate) vertical_m_s: f64,
}

impl Brake {
    /// Falls from a moment of the burn until the target velocity is reached or the thrust is below the weight.
    pub(crate) fn stop(&self, burn: &Burn<'_>, burning_s: f64, vertical_m_s: f64) -> Stop {
        let carried_s =
            burn.falls_through_weight_s(self.mass_at_ignition_kg, self.gravity_m_s2).unwrap_or(burning_s);
        let (mut time_s, mut speed_m_s, mut fallen_m) = (burning_s, vertical_m_s, 0.0);
        while time_s < carried_s && speed_m_s < CONTACT_M_S {
            let mass_kg = self.mass_at_ignition_kg - burn.burnt_kg(time_s);
            let drag_n = 0.5 * self.air_density_kg_m3 * self.drag_area_m2 * speed_m_s * speed_m_s;
            let force_n = self.thrust_share * burn.mean_thrust_n(time_s, STEP_S) + drag_n;
            let after_m_s = speed_m_s + STEP_S * (force_n / mass_kg - self.gravity_m_s2);
            fallen_m -= 0.5 * STEP_S * (speed_m_s + after_m_s);
            speed_m_s = after_m_s;
            time_s += STEP_S;
        }
        Stop { fallen_m, vertical_m_s: speed_m_s }
    }

    /// The drag area, within a range, that brings the vehicle to rest just when the thrust falls through the weight:
    /// the smallest area if even that brakes too much, the largest if even that brakes too little.
    pub(crate) fn drag_area_to_rest_m2(
        &self,
        burn: &Burn<'_>,
        vertical_m_s: f64,
        [least_m2, most_m2]: [f64; 2],
    ) -> f64 {
        let rests = |drag_area_m2: f64| {
            Self { drag_area_m2, ..*self }.stop(burn, 0.0, vertical_m_s).vertical_m_s >= CONTACT_M_S
        };
        smallest(least_m2, most_m2, rests)
    }

    /// The swing with which the vehicle comes to rest after falling exactly its height, rad.
    pub(crate) fn swing_to_rest_rad(
        &self,
        burn: &Burn<'_>,
        burning_s: f64,
        vertical_m_s: f64,
        height_m: f64,
        most_rad: f64,
    ) -> f64 {
        // The larger the swing, the farther it falls.
        let reaches = |swing_rad: f64| {
            let brake = Self { thrust_share: mean_cosine(swing_rad), ..*self };
            brake.stop(burn, burning_s, vertical_m_s).fallen_m >= height_m
        };
        smallest(0.0, most_rad, reaches)
    }
}

/// The smallest value that fulfils a condition, which must hold for all larger values; the maximum if none does.
fn smallest(least: f64, most: f64, holds: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (least, most);
    if holds(low) {
        return low;
    }
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if holds(middle) { high = middle } else { low = middle }
    }
    high
}

/// Speed, m/s, after a fall of `fallen_m` from the mission's apogee, fins open.
pub(crate) fn nominal_fall_speed_m_s(
    mission: &Mission,
    mass_kg: f64,
    drag_area_m2: f64,
    fallen_m: f64,
) -> f64 {
    let density_kg_m3 = crate::vehicle::atmosphere::Air::at_height_m(mission.pad_altitude_m).density_kg_m3;
    let terminal2 = 2.0 * mass_kg * mission.gravity_m_s2 / (density_kg_m3 * drag_area_m2);
    let shed = libm::exp(-2.0 * mission.gravity_m_s2 * fallen_m / terminal2);
    libm::sqrt(terminal2 * (1.0 - shed))
}

#[cfg(test)]
mod tests {
    use crate::vehicle::thrust_curve::{MotorData, ThrustCurve, ThrustPoint};

    use super::*;

    /// A massless motor with 40 N for ten seconds on 2 kg, without air, at 10 m/s^2: the vehicle brakes at 10 m/s^2.
    fn brake() -> (Brake, ThrustCurve) {
        // No motor file may say so: it is not read from one.
        let at = |(time_s, thrust_n)| ThrustPoint { time_s, thrust_n };
        let curve = ThrustCurve::new(MotorData {
            name: "T".into(),
            manufacturer: "M".into(),
            diameter_m: 0.038,
            length_m: 0.2,
            propellant_mass_kg: 1e-6,
            total_mass_kg: 0.3,
            points: [(0.0, 0.0), (0.001, 40.0), (9.999, 40.0), (10.0, 0.0)].map(at).to_vec(),
        })
        .unwrap();
        let brake = Brake {
            mass_at_ignition_kg: 2.0,
            gravity_m_s2: 10.0,
            air_density_kg_m3: 1.2,
            drag_area_m2: 0.0,
            thrust_share: 1.0,
        };
        (brake, curve)
    }

    /// From 20 m/s at 10 m/s^2: 20 m, less 2 mm because the contact speed is not zero.
    #[test]
    fn a_fall_stops_after_the_distance_of_constant_deceleration() {
        let (brake, curve) = brake();
        let stop = brake.stop(&Burn::nominal(&curve), 0.1, -20.0);
        assert!((stop.fallen_m - (20.0 - 0.002)).abs() < 0.01, "{stop:?}");
        assert!((stop.vertical_m_s - CONTACT_M_S).abs() < 0.021, "{stop:?}");
    }

    /// 25 m instead of 20 m takes 8 m/s^2: nine tenths of the thrust, and J0(0.64) = 0.9.
    #[test]
    fn the_swing_wastes_the_surplus_thrust() {
        let (brake, curve) = brake();
        let swing_rad = brake.swing_to_rest_rad(&Burn::nominal(&curve), 0.1, -20.0, 25.0, 1.0);
        assert!((swing_rad - 0.6407).abs() < 0.005, "{swing_rad}");
        let none = brake.swing_to_rest_rad(&Burn::nominal(&curve), 0.1, -20.0, 15.0, 1.0);
        assert!(none.abs() < 1e-12, "{none}");
    }
}
