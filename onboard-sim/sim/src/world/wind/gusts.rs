//! Dryden gusts at low altitude, MIL-F-8785C section 3.7.3.4: intensities and lengths depend on
//! height, and filtered noise on the path through the air.
//!
//! With the height h in feet, `L_w = h`, `L_u = L_v = h / (0.177 + 0.000823 h)^1.2`, `sigma_w = 0.1
//! W20` and `sigma_u = sigma_v = sigma_w / (0.177 + 0.000823 h)^0.4`, held at their values at 10 ft
//! below and at 1,000 ft above. The gust field is frozen in the air: the filters run over the path
//! flown through it. Along the mean wind the spectrum is the longitudinal one, across it and
//! upwards the transverse one. (The standard is written for aircraft in level flight. For a falling
//! vehicle the choice of the longitudinal component is free.)
//!
//! Both filters are discretised exactly: state transition and noise covariance of the continuous
//! filter over the step, for any length of step, from a stationary start. The states have unit
//! variance and are scaled by sigma at the output, so that a change of height does not disturb the
//! variance.

use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng as _;

use crate::world::normal::Normal;

const FEET_M: f64 = 0.304_8;
const LOWEST_FT: f64 = 10.0;
const HIGHEST_FT: f64 = 1000.0;

/// Gusts along the mean wind, across it (to the left) and upwards.
#[derive(Debug, Clone)]
pub struct Gusts {
    wind_at_20_ft_m_s: f64,
    normals: Normal<ChaCha8Rng>,
    along: f64,
    across: Transverse,
    up: Transverse,
}

/// Intensities and lengths at one height.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GustScales {
    /// Standard deviation along and across the wind, m/s.
    pub horizontal_m_s: f64,
    /// Standard deviation upwards, m/s.
    pub vertical_m_s: f64,
    /// Length along and across the wind, m.
    pub horizontal_m: f64,
    /// Length upwards, m.
    pub vertical_m: f64,
}

impl GustScales {
    /// The standard's values at a height above ground, m, for a wind at 20 ft, m/s.
    pub fn at(height_m: f64, wind_at_20_ft_m_s: f64) -> Self {
        let height_ft = (height_m / FEET_M).clamp(LOWEST_FT, HIGHEST_FT);
        let base = 0.177 + 0.000_823 * height_ft;
        // base^0.4 once, base^1.2 from it.
        let root = libm::pow(base, 0.4);
        let vertical_m_s = 0.1 * wind_at_20_ft_m_s;
        Self {
            horizontal_m_s: vertical_m_s / root,
            vertical_m_s,
            horizontal_m: height_ft / (root * root * root) * FEET_M,
            vertical_m: height_ft * FEET_M,
        }
    }
}

/// The transverse filter `(1 + sqrt(3) L s) / (1 + L s)^2` over the path s: two equal lags in a
/// row, the output a mix of their states.
#[derive(Debug, Clone, Copy)]
struct Transverse {
    first: f64,
    second: f64,
}

/// Stationary covariance of the two lags: 1/2, 1/4, 1/4 for a unit output.
const FIRST_VARIANCE: f64 = 0.5;
const CROSS: f64 = 0.25;
const SECOND_VARIANCE: f64 = 0.25;

impl Transverse {
    fn stationary(normals: &mut Normal<ChaCha8Rng>) -> Self {
        let first = FIRST_VARIANCE.sqrt() * normals.next();
        let second = CROSS / FIRST_VARIANCE * first
            + (SECOND_VARIANCE - CROSS * CROSS / FIRST_VARIANCE).sqrt() * normals.next();
        Self { first, second }
    }

    /// Advances by a fraction of the gust length.
    fn step(&mut self, share: f64, normals: &mut Normal<ChaCha8Rng>) {
        let decay = libm::exp(-share);
        let squared = decay * decay;
        let first_noise = FIRST_VARIANCE * (1.0 - squared);
        let cross_noise = CROSS - squared * (FIRST_VARIANCE * share + CROSS);
        let second_noise = SECOND_VARIANCE
            - squared * (FIRST_VARIANCE * share * share + 2.0 * CROSS * share + SECOND_VARIANCE);
        let (one, two) = (normals.next(), normals.next());
        let first_deviation = first_noise.max(0.0).sqrt();
        let mix = if first_deviation > 0.0 { cross_noise / first_deviation } else { 0.0 };
        self.second = decay * (self.second + share * self.first)
            + mix * one
            + (second_noise - mix * mix).max(0.0).sqrt() * two;
        self.first = decay * self.first + first_deviation * one;
    }

    fn output(&self) -> f64 {
        const ROOT_3: f64 = 1.732_050_807_568_877_2;
        ROOT_3 * self.first + (1.0 - ROOT_3) * self.second
    }
}

impl Gusts {
    /// These gusts with the intensity of other gusts.
    pub(crate) fn as_strong_as(&self, other: &Self) -> Self {
        Self { wind_at_20_ft_m_s: other.wind_at_20_ft_m_s, ..self.clone() }
    }

