//! The expected burn of the landing motor.

use crate::vehicle::atmosphere::STANDARD_GRAVITY_M_S2;
use crate::vehicle::thrust_curve::ThrustCurve;

/// A certified thrust curve with the scales of this motor: `T(t) = s/b T0(t/b)`, so that `s` scales
/// the impulse and `b` the time: with `t = b u` the integral of `T dt` is `s` times that of `T0
/// du`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Burn<'a> {
    /// The certified curve.
    pub curve: &'a ThrustCurve,
    /// Impulse over the certified impulse.
    pub impulse_scale: f64,
    /// Burn time over the certified burn time.
    pub time_scale: f64,
    /// Deviation from the certified shape.
    pub deviation: Deviation,
}

/// A deviation of the thrust from the certified shape: a fraction of the thrust that fades
/// exponentially from an instant on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Deviation {
    /// At that instant.
    pub share: f64,
    /// The instant, s since the thrust began.
    pub at_s: f64,
    /// Time constant of its fading, s.
    pub lasts_s: f64,
}

impl Deviation {
    /// The certified shape.
    pub const NONE: Self = Self { share: 0.0, at_s: 0.0, lasts_s: 1.0 };

    /// Mean over a span that begins at `from_s` since the thrust began, s: of `exp(-t)` over a time
    /// `d` it is `(1 - exp(-d)) / d`.
    fn mean(&self, from_s: f64, duration_s: f64) -> f64 {
        if self.share == 0.0 {
            return 0.0;
        }
        let begins = ((from_s - self.at_s) / self.lasts_s).max(0.0);
        let lasts = duration_s / self.lasts_s;
        let over_span = if lasts > 1e-6 { (1.0 - libm::exp(-lasts)) / lasts } else { 1.0 };
        self.share * libm::exp(-begins) * over_span
    }
}

impl<'a> Burn<'a> {
    /// The burn as certified.
    pub fn nominal(curve: &'a ThrustCurve) -> Self {
        Self { curve, impulse_scale: 1.0, time_scale: 1.0, deviation: Deviation::NONE }
    }

    /// Thrust at a time since it began, N.
    pub fn thrust_n(&self, burning_s: f64) -> f64 {
        let scaled_n =
            self.impulse_scale / self.time_scale * self.curve.thrust_at_n(burning_s / self.time_scale);
        scaled_n * (1.0 + self.deviation.mean(burning_s, 0.0))
    }

    /// Mean thrust over `[from_s, from_s + duration_s]` since it began, N.
    pub fn mean_thrust_n(&self, from_s: f64, duration_s: f64) -> f64 {
        let curve_n = self.curve.mean_thrust_n(from_s / self.time_scale, duration_s / self.time_scale);
        self.impulse_scale / self.time_scale * curve_n * self.deviates(from_s, duration_s)
    }

    /// Impulse up to a time since it began, N s, without the deviation from the certified shape.
    pub(crate) fn impulse_n_s(&self, burning_s: f64) -> f64 {
        self.impulse_scale * self.curve.impulse_to_n_s(burning_s / self.time_scale)
    }

    /// Factor of the deviation on the mean thrust of a span that begins at `from_s` since it began,
    /// s. It changes little over the spans of a plan, so its mean may multiply the thrust's.
    pub(crate) fn deviates(&self, from_s: f64, duration_s: f64) -> f64 {
        1.0 + self.deviation.mean(from_s, duration_s)
    }

    /// Derivative of the impulse from `from_s` to `until_s` since the thrust began by the deviation
    /// at `from_s`, N s.
    pub fn fading_n_s(&self, from_s: f64, until_s: f64) -> f64 {
        let fading = Deviation { share: 1.0, at_s: from_s, ..self.deviation };
        let duration_s = until_s - from_s;
        self.mean_thrust_n(from_s, duration_s) * fading.mean(from_s, duration_s) * duration_s
    }

    /// Propellant burnt up to a time since it began, kg.
    pub fn burnt_kg(&self, burning_s: f64) -> f64 {
        self.curve.propellant_burnt_kg(burning_s / self.time_scale)
    }

    /// When the thrust falls through the weight for the last time, s since it began; `None` if it
    /// never exceeds the weight.
    ///
    /// `mass_at_ignition_kg` is the mass before the burn.
    pub fn falls_through_weight_s(&self, mass_at_ignition_kg: f64) -> Option<f64> {
        let mut time_s = self.time_scale * self.curve.burn_time_s();
        // The burnt propellant changes the weight by one or two per cent, so the fixed-point
        // iteration needs few rounds.
        for _ in 0..4 {
            let weight_n = (mass_at_ignition_kg - self.burnt_kg(time_s)) * STANDARD_GRAVITY_M_S2;
            let curve_n =
                weight_n * self.time_scale / self.impulse_scale / (1.0 + self.deviation.mean(time_s, 0.0));
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
        let burn = Burn { curve: &curve, impulse_scale: 1.05, time_scale: 0.96, ..Burn::nominal(&curve) };
        let whole_n_s = burn.mean_thrust_n(0.0, 10.0) * 10.0;
        assert!((whole_n_s - 1.05 * curve.total_impulse_n_s()).abs() < 1e-9);
        assert!((burn.burnt_kg(10.0) - curve.propellant_mass_kg()).abs() < 1e-12);
    }

    #[test]
    fn thrust_equals_weight_at_the_fall_through() {
        let curve = motors::builtin("H45W").expect("a built-in motor");
        let burn = Burn { curve: &curve, impulse_scale: 0.97, time_scale: 1.03, ..Burn::nominal(&curve) };
        let time_s = burn.falls_through_weight_s(3.13).expect("the thrust carries the vehicle");
        let weight_n = (3.13 - burn.burnt_kg(time_s)) * 9.80665;
        assert!((burn.thrust_n(time_s) - weight_n).abs() < 1e-3, "{time_s} s");
        assert!(burn.thrust_n(time_s + 0.1) < weight_n);
        assert_eq!(burn.falls_through_weight_s(30.0), None);
    }

    #[test]
    fn val_hand_a_deviation_fades() {
        let deviation = Deviation { share: 0.02, at_s: 1.0, lasts_s: 0.5 };
        assert!((deviation.mean(1.5, 0.0) - 0.02 * libm::exp(-1.0)).abs() < 1e-15);
        // Integral of exp(-t / 0.5) over 1 s is 0.5 (1 - exp(-2)).
        assert!((deviation.mean(1.0, 1.0) - 0.02 * 0.5 * (1.0 - libm::exp(-2.0))).abs() < 1e-15);
        assert!((deviation.mean(0.2, 0.0) - 0.02).abs() < 1e-15, "before the instant it does not grow");
    }
}
