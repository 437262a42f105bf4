//! A burn that differs from its certified curve: `T(t) = s/b T0(t/b) (1 + sum over k of a_k cos(k
//! pi i))` for the impulse scale `s`, the burn-time scale `b`, and the fraction `i` of the impulse
//! that the curve has given by then.
//!
//! The cosines have no mean over the impulse: a shape changes neither the impulse nor, by itself,
//! the burn time. Any slow deviation from a curve is a sum of few of them.
//!
//! A thrust that rises slowly comes along its curve at a rate that grows from 0 to 1 within the
//! rise: the whole burn is late by half of the rise, and no impulse is lost. The delay of an
//! ignition is that of the impulse, which is what brakes: where the rise begins is half of the rise
//! before it.

use core::f64::consts::PI;

use anyhow::{Context as _, Result, bail};
use flight::vehicle::thrust_curve::ThrustCurve;

use super::along::white_variance;
use super::least_squares::{Prior, inflate, solve_from};
use super::{Basis, Fit, Row};

/// Terms of the shape. Five follow a deviation that turns around four times in a burn; faster ones
/// change neither speed nor height at the ground.
pub(super) const SHAPE_TERMS: usize = 5;

#[derive(Debug, Clone, Copy)]
#[expect(clippy::struct_field_names, reason = "the burn time is called so")]
pub(super) struct Burn<'a> {
    pub(super) curve: &'a ThrustCurve,
    pub(super) impulse_scale: f64,
    pub(super) burn_time_scale: f64,
    /// Time in which the thrust rises to the curve's, s.
    pub(super) rise_s: f64,
    pub(super) shape: [f64; SHAPE_TERMS],
}

impl Burn<'_> {
    /// Fraction of the impulse that is given until a time since the burn began by its impulse.
    fn given(&self, burning_s: f64) -> f64 {
        let total_n_s = self.curve.total_impulse_n_s();
        let (half_s, since_s) = (0.5 * self.rise_s, burning_s + 0.5 * self.rise_s);
        let on_curve_s = if since_s > 0.0 && burning_s < half_s {
            0.5 * since_s * since_s / self.rise_s
        } else {
            burning_s
        };
        let share = self.curve.impulse_to_n_s(on_curve_s / self.burn_time_scale) / total_n_s;
        let (sin, cos) = libm::sincos(PI * share);
        let (mut sin_k, mut cos_k, mut more) = (sin, cos, 0.0);
        for (k, amplitude) in (1..).zip(self.shape) {
            more += amplitude * sin_k / (PI * f64::from(k));
            (sin_k, cos_k) = (sin_k * cos + cos_k * sin, cos_k * cos - sin_k * sin);
        }
        share + more
    }

    /// Mean thrust between two times since the burn began by its impulse, N.
    pub(super) fn mean_n(&self, from_s: f64, to_s: f64) -> f64 {
        let total_n_s = self.impulse_scale * self.curve.total_impulse_n_s();
        total_n_s * (self.given(to_s) - self.given(from_s)) / (to_s - from_s)
    }

    /// Propellant burnt until a time since the burn began by its impulse, kg.
    pub(super) fn burnt_kg(&self, burning_s: f64) -> f64 {
        self.curve.propellant_mass_kg() * self.given(burning_s)
    }
}

/// How far the terms of a shape of this rms may go, as standard deviations: slow deviations are
/// larger than fast ones.
pub(super) fn shape_sigmas(rms: f64) -> [f64; SHAPE_TERMS] {
    let terms: [f64; SHAPE_TERMS] = core::array::from_fn(|k| 1.0 / (k + 1) as f64);
    // The rms of a cosine is its amplitude over the root of 2.
    let whole = libm::sqrt(0.5 * terms.iter().map(|term| term * term).sum::<f64>());
    terms.map(|term| rms * term / whole)
}

/// The terms of the shape, from a place in a solution on.
pub(super) fn shape_rows(first: usize) -> [Row; SHAPE_TERMS] {
    const NAMES: [&str; SHAPE_TERMS] =
        ["thrust_shape_1", "thrust_shape_2", "thrust_shape_3", "thrust_shape_4", "thrust_shape_5"];
    core::array::from_fn(|k| (first + k, NAMES[k], ""))
}

/// Fewest rows with thrust.
const FEWEST: usize = 20;
/// Blocks over which residuals may be correlated: a stand rings at some ten hertz.
const BLOCKS: usize = 40;
/// Standard deviation of a load cell's calibration with known weights. The table does not show it.
const CALIBRATION_SIGMA: f64 = 0.003;

