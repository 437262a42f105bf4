//! Estimates from all flights so far: a motor lot, an airframe and a site, and what the next flight
//! may expect of them.
//!
//! * [`Posterior`]: a lot's mean and scatter, from the prior of a set of dispersions and the burns
//!   so far.
//! * [`predict`]: the landing rate with its interval, from simulated flights with motors of the
//!   posterior.
//! * [`Day`]: the mission and the set of dispersions of the day, as files.
//!
//! Everything is per mass of the mission's data, as the fits are: the vehicle is taken as weighed,
//! and its mass does not scatter beside its thrust.

use std::fmt::Write as _;
use std::num::NonZeroUsize;
use std::path::PathBuf;

use anyhow::{Context as _, Result, bail, ensure};
use clap::Args;
use flight::vehicle::lot::{Burnt, Posterior};
use flight::vehicle::mission::Mission;
use onboard_sim::progress::Progress;
use onboard_sim::run::in_parallel;
use serde::Serialize;
use sim::dispersion::{DEFAULT, Dispersion, is_more_benign};
use sim::draw::{Chance, Draw, draw};
use sim::sortie::{SetUpError, Sortie};
use sim::world::truth::Truth;
use statrs::distribution::{Beta, ContinuousCDF as _};
use statrs::function::beta::beta;

use super::lot::{Prediction, Trial, burnt, burnt_weighted, distances, draw_next, predict, weight};
use super::{Basis, Fit, Parameter, Pooled, Z_95, pooled};
use crate::cli::{Answer, print_note, text_of};
use crate::print::{columns, counted};
use crate::settings::{Setting, mission_toml_with, mission_with};
use onboard_sim::files::{new_folder, write_folder};
use onboard_sim::run::threads;

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

/// A burn beside the others.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Burn {
    /// The log or the stand's table.
    pub source: String,
    /// Distances of thrust, burn time and ignition delay from the median, in standard deviations of
    /// a next burn; `None` if not found.
    pub distances: [Option<f64>; 3],
    /// Weight in the lot, 0 to 1.
    pub weight: f64,
}

impl Burn {
    /// Every fit with thrust and burn time, each beside the others: the further of the two decides
    /// the weight.
    fn of<'a>(fits: &'a [Fit], priors: &[Posterior; 3]) -> Vec<(&'a Fit, Self)> {
        let is_burn = |fit: &&Fit| PROPERTIES[..2].iter().all(|(name, _)| fit.get(name).is_some());
        let burns: Vec<&Fit> = fits.iter().filter(is_burn).collect();
        let of_each: [Vec<Option<f64>>; 3] = std::array::from_fn(|property| {
            let found = burns.iter().map(|fit| fit.get(PROPERTIES[property].0));
            let found: Vec<_> = found.map(|found| found.map(|found| (found.value, found.sigma))).collect();
            let known: Vec<_> = found.iter().flatten().copied().collect();
            let mut distances = distances(&priors[property], &known).into_iter();
            found.iter().map(|found| found.and_then(|_| distances.next())).collect()
        });
        let burn = |(place, fit): (usize, &&'a Fit)| {
            let distances = of_each.each_ref().map(|distances| distances[place]);
            let weight =
                distances[..2].iter().flatten().map(|distance| weight(*distance)).fold(1.0, f64::min);
            (*fit, Self { source: fit.source.clone(), distances, weight })
        };
        burns.iter().enumerate().map(burn).collect()
    }

    /// The burn that is furthest away, for errors.
    fn furthest(burns: &[Self]) -> String {
        let far =
            |burn: &Self| burn.distances.iter().flatten().fold(0.0, |most: f64, one| most.max(one.abs()));
        let furthest = burns.iter().max_by(|a, b| far(a).total_cmp(&far(b)));
        furthest.map_or_else(String::new, |burn| format!("{}, {:.1} deviations away", burn.source, far(burn)))
    }
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
    /// The burns that the lot is learnt from, and their weights in it.
    pub burns: Vec<Burn>,
    /// The same as the section `[lot]` of a mission.
    pub lot_toml: String,
    /// Drag and gimbal of the airframe, over the flights.
    pub airframe: Vec<Pooled>,
    /// The gimbal's rate that the next day is flown with, deg/s, and the fit that it is from: the
    /// slowest, if it is slower than the mission's. What has slowed down does not recover.
    pub slow_gimbal: Option<(f64, String)>,
    /// Mean wind at the site, lowest and highest of an even distribution, m/s.
    pub wind_m_s: [f64; 2],
    pub flights: usize,
    /// Simulated flights that landed.
    pub landed: usize,
    /// `None` if the day was not flown.
    pub prediction: Option<Prediction>,
    /// How the flights so far ended.
    pub flown: Outcomes,
    /// The rate after these outcomes, which decides; `None` if the day was not flown.
    pub expected: Option<Expected>,
    pub limit: f64,
    pub risk: f64,
    pub go: Option<bool>,
    #[serde(skip)]
    pub day: Day,
}

