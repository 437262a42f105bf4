//! Measured burns of the landing motor's lot, and the resulting expectation of the motor.
//!
//! A certified curve was measured on motors of another lot. A club that has burnt some of its lot
//! on a stand states the results in the section `[lot]` of its mission: their deviations, their
//! temperature, and the weights of motor and vehicle on the day. [`Lot::expectation`] is the one
//! place where these become a mean and a width.

use alloc::string::String;

use serde::{Deserialize, Serialize};

use crate::estimation::motor_estimate::MotorPrior;
use crate::vehicle::airframe::BadValue;

/// The section `[lot]`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Lot {
    /// The lot's name, as on the label.
    pub name: String,
    /// Motors of the lot that were burnt and measured. With 0 nothing confirms the curve.
    pub burns: u32,
    /// A measured curve, flown instead of the certified one: a built-in motor's name, or the text
    /// of a motor file. The scales are then over this curve.
    pub curve: Option<String>,
    /// Impulses of the burns over the curve's.
    #[serde(default)]
    pub impulse: Burnt,
    /// Burn times of the burns over the curve's.
    #[serde(default)]
    pub burn_time: Burnt,
    pub temperature: Option<Temperature>,
    #[serde(default)]
    pub weighed: Weighed,
}

with_defaults! {
    /// A measured quantity of the lot's burns, relative to the curve's value.
    #[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
    #[serde(deny_unknown_fields)]
    pub struct Burnt {
        pub mean: f64 = 1.0,
        /// Sample standard deviation; 0 of a single burn.
        #[serde(default)]
        pub scatter: f64 = 0.0,
        /// Standard deviation of the common error of all burns, such as the load cell's
        /// calibration.
        #[serde(default)]
        pub common: f64 = 0.0,
    }
}

/// Temperatures of the propellant, degrees Celsius.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Temperature {
    /// Mean of the burns.
    pub burns_c: f64,
    /// On the pad.
    pub pad_c: f64,
}

/// Weights of the day, to 5 g.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Weighed {
    /// The motor before the flight, kg.
    pub motor_kg: Option<f64>,
    /// The vehicle with the motor in, kg. It replaces `airframe.mass.loaded_kg`.
    pub vehicle_kg: Option<f64>,
}

/// The prior counts as this many burns for the mean: a lot's mean differs from the certified value
/// as much as motors within the lot differ from each other. (The certified curves of one motor,
/// which are of different lots, differ by 3.75 % of impulse; the set `field` has 2.5 % for the two
/// together.)
const PRIOR_BURNS: f64 = 1.0;
/// Half the degrees of freedom of the prior's scatter: the fewest with which the next value has a
/// variance, so that the lot's burns soon dominate.
const PRIOR_ALPHA: u32 = 2;
/// Standard deviation of the mass of a vehicle that was not weighed on the day: the 1 % that
/// [`MotorPrior`] has in its impulse.
const UNWEIGHED_SHARE: f64 = 0.01;
/// A weighing is right to this, kg.
const WEIGHED_KG: f64 = 0.005;
/// Change of the chamber pressure by the propellant's temperature, 1/K: the middle of 0.067 to
/// 0.278 % (Sutton and Biblarz, Rocket Propulsion Elements, 9th edition, chapter 12, temperature
/// sensitivity at constant area ratio). The thrust changes as the pressure, the burn time
/// inversely: the impulse stays.
const PRESSURE_PER_K: f64 = 0.001_725;
/// Its standard deviation, that of an even distribution between these two, 1/K.
const PRESSURE_PER_K_SIGMA: f64 = 0.000_609;

/// Posterior of a normal distribution: the conjugate normal-inverse-gamma (A. Gelman et al.,
/// Bayesian Data Analysis, 3rd edition, section 3.3), with a common error of all values.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Posterior {
    /// Expected mean.
    pub mean: f64,
    /// How many values the knowledge of the mean is worth.
    pub worth: f64,
    /// Degrees of freedom of the scatter, and of the next value's Student t.
    pub freedom: u32,
    /// Sum of squares that belongs to the degrees of freedom.
    pub squares: f64,
    /// Standard deviation of the common error of all values. No number of values reduces it.
    pub common: f64,
}

