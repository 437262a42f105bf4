//! Estimates from flight logs of the vehicle, the motor and the weather: values with 95 %
//! intervals, and the parameters that could not be found, with the reason.
//!
//! Only what a real flight's log holds is used: sensor samples, commands, feedback, and the flight
//! computer's estimates.
//!
//! In reading order:
//!
//! * [`trace`]: a flight's frames.
//! * [`along`]: drag and thrust along the nose. [`burn`] is the model of the thrust, and of a burn
//!   on a test stand.
//! * [`sound`]: whether the accelerometer's samples can be those of the vehicle.
//! * [`turning`]: the gimbal, from the rotation while the motor burns. [`servo`] is its model.
//! * [`wind`]: the mean wind, from the force across the nose.
//! * [`calibration`]: by how much the intervals exceed the noise of the samples.
//!   `examples/fit_coverage.rs` measures whether they hold the truth.
//! * [`pooled`]: several flights together. [`patched`]: the mission with what was found.
//! * [`lot`] and [`day`]: predict the next flight from all flights so far.
//! * [`least_squares`]: most likely values, where the noise is a slow disturbance.

mod along;
mod burn;
pub mod calibration;
pub mod day;
mod least_squares;
pub mod lot;
mod servo;
mod sound;
mod trace;
mod turning;
mod wind;

use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result, bail, ensure};
use flight::vehicle::mission::Mission;
use flight::vehicle::thrust_curve::ThrustCurve;
use flight::vehicles::motors;
use protocol::program::Exit;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, StudentsT};

use self::along::{ACCELEROMETER_SCALE_SIGMA, Along};
use self::burn::fit_stand;
use self::calibration::{Calibration, Table};
use self::day::Learnt;
use self::least_squares::Solution;
pub use self::trace::{Frame, Trace};
use crate::cli::{Answer, ending, give, print_error, print_note, text_of, warn_of_loss};
use crate::info::utc;
use crate::log::Recording;
use crate::output::NewFile;
use crate::print::counted;
use crate::settings::{Setting, SettingError, mission_toml_with_reasons, mission_with};

/// 97.5 % point of the normal distribution.
pub const Z_95: f64 = 1.959_963_984_540_054;

/// A parameter counts as found if its standard deviation is below this fraction of its prior's:
/// then the flight has at least eight times the information of the prior, and the prior moves the
/// value by less than a third of its standard deviation.
const FOUND: f64 = 1.0 / 3.0;

/// A value with its 95 % interval.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Parameter {
    pub name: String,
    pub unit: String,
    pub value: f64,
    /// Standard deviation.
    pub sigma: f64,
    /// Ends of the 95 % interval.
    pub low: f64,
    pub high: f64,
    /// The part of `sigma` that the models lack, from flights with a known truth: a vehicle's
    /// flights have it in common. `None`: not calibrated, the interval is that of the noise alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub systematic: Option<f64>,
}

impl Parameter {
    /// A parameter whose error is normal.
    pub fn normal(name: &str, unit: &str, value: f64, sigma: f64) -> Self {
        let (name, unit) = (name.to_owned(), unit.to_owned());
        let (low, high) = (value - Z_95 * sigma, value + Z_95 * sigma);
        Self { name, unit, value, sigma, low, high, systematic: None }
    }

    /// Standard deviation without the systematic part.
    fn noise(&self) -> f64 {
        let systematic = self.systematic.unwrap_or(0.0);
        // The two were added as squares; rounding must leave something to divide by.
        libm::sqrt((self.sigma - systematic) * (self.sigma + systematic)).max(1e-3 * self.sigma)
    }
}

/// A parameter that the flight does not determine.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct NotFound {
    pub name: String,
    /// Why.
    pub reason: String,
}

/// The data that the scales of a fit are over, so that fits over other data can be put together.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Basis {
    pub impulse_n_s: f64,
    pub burn_time_s: f64,
    /// Drag area with open fins, m^2; 0 on a test stand.
    pub drag_area_m2: f64,
    /// Mass with the motor full, which thrust and drag are per, kg; 0 on a test stand.
    pub loaded_kg: f64,
}

