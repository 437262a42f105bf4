//! A burn that differs from its certified curve: `T(t) = s/b T0(t/b) (1 + sum over k of a_k cos(k pi i))` for the impulse
//! scale `s`, the burn-time scale `b`, and the fraction `i` of the impulse that the curve has given by then.
//!
//! The cosines have no mean over the impulse: a shape changes neither the impulse nor, by itself, the burn time. Any
//! slow deviation from a curve is a sum of few of them.

use core::f64::consts::PI;

use flight::vehicle::thrust_curve::ThrustCurve;

/// Terms of the shape. Five follow a deviation that turns around four times in a burn; faster ones change neither speed
/// nor height at the ground.
pub(super) const SHAPE_TERMS: usize = 5;

#[derive(Debug, Clone, Copy)]
#[expect(clippy::struct_field_names, reason = "the burn time is called so")]
pub(super) struct Burn<'a> {
    pub(super) curve: &'a ThrustCurve,
    pub(super) impulse_scale: f64,
    pub(super) burn_time_scale: f64,
    pub(super) shape: [f64; SHAPE_TERMS],
}

impl Burn<'_> {
    /// Fraction of the impulse that is given until a time since the thrust began.
    fn given(&self, burning_s: f64) -> f64 {
        let total_n_s = self.curve.total_impulse_n_s();
        let share = self.curve.impulse_to_n_s(burning_s / self.burn_time_scale) / total_n_s;
        let (sin, cos) = libm::sincos(PI * share);
        let (mut sin_k, mut cos_k, mut more) = (sin, cos, 0.0);
        for (k, amplitude) in (1..).zip(self.shape) {
            more += amplitude * sin_k / (PI * f64::from(k));
            (sin_k, cos_k) = (sin_k * cos + cos_k * sin, cos_k * cos - sin_k * sin);
        }
        share + more
    }

    /// Mean thrust between two times since the thrust began, N.
    pub(super) fn mean_n(&self, from_s: f64, to_s: f64) -> f64 {
        let total_n_s = self.impulse_scale * self.curve.total_impulse_n_s();
        total_n_s * (self.given(to_s) - self.given(from_s)) / (to_s - from_s)
    }

    /// Propellant burnt until a time since the thrust began, kg.
    pub(super) fn burnt_kg(&self, burning_s: f64) -> f64 {
        self.curve.propellant_mass_kg() * self.given(burning_s)
    }
}

/// How far the terms of a shape of this rms may go, as standard deviations: slow deviations are larger than fast ones.
pub(super) fn shape_sigmas(rms: f64) -> [f64; SHAPE_TERMS] {
    let terms: [f64; SHAPE_TERMS] = core::array::from_fn(|k| 1.0 / (k + 1) as f64);
    // The rms of a cosine is its amplitude over the root of 2.
    let whole = libm::sqrt(0.5 * terms.iter().map(|term| term * term).sum::<f64>());
    terms.map(|term| rms * term / whole)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A trapezium of 120 N s: 1 s up to 40 N, 2 s level, 1 s down; 10 % more impulse in twice the time.
    #[test]
    fn val_hand_a_scaled_trapezium() {
        let curve = vehicles::thrust_curve::from_rasp("T40 38 200 P 0.12 0.3 M\n1 40\n3 40\n4 0\n").unwrap();
        let burn =
            Burn { curve: &curve, impulse_scale: 1.1, burn_time_scale: 2.0, shape: [0.0; SHAPE_TERMS] };
        // From 2 to 6 s it is level: 40 N of the file, 1.1 / 2 of it.
        assert!((burn.mean_n(3.0, 3.5) - 22.0).abs() < 1e-9);
        assert!((burn.mean_n(0.0, 8.0) - 1.1 * 120.0 / 8.0).abs() < 1e-9);
        assert!((burn.burnt_kg(4.0) - 0.06).abs() < 1e-12, "half of the impulse");
        // With a first term of 0.1 half of the impulse has 0.1 / pi of it more.
        let shaped = Burn { shape: [0.1, 0.0, 0.0, 0.0, 0.0], ..burn };
        assert!((shaped.burnt_kg(4.0) - 0.12 * (0.5 + 0.1 / PI)).abs() < 1e-12);
        assert!((shaped.burnt_kg(9.0) - 0.12).abs() < 1e-12, "and the whole stays");
        // There the cosine is zero: the thrust is that without a shape.
        assert!((shaped.mean_n(3.999, 4.001) - 22.0).abs() < 1e-6);
    }
}