/// The three properties of a lot, in the order of a trial's draws.
const PROPERTIES: [(&str, &str); 3] =
    [("thrust_scale", ""), ("burn_time_scale", ""), ("ignition_delay", "s")];

/// Learns from fits for a mission, from the prior that a set of dispersions is, and flies the day.
fn learn(fits: &[Fit], ask: &Arguments, mission_toml: &str, set_toml: &str) -> Result<Learnt> {
    let set = Dispersion::from_toml(set_toml, &ask.prior)?;
    let (before, lot) = unburnt(mission_toml)?;
    let mission = mission_with(&before, &[])?;
    one_vehicle(fits, [&mission.name, mission.motor_curve.name()])?;
    let basis = Basis::of(&mission);
    let fits: Vec<Fit> = fits.iter().map(|fit| fit.over(&basis)).collect();
    let fits = fits.as_slice();
    let scatter_scale = mission.airframe.igniter_scatter();
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
    .map(|(mean, sigma)| Posterior::prior(mean, sigma.max(1e-3)));
    let burns = Burn::of(fits, &priors);
    let counted_burns: Vec<(&Fit, f64)> =
        burns.iter().filter(|(_, burn)| burn.weight > 0.0).map(|(fit, burn)| (*fit, burn.weight)).collect();
    // A delay may be found without a burn. A distant one counts fully: a hang fire may come again.
    let without_burn = fits.iter().filter(|fit| burns.iter().all(|(burn, _)| !std::ptr::eq(*burn, *fit)));
    let delays: Vec<(&Fit, f64)> =
        counted_burns.iter().map(|(fit, _)| *fit).chain(without_burn).map(|fit| (fit, 1.0)).collect();
    ensure!(
        !counted_burns.is_empty(),
        "no burn was found in {} fits: a lot is learnt from burns",
        fits.len()
    );
    let of = |fits: &[(&Fit, f64)], name: &str| {
        let found: Vec<_> = fits.iter().filter_map(|(fit, weight)| Some((fit.get(name)?, *weight))).collect();
        let common = found.iter().filter_map(|(found, _)| found.systematic).fold(0.0, f64::max);
        let values: Vec<_> = found.iter().map(|(found, weight)| (found.value, *weight)).collect();
        (values.len(), burnt_weighted(&values, common))
    };
    let [thrust, burn_time, delay] = PROPERTIES.map(|(name, _)| name);
    let values = [of(&counted_burns, thrust), of(&counted_burns, burn_time), of(&delays, delay)];
    let burns: Vec<Burn> = burns.into_iter().map(|(_, burn)| burn).collect();
    let lots = priors.iter().zip(&values);
    let lots: Vec<Posterior> = lots.map(|(prior, (count, burnt))| prior.with(*count as u32, burnt)).collect();
    let airframe: Vec<Pooled> = airframe(fits);
    let slow_gimbal = slow_gimbal(fits, mission.airframe.gimbal.servo.rate_deg_s);
    let wind_m_s = wind(fits, &set);
    let sources: Vec<String> = fits.iter().map(|fit| fit.source.clone()).collect();
    let motor = mission.motor_curve.name();
    let lot = with_burns(lot, motor, counted_burns.len(), [&values[0].1, &values[1].1])?;
    let rate_deg_s = slow_gimbal.as_ref().map(|(rate_deg_s, _)| *rate_deg_s);
    let day =
        Day::of([&before, set_toml], &ask.prior, &lot, &lots, (&airframe, rate_deg_s), wind_m_s, &sources)
            .with_context(|| format!("the lot, whose furthest burn is {}", Burn::furthest(&burns)))?;
    let trials = ask.flights.map(|flights| fly(ask.seed, flights, &lots, &day)).transpose()?;
    let prediction = trials
        .as_ref()
        .map(|trials| predict(&lots, trials, ask.seed).context("no flight was simulated: --flights is 0"));
    let prediction = prediction.transpose()?;
    let flown = Outcomes::of(fits);
    let expected = prediction.as_ref().and_then(|found| Expected::of(found, flown, ask.limit));
    let reports = PROPERTIES.iter().zip(&lots).zip(&values).zip(&priors);
    let reports = reports.map(|((((name, unit), lot), (burns, _)), prior)| LotReport {
        name,
        unit,
        burns: *burns,
        mean: lot.mean,
        low: lot.mean - Z_95 * lot.mean_sigma(),
        high: lot.mean + Z_95 * lot.mean_sigma(),
        scatter: lot.scatter(),
        next_sigma: lot.next_sigma(),
        prior_sigma: prior.next_sigma(),
    });
    let every_burn_counts = burns.iter().all(|burn| burn.weight > 0.0);
    Ok(Learnt {
        mission: mission.name.clone(),
        motor: motor.to_owned(),
        set: ask.prior.clone(),
        sources,
        lots: reports.collect(),
        burns,
        lot_toml: lot_toml(&lot),
        airframe,
        slow_gimbal,
        wind_m_s,
        flights: trials.as_ref().map_or(0, Vec::len),
        landed: trials.map_or(0, |trials| trials.iter().filter(|trial| trial.landed).count()),
        prediction,
        flown,
        expected,
        limit: ask.limit,
        risk: ask.risk,
        go: expected.map(|expected| expected.risk <= ask.risk && every_burn_counts),
        day,
    })
}