impl Basis {
    /// The data of a mission.
    pub fn of(mission: &Mission) -> Self {
        let (curve, airframe) = (&mission.motor_curve, &mission.airframe);
        Self {
            impulse_n_s: curve.total_impulse_n_s(),
            burn_time_s: curve.burn_time_s(),
            drag_area_m2: airframe.drag_area_m2(airframe.fins.open_rad()),
            loaded_kg: airframe.mass.loaded_kg,
        }
    }
}

/// Parameters of one flight.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Fit {
    /// The log.
    pub source: String,
    /// The mission that was flown; scales are over its data.
    pub mission: String,
    /// The landing motor's name.
    pub motor: String,
    /// The data of mission and motor.
    pub basis: Basis,
    pub found: Vec<Parameter>,
    pub not_found: Vec<NotFound>,
    /// Fraction of the air force in this fall that is the body's by the mission's data:
    /// `drag_per_mass_scale` is that of the sum.
    pub body_share: Option<f64>,
    /// What intervals were widened by; `None`: they are those of the noise alone.
    pub calibration: Option<Calibration>,
    /// Parameters whose interval is that of the noise alone.
    #[serde(default)]
    pub not_calibrated: Vec<NotFound>,
    /// Why the log could not be read to its end, if so.
    pub damage: Option<String>,
    /// Whether the flight landed; `None` of a test stand, and of a log without a verdict.
    pub landed: Option<bool>,
    /// Names what was recorded: one flight is one flight, under however many names.
    pub content: Option<String>,
}

impl Fit {
    /// A fit that has found nothing yet.
    fn of(source: &str, mission: &str, motor: &str, basis: Basis) -> Self {
        let [source, mission, motor] = [source, mission, motor].map(str::to_owned);
        Self { source, mission, motor, basis, ..Self::default() }
    }

    /// The same fit over other data: every scale times what the data differ by.
    #[must_use]
    pub fn over(&self, other: &Basis) -> Self {
        let own = &self.basis;
        let per_mass = if own.loaded_kg > 0.0 { other.loaded_kg / own.loaded_kg } else { 1.0 };
        let mut fit = Self { basis: *other, ..self.clone() };
        for parameter in &mut fit.found {
            let factor = match parameter.name.as_str() {
                "thrust_scale" => own.impulse_n_s / other.impulse_n_s * per_mass,
                "burn_time_scale" => own.burn_time_s / other.burn_time_s,
                "drag_per_mass_scale" | "body_drag_scale" | "fin_drag_scale" => {
                    own.drag_area_m2 / other.drag_area_m2 * per_mass
                }
                _ => continue,
            };
            let Parameter { value, sigma, low, high, systematic, .. } = parameter;
            for number in [value, sigma, low, high].into_iter().chain(systematic) {
                *number *= factor;
            }
        }
        fit
    }

    /// The parameter of a name.
    pub fn get(&self, name: &str) -> Option<&Parameter> {
        self.found.iter().find(|parameter| parameter.name == name)
    }

    /// What the intervals rest on.
    fn widened(&self) -> String {
        let Some(Calibration { vehicles, flights, sets, own }) = &self.calibration else {
            return "not calibrated: those of the noise alone".to_owned();
        };
        let by = format!(
            "calibrated on {flights} simulated flights in {} (on other flights about 90 % hold)",
            sets.join(" and ")
        );
        if *own {
            return by;
        }
        format!("the widest of {}, {by}: not calibrated on this vehicle", vehicles.join(" and "))
    }

    fn head(&self) -> String {
        let Self { source, mission, motor, .. } = self;
        let mission = if mission.is_empty() { "a test stand" } else { mission };
        format!("{source}: {mission} with {motor}")
    }

