//! What all flights so far tell of a motor lot, an airframe and a site, and what the next flight may expect of them.
//!
//! * [`posterior`]: a lot's mean and scatter, from the prior of a set of dispersions and the burns so far.
//! * [`rate`]: the landing rate with its interval, from simulated flights with motors of the posterior.
//! * [`day`]: the mission and the set of dispersions of the day, as files.
//!
//! Everything is per mass of the mission's data, as the fits are: the vehicle is taken as weighed, and its mass does not
//! scatter beside its thrust.

pub mod day;
pub mod posterior;
pub mod rate;
mod surface;

use std::num::NonZeroUsize;
use std::panic::resume_unwind;
use std::sync::atomic::{AtomicUsize, Ordering};

use flight::guidance::baseline::{Controller, Law};
use rand::SeedableRng as _;
use rand_chacha::ChaCha12Rng;
use serde::Serialize;
use sim::dispersion::{Dispersion, DispersionError};
use sim::draw::{Draw, draw};
use sim::sortie::{SetUpError, Sortie};
use world::truth::Truth;

use self::day::Day;
use self::posterior::{Chance, Lot};
use self::rate::{Prediction, Trial, draw_next, predict};
use crate::fit::{Basis, Fit, Pooled, Z_95, pooled};
use crate::settings::SettingError;

/// What is asked.
#[derive(Debug, Clone)]
pub struct Ask<'a> {
    pub mission_toml: &'a str,
    /// Name and text of the set of dispersions that is the prior.
    pub set: (&'a str, &'a str),
    /// Simulated flights of the day.
    pub flights: usize,
    pub seed: u64,
    /// The landing rate that the club wants, and the risk of flying below it that it takes.
    pub limit: f64,
    pub risk: f64,
    /// Flights at the same time; the answer does not depend on it.
    pub jobs: NonZeroUsize,
}

/// Why nothing can be learnt.
#[derive(Debug, thiserror::Error)]
pub enum LearnError {
    /// No fit has a burn.
    #[error("no burn was found in {0} fits: a lot is learnt from burns")]
    NoBurn(usize),
    /// A fit is of another vehicle or motor than the mission.
    #[error(
        "{source_name} is of {found}, and the mission of {known}: one vehicle and one motor are learnt at a time"
    )]
    Other { source_name: String, found: String, known: String },
    /// The mission, or a value that was learnt for it.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// The set of dispersions.
    #[error(transparent)]
    Dispersion(#[from] DispersionError),
    /// What was learnt cannot be written as a file.
    #[error("{0}")]
    Day(String),
    /// A flight cannot be simulated.
    #[error(transparent)]
    SetUp(#[from] SetUpError),
}

/// A lot's property before the next burn.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LotReport {
    pub name: &'static str,
    pub unit: &'static str,
    /// Burns with this property.
    pub burns: usize,
    pub mean: f64,
    /// Ends of the 95 % interval of the mean, as a normal one.
    pub low: f64,
    pub high: f64,
    /// Standard deviation within the lot.
    pub scatter: f64,
    /// Standard deviation of the next burn.
    pub next_sigma: f64,
    /// The same before the first burn.
    pub prior_sigma: f64,
}

/// What was learnt, and the answer for the day.
#[derive(Debug, Clone, Serialize)]
pub struct Learnt {
    pub mission: String,
    pub motor: String,
    /// Name of the set of dispersions that was the prior.
    pub set: String,
    pub sources: Vec<String>,
    pub lots: Vec<LotReport>,
    /// Drag and gimbal of the airframe, over the flights.
    pub airframe: Vec<Pooled>,
    /// Mean wind at the site, lowest and highest of an even distribution, m/s.
    pub wind_m_s: [f64; 2],
    pub flights: usize,
    pub prediction: Prediction,
    pub limit: f64,
    pub risk: f64,
    pub go: bool,
    #[serde(skip)]
    pub day: Day,
}

/// The three properties of a lot, in the order of a trial's draws.
const PROPERTIES: [(&str, &str); 3] =
    [("thrust_scale", ""), ("burn_time_scale", ""), ("ignition_delay", "s")];

