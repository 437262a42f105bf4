//! Several fits together: the mean of each parameter, and how much it differs from flight to flight beyond the fits' own
//! errors.
//!
//! The flights' values scatter around a mean with a variance of their own (random effects: R. DerSimonian and N. Laird,
//! Controlled Clinical Trials 7, 1986). The interval is that of J. Hartung and G. Knapp (Statistics in Medicine 20, 2001),
//! on Student's t, which holds for few flights.

use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, StudentsT};

use super::{Fit, Parameter};

/// A parameter over several flights.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Pooled {
    /// The mean, with the interval of the mean.
    pub mean: Parameter,
    /// How many flights have it.
    pub flights: usize,
    /// Standard deviation from flight to flight, without the fits' own errors.
    pub scatter: f64,
}

/// Every parameter that at least two fits have, in the order of the first fit that has it.
pub fn pooled(fits: &[Fit]) -> Vec<Pooled> {
    let mut names: Vec<&str> = Vec::new();
    for parameter in fits.iter().flat_map(|fit| &fit.found) {
        if !names.contains(&parameter.name.as_str()) {
            names.push(&parameter.name);
        }
    }
    names
        .into_iter()
        .filter_map(|name| pool(&fits.iter().filter_map(|fit| fit.get(name)).collect::<Vec<_>>()))
        .collect()
}

fn pool(values: &[&Parameter]) -> Option<Pooled> {
    let first = *values.first()?;
    let count = values.len() as f64;
    if values.len() < 2 || values.iter().any(|value| value.sigma.is_nan() || value.sigma <= 0.0) {
        return None;
    }
    let weighted = |variance: f64| {
        let weights: Vec<f64> = values.iter().map(|one| 1.0 / (one.sigma * one.sigma + variance)).collect();
        let sum: f64 = weights.iter().sum();
        let mean = values.iter().zip(&weights).map(|(one, weight)| one.value * weight).sum::<f64>() / sum;
        let spread: f64 =
            values.iter().zip(&weights).map(|(one, weight)| weight * libm::pow(one.value - mean, 2.0)).sum();
        let squares: f64 = weights.iter().map(|weight| weight * weight).sum();
        (mean, sum, squares, spread)
    };
    let (_, sum, squares, spread) = weighted(0.0);
    let variance = ((spread - (count - 1.0)) / (sum - squares / sum)).max(0.0);
    let (mean, sum, _, spread) = weighted(variance);
    let sigma = libm::sqrt((spread / (count - 1.0)).max(1.0) / sum);
    let reach = StudentsT::new(0.0, 1.0, count - 1.0).ok()?.inverse_cdf(0.975) * sigma;
    let mean = Parameter {
        low: mean - reach,
        high: mean + reach,
        ..Parameter::normal(&first.name, &first.unit, mean, sigma)
    };
    Some(Pooled { mean, flights: values.len(), scatter: libm::sqrt(variance) })
}

#[cfg(test)]
mod tests {
    use super::super::Basis;
    use super::*;

    fn fits(values: &[(f64, f64)]) -> Vec<Fit> {
        let fit = |(value, sigma): &(f64, f64)| Fit {
            source: String::new(),
            mission: String::new(),
            motor: String::new(),
            basis: Basis { impulse_n_s: 1.0, burn_time_s: 1.0, drag_area_m2: 1.0, loaded_kg: 1.0 },
            found: vec![Parameter::normal("drag_scale", "", *value, *sigma)],
            not_found: Vec::new(),
            damage: None,
        };
        values.iter().map(fit).collect()
    }

    /// 1, 2 and 3 with errors of 0.1: the weights are equal, the mean is 2, the variance between is 1 - 0.01, and the
    /// interval is 4.3027 (97.5 % of Student's t with 2 degrees) times the root of 1/3.
    #[test]
    fn val_hand_three_flights() {
        let found = pooled(&fits(&[(1.0, 0.1), (2.0, 0.1), (3.0, 0.1)]));
        assert_eq!(found.len(), 1);
        let Pooled { mean, scatter, flights } = &found[0];
        assert!((mean.value - 2.0).abs() < 1e-12 && *flights == 3);
        assert!((scatter - libm::sqrt(0.99)).abs() < 1e-12, "{scatter}");
        assert!((mean.high - 2.0 - 4.302_65 / libm::sqrt(3.0)).abs() < 1e-4, "{mean:?}");
    }

    #[test]
    fn one_flight_is_not_pooled_and_equal_flights_do_not_scatter() {
        assert!(pooled(&fits(&[(1.0, 0.1)])).is_empty());
        let found = pooled(&fits(&[(1.0, 0.1), (1.0, 0.1)]));
        assert!(
            found[0].scatter.abs() < 1e-12 && (found[0].mean.sigma - 0.1 / libm::sqrt(2.0)).abs() < 1e-12
        );
    }
}