    /// The reasons why a burn or a fall was not found, with everything that it takes away.
    fn lacking(&self) -> impl Iterator<Item = String> {
        let of =
            |wanted: &str| self.not_found.iter().find(|lack| lack.name == wanted).map(|lack| &lack.reason);
        let reasons: BTreeSet<&String> =
            ["thrust_scale", "drag_per_mass_scale"].into_iter().filter_map(of).collect();
        reasons.into_iter().map(|reason| {
            let lost = self.not_found.iter().filter(|lack| lack.reason == *reason);
            let names: Vec<&str> = lost.map(|lack| lack.name.as_str()).collect();
            format!("  {}: {}: {reason}", self.source, names.join(", "))
        })
    }

    fn lacks(&mut self, name: &str, reason: &str) {
        self.not_found.push(NotFound { name: name.to_owned(), reason: reason.to_owned() });
    }

    /// Takes parameters of a solution, each as found or, with the reason, as not found.
    fn take(&mut self, solution: &Solution, reason: &str, rows: &[Row]) {
        for &(place, name, unit) in rows {
            let sigma = libm::sqrt(solution.covariance[(place, place)]);
            if sigma < FOUND * solution.priors[place].sigma {
                let scale = if unit.starts_with("deg") { 1.0_f64.to_degrees() } else { 1.0 };
                self.found.push(Parameter::normal(name, unit, scale * solution.values[place], scale * sigma));
            } else {
                self.lacks(name, reason);
            }
        }
    }
}

/// A parameter: its place in a solution, which is in SI, its name, and its unit.
type Row = (usize, &'static str, &'static str);

/// Fits every parameter that a flight determines.
pub fn fit(trace: &Trace) -> Fit {
    let fit = uncalibrated(trace);
    match Table::built_in() {
        Some(table) => table.applied(fit),
        None => fit,
    }
}

/// A fit whose intervals are those of the noise alone.
pub fn uncalibrated(trace: &Trace) -> Fit {
    let mission = &trace.mission;
    let mut fit = Fit {
        damage: trace.damage.clone(),
        landed: trace.landed,
        content: trace.content.map(|content| format!("{content:016x}")),
        ..Fit::of(&trace.name, &mission.name, mission.motor_curve.name(), Basis::of(mission))
    };
    let steady = wind::is_one_wind(trace);
    let understood = steady.and_then(|()| along_and_turning(trace));
    match understood {
        Ok((along, turning)) => {
            fit.body_share = Some(along.body_share);
            drag(&mut fit, &along);
            motor(&mut fit, &along);
            gimbal(&mut fit, turning);
            match wind::fit_wind(trace, &along) {
                Ok(found) => fit.found.extend(found),
                Err(reason) => fit.lacks("wind", reason),
            }
        }
        Err(reason) => {
            for name in
                ["drag_per_mass_scale", "thrust_scale", "burn_time_scale", "ignition_delay", "gimbal", "wind"]
            {
                fit.lacks(name, &reason);
            }
        }
    }
    fit.lacks("mass", "the accelerometer cannot tell a lighter vehicle from more thrust and drag: weigh it");
    fit.lacks(
        "sensors",
        "an hour on the pad shows their noise and drift better than a flight (Allan variance)",
    );
    fit
}

/// Both directions, each with what the other found: the thrust turns the vehicle, and the turned
/// nozzle loses some of it.
fn along_and_turning(trace: &Trace) -> Result<(Along, Result<Solution, String>), String> {
    let gimbal = &trace.mission.airframe.gimbal;
    let frames = &trace.frames;
    // The command that is obeyed at a time, late by the servo's delay.
    let thrust_along = |time_s: f64| {
        let obeyed = frames.partition_point(|frame| frame.time_s <= time_s - gimbal.servo.delay_s);
        let angles_rad = obeyed.checked_sub(1).map_or([0.0; 2], |place| frames[place].gimbal_rad);
        libm::cos(angles_rad[0]) * libm::cos(angles_rad[1])
    };
    let along = along::fit_along(trace, &thrust_along)?;
    let turning = turning::fit_turning(trace, &along);
    Ok((along, turning))
}

