//! The wind: a mean that grows with height, and gusts.
//!
//! The mean follows the power law over flat open country with the exponent 1/7 (J. F. Manwell, J.
//! G. McGowan and A. L. Rogers, Wind Energy Explained, 2nd edition, chapter 2), from its value 10 m
//! above the ground. [`aloft`] replaces it by a table. Gusts are those of [`gusts`].

pub mod aloft;
pub mod gusts;

use nalgebra::Vector3;

use aloft::WindsAloft;
use gusts::Gusts;

/// Reference height of the mean wind, m.
pub const REFERENCE_HEIGHT_M: f64 = 10.0;
/// Exponent of the power law.
pub const EXPONENT: f64 = 1.0 / 7.0;
/// Below this height the mean wind is constant, m: the power law does not hold so close to the
/// ground.
const LOWEST_M: f64 = 0.5;
/// Reference height of the wind in the gust standard: 20 ft, m.
const GUST_REFERENCE_HEIGHT_M: f64 = 6.096;

/// The wind of one flight.
#[derive(Debug, Clone)]
pub struct Wind {
    reference_m_s: f64,
    exponent: f64,
    veer_rad_m: f64,
    along: Vector3<f64>,
    across: Vector3<f64>,
    /// A measured profile instead of the power law, and the difference between the wind at the
    /// reference height and it, m/s.
    aloft: Option<(WindsAloft, Vector3<f64>)>,
    gusts: Gusts,
    now_m_s: Vector3<f64>,
}

impl Wind {
    /// A wind from its mean at the reference height, m/s, the direction it blows to (from world x
    /// towards world y, rad), the gust intensity as a multiple of the standard's, and the seed of
    /// the gusts.
    pub fn new(reference_m_s: f64, towards_rad: f64, gust_scale: f64, seed: u64) -> Self {
        let (sin, cos) = libm::sincos(towards_rad);
        let gust_wind_m_s = mean_m_s(reference_m_s, EXPONENT, GUST_REFERENCE_HEIGHT_M);
        Self {
            reference_m_s,
            exponent: EXPONENT,
            veer_rad_m: 0.0,
            along: Vector3::new(cos, sin, 0.0),
            across: Vector3::new(-sin, cos, 0.0),
            aloft: None,
            gusts: Gusts::new(gust_scale * gust_wind_m_s, seed),
            now_m_s: Vector3::zeros(),
        }
    }

    /// This wind with another exponent of the power law, and a direction that turns with the height
    /// over the reference height, rad/m.
    #[must_use]
    pub fn over_height(self, exponent: f64, veer_rad_m: f64) -> Self {
        Self { exponent, veer_rad_m, ..self }
    }

    /// This wind with another mean over height, if there is one. It is shifted so that the wind at
    /// the reference height stays.
    #[must_use]
    pub fn with_aloft(self, aloft: Option<&WindsAloft>) -> Self {
        let shift_m_s =
            |aloft: &WindsAloft| self.along * self.reference_m_s - aloft.at_m_s(REFERENCE_HEIGHT_M);
        let aloft = aloft.map(|aloft| (aloft.clone(), shift_m_s(aloft)));
        Self { aloft, ..self }
    }

    /// This wind with the mean at the reference height and the gust intensity of another wind; the
    /// gusts themselves continue.
    pub(crate) fn changed(&self, other: &Self) -> Self {
        let gusts = self.gusts.as_strong_as(&other.gusts);
        let aloft = self.aloft.as_ref().map(|(aloft, _)| aloft);
        Self { gusts, now_m_s: self.now_m_s, ..other.clone() }.with_aloft(aloft)
    }

    /// Mean wind at a height above ground, in the world, m/s.
    pub fn mean_m_s(&self, height_m: f64) -> Vector3<f64> {
        if let Some((aloft, shift_m_s)) = &self.aloft {
            return aloft.at_m_s(height_m) + shift_m_s;
        }
        let mean_m_s = mean_m_s(self.reference_m_s, self.exponent, height_m);
        if self.veer_rad_m == 0.0 {
            return self.along * mean_m_s;
        }
        let (sin, cos) = libm::sincos(self.veer_rad_m * (height_m.max(LOWEST_M) - REFERENCE_HEIGHT_M));
        (self.along * cos + self.across * sin) * mean_m_s
    }

    /// Advances by a length of air, m, at a height above ground, m.
    pub(crate) fn step(&mut self, height_m: f64, path_m: f64) {
        self.now_m_s = self.mean_m_s(height_m);
        if self.gusts.blow() {
            let gust = self.gusts.step(height_m, path_m);
            self.now_m_s += self.along * gust.x + self.across * gust.y;
            self.now_m_s.z += gust.z;
        }
    }

    /// Mean and gusts together, in the world, m/s.
    pub fn now_m_s(&self) -> Vector3<f64> {
        self.now_m_s
    }
}

fn mean_m_s(reference_m_s: f64, exponent: f64, height_m: f64) -> f64 {
    if reference_m_s == 0.0 {
        return 0.0;
    }
    reference_m_s * libm::pow(height_m.max(LOWEST_M) / REFERENCE_HEIGHT_M, exponent)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_follows_the_power_law_and_its_direction() {
        let wind = Wind::new(5.0, core::f64::consts::FRAC_PI_2, 0.0, 1);
        assert!((wind.mean_m_s(10.0) - Vector3::new(0.0, 5.0, 0.0)).norm() < 1e-12);
        // 2^7 times the height doubles it.
        assert!((wind.mean_m_s(1280.0).y - 10.0).abs() < 1e-9);
        assert!((wind.mean_m_s(-3.0) - wind.mean_m_s(0.5)).norm() < 1e-12);
    }

    #[test]
    fn still_air_has_no_mean_and_no_gusts() {
        let mut wind = Wind::new(0.0, 1.0, 1.0, 1);
        wind.step(100.0, 0.04);
        assert!(wind.now_m_s().norm() < 1e-300);
    }
}