/// Learns from fits, and flies the day.
///
/// # Errors
/// [`LearnError`] says what is wrong with the fits, the mission or the set.
pub fn learn(fits: &[Fit], ask: &Ask<'_>) -> Result<Learnt, LearnError> {
    let set = Dispersion::from_toml(ask.set.1, ask.set.0)?;
    let mission = crate::settings::mission_with(ask.mission_toml, &[])?;
    one_vehicle(fits, [&mission.name, mission.motor_curve.name()])?;
    let basis = Basis::of(&mission);
    let fits: Vec<Fit> = fits.iter().map(|fit| fit.over(&basis)).collect();
    let fits = fits.as_slice();
    let scatter_scale = mission.airframe.igniter.scatter_scale;
    let both = |sigma: f64, even: f64| libm::sqrt(sigma * sigma + even * even / 3.0);
    let priors = [
        // The scale is per mass: the mass scatters in it.
        (1.0, libm::hypot(both(set.impulse_share, set.impulse_even_share), set.mass_share)),
        (1.0, set.burn_time_share),
        (
            Truth::default().ignition_delay_s,
            scatter_scale * both(set.ignition_delay_s, set.ignition_delay_even_s),
        ),
    ]
    // A set without scatter still has to leave room for what is measured.
    .map(|(mean, sigma)| Lot::prior(mean, sigma.max(1e-3)));
    let values: Vec<Vec<f64>> = PROPERTIES
        .iter()
        .map(|(name, _)| fits.iter().filter_map(|fit| fit.get(name)).map(|found| found.value).collect())
        .collect();
    if values[0].is_empty() {
        return Err(LearnError::NoBurn(fits.len()));
    }
    let lots: Vec<Lot> = priors.iter().zip(&values).map(|(prior, values)| prior.with(values)).collect();
    let airframe: Vec<Pooled> = airframe(fits);
    let wind_m_s = wind(fits, &set);
    let sources: Vec<String> = fits.iter().map(|fit| fit.source.clone()).collect();
    let day = Day::of(ask, &mission, &lots, &airframe, wind_m_s, &sources)?;
    let trials = fly(ask, &lots, &day)?;
    let prediction = predict(&lots, &trials, ask.limit, ask.seed)
        .ok_or_else(|| LearnError::Day("no flight was simulated: --flights is 0".to_owned()))?;
    let reports = PROPERTIES.iter().zip(&lots).zip(&values).zip(&priors);
    let reports = reports.map(|((((name, unit), lot), values), prior)| LotReport {
        name,
        unit,
        burns: values.len(),
        mean: lot.mean,
        low: lot.mean - Z_95 * lot.mean_sigma(),
        high: lot.mean + Z_95 * lot.mean_sigma(),
        scatter: lot.scatter(),
        next_sigma: lot.next_sigma(),
        prior_sigma: prior.next_sigma(),
    });
    Ok(Learnt {
        mission: mission.name.clone(),
        motor: mission.motor_curve.name().to_owned(),
        set: ask.set.0.to_owned(),
        sources,
        lots: reports.collect(),
        airframe,
        wind_m_s,
        flights: trials.len(),
        prediction,
        limit: ask.limit,
        risk: ask.risk,
        go: prediction.risk <= ask.risk,
        day,
    })
}

/// Refuses fits of other vehicles and motors than the mission's, by their names; a test stand has no vehicle.
fn one_vehicle(fits: &[Fit], known: [&str; 2]) -> Result<(), LearnError> {
    for fit in fits {
        for (found, known) in [&fit.mission, &fit.motor].into_iter().zip(known) {
            if !found.is_empty() && found != known {
                return Err(LearnError::Other {
                    source_name: fit.source.clone(),
                    found: found.clone(),
                    known: known.to_owned(),
                });
            }
        }
    }
    Ok(())
}

/// Drag and gimbal; of one flight as it was found.
fn airframe(fits: &[Fit]) -> Vec<Pooled> {
    let wanted = ["drag_scale", "gimbal_delay", "gimbal_gain", "gimbal_play"];
    let together = pooled(fits);
    let one = |name: &str| {
        let mean = fits.iter().find_map(|fit| fit.get(name))?.clone();
        Some(Pooled { mean, flights: 1, scatter: 0.0 })
    };
    let found = wanted.into_iter().filter_map(|name| {
        together.iter().find(|pooled| pooled.mean.name == name).cloned().or_else(|| one(name))
    });
    found.collect()
}