const TARE: usize = 0;
const IMPULSE: usize = 1;
const BURN_TIME: usize = 2;
const BEGIN: usize = 3;
const SHAPE: usize = 4;

/// Thrust over that of the rows beside it beyond which a row is an outlier.
const OUTLIER: f64 = 10.0;

/// Fits a burn; times count from the ignition command.
///
/// # Errors
/// The table has too little thrust.
pub(super) fn fit_stand(source: &str, rows: &[(f64, f64)], curve: &ThrustCurve) -> Result<Fit> {
    for window in rows.windows(3) {
        let [before, row, after] = window else { continue };
        let beside_n = before.1.max(after.1).max(0.1 * curve.peak_thrust_n());
        if row.1 > OUTLIER * beside_n {
            bail!("{} s: thrust {} N, {beside_n:.1} N beside it: remove this row", row.0, row.1);
        }
    }
    let peak_n = rows.iter().map(|row| row.1).fold(f64::NEG_INFINITY, f64::max);
    let burning: Vec<usize> = (0..rows.len()).filter(|row| rows[*row].1 > 0.1 * peak_n).collect();
    let (Some(first), Some(last)) = (burning.first().copied(), burning.last().copied()) else {
        bail!("has no thrust");
    };
    if burning.len() < FEWEST || peak_n <= 0.0 {
        bail!("has fewer than {FEWEST} rows with thrust");
    }
    // The tare is measured over a tenth of the burn time before and after it.
    let lasted_s = rows[last].0 - rows[first].0;
    let near = |row: &&(f64, f64)| {
        row.0 >= rows[first].0 - 0.1 * lasted_s - 0.2 && row.0 <= rows[last].0 + 0.1 * lasted_s + 0.2
    };
    let rows: Vec<(f64, f64)> = rows.iter().filter(near).copied().collect();
    let thrusts: Vec<f64> = rows.iter().map(|row| row.1).collect();
    let white_n = libm::sqrt(white_variance(&thrusts).unwrap_or(0.0)).max(1e-3 * peak_n);
    let begins_s = rows.iter().find(|row| row.1 > 0.1 * peak_n).map_or(0.0, |row| row.0);
    let mut priors = vec![
        Prior { mean: 0.0, sigma: 0.1 * peak_n },
        Prior { mean: 1.0, sigma: 0.5 },
        Prior { mean: 1.0, sigma: 0.5 },
        Prior { mean: begins_s, sigma: 1.0 },
    ];
    // On a stand nothing else hides the shape: five per cent is more than certified curves differ
    // by.
    priors.extend(shape_sigmas(0.05).map(|sigma| Prior { mean: 0.0, sigma }));
    let residuals = |values: &[f64]| -> Vec<f64> {
        let burn = Burn {
            curve,
            impulse_scale: values[IMPULSE],
            burn_time_scale: values[BURN_TIME].max(0.2),
            rise_s: 0.0,
            shape: core::array::from_fn(|k| values[SHAPE + k]),
        };
        let half_s = 0.5e-3;
        let missed = rows.iter().map(|(time_s, thrust_n)| {
            let at_s = time_s - values[BEGIN];
            (thrust_n - values[TARE] - burn.mean_n(at_s - half_s, at_s + half_s)) / white_n
        });
        missed.collect()
    };
    let mut start: Vec<f64> = priors.iter().map(|prior| prior.mean).collect();
    let impulse_n_s: f64 =
        rows.windows(2).map(|pair| 0.5 * (pair[0].1 + pair[1].1) * (pair[1].0 - pair[0].0)).sum();
    start[IMPULSE] = (impulse_n_s / curve.total_impulse_n_s()).clamp(0.2, 5.0);
    let lasts_s = curve.falls_through_s(0.1 * curve.peak_thrust_n()).unwrap_or(curve.burn_time_s());
    start[BURN_TIME] = (lasted_s / lasts_s).clamp(0.2, 5.0);
    if (start[IMPULSE] - 1.0).abs() > 0.3 || (start[BURN_TIME] - 1.0).abs() > 0.4 {
        bail!(
            "gives {impulse_n_s:.1} N s in {lasted_s:.2} s, and {} has {:.1} N s in {lasts_s:.2} s: another motor, or another unit",
            curve.name(),
            curve.total_impulse_n_s()
        );
    }
    let mut solution = solve_from(&start, &priors, residuals).context("does not fit the curve")?;
    inflate(&mut solution, residuals, rows.len().div_ceil(BLOCKS));
    solution.covariance[(IMPULSE, IMPULSE)] += libm::pow(CALIBRATION_SIGMA * solution.values[IMPULSE], 2.0);
    let basis = Basis {
        impulse_n_s: curve.total_impulse_n_s(),
        burn_time_s: curve.burn_time_s(),
        drag_area_m2: 0.0,
        loaded_kg: 0.0,
    };
    let mut fit = Fit::of(source, "", curve.name(), basis);
    let reason = "the table does not show it";
    let rows = [
        (IMPULSE, "thrust_scale", ""),
        (BURN_TIME, "burn_time_scale", ""),
        (BEGIN, "ignition_delay", "s"),
        (TARE, "tare", "N"),
    ];
    fit.take(&solution, reason, &rows);
    fit.take(&solution, reason, &shape_rows(SHAPE));
    fit.lacks("drag_per_mass_scale, gimbal, wind, sensors", "a test stand does not fly");
    Ok(fit)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A trapezium of 120 N s: 1 s up to 40 N, 2 s level, 1 s down; 10 % more impulse in twice the
    /// time.
    #[test]
    fn val_hand_a_scaled_trapezium() {
        let curve =
            flight::vehicles::thrust_curve::from_rasp("T40 38 200 P 0.12 0.3 M\n1 40\n3 40\n4 0\n").unwrap();
        let burn = Burn {
            curve: &curve,
            impulse_scale: 1.1,
            burn_time_scale: 2.0,
            rise_s: 0.0,
            shape: [0.0; SHAPE_TERMS],
        };
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

    fn curve() -> ThrustCurve {
        flight::vehicles::thrust_curve::from_rasp("T40 38 200 P 0.12 0.3 M\n0.2 40\n3 36\n4 0\n").unwrap()
    }

    /// The curve with 4 % more impulse in a burn that is 5 % shorter, 0.21 s after the command,
    /// with a tare of 1.5 N and a noise of 0.2 N that repeats itself every 7 rows.
    #[test]
    fn val_hand_a_synthetic_burn() {
        let curve = curve();
        let noise = [0.2, -0.1, 0.3, -0.3, 0.0, -0.2, 0.1];
        let rows: Vec<(f64, f64)> = (0..2500)
            .map(|row| {
                let time_s = f64::from(row) * 0.002;
                let thrust_n = 1.04 / 0.95 * curve.thrust_at_n((time_s - 0.21) / 0.95);
                (time_s, 1.5 + thrust_n + noise[row as usize % 7])
            })
            .collect();
        let fit = fit_stand("stand.csv", &rows, &curve).unwrap();
        for (name, truth, bar) in [
            ("thrust_scale", 1.04, 0.004),
            ("burn_time_scale", 0.95, 0.004),
            ("ignition_delay", 0.21, 0.002),
            ("tare", 1.5, 0.1),
        ] {
            let found = fit.get(name).unwrap();
            assert!((found.value - truth).abs() < bar, "{found:?}");
            assert!(found.low < truth && truth < found.high, "{found:?}");
        }
    }

    #[test]
    fn a_row_of_9999_n_is_named() {
        let curve = curve();
        let mut rows: Vec<(f64, f64)> = (0..500)
            .map(|row| f64::from(row) * 0.01)
            .map(|time_s| (time_s, curve.thrust_at_n(time_s - 0.2)))
            .collect();
        rows[60].1 = 9_999.0;
        let error = fit_stand("stand.csv", &rows, &curve).unwrap_err().to_string();
        assert!(error.starts_with("0.6 s: thrust 9999 N, "), "{error}");
    }

    #[test]
    fn another_motor_is_named() {
        let rows: Vec<(f64, f64)> = (0..200).map(|row| (f64::from(row) * 0.01, 500.0)).collect();
        let error = fit_stand("stand.csv", &rows, &curve()).unwrap_err().to_string();
        assert!(error.contains("another motor, or another unit"), "{error}");
    }

    proptest! {
        #[test]
        fn no_table_panics(mut rows in prop::collection::vec((-1e3..1e3_f64, -1e6..1e6_f64), 0..60)) {
            rows.sort_by(|one, two| one.0.total_cmp(&two.0));
            let _ = fit_stand("any", &rows, &curve());
        }
    }
}
