//! The expected burn of the landing motor.

use crate::vehicle::thrust_curve::ThrustCurve;

/// A certified thrust curve with the scales of this motor: `T(t) = s/b T0(t/b)`, so that `s` scales the impulse and `b`
/// the time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Burn<'a> {
    /// The certified curve.
    pub curve: &'a ThrustCurve,
    /// Impulse over the certified impulse.
    pub impulse_scale: f64,
    /// Burn time over the certified burn time.
    pub time_scale: f64,
}

impl<'a> Burn<'a> {
    /// The burn as certified.
    pub fn nominal(curve: &'a ThrustCurve) -> Self {
        Self { curve, impulse_scale: 1.0, time_scale: 1.0 }
    }

    /// Thrust at a time since it began, N.
    pub fn thrust_n(&self, burning_s: f64) -> f64 {
        self.impulse_scale / self.time_scale * self.curve.thrust_at_n(burning_s / self.time_scale)
    }

    /// Mean thrust over `[from_s, from_s + duration_s]` since it began, N.
    pub fn mean_thrust_n(&self, from_s: f64, duration_s: f64) -> f64 {
        let curve_n = self.curve.mean_thrust_n(from_s / self.time_scale, duration_s / self.time_scale);
        self.impulse_scale / self.time_scale * curve_n
    }

    /// Propellant burnt up to a time since it began, kg.
    pub fn burnt_kg(&self, burning_s: f64) -> f64 {
        self.curve.propellant_burnt_kg(burning_s / self.time_scale)
    }

    /// When the thrust falls through the weight for the last time, s since it began; `None` if it never exceeds the
    /// weight.
    ///
    /// `mass_at_ignition_kg` is the mass before the burn.
    pub fn falls_through_weight_s(&self, mass_at_ignition_kg: f64, gravity_m_s2: f64) -> Option<f64> {
        let mut time_s = self.time_scale * self.curve.burn_time_s();
        // The burnt propellant changes the weight by one or two per cent, so the fixed-point iteration needs few
        // rounds.
        for _ in 0..4 {
            let weight_n = (mass_at_ignition_kg - self.burnt_kg(time_s)) * gravity_m_s2;
            let curve_n = weight_n * self.time_scale / self.impulse_scale;
            time_s = self.time_scale * self.curve.falls_through_s(curve_n)?;
        }
        Some(time_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicles::motors;

    #[test]
    fn the_scales_give_the_stated_impulse_and_burn_time() {
        let curve = motors::builtin("H45W").expect("a built-in motor");
        let burn = Burn { curve: &curve, impulse_scale: 1.05, time_scale: 0.96 };
        let whole_n_s = burn.mean_thrust_n(0.0, 10.0) * 10.0;
        assert!((whole_n_s - 1.05 * curve.total_impulse_n_s()).abs() < 1e-9);
        assert!((burn.burnt_kg(10.0) - curve.propellant_mass_kg()).abs() < 1e-12);
    }

    #[test]
    fn thrust_equals_weight_at_the_fall_through() {
        let curve = motors::builtin("H45W").expect("a built-in motor");
        let burn = Burn { curve: &curve, impulse_scale: 0.97, time_scale: 1.03 };
        let time_s = burn.falls_through_weight_s(3.13, 9.80665).expect("the thrust carries the vehicle");
        let weight_n = (3.13 - burn.burnt_kg(time_s)) * 9.80665;
        assert!((burn.thrust_n(time_s) - weight_n).abs() < 1e-3, "{time_s} s");
        assert!(burn.thrust_n(time_s + 0.1) < weight_n);
        assert_eq!(burn.falls_through_weight_s(30.0, 9.80665), None);
    }
}