/// The mean wind of the next day: the prior's range is a mean and a deviation, the flights' winds are values of them, and the
/// next value's deviation is a range again.
fn wind(fits: &[Fit], set: &Dispersion) -> [f64; 2] {
    let [low, high] = set.wind_m_s;
    let speeds: Vec<f64> = fits
        .iter()
        .filter_map(|fit| Some(libm::hypot(fit.get("wind_x")?.value, fit.get("wind_y")?.value)))
        .collect();
    if speeds.is_empty() || high <= low {
        return set.wind_m_s;
    }
    let lot = Lot::prior(0.5 * (low + high), (high - low) / libm::sqrt(12.0)).with(&speeds);
    let reach = libm::sqrt(3.0) * lot.next_sigma();
    [(lot.mean - reach).max(0.0), lot.mean + reach]
}

/// Flies the day's flights, several at a time.
fn fly(ask: &Ask<'_>, lots: &[Lot], day: &Day) -> Result<Vec<Trial>, LearnError> {
    let law = Law::of(Controller::Nmpc, &day.mission);
    let mut chance = Chance(ChaCha12Rng::seed_from_u64(ask.seed));
    let motors: Vec<Vec<f64>> = (0..ask.flights).map(|_| draw_next(lots, &mut chance)).collect();
    let next = AtomicUsize::new(0);
    let landed = std::thread::scope(|scope| {
        let one = || -> Result<Vec<(usize, bool)>, SetUpError> {
            let mut flown = Vec::new();
            loop {
                let number = next.fetch_add(1, Ordering::Relaxed);
                let Some(motor) = motors.get(number) else { return Ok(flown) };
                let drawn = draw(&day.mission, &day.dispersion, ask.seed, number as u64);
                let truth = Truth {
                    // The day's mission has the lot's means already.
                    impulse_scale: (motor[0] / lots[0].mean).clamp(0.1, 10.0),
                    burn_time_scale: (motor[1] / lots[1].mean).clamp(0.3, 10.0),
                    ignition_delay_s: motor[2].clamp(0.02, 60.0),
                    ..drawn.truth
                };
                let mut flight =
                    Sortie::drawn_as(&day.mission, &day.dispersion, &Draw { truth, ..drawn }, law.clone())?;
                flown.push((number, flight.run().legs));
            }
        };
        let workers: Vec<_> = (0..ask.jobs.get().min(ask.flights.max(1))).map(|_| scope.spawn(one)).collect();
        let mut landed = vec![false; motors.len()];
        for worker in workers {
            for (number, legs) in worker.join().unwrap_or_else(|panic| resume_unwind(panic))? {
                landed[number] = legs;
            }
        }
        Ok::<_, SetUpError>(landed)
    })?;
    Ok(motors.into_iter().zip(landed).map(|(drawn, landed)| Trial { drawn, landed }).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::Parameter;

    fn fit(source: &str, mission: &str, motor: &str, found: Vec<Parameter>) -> Fit {
        let text = |text: &str| text.to_owned();
        Fit {
            source: text(source),
            mission: text(mission),
            motor: text(motor),
            basis: Basis { impulse_n_s: 1.0, burn_time_s: 1.0, drag_area_m2: 1.0, loaded_kg: 1.0 },
            found,
            not_found: Vec::new(),
            damage: None,
        }
    }

    #[test]
    fn other_vehicles_and_other_motors_are_refused_and_a_stand_is_not() {
        let fits = [fit("a", "mk2", "H45W", vec![]), fit("b", "", "H45W", vec![])];
        assert!(one_vehicle(&fits, ["mk2", "H45W"]).is_ok());
        let error = one_vehicle(&fits, ["mk2", "H53"]).unwrap_err().to_string();
        assert!(error.starts_with("a is of H45W, and the mission of H53"), "{error}");
    }

    /// A range of 0 to 6 is 3 with 1.732; one flight in 5 m/s makes the mean 4 and the squares 3 + 2 (worth one value and one
    /// more): the next deviation is the root of (3 + 2) / 3 * 1.5, the range 1.732 times that to both sides.
    #[test]
    fn val_hand_the_wind_of_the_next_day() {
        let set = Dispersion { wind_m_s: [0.0, 6.0], ..Dispersion::default() };
        let wind_x = Parameter::normal("wind_x", "m/s", 3.0, 0.1);
        let wind_y = Parameter::normal("wind_y", "m/s", 4.0, 0.1);
        let [low, high] = wind(&[fit("a", "mk2", "H45W", vec![wind_x, wind_y])], &set);
        let reach = libm::sqrt(3.0) * libm::sqrt((3.0 + 2.0) / 3.0 * 1.5);
        assert!(
            (high - 4.0 - reach).abs() < 1e-9 && (low - (4.0 - reach).max(0.0)).abs() < 1e-9,
            "{low} {high}"
        );
    }
}