fn drag(fit: &mut Fit, along: &Along) {
    let (total, sigma) = along.drag();
    fit.found.push(Parameter::normal("drag_per_mass_scale", "", total, sigma));
    let reason = "the openings of the fins changed too little to tell their drag from the body's: drag_per_mass_scale is the sum";
    fit.take(
        &along.solution,
        reason,
        &[(along::BODY, "body_drag_scale", ""), (along::FINS, "fin_drag_scale", "")],
    );
    fit.found.push(Parameter::normal("updraught_rms", "m/s", along.updraught_m_s, 0.3 * along.updraught_m_s));
}

fn motor(fit: &mut Fit, along: &Along) {
    let Along { solution, .. } = along;
    if let Err(reason) = &along.burn_seen_s {
        for name in ["thrust_scale", "burn_time_scale", "ignition_delay", "thrust_shape", "exhaust_body_loss"]
        {
            fit.lacks(name, reason);
        }
        return;
    }
    let mut with_scale = solution.clone();
    with_scale.covariance[(along::IMPULSE, along::IMPULSE)] +=
        libm::pow(ACCELEROMETER_SCALE_SIGMA * solution.values[along::IMPULSE], 2.0);
    let scales = [(along::IMPULSE, "thrust_scale", ""), (along::BURN_TIME, "burn_time_scale", "")];
    let short = "too little of the burn was seen before the contact";
    fit.take(&with_scale, short, &scales);
    fit.take(solution, short, &[(along::DELAY, "ignition_delay", "s")]);
    let reason = "this term of the shape is too small, or too much like an error of burn time and drag";
    fit.take(solution, reason, &burn::shape_rows(along::SHAPE));
    let reason = "while the motor burns the drag is too small a part of the force";
    let rows = [(along::BODY_LOSS, "exhaust_body_loss", ""), (along::FIN_LOSS, "exhaust_fin_loss", "")];
    fit.take(solution, reason, &rows);
}

fn gimbal(fit: &mut Fit, turning: Result<Solution, String>) {
    const PLAY: &str = "gimbal_play";
    const ROWS: [Row; 5] = [
        (turning::DELAY, "gimbal_delay", "s"),
        (turning::RATE, "gimbal_rate", "deg/s"),
        (turning::GAIN, "gimbal_gain", ""),
        (turning::PITCH, "gimbal_pitch_offset", "deg"),
        (turning::YAW, "gimbal_yaw_offset", "deg"),
    ];
    let turning = match turning {
        Ok(turning) => turning,
        Err(reason) => {
            ROWS.iter().map(|row| row.1).chain([PLAY]).for_each(|name| fit.lacks(name, &reason));
            return;
        }
    };
    let reason = "its commands changed too little";
    fit.take(&turning, reason, &ROWS);
    let (play_rad, sigma_rad) = turning::play_rad(&turning);
    if sigma_rad < FOUND * turning::LINK_RAD {
        fit.found.push(Parameter::normal(PLAY, "deg", play_rad.to_degrees(), sigma_rad.to_degrees()));
    } else {
        fit.lacks(PLAY, reason);
    }
}