/// How the flights so far ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Outcomes {
    pub landed: usize,
    pub of: usize,
    /// Flights whose log does not say how they ended.
    pub unknown: usize,
}

impl Outcomes {
    /// A burn on a stand is no flight.
    fn of(fits: &[Fit]) -> Self {
        let flights = || fits.iter().filter(|fit| !fit.mission.is_empty());
        let landed = flights().filter(|fit| fit.landed == Some(true)).count();
        let of = flights().filter(|fit| fit.landed.is_some()).count();
        Self { landed, of, unknown: flights().count() - of }
    }
}

/// The landing rate by the simulation and by the outcomes of flights: one distribution for rate,
/// interval and risk.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Expected {
    /// Probability that the simulation is of the club's world.
    pub trust: f64,
    pub rate: f64,
    /// Ends of the 95 % interval.
    pub low: f64,
    pub high: f64,
    /// Probability that the rate is below the limit.
    pub risk: f64,
}

/// Before its first flight one club of ten lives in a world that its simulation does not have: any
/// rate may be there. More of them, and no club could fly before it has flown ten times; fewer, and
/// five flights are no evidence against a simulation.
const OTHER_WORLD: f64 = 0.1;

impl Expected {
    /// A mixture of the rates that the simulation predicts and a uniform rate, each with the
    /// likelihood of the outcomes (Gelman et al., Bayesian Data Analysis, 3rd ed., 2.4 and 7.4).
    pub fn of(simulated: &Prediction, Outcomes { landed, of, .. }: Outcomes, limit: f64) -> Option<Self> {
        let [landed, lost] = [landed, of - landed].map(|count| count as f64);
        let likelihood = |rate: f64| libm::pow(rate, landed) * libm::pow(1.0 - rate, lost);
        let any = Beta::new(1.0 + landed, 1.0 + lost).ok()?;
        let any_weight = OTHER_WORLD * beta(1.0 + landed, 1.0 + lost);
        let share = (1.0 - OTHER_WORLD) / simulated.rates.len() as f64;
        let rates = || simulated.rates.iter().map(|rate| (*rate, share * likelihood(*rate)));
        let held: f64 = rates().map(|(_, weight)| weight).sum();
        let all = held + any_weight;
        let below = |limit: f64| {
            let held: f64 = rates().filter(|(rate, _)| *rate < limit).map(|(_, weight)| weight).sum();
            (held + any_weight * any.cdf(limit)) / all
        };
        let at = |share: f64| {
            let halved = |[low, high]: [f64; 2], _| {
                let middle = 0.5 * (low + high);
                if below(middle) < share { [middle, high] } else { [low, middle] }
            };
            (0..30).fold([0.0, 1.0], halved)[0]
        };
        let held_rate: f64 = rates().map(|(rate, weight)| rate * weight).sum();
        let rate = (held_rate + any_weight * (1.0 + landed) / (2.0 + of as f64)) / all;
        Some(Self { trust: held / all, rate, low: at(0.025), high: at(0.975), risk: below(limit) })
    }
}