impl Posterior {
    /// Before any burn: the next value has this mean and this standard deviation.
    pub fn prior(mean: f64, sigma: f64) -> Self {
        let alpha = f64::from(PRIOR_ALPHA);
        // The variance of the next value is squares / (2 alpha - 2) (1 + 1 / worth).
        let squares = 2.0 * sigma * sigma * (alpha - 1.0) / (1.0 + 1.0 / PRIOR_BURNS);
        Self { mean, worth: PRIOR_BURNS, freedom: 2 * PRIOR_ALPHA, squares, common: 0.0 }
    }

    /// With some burns more.
    #[must_use]
    pub fn with(self, burns: u32, burnt: &Burnt) -> Self {
        let Burnt { mean, scatter, common } = *burnt;
        let count = f64::from(burns);
        let (missed, worth) = (mean - self.mean, self.worth + count);
        let within = (count - 1.0).max(0.0) * scatter * scatter;
        Self {
            mean: self.mean + missed * count / worth,
            worth,
            freedom: self.freedom + burns,
            squares: self.squares + within + missed * missed * self.worth * count / worth,
            common: if burns > 0 { common } else { self.common },
        }
    }

    /// Standard deviation of the next value.
    pub fn next_sigma(&self) -> f64 {
        libm::hypot(self.scatter(), self.mean_sigma())
    }

    /// Expected standard deviation within the lot (the root of the expected variance).
    pub fn scatter(&self) -> f64 {
        libm::sqrt(self.squares / (f64::from(self.freedom) - 2.0))
    }

    /// Standard deviation of the mean.
    pub fn mean_sigma(&self) -> f64 {
        libm::hypot(self.scatter() / libm::sqrt(self.worth), self.common)
    }
}

/// A value of the next burn over the curve's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scale {
    pub mean: f64,
    /// Standard deviation, as a fraction of the mean.
    pub share: f64,
}

/// Expectation of the motor on its pad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Expectation {
    pub impulse: Scale,
    pub burn_time: Scale,
    /// Standard deviation of the vehicle's mass, as a fraction.
    pub mass_share: f64,
}

impl Expectation {
    /// Standard deviation of the impulse per mass, as a fraction: an accelerometer cannot
    /// distinguish the two.
    pub fn impulse_per_mass_share(&self) -> f64 {
        libm::hypot(self.impulse.share, self.mass_share)
    }
}

impl Lot {
    /// The expectation from this lot and `prior`, for a vehicle of this mass. Mean and scatter are
    /// those of [`Posterior`]; the variances of independent causes add up.
    pub fn expectation(&self, prior: &MotorPrior, loaded_kg: f64) -> Expectation {
        let impulse_sigma = libm::sqrt(
            (prior.impulse_sigma * prior.impulse_sigma - UNWEIGHED_SHARE * UNWEIGHED_SHARE).max(0.0),
        );
        let next = |sigma, burnt| {
            let posterior = Posterior::prior(1.0, sigma).with(self.burns, burnt);
            Scale { mean: posterior.mean, share: posterior.next_sigma() / posterior.mean }
        };
        let burn_time = next(prior.burn_time_sigma, &self.burn_time);
        let warmer_k = self.temperature.map_or(0.0, |temperature| temperature.pad_c - temperature.burns_c);
        Expectation {
            impulse: next(impulse_sigma, &self.impulse),
            burn_time: Scale {
                mean: burn_time.mean * libm::exp(-PRESSURE_PER_K * warmer_k),
                share: libm::hypot(burn_time.share, PRESSURE_PER_K_SIGMA * warmer_k),
            },
            mass_share: self.weighed.vehicle_kg.map_or(UNWEIGHED_SHARE, |_| WEIGHED_KG / loaded_kg),
        }
    }