/// The text of a mission with what a fit found of its vehicle: comments and order stay, and a
/// changed line names the flight that it is from. `flown` is the mission that the fit's scales are
/// over, and `flight` its name and day.
///
/// # Errors
/// The mission's text is none, or a value that was found is outside the range of its key.
pub fn patched(mission_toml: &str, flown: &Mission, fit: &Fit, flight: &str) -> Result<String, SettingError> {
    let mission = mission_with(mission_toml, &[])?;
    let effective = toml::Value::try_from(&mission)
        .map_err(|error| SettingError::Toml { origin: mission.name.clone(), reason: error.to_string() })?;
    // Scales are per mass. Where the two cannot be separated, both have the scale of the sum.
    let airframe = &flown.airframe;
    let per_mass = mission.airframe.mass.loaded_kg / airframe.mass.loaded_kg;
    let apart = ["body_drag_scale", "fin_drag_scale"].iter().all(|name| fit.get(name).is_some());
    let [body, fins] = if apart { ["body_drag_scale", "fin_drag_scale"] } else { ["drag_per_mass_scale"; 2] };
    let rows = [
        ("airframe.body.axial_drag_coefficient", body, airframe.body.axial_drag_coefficient * per_mass),
        ("airframe.fins.drag_coefficient", fins, airframe.fins.drag_coefficient * per_mass),
        ("airframe.legs.drag_area_m2", body, airframe.legs.drag_area_m2 * per_mass),
        ("airframe.gimbal.servo.delay_s", "gimbal_delay", 1.0),
        ("airframe.gimbal.servo.rate_deg_s", "gimbal_rate", 1.0),
        ("airframe.gimbal.servo.slop_deg", "gimbal_play", 1.0),
    ];
    let settings =
        rows.into_iter().filter(|(.., factor)| *factor > 0.0).filter_map(|(path, name, factor)| {
            let found = fit.get(name)?;
            let [value, low, high] =
                [found.value, found.low, found.high].map(|number| (factor * number).max(0.0));
            let sigma = (high - low) / (2.0 * Z_95);
            let was = path.split('.').try_fold(&effective, |table, section| table.get(section));
            let was = was.map_or_else(|| "not stated".to_owned(), ToString::to_string);
            let reason =
                format!("{flight}, 95 % {} to {} (was {was})", digits(low, sigma), digits(high, sigma));
            let value = toml::Value::Float(digits(value, 1e-2 * sigma).parse().unwrap_or(value));
            Some((Setting { path: path.to_owned(), value, at_s: None }, reason))
        });
    let settings: Vec<(Setting, String)> = settings.collect();
    let text = mission_toml_with_reasons(mission_toml, &settings)?;
    mission_with(&text, &[])?;
    Ok(text)
}

/// A parameter over several flights.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Pooled {
    /// The mean, with the interval of the mean.
    pub mean: Parameter,
    /// How many flights have it.
    pub flights: usize,
    /// Standard deviation from flight to flight, without the errors of the fits.
    pub scatter: f64,
}

/// The missions of fits; a test stand has none.
fn missions(fits: &[Fit]) -> BTreeSet<&str> {
    fits.iter().map(|fit| fit.mission.as_str()).filter(|mission| !mission.is_empty()).collect()
}

