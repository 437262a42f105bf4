//! Random differences, from a seed, between the true vehicle and the controller's model of it.

use flight::vehicle::dynamics::PlanarState;
use flight::vehicle::profile::Profile;
use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha12Rng;

/// One flight's draw from a profile's dispersions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Draw {
    /// True thrust over nominal thrust.
    pub thrust_scale: f64,
    /// True state at release.
    pub release: PlanarState,
}

/// Draws the truth of one flight. The same profile and seed give the same bits.
pub fn draw(profile: &Profile, seed: u64) -> Draw {
    let mut normal = Normal { random: ChaCha12Rng::seed_from_u64(seed) };
    let sigma = &profile.dispersion;
    let nominal = profile.start.planar_state();
    // The order is fixed and every value is drawn, even if its sigma is zero. So a changed sigma does not change the
    // other draws.
    let thrust = 1.0 + sigma.thrust_fraction * normal.next();
    Draw {
        thrust_scale: profile.plant.thrust_scale * thrust,
        release: PlanarState {
            x_m: nominal.x_m,
            u_m_s: nominal.u_m_s + sigma.u_m_s * normal.next(),
            w_m_s: nominal.w_m_s + sigma.w_m_s * normal.next(),
            theta_rad: nominal.theta_rad + sigma.pitch_deg.to_radians() * normal.next(),
            q_rad_s: nominal.q_rad_s + sigma.pitch_rate_deg_s.to_radians() * normal.next(),
            z_m: nominal.z_m + sigma.altitude_m * normal.next(),
        },
    }
}

/// Standard normal numbers by Box and Muller, on `libm` so that they are the same on every machine.
struct Normal {
    random: ChaCha12Rng,
}

impl Normal {
    fn next(&mut self) -> f64 {
        // 53 random bits; the first uniform avoids 0, whose logarithm is infinite.
        let unit = |bits: u64| (bits >> 11) as f64 / (1u64 << 53) as f64;
        let radius = libm::sqrt(-2.0 * libm::log(1.0 - unit(self.random.next_u64())));
        let angle_rad = core::f64::consts::TAU * unit(self.random.next_u64());
        radius * libm::cos(angle_rad)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_profile_without_dispersion_draws_its_nominal_values() {
        let profile = vehicles::profile::builtin("paper-calibrated").unwrap();
        for seed in 0..20 {
            let draw = draw(&profile, seed);
            assert_eq!(draw.release, profile.start.planar_state());
            assert_eq!(draw.thrust_scale.to_bits(), 1.0f64.to_bits());
        }
    }

    #[test]
    fn draws_have_the_stated_mean_and_sigma_and_repeat() {
        let profile = vehicles::profile::builtin("paper-dispersed").unwrap();
        let n = 4000;
        let draws: Vec<f64> = (0..n).map(|seed| draw(&profile, seed).release.w_m_s).collect();
        let mean = draws.iter().sum::<f64>() / n as f64;
        let variance = draws.iter().map(|w| (w - mean) * (w - mean)).sum::<f64>() / (n - 1) as f64;
        let sigma = profile.dispersion.w_m_s;
        assert!(sigma > 0.0);
        // Four standard errors of each mean and sigma.
        assert!(mean.abs() < 4.0 * sigma / (n as f64).sqrt(), "{mean}");
        assert!((variance.sqrt() / sigma - 1.0).abs() < 4.0 / (2.0 * n as f64).sqrt(), "{variance}");
        assert_eq!(draw(&profile, 7), draw(&profile, 7));
        assert_ne!(draw(&profile, 7), draw(&profile, 8));
    }
}