    /// Gusts for a wind at 20 ft, m/s, from a seed.
    pub fn new(wind_at_20_ft_m_s: f64, seed: u64) -> Self {
        let mut normals = Normal::of(ChaCha8Rng::seed_from_u64(seed), 1.0);
        Self {
            wind_at_20_ft_m_s,
            along: normals.next(),
            across: Transverse::stationary(&mut normals),
            up: Transverse::stationary(&mut normals),
            normals,
        }
    }

    /// Whether there is any gust.
    pub fn blow(&self) -> bool {
        self.wind_at_20_ft_m_s > 0.0
    }

    /// Advances by a length of air, m, at a height above ground, m. Returns the gust along the mean
    /// wind, across it and upwards, m/s.
    pub fn step(&mut self, height_m: f64, path_m: f64) -> Vector3<f64> {
        let scales = GustScales::at(height_m, self.wind_at_20_ft_m_s);
        let share = path_m / scales.horizontal_m;
        let decay = libm::exp(-share);
        self.along = decay * self.along + (1.0 - decay * decay).sqrt() * self.normals.next();
        self.across.step(share, &mut self.normals);
        self.up.step(path_m / scales.vertical_m, &mut self.normals);
        Vector3::new(
            scales.horizontal_m_s * self.along,
            scales.horizontal_m_s * self.across.output(),
            scales.vertical_m_s * self.up.output(),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// MIL-F-8785C at 200 ft in 15 m/s of wind at 20 ft, worked by hand: 0.177 + 0.1646 = 0.3416;
    /// ^0.4 = 0.650739, ^1.2 = 0.275565; lengths 200 / 0.275565 = 725.78 ft and 200 ft.
    #[test]
    fn val_mil_f_8785c_scales_at_200_ft() {
        let scales = GustScales::at(60.96, 15.0);
        for (found, expected) in [
            (scales.vertical_m_s, 1.5),
            (scales.horizontal_m_s, 2.305_07),
            (scales.vertical_m, 60.96),
            (scales.horizontal_m, 221.22),
        ] {
            assert!((found / expected - 1.0).abs() < 3e-5, "{found} {expected}");
        }
        assert_eq!(GustScales::at(0.0, 15.0), GustScales::at(3.048, 15.0));
        assert_eq!(GustScales::at(900.0, 15.0), GustScales::at(304.8, 15.0));
    }

    /// Variances, and the correlation a quarter and a whole length apart, over many samples. The
    /// step is longer than in a simulation, which exact discretisation allows.
    #[test]
    fn val_mil_f_8785c_variance_and_correlation() {
        let height_m = 60.0;
        let scales = GustScales::at(height_m, 10.0);
        let path_m = scales.vertical_m / 4.0;
        let mut gusts = Gusts::new(10.0, 7);
        let samples: Vec<_> = (0..400_000).map(|_| gusts.step(height_m, path_m)).collect();
        let correlation = |axis: usize, lag: usize| {
            let sum: f64 = samples.iter().zip(&samples[lag..]).map(|(a, b)| a[axis] * b[axis]).sum();
            sum / (samples.len() - lag) as f64
        };
        let longitudinal = |share: f64| libm::exp(-share);
        // The transform of the transverse spectrum (1 + 3 x^2) / (1 + x^2)^2.
        let transverse = |share: f64| libm::exp(-share) * (1.0 - share / 2.0);
        let horizontal_share = path_m / scales.horizontal_m;
        for lag in [0, 1, 4] {
            let lags = lag as f64;
            for (axis, deviation_m_s, expected) in [
                (0, scales.horizontal_m_s, longitudinal(lags * horizontal_share)),
                (1, scales.horizontal_m_s, transverse(lags * horizontal_share)),
                (2, scales.vertical_m_s, transverse(lags * 0.25)),
            ] {
                let found = correlation(axis, lag) / (deviation_m_s * deviation_m_s);
                // Four standard errors of the slowest axis.
                assert!(
                    (found - expected).abs() < 0.02,
                    "axis {axis}, lag {lag}: {found}, expected {expected}"
                );
            }
        }
    }

    /// Many short steps equal one long step: the same decay, and the same variance at the end.
    #[test]
    fn in_still_air_a_gust_persists() {
        let mut gusts = Gusts::new(10.0, 3);
        let before = gusts.step(50.0, 0.0);
        for _ in 0..1000 {
            assert!((gusts.step(50.0, 0.0) - before).norm() < 1e-12);
        }
    }

    #[test]
    fn the_same_seed_gives_the_same_gusts() {
        let flight = |seed| {
            let mut gusts = Gusts::new(8.0, seed);
            (0..1000).map(|_| gusts.step(30.0, 0.04)).collect::<Vec<_>>()
        };
        assert_eq!(flight(5), flight(5));
        assert_ne!(flight(5), flight(6));
    }
}