/// Every parameter that at least two fits have, in the order of the first fit that has it; none of
/// different missions.
pub fn pooled(fits: &[Fit]) -> Vec<Pooled> {
    let mut names: Vec<&str> = Vec::new();
    let fits = if missions(fits).len() > 1 { &[] } else { fits };
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
    // What the models lack is the same in every flight of a vehicle, as far as anybody knows: it
    // neither scatters from one to the next nor averages out.
    let common = values.iter().filter_map(|value| value.systematic).reduce(f64::max);
    let noise: Vec<f64> = values.iter().map(|value| value.noise()).collect();
    let weighted = |variance: f64| {
        let weights: Vec<f64> = noise.iter().map(|noise| 1.0 / (noise * noise + variance)).collect();
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
    let wider = common.unwrap_or(0.0);
    let reach = libm::hypot(reach, Z_95 * wider);
    let mean = Parameter {
        low: mean - reach,
        high: mean + reach,
        systematic: common,
        ..Parameter::normal(&first.name, &first.unit, mean, libm::hypot(sigma, wider))
    };
    Some(Pooled { mean, flights: values.len(), scatter: libm::sqrt(variance) })
}

/// Fits of flights and burns, each alone and all together.
#[derive(Debug, Clone, Serialize)]
pub struct FitReport {
    pub fits: Vec<Fit>,
    /// Parameters of at least two of them.
    pub together: Vec<Pooled>,
    /// Prediction of the next day, if requested.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub day: Option<Learnt>,
}

impl Answer for FitReport {
    fn sentences(&self) -> Vec<String> {
        // Many fits are one answer; JSON has each.
        let mut lines = Vec::new();
        let missions: Vec<&str> = missions(&self.fits).into_iter().collect();
        if self.together.is_empty() {
            lines = self.fits.sentences();
            if missions.len() > 1 {
                lines.push(format!("not put together: these are flights of {}", missions.join(" and ")));
            }
        } else {
            let logs = counted(self.fits.len() as u64, "log");
            lines.extend(self.fits.iter().map(Fit::head));
            let lacking: Vec<String> = self.fits.iter().flat_map(Fit::lacking).collect();
            lines.extend((!lacking.is_empty()).then(|| "not found".to_owned()));
            lines.extend(lacking);
            lines.push(String::new());
            lines.push(format!(
                "together, {logs}: mean with its 95 % interval, and scatter from one to the next"
            ));
        }
        lines.extend(self.together.iter().map(|Pooled { mean, flights, scatter }| {
            format!("  {}   scatter {} in {flights}", line(mean), digits(*scatter, mean.sigma))
        }));
        if let Some(day) = &self.day {
            lines.push(String::new());
            lines.extend(day.sentences());
        }
        lines
    }

    fn outcome(&self) -> Exit {
        let go = self.day.as_ref().and_then(|day| day.go);
        go.map_or(Exit::Yes, Exit::of)
    }
}

impl Answer for Fit {
    fn sentences(&self) -> Vec<String> {
        let mut lines = vec![self.head(), format!("95 % intervals, {}", self.widened())];
        lines.extend(self.found.iter().map(|parameter| format!("  {}", line(parameter))));
        for (title, lacks) in [
            ("not calibrated: the interval is that of the noise alone", &self.not_calibrated),
            ("not found", &self.not_found),
        ] {
            lines.extend(lacks.first().map(|_| title.to_owned()));
            lines.extend(lacks.iter().map(|NotFound { name, reason }| format!("  {name}: {reason}")));
        }
        lines
    }
}

fn line(Parameter { name, unit, value, sigma, low, high, .. }: &Parameter) -> String {
    let [value, low, high] = [value, low, high].map(|number| digits(*number, *sigma));
    format!("{name:<28} {value:>10}   {low:>10} to {high:<10} {unit}").trim_end().to_owned()
}

/// A number to two digits of its standard deviation.
fn digits(value: f64, sigma: f64) -> String {
    let places = if sigma > 0.0 && sigma.is_finite() {
        (1.0 - libm::floor(libm::log10(sigma))).clamp(0.0, 7.0) as usize
    } else {
        4
    };
    format!("{value:.places$}")
}

#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// Logs of vehicles (MCAP), tables of a test stand (CSV with time_s from the ignition command,
    /// and thrust_n), and earlier answers in JSON.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// The motor that a table is compared with: a built-in one, or a .eng or .rse file.
    #[arg(long, value_name = "NAME|FILE")]
    motor: Option<String>,
    /// Put what was found in the only log into this mission's file; its comments stay. If there is
    /// no such file, it gets the mission that was flown.
    #[arg(long, alias = "write", value_name = "FILE.toml")]
    out: Option<PathBuf>,
    #[command(flatten)]
    day: day::Arguments,
    /// Answer in JSON.
    #[arg(long)]
    json: bool,
}

/// What is read of an earlier answer.
#[derive(Deserialize)]
struct Earlier {
    fits: Vec<Fit>,
}

