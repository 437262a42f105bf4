//! The statistics of a campaign's summary.

use core::fmt;

use flight::rules::verdict::Landing;
use serde::Serialize;
use statrs::distribution::{Beta, ContinuousCDF as _};

/// 97.5 % point of the normal distribution.
const Z_95: f64 = 1.959_963_984_540_054;

/// A count of a total, with a 95 % confidence interval of the true fraction.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Share {
    pub count: u64,
    /// The total.
    pub of: u64,
    /// The count divided by the total.
    pub share: f64,
    /// Low end of the interval.
    pub low: f64,
    /// High end of the interval.
    pub high: f64,
}

impl Share {
    /// Uses E. B. Wilson's score interval (Journal of the American Statistical Association 22,
    /// 1927), which unlike the normal approximation is right near 0 and 1.
    pub fn new(count: u64, of: u64) -> Self {
        if of == 0 {
            return Self { count, of, share: 0.0, low: 0.0, high: 1.0 };
        }
        let (n, share) = (of as f64, count as f64 / of as f64);
        let z2 = Z_95 * Z_95;
        let centre = share + z2 / (2.0 * n);
        let half = Z_95 * libm::sqrt(share * (1.0 - share) / n + z2 / (4.0 * n * n));
        let scale = 1.0 + z2 / n;
        let low = if count == 0 { 0.0 } else { (centre - half) / scale };
        let high = if count == of { 1.0 } else { (centre + half) / scale };
        Self { count, of, share, low, high }
    }

    /// The same count with an interval that holds the true fraction at all of so many looks: the
    /// exact one of C. J. Clopper and E. S. Pearson (Biometrika 26, 1934), with the error divided
    /// among the looks (Bonferroni's inequality).
    fn at_looks(self, looks: u32) -> Self {
        let tail = 0.025 / f64::from(looks);
        let (inside, outside) = (self.count as f64, (self.of - self.count) as f64);
        // The fraction of no and of all flights has no such end, and no such distribution.
        let end = |a: f64, b: f64, quantile: f64| Beta::new(a, b).ok().map(|beta| beta.inverse_cdf(quantile));
        let low = end(inside, outside + 1.0, tail).unwrap_or(0.0);
        let high = end(inside + 1.0, outside, 1.0 - tail).unwrap_or(1.0);
        Self { low, high, ..self }
    }
}

impl fmt::Display for Share {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [share, low, high] = [self.share, self.low, self.high].map(|share| 100.0 * share);
        write!(out, "{} of {}: {share:.1} % ({low:.1} to {high:.1} %)", self.count, self.of)
    }
}

/// Numbers of flights by the words of a [`Landing`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Landings {
    pub stands: Share,
    pub upright: Share,
    pub envelope: Share,
    pub table_2: Share,
}

impl Landings {
    pub fn of(landings: impl Iterator<Item = Landing>) -> Self {
        let (mut counts, mut of) = ([0; 4], 0);
        for landing in landings {
            of += 1;
            counts.iter_mut().zip(landing.flags()).for_each(|(count, flag)| *count += u64::from(flag));
        }
        let [stands, upright, envelope, table_2] = counts.map(|count| Share::new(count, of));
        Self { stands, upright, envelope, table_2 }
    }

    /// The same counts with intervals that hold at all of so many looks at a growing sample.
    #[must_use]
    pub fn at_looks(self, looks: u32) -> Self {
        let [stands, upright, envelope, table_2] = self.shares().map(|share| share.at_looks(looks));
        Self { stands, upright, envelope, table_2 }
    }

    /// In the order of [`Landing::flags`].
    pub fn shares(&self) -> [&Share; 4] {
        [&self.stands, &self.upright, &self.envelope, &self.table_2]
    }
}

impl fmt::Display for Landings {
    /// Vehicles that stand undamaged, always with those inside the design envelope of their legs.
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{}, {} inside the envelope", self.stands, self.envelope.count)
    }
}

/// The quantile of a fraction, with linear interpolation between neighbours (R's type 7); `None`
/// without values. `sorted` must be in ascending order.
pub fn quantile(sorted: &[f64], share: f64) -> Option<f64> {
    let last = sorted.len().checked_sub(1)?;
    let place = share.clamp(0.0, 1.0) * last as f64;
    let below = libm::floor(place) as usize;
    let above = (below + 1).min(last);
    Some(sorted[below] + (place - below as f64) * (sorted[above] - sorted[below]))
}

/// The finite values, sorted.
pub fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.filter(|value| !value.is_nan()).collect();
    values.sort_by(f64::total_cmp);
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: 8 of 10, z = 1.96: centre (0.8 + 0.19207) / 1.38415 = 0.71674, half 0.22659.
    #[test]
    fn val_wilson_by_hand() {
        let share = Share::new(8, 10);
        assert!((share.low - 0.490_16).abs() < 1e-5 && (share.high - 0.943_32).abs() < 1e-5, "{share:?}");
        let all = Share::new(1000, 1000);
        // n / (n + z^2).
        assert!((all.low - 1000.0 / 1_003.841_459).abs() < 1e-9, "{all:?}");
        assert!((all.high - 1.0).abs() < 1e-15);
        assert!(Share::new(0, 5).low.abs() < 1e-15 && Share::new(0, 0).high >= 1.0);
    }

    /// At each end the count, or one farther from it, has the probability of the tail.
    #[test]
    fn val_clopper_pearson_by_hand() {
        let at = |count, of, looks| Share::new(count, of).at_looks(looks);
        let all = at(50, 50, 3);
        assert!((all.low - libm::pow(0.025 / 3.0, 0.02)).abs() < 1e-9 && all.high >= 1.0, "{all:?}");
        let none = at(0, 20, 1);
        assert!(none.low <= 0.0 && (none.high - (1.0 - libm::pow(0.025, 0.05))).abs() < 1e-9, "{none:?}");
        let most = at(49, 50, 3);
        let at_least = |p: f64| libm::pow(p, 50.0) + 50.0 * libm::pow(p, 49.0) * (1.0 - p);
        assert!((at_least(most.low) - 0.025 / 3.0).abs() < 1e-9, "{most:?}");
        assert!((1.0 - libm::pow(most.high, 50.0) - 0.025 / 3.0).abs() < 1e-9, "{most:?}");
    }

    #[test]
    fn val_quantiles_by_hand() {
        let values = sorted([4.0, 1.0, f64::NAN, 2.0, 3.0].into_iter());
        assert_eq!(quantile(&values, 0.5), Some(2.5));
        assert_eq!(quantile(&values, 0.25), Some(1.75));
        assert_eq!(quantile(&values, 1.0), Some(4.0));
        assert_eq!(quantile(&[], 0.5), None);
    }
}