    /// Checks the weights against the data of motor and vehicle, kg: a wrong one was weighed, or in
    /// grams.
    ///
    /// # Errors
    /// [`BadValue`] names the key.
    pub fn validate_weights(&self, motor_kg: f64, vehicle_kg: f64) -> Result<(), BadValue> {
        let Weighed { motor_kg: motor, vehicle_kg: vehicle } = self.weighed;
        for (key, found, by_data, required) in [
            ("lot.weighed.motor_kg", motor, motor_kg, "within a tenth of the motor's total mass, kg"),
            ("lot.weighed.vehicle_kg", vehicle, vehicle_kg, "within a tenth of airframe.mass.loaded_kg, kg"),
        ] {
            if let Some(found) = found.filter(|found| !(0.9..=1.1).contains(&(found / by_data))) {
                return Err(BadValue::new(key, &found, required));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lot(burns: u32, impulse: Burnt, burn_time: Burnt) -> Lot {
        let name = "2609".into();
        Lot { name, burns, curve: None, impulse, burn_time, temperature: None, weighed: Weighed::default() }
    }

    /// A prior of 1 with 0.02, worth one value, 4 degrees: squares 0.0004. Values 1.02 and 0.99:
    /// the mean is (1 + 1.02 + 0.99) / 3; the squares grow by 0.02^2 / 2 and by 0.02^2 2/3, value
    /// by value.
    #[test]
    fn val_hand_two_burns() {
        let prior = Posterior::prior(1.0, 0.02);
        assert!((prior.next_sigma() - 0.02).abs() < 1e-12 && (prior.squares - 0.0004).abs() < 1e-15);
        let burnt = Burnt { mean: 1.005, scatter: 0.015 * core::f64::consts::SQRT_2, common: 0.0 };
        let posterior = prior.with(2, &burnt);
        assert!((posterior.mean - 3.01 / 3.0).abs() < 1e-12);
        assert_eq!(posterior.freedom, 6);
        let squares = 0.0004 + 0.0004 / 2.0 + 0.0004 * 2.0 / 3.0;
        assert!((posterior.squares - squares).abs() < 1e-12, "{posterior:?}");
        assert!((posterior.next_sigma() - libm::sqrt(squares / 4.0 * 4.0 / 3.0)).abs() < 1e-12);
    }

    /// 0.03 in common with 0.04 of the mean by its values: the mean has 0.05.
    #[test]
    fn val_hand_what_all_burns_have_in_common_widens_the_mean() {
        let posterior = Posterior { squares: 0.0016 * 2.0, common: 0.03, ..Posterior::prior(1.0, 0.02) };
        assert!((posterior.mean_sigma() - 0.05).abs() < 1e-12 && (posterior.scatter() - 0.04).abs() < 1e-12);
    }

    #[test]
    fn a_lot_without_burns_expects_what_is_expected_without_a_lot() {
        let prior = MotorPrior::default();
        let found = lot(0, Burnt::default(), Burnt::default()).expectation(&prior, 3.3);
        assert!((found.impulse.mean - 1.0).abs() < 1e-15 && (found.burn_time.mean - 1.0).abs() < 1e-15);
        assert!((found.impulse_per_mass_share() - prior.impulse_sigma).abs() < 1e-12, "{found:?}");
        assert!((found.burn_time.share - prior.burn_time_sigma).abs() < 1e-12);
    }

    #[test]
    fn more_burns_and_scales_narrow_what_is_expected() {
        let prior = MotorPrior::default();
        let burnt = |scatter| Burnt { scatter, ..Burnt::default() };
        let few = lot(3, burnt(0.01), burnt(0.015)).expectation(&prior, 3.3);
        let many = lot(30, burnt(0.01), burnt(0.015)).expectation(&prior, 3.3);
        assert!(many.impulse.share < few.impulse.share && few.impulse_per_mass_share() < prior.impulse_sigma);
        // Many burns have the scatter of the lot.
        assert!((many.impulse.share - 0.01).abs() < 0.002 && (many.burn_time.share - 0.015).abs() < 0.003);
        let weighed = Weighed { vehicle_kg: Some(3.3), ..Weighed::default() };
        let weighed = Lot { weighed, ..lot(3, burnt(0.01), burnt(0.015)) }.expectation(&prior, 3.3);
        assert!((weighed.mass_share - 0.005 / 3.3).abs() < 1e-15 && weighed.impulse == few.impulse);
    }

    /// 15 K colder, 0.1725 % a kelvin: the burn is longer by 2.6 %, with an additional uncertainty
    /// of 0.91 %.
    #[test]
    fn val_sutton_a_cold_motor_burns_longer_with_the_same_impulse() {
        let prior = MotorPrior { burn_time_sigma: 0.0, ..MotorPrior::default() };
        let warm = lot(0, Burnt::default(), Burnt::default());
        let cold = Lot { temperature: Some(Temperature { burns_c: 20.0, pad_c: 5.0 }), ..warm.clone() };
        let (warm, cold) = (warm.expectation(&prior, 3.3), cold.expectation(&prior, 3.3));
        assert_eq!(warm.impulse, cold.impulse);
        assert!((cold.burn_time.mean - 1.0262).abs() < 1e-4, "{cold:?}");
        assert!((cold.burn_time.share - 0.009_135).abs() < 1e-6, "{cold:?}");
    }
}