impl Args {
    pub(crate) fn run(self) -> Result<Exit> {
        if self.out.is_some()
            && (self.files.len() != 1 || ["csv", "json"].contains(&ending(&self.files[0]).as_str()))
        {
            bail!("--out takes the log of one flight: its mission is changed");
        }
        if let Some(motor) = &self.motor
            && !self.files.iter().any(|file| ending(file) == "csv")
        {
            bail!(
                "--motor {motor}: only a table of a test stand (CSV) is compared with a motor; a log has its own"
            );
        }
        self.day.check()?;
        let (mut fits, mut refused, mut flown) = (Vec::new(), false, None);
        for file in &self.files {
            match self.one(file, &mut flown) {
                Ok(found) => fits.extend(found),
                Err(error) if self.files.len() == 1 || self.day.is_requested() => return Err(error),
                // One unreadable log must not hide the others.
                Err(error) => {
                    refused = true;
                    print_error(&format!("{error:#}"));
                }
            }
        }
        once_each(&mut fits);
        for fit in &fits {
            warn_of_loss(&fit.source, fit.damage.as_deref(), None);
        }
        let day = self.day.is_requested().then(|| self.day.learn(&fits, flown)).transpose()?;
        let report = FitReport { together: pooled(&fits), fits, day };
        let outcome = give(&report, self.json)?;
        Ok(if refused { Exit::NotSeen } else { outcome })
    }

    /// The fits of a file; notes the mission of the first log.
    fn one(&self, file: &Path, flown: &mut Option<String>) -> Result<Vec<Fit>> {
        let name = file.display().to_string();
        let read = || std::fs::read_to_string(file).with_context(|| format!("{name}: cannot be read"));
        if ending(file) == "json" {
            let earlier: Earlier = serde_json::from_str(&read()?)
                .with_context(|| format!("{name}: is no answer of `replay fit --json`"))?;
            for Fit { source, basis, .. } in &earlier.fits {
                let sound = basis.impulse_n_s > 0.0 && basis.burn_time_s > 0.0;
                ensure!(sound, "{name}: {source}: basis.impulse_n_s and basis.burn_time_s must be above 0");
            }
            return Ok(earlier.fits);
        }
        if ending(file) == "csv" {
            let motor = self.motor.as_deref().with_context(|| {
                format!("{name}: --motor is missing: a table is compared with the motor's certified curve")
            })?;
            let rows = flight::vehicles::thrust_curve::read_stand(&read()?).with_context(|| name.clone())?;
            return Ok(vec![fit_stand(&name, &rows, &curve_of(motor)?).context(name)?]);
        }
        let recording = Recording::open(file)?;
        let trace = Trace::of(&recording)?;
        let found = fit(&trace);
        if let Some(path) = &self.out {
            write_into(path, file, &trace, &found)?;
        }
        flown.get_or_insert(trace.mission_toml);
        Ok(vec![found])
    }
}

/// Puts what was found in a log into a mission's file.
fn write_into(path: &Path, log: &Path, trace: &Trace, found: &Fit) -> Result<()> {
    let name = path.display();
    let text = match std::fs::read_to_string(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => trace.mission_toml.clone(),
        read => read.with_context(|| format!("{name}: cannot be read"))?,
    };
    let own = flight::vehicles::mission::from_toml(&text, &name.to_string())?.name;
    if own != found.mission {
        bail!("{name}: is the mission of {own}, and the log is of {}", found.mission);
    }
    let flight = log.file_stem().unwrap_or_default().to_string_lossy();
    let day = trace.last_ns.map_or_else(String::new, |last_ns| {
        format!(", {}", utc(last_ns).split('T').next().unwrap_or_default())
    });
    let flight = protocol::text::printable(format!("flight {flight}{day}").as_bytes());
    let text = patched(&text, &trace.mission, found, &flight).context("the mission with what was found")?;
    NewFile::replace(path)?.fill(|file| file.write_all(text.as_bytes()))?;
    print_note(&format!("{name}: --mission of `onboard-sim fly`, `campaign` and `card` takes it"));
    Ok(())
}

/// Leaves out what is there already under another name.
fn once_each(fits: &mut Vec<Fit>) {
    let mut known: BTreeMap<String, String> = BTreeMap::new();
    fits.retain(|fit| {
        let Some(content) = &fit.content else { return true };
        if let Some(first) = known.get(content) {
            print_note(&format!("left out: {} is the same as {first}", fit.source));
            return false;
        }
        known.insert(content.clone(), fit.source.clone());
        true
    });
}