/// Refuses fits of other vehicles and motors than the mission's, by their names; a test stand has
/// no vehicle.
fn one_vehicle(fits: &[Fit], known: [&str; 2]) -> Result<()> {
    for fit in fits {
        for (found, known) in [&fit.mission, &fit.motor].into_iter().zip(known) {
            ensure!(
                found.is_empty() || found == known,
                "{} is of {found}, and the mission of {known}: one vehicle and one motor are learnt at a time",
                fit.source
            );
        }
    }
    Ok(())
}

/// Drag and gimbal; of one flight as it was found.
fn airframe(fits: &[Fit]) -> Vec<Pooled> {
    let wanted = ["drag_per_mass_scale", "gimbal_delay", "gimbal_gain", "gimbal_play"];
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

/// The slowest gimbal that a fit has found for certain, deg/s, and which one, if it is below the
/// mission's.
fn slow_gimbal(fits: &[Fit], of_mission_deg_s: f64) -> Option<(f64, String)> {
    let found = fits.iter().filter_map(|fit| Some((fit.get("gimbal_rate")?, &fit.source)));
    let slow = found.filter(|(rate, _)| rate.high < of_mission_deg_s * SLOWER);
    let (rate, source) = slow.min_by(|a, b| a.0.value.total_cmp(&b.0.value))?;
    Some((rate.value, source.clone()))
}

/// A servo at another voltage or load is as much slower.
const SLOWER: f64 = 0.9;

/// The mean wind of the next day: the prior's range is a mean and a deviation, the flights' winds
/// are values of them, and the next value's deviation is a range again.
fn wind(fits: &[Fit], set: &Dispersion) -> [f64; 2] {
    let [low, high] = set.wind_m_s;
    let speeds: Vec<f64> = fits
        .iter()
        .filter_map(|fit| Some(libm::hypot(fit.get("wind_x")?.value, fit.get("wind_y")?.value)))
        .collect();
    if speeds.is_empty() || high <= low {
        return set.wind_m_s;
    }
    let lot = Posterior::prior(0.5 * (low + high), (high - low) / libm::sqrt(12.0))
        .with(speeds.len() as u32, &burnt(&speeds, 0.0));
    let reach = libm::sqrt(3.0) * lot.next_sigma();
    [(lot.mean - reach).max(0.0), lot.mean + reach]
}

/// Flies the day's flights.
fn fly(seed: u64, flights: usize, lots: &[Posterior], day: &Day) -> Result<Vec<Trial>> {
    let mut chance = Chance::of(seed, 0);
    let motors: Vec<(u64, Vec<f64>)> =
        (0..flights as u64).map(|number| (number, draw_next(lots, &mut chance))).collect();
    let one = |(number, motor): &(u64, Vec<f64>)| -> Result<bool, SetUpError> {
        let drawn = draw(&day.mission, &day.dispersion, seed, *number);
        let truth = Truth {
            // The day's mission has the lot's means already.
            impulse_scale: (motor[0] / lots[0].mean).clamp(0.1, 10.0),
            burn_time_scale: (motor[1] / lots[1].mean).clamp(0.3, 10.0),
            ignition_delay_s: motor[2].clamp(0.02, 60.0),
            // The thrust is per mass and has the mass's scatter in it.
            mass_scale: 1.0,
            ..drawn.truth
        };
        let draw = Draw { truth, ..drawn };
        Ok(Sortie::drawn_as(&day.mission, &day.dispersion, &draw)?.run().landing.stands)
    };
    let progress = Progress::start();
    let landed = in_parallel(&motors, one, &|done| progress.show(done, flights, "flights"));
    let trials =
        motors.into_iter().zip(landed).map(|((_, drawn), landed)| Ok(Trial { drawn, landed: landed? }));
    trials.collect()
}

/// The files of the day.
#[derive(Debug, Clone)]
pub struct Day {
    pub mission: Mission,
    pub mission_toml: String,
    pub dispersion: Dispersion,
    pub dispersion_toml: String,
}

impl Day {
    fn of(
        [before_toml, set_toml]: [&str; 2],
        set: &str,
        lot: &toml::Table,
        lots: &[Posterior],
        (airframe, gimbal_deg_s): (&[Pooled], Option<f64>),
        wind_m_s: [f64; 2],
        sources: &[String],
    ) -> Result<Self> {
        let [_, _, delay] = lots else { bail!("a lot has thrust, burn time and delay") };
        let mission = mission_with(before_toml, &[])?;
        let drag = airframe
            .iter()
            .find(|pooled| pooled.mean.name == "drag_per_mass_scale")
            .map(|pooled| &pooled.mean);
        let drag_scale = drag.map_or(1.0, |mean| mean.value);
        let (body, fins) = (&mission.airframe.body, &mission.airframe.fins);
        let float = |value: f64| toml::Value::Float(value);
        let settings = [
            ("lot", toml::Value::Table(lot.clone())),
            ("airframe.body.axial_drag_coefficient", float(body.axial_drag_coefficient * drag_scale)),
            ("airframe.body.crossflow_drag_coefficient", float(body.crossflow_drag_coefficient * drag_scale)),
            ("airframe.fins.drag_coefficient", float(fins.drag_coefficient * drag_scale)),
            ("airframe.fins.lift_coefficient", float(fins.lift_coefficient * drag_scale)),
            ("airframe.legs.drag_area_m2", float(mission.airframe.legs.drag_area_m2 * drag_scale)),
            ("ignition.delay_s", float(delay.mean)),
        ];
        let gimbal = gimbal_deg_s.map(|deg_s| ("airframe.gimbal.servo.rate_deg_s", float(deg_s)));
        let settings: Vec<Setting> = settings
            .into_iter()
            .chain(gimbal)
            .map(|(path, value)| Setting { path: path.to_owned(), value, at_s: None })
            .collect();
        let mission_toml = head("The mission", set, sources) + &mission_toml_with(before_toml, &settings)?;
        let mission = mission_with(&mission_toml, &[])?;
        let mut table: toml::Table = set_toml.parse().with_context(|| set.to_owned())?;
        let mut change = |key: &str, value: toml::Value| table.insert(key.to_owned(), value);
        // Impulse and burn time scatter as the mission's lot does. A set's delays scatter around
        // the nominal one; a lot with another mean gets its distance as scatter, too.
        let apart_s = delay.mean - Truth::default().ignition_delay_s;
        let scatter_scale = mission.airframe.igniter_scatter().max(1e-3);
        change("ignition_delay_s", float(libm::hypot(delay.next_sigma(), apart_s) / scatter_scale));
        change("ignition_delay_even_s", float(0.0));
        if let Some(mean) = drag {
            change("drag_share", float(mean.sigma / mean.value));
        }
        change("wind_m_s", toml::Value::Array(wind_m_s.map(float).to_vec()));
        let dispersion_toml = head("The dispersions", set, sources) + &toml::to_string(&table)?;
        // Read as the campaign reads it.
        let dispersion = Dispersion::from_toml(&dispersion_toml, "the day's set")?;
        Ok(Self { mission, mission_toml, dispersion, dispersion_toml })
    }
}

fn head(what: &str, set: &str, sources: &[String]) -> String {
    let mut head = format!("# {what} of the next flight, after {} with the prior {set}:\n", sources.len());
    for source in sources {
        // Writing to a String cannot fail.
        let _ = writeln!(head, "# {}", protocol::text::printable(source.as_bytes()));
    }
    head
}

/// The mission without what it knows of burns and of a day, and its `[lot]`: scales are over its
/// curve, and the next day has weights and temperatures of its own.
fn unburnt(mission_toml: &str) -> Result<(String, toml::Table)> {
    let mut mission: toml::Table = mission_toml.parse()?;
    let Some(toml::Value::Table(lot)) = mission.get_mut("lot") else {
        return Ok((mission_toml.to_owned(), toml::Table::new()));
    };
    lot.retain(|key, _| key == "name" || key == "curve");
    lot.insert("burns".to_owned(), toml::Value::Integer(0));
    let lot = lot.clone();
    Ok((toml::to_string(&mission)?, lot))
}

/// A lot with its burns; without a name it is named after its motor.
fn with_burns(mut lot: toml::Table, motor: &str, burns: usize, burnt: [&Burnt; 2]) -> Result<toml::Table> {
    lot.entry("name").or_insert_with(|| toml::Value::String(motor.to_owned()));
    lot.insert("burns".to_owned(), toml::Value::try_from(burns)?);
    for (name, burnt) in ["impulse", "burn_time"].into_iter().zip(burnt) {
        lot.insert(name.to_owned(), toml::Value::try_from(burnt)?);
    }
    Ok(lot)
}

/// The section as text, each property in a line of its own.
fn lot_toml(lot: &toml::Table) -> String {
    let lines = lot.iter().map(|(key, value)| format!("{key} = {value}\n"));
    format!("[lot]\n{}", lines.collect::<String>())
}

impl Answer for Learnt {
    fn sentences(&self) -> Vec<String> {
        let Self { mission, motor, set, .. } = self;
        let fits = counted(self.sources.len() as u64, "fit");
        let mut lines = vec![
            format!("next day: {mission} with {motor} after {fits}, prior {set}"),
            "lot                  burns      mean   95 % interval       next burn +-   before any burn +-"
                .to_owned(),
        ];
        for LotReport { name, unit, burns, mean, low, high, next_sigma, prior_sigma, .. } in &self.lots {
            let interval = format!("{low:.4} to {high:.4}");
            let line = format!(
                "  {name:<18} {burns:>5}  {mean:>8.4}   {interval:<18}  {next_sigma:>12.4}   {prior_sigma:>17.4} {unit}"
            );
            lines.push(line.trim_end().to_owned());
        }
        let head = ["burn", "thrust", "burn time", "delay", "weight"].map(str::to_owned);
        let row = |Burn { source, distances, weight }: &Burn| {
            let [thrust, burn_time, delay] =
                distances.map(|far| far.map_or_else(|| "-".to_owned(), |far| format!("{far:+.1}")));
            [source.clone(), thrust, burn_time, delay, format!("{weight:.2}")]
        };
        lines.push("burns, in standard deviations from their median:".to_owned());
        let rows = std::iter::once(head).chain(self.burns.iter().map(row));
        lines.extend(columns(['<', '>', '>', '>', '>'], rows).into_iter().map(|line| format!("  {line}")));
        for Pooled { mean: Parameter { name, unit, value, low, high, .. }, .. } in &self.airframe {
            let line = format!("airframe  {name:<16} {value:.4}, {low:.4} to {high:.4} {unit}");
            lines.push(line.trim_end().to_owned());
        }
        lines.extend(self.slow_gimbal.iter().map(|(rate_deg_s, source)| {
            format!(
                "SLOW      the gimbal turned at {rate_deg_s:.0} deg/s in {source}: the day is flown with that"
            )
        }));
        lines.extend(self.lot_toml.lines().map(str::to_owned));
        let [low, high] = self.wind_m_s;
        lines.push(format!("site      wind {low:.1} to {high:.1} m/s"));
        let Some(found) = &self.prediction else { return lines };
        let percent = |shares: [f64; 3]| shares.map(|share| 100.0 * share);
        let [rate, low, high] = percent([found.rate, found.low, found.high]);
        let flights = counted(self.flights as u64, "simulated flight");
        let burns = self.burns.len();
        lines.push(format!("simulated {} of {flights} in {set} landed", self.landed));
        lines.push(format!(
            "rate      {rate:.1} %, 95 % interval {low:.1} to {high:.1} %, over all lots that {} and the prior allow",
            counted(burns as u64, "burn")
        ));
        let Some(expected) = self.expected else { return lines };
        let Outcomes { landed, of, unknown } = self.flown;
        let [trust, rate, low, high] =
            [expected.trust, expected.rate, expected.low, expected.high].map(|share| 100.0 * share);
        let unknown = match unknown {
            0 => String::new(),
            unknown => format!(" ({} without a verdict not counted)", counted(unknown as u64, "flight")),
        };
        lines.push(format!(
            "flown     {landed} of {of} landed{unknown}: the simulation holds with {trust:.0} %; rate {rate:.1} %, 95 % interval {low:.1} to {high:.1} %"
        ));
        lines.push(format!(
            "prior     the simulation holds with {:.0} % before any flight; where it does not, any rate is possible: {:+.1} % of the rate",
            100.0 * (1.0 - OTHER_WORLD),
            rate - 100.0 * found.rate
        ));
        let [risk, limit, taken] = percent([expected.risk, self.limit, self.risk]);
        lines.push(format!(
            "risk      {risk:.1} % that the rate is below {limit:.0} %; {taken:.0} % is taken"
        ));
        lines.push(match (self.go == Some(true), is_more_benign(set)) {
            (true, false) => "GO".to_owned(),
            (true, true) => format!("GO in {set} only, which may be kinder than {DEFAULT}"),
            (false, _) => "NO-GO".to_owned(),
        });
        let without_weight = self.burns.iter().find(|burn| burn.weight <= 0.0);
        lines.extend(without_weight.map(|Burn { source, .. }| {
            format!("NO-GO as long as {source} is here: its burn is not of this lot, or its log is faulty")
        }));
        lines
    }
}

/// Request for the next day.
#[derive(Debug, Args)]
#[group(id = "learnt")]
pub(super) struct Arguments {
    /// Learn the motor lot, the airframe and the site, and write mission.toml and dispersion.toml
    /// of the next day into this directory, for `onboard-sim campaign`. If it exists, it is kept,
    /// and the next free name is taken.
    #[arg(long, value_name = "DIR", conflicts_with = "out")]
    day: Option<PathBuf>,
    /// Simulate this many flights of the next day for the landing rate, and GO or NO-GO; a thousand
    /// take some minutes.
    #[arg(long, value_name = "N")]
    flights: Option<usize>,
    /// Mission of the next day: built-in or TOML file [default: that of the first log]. Scales of
    /// fits over other data of the same vehicle and motor are converted.
    #[arg(long, value_name = "NAME|FILE")]
    mission: Option<String>,
    /// Prior: built-in set of dispersions (none, thrust-only, field, harsh, real, real-harsh, wild)
    /// or TOML file.
    #[arg(long, default_value = sim::dispersion::DEFAULT, value_name = "NAME|FILE")]
    prior: String,
    /// Seed of the simulated flights.
    #[arg(long, default_value_t = 1, requires = "flights")]
    seed: u64,
    /// Landing rate that the club wants at least.
    #[arg(long, default_value_t = 0.95, value_name = "SHARE", requires = "flights")]
    limit: f64,
    /// Risk that is taken of flying below it: GO if the probability is no higher.
    #[arg(long, default_value_t = 0.1, value_name = "SHARE", requires = "flights")]
    risk: f64,
    /// Flights at the same time; the answer does not depend on it [default: all processors].
    #[arg(long, value_name = "N")]
    jobs: Option<NonZeroUsize>,
}

impl Arguments {
    pub(super) fn is_requested(&self) -> bool {
        self.day.is_some() || self.flights.is_some()
    }

    /// Refuses, before the work, what cannot be answered or written.
    pub(super) fn check(&self) -> Result<()> {
        for (name, share) in [("--limit", self.limit), ("--risk", self.risk)] {
            ensure!((0.0..=1.0).contains(&share), "{name} {share}: must be 0 to 1");
        }
        Ok(())
    }

    /// The prediction for the next day from the fits; `flown` is the mission of the first log.
    pub(super) fn learn(&self, fits: &[Fit], flown: Option<String>) -> Result<Learnt> {
        let mission_toml = match (&self.mission, flown) {
            (Some(name), _) => text_of(name, flight::vehicles::mission::BUILTIN, "mission")?,
            (None, Some(flown)) => flown,
            (None, None) => bail!("--mission is missing: fits do not hold their mission"),
        };
        let set = text_of(&self.prior, sim::dispersion::BUILTIN, "set of dispersions")?;
        if let Some(flights) = self.flights {
            print_note(&format!("simulates {flights} flights of the day; a thousand take some minutes"));
        }
        let learnt =
            threads(self.jobs.map(NonZeroUsize::get))?.install(|| learn(fits, self, &mission_toml, &set))?;
        if let Some(directory) = &self.day {
            let (directory, _held) = new_folder(directory)?;
            let (name, day) = (directory.display(), &learnt.day);
            let files = [("mission.toml", &day.mission_toml), ("dispersion.toml", &day.dispersion_toml)];
            write_folder(&directory, &files)?;
            print_note(&format!(
                "onboard-sim campaign --mission {name}/mission.toml --dispersion {name}/dispersion.toml --out flights"
            ));
        }
        Ok(learnt)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fit(source: &str, mission: &str, motor: &str, found: Vec<Parameter>) -> Fit {
        Fit { found, ..Fit::of(source, mission, motor, Basis::default()) }
    }

    #[test]
    fn other_vehicles_and_other_motors_are_refused_and_a_stand_is_not() {
        let fits = [fit("a", "mk2", "H45W", vec![]), fit("b", "", "H45W", vec![])];
        assert!(one_vehicle(&fits, ["mk2", "H45W"]).is_ok());
        let error = one_vehicle(&fits, ["mk2", "H53"]).unwrap_err().to_string();
        assert!(error.starts_with("a is of H45W, and the mission of H53"), "{error}");
    }

    /// A range of 0 to 6 is 3 with 1.732; one flight in 5 m/s makes the mean 4 and the squares 3 +
    /// 2 (worth one value and one more): the next deviation is the root of (3 + 2) / 3 * 1.5, the
    /// range 1.732 times that to both sides.
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

    #[test]
    fn a_gimbal_that_was_slow_once_is_slow_on_the_next_day() {
        let with = |source: &str, deg_s| {
            fit(source, "mk3", "H45W", vec![Parameter::normal("gimbal_rate", "deg/s", deg_s, 2.0)])
        };
        let fits = [with("a", 299.0), with("b", 150.0), with("c", 298.0)];
        assert_eq!(slow_gimbal(&fits, 300.0), Some((150.0, "b".to_owned())));
        assert_eq!(slow_gimbal(&fits[..1], 300.0), None);
    }

    /// A simulation that says 0.8 and 1 with the same weight, and three of four landed: 0.8^3 0.2 =
    /// 0.1024 of the first, nothing of the second. Of any rate it is B(4, 2) = 3! 1! / 5! = 0.05.
    #[test]
    fn val_hand_what_was_flown_decides() {
        let simulated = Prediction { rate: 0.9, low: 0.8, high: 1.0, rates: vec![0.8, 1.0] };
        let flown = |landed, of| Outcomes { landed, of, unknown: 0 };
        let found = Expected::of(&simulated, flown(3, 4), 0.7).unwrap();
        let (held, any) = (0.9 * 0.5 * 0.1024, 0.1 * 0.05);
        assert!((found.trust - held / (held + any)).abs() < 1e-9, "{found:?}");
        assert!((found.rate - (held * 0.8 + any * 4.0 / 6.0) / (held + any)).abs() < 1e-9, "{found:?}");
        // A beta distribution of 4 and 2 is below x with 5 x^4 - 4 x^5.
        let below = any / (held + any) * (5.0 * 0.7_f64.powi(4) - 4.0 * 0.7_f64.powi(5));
        assert!((found.risk - below).abs() < 1e-9, "{found:?}");
        assert!(found.low < 0.8 && (found.high - 0.8).abs() < 0.2, "{found:?}");
    }

    /// One of five landed, and the simulation says 88 %: whoever asks for 50 or 60 % does not fly.
    #[test]
    fn flights_speak_against_a_simulation() {
        let rates: Vec<f64> = (0..1000).map(|i| 0.86 + 5e-5 * f64::from(i)).collect();
        let simulated = Prediction { rate: 0.885, low: 0.861, high: 0.909, rates };
        let risk = |landed, of, limit| {
            Expected::of(&simulated, Outcomes { landed, of, unknown: 0 }, limit).unwrap().risk
        };
        for (landed, of, limit) in [(1, 5, 0.6), (1, 5, 0.5), (2, 5, 0.6), (0, 2, 0.5)] {
            assert!(
                risk(landed, of, limit) > 0.1,
                "{landed} of {of} at {limit}: {}",
                risk(landed, of, limit)
            );
        }
        for (landed, of, limit) in [(5, 5, 0.8), (4, 5, 0.6), (9, 10, 0.8), (0, 0, 0.8)] {
            assert!(
                risk(landed, of, limit) < 0.1,
                "{landed} of {of} at {limit}: {}",
                risk(landed, of, limit)
            );
        }
    }
}