fn curve_of(motor: &str) -> Result<ThrustCurve> {
    if let Ok(curve) = motors::builtin(motor) {
        return Ok(curve);
    }
    let text = text_of(motor, motors::BUILTIN, "motor")?;
    flight::vehicles::thrust_curve::from_file_text(motor, &text).with_context(|| motor.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIT: Basis = Basis { impulse_n_s: 1.0, burn_time_s: 1.0, drag_area_m2: 1.0, loaded_kg: 1.0 };

    fn fits<const N: usize>(name: &str, basis: Basis, values: [(f64, f64); N]) -> [Fit; N] {
        values.map(|(value, sigma)| Fit {
            found: vec![Parameter::normal(name, "", value, sigma)],
            ..Fit::of("", "", "", basis)
        })
    }

    /// 2 % more than 100 N s for 3 kg are, over 110 N s for 3.3 kg, 1.02 100 / 110 1.1.
    #[test]
    fn val_hand_a_scale_over_other_data() {
        let basis = Basis { impulse_n_s: 100.0, burn_time_s: 5.0, drag_area_m2: 0.03, loaded_kg: 3.0 };
        let [fit] = fits("thrust_scale", basis, [(1.02, 0.01)]);
        let over = |impulse_n_s| fit.over(&Basis { impulse_n_s, loaded_kg: 3.3, ..basis }).found.remove(0);
        assert!((over(110.0).value - 1.02).abs() < 1e-12, "the two cancel");
        assert!((over(100.0).sigma - 0.011).abs() < 1e-12);
    }

    /// 1, 2 and 3 with errors of 0.1: the weights are equal, the mean is 2, the variance between is
    /// 1 - 0.01, and the interval is 4.3027 (97.5 % of Student's t with 2 degrees) times the root
    /// of 1/3.
    #[test]
    fn val_hand_three_flights() {
        let found = pooled(&fits("drag_per_mass_scale", UNIT, [(1.0, 0.1), (2.0, 0.1), (3.0, 0.1)]));
        let [Pooled { mean, scatter, flights: 3 }] = &found[..] else { panic!("{found:?}") };
        assert!((mean.value - 2.0).abs() < 1e-12 && (scatter - libm::sqrt(0.99)).abs() < 1e-12, "{found:?}");
        assert!((mean.high - 2.0 - 4.302_65 / libm::sqrt(3.0)).abs() < 1e-4, "{mean:?}");
    }

    /// Two equal values do not scatter. With a noise of 0.1 and a systematic part of 0.3: the noise
    /// of the mean is 0.1 over the root of 2, and the systematic part stays, however many flights
    /// there are. One flight is not pooled.
    #[test]
    fn val_hand_what_all_flights_have_in_common_does_not_average_out() {
        for common in [0.0, 0.3] {
            let mut fits = fits("drag_per_mass_scale", UNIT, [(1.0, libm::hypot(0.1, common)); 2]);
            for parameter in fits.iter_mut().flat_map(|fit| &mut fit.found) {
                parameter.systematic = Some(common);
            }
            let found = pooled(&fits);
            let expected = libm::hypot(0.1 / libm::sqrt(2.0), common);
            assert!(
                (found[0].mean.sigma - expected).abs() < 1e-12 && found[0].scatter.abs() < 1e-12,
                "{found:?}"
            );
            assert_eq!(found[0].mean.systematic, Some(common));
            assert!(pooled(&fits[..1]).is_empty());
        }
    }

    #[test]
    fn a_number_has_two_digits_of_its_deviation() {
        let written = [(0.998_765, 0.001_8), (254.71, 9.8), (1234.4, 120.0), (1.0, 0.0)]
            .map(|(value, sigma)| digits(value, sigma));
        assert_eq!(written, ["0.9988", "254.7", "1234", "1.0000"]);
    }
}
