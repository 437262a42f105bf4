//! What a flight tells of its vehicle, its motor, its sensors and its day: values with 95 % intervals, and what could not
//! be told, with the reason.
//!
//! Only what a real flight's log holds is used: sensor samples, commands, feedback, and the flight computer's estimates.
//!
//! In reading order:
//!
//! * [`trace`]: a flight's frames.
//! * [`along`]: drag and thrust along the nose. [`burn`] is the model of the thrust.
//! * [`turning`]: the gimbal, from the rotation while the motor burns. [`servo`] and [`air_moment`] are its models.
//! * [`wind`]: the mean wind, from the force across the nose.
//! * [`sensors`]: noises and biases.
//! * [`stand`]: a burn on a test stand.
//! * [`pooled`](mod@pooled): several flights together. [`patch`]: the mission with what was found.
//! * [`least_squares`] and [`whiten`]: most likely values, where the noise is a slow disturbance.

mod air_moment;
mod along;
mod burn;
mod least_squares;
mod patch;
mod pooled;
mod sensors;
mod servo;
mod stand;
mod trace;
mod turning;
mod whiten;
mod wind;

use flight::vehicle::mission::Mission;
use serde::{Deserialize, Serialize};

use self::along::{ACCELEROMETER_SCALE_SIGMA, Along};
use self::least_squares::{Prior, Solution};
pub use self::patch::patched;
pub use self::pooled::{Pooled, pooled};
pub use self::stand::{StandError, fit_stand, read_stand};
pub use self::trace::{Frame, Trace, TraceError};
use self::turning::Turning;

/// 97.5 % point of the normal distribution.
pub const Z_95: f64 = 1.959_963_984_540_054;

/// A parameter counts as found if its standard deviation is below this fraction of its prior's: then the flight tells at
/// least eight times as much of it as was known before, and the prior moves it by less than its own standard deviation
/// over three.
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
}

impl Parameter {
    /// A parameter whose error is normal.
    pub fn normal(name: &str, unit: &str, value: f64, sigma: f64) -> Self {
        let (name, unit) = (name.to_owned(), unit.to_owned());
        Self { name, unit, value, sigma, low: value - Z_95 * sigma, high: value + Z_95 * sigma }
    }
}

/// A parameter of which the flight says too little.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct NotFound {
    pub name: String,
    /// Why.
    pub reason: String,
}

/// The data that the scales of a fit are over, so that fits over other data can be put together.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
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

/// What one flight tells.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
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
    /// Why the log could not be read to its end, if so.
    pub damage: Option<String>,
}

impl Fit {
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
                "drag_scale" | "body_drag_scale" | "fin_drag_scale" => {
                    own.drag_area_m2 / other.drag_area_m2 * per_mass
                }
                _ => continue,
            };
            let Parameter { value, sigma, low, high, .. } = parameter;
            for number in [value, sigma, low, high] {
                *number *= factor;
            }
        }
        fit
    }

    /// The parameter of a name.
    pub fn get(&self, name: &str) -> Option<&Parameter> {
        self.found.iter().find(|parameter| parameter.name == name)
    }

    fn lacks(&mut self, name: &str, reason: &str) {
        self.not_found.push(NotFound { name: name.to_owned(), reason: reason.to_owned() });
    }

    /// Takes a parameter of a solution, as found or as not found.
    fn take(&mut self, solution: &Solution, priors: &[Prior], place: usize, as_named: &Named<'_>) {
        let Named { name, unit, scale, reason } = *as_named;
        let sigma = libm::sqrt(solution.covariance[(place, place)]);
        if sigma < FOUND * priors[place].sigma {
            self.found.push(Parameter::normal(name, unit, scale * solution.values[place], scale * sigma));
        } else {
            self.lacks(name, reason);
        }
    }
}

/// How a parameter is called, in which unit, and why it may not be found.
struct Named<'a> {
    name: &'a str,
    unit: &'a str,
    scale: f64,
    reason: &'a str,
}

/// Fits everything that a flight tells.
pub fn fit(trace: &Trace) -> Fit {
    let mut fit = Fit {
        source: trace.name.clone(),
        mission: trace.mission.name.clone(),
        motor: trace.mission.motor_curve.name().to_owned(),
        basis: Basis::of(&trace.mission),
        found: Vec::new(),
        not_found: Vec::new(),
        damage: trace.damage.clone(),
    };
    match along_and_turning(trace) {
        Ok((along, turning)) => {
            drag(&mut fit, &along);
            motor(&mut fit, &along);
            gimbal(&mut fit, turning);
            match wind::fit_wind(trace, &along) {
                Ok(found) => fit.found.extend(found),
                Err(reason) => fit.lacks("wind", reason),
            }
        }
        Err(reason) => {
            for name in ["drag_scale", "thrust_scale", "burn_time_scale", "ignition_delay", "gimbal", "wind"]
            {
                fit.lacks(name, reason);
            }
        }
    }
    fit.found.extend(sensors::sensors(trace));
    fit.lacks("mass", "the accelerometer cannot tell a lighter vehicle from more thrust and drag: weigh it");
    fit.lacks("gnss_wander, barometer_offset_walk", "the flight is shorter than they take to wander");
    fit
}

/// Both directions, each with what the other found: the thrust turns the vehicle, and the turned nozzle loses some of it.
fn along_and_turning(trace: &Trace) -> Result<(Along, Result<Turning, &'static str>), &'static str> {
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
    let Along { solution, priors, .. } = along;
    let (total, sigma) = along.drag();
    fit.found.push(Parameter::normal("drag_scale", "", total, sigma));
    for (place, name) in [(along::BODY, "body_drag_scale"), (along::FINS, "fin_drag_scale")] {
        let reason = "the openings of the fins changed too little to tell their drag from the body's: drag_scale is the sum";
        fit.take(solution, priors, place, &Named { name, unit: "", scale: 1.0, reason });
    }
    fit.found.push(Parameter::normal("updraught_rms", "m/s", along.updraught_m_s, 0.3 * along.updraught_m_s));
}

fn motor(fit: &mut Fit, along: &Along) {
    if along.burn_seen_s <= 0.0 {
        let reason = if along.commanded_s.is_none() {
            "the motor was not lit"
        } else {
            "no thrust was seen after the igniter was fired"
        };
        for name in ["thrust_scale", "burn_time_scale", "ignition_delay", "thrust_shape", "exhaust_body_loss"]
        {
            fit.lacks(name, reason);
        }
        return;
    }
    let Along { solution, priors, .. } = along;
    let short = "too little of the burn was seen before the contact";
    let mut with_scale = solution.clone();
    with_scale.covariance[(along::IMPULSE, along::IMPULSE)] +=
        libm::pow(ACCELEROMETER_SCALE_SIGMA * solution.values[along::IMPULSE], 2.0);
    for (place, name, unit) in [
        (along::IMPULSE, "thrust_scale", ""),
        (along::BURN_TIME, "burn_time_scale", ""),
        (along::DELAY, "ignition_delay", "s"),
    ] {
        fit.take(&with_scale, priors, place, &Named { name, unit, scale: 1.0, reason: short });
    }
    for k in 0..burn::SHAPE_TERMS {
        let name = format!("thrust_shape_{}", k + 1);
        let reason = "this term of the shape is too small, or too much like an error of burn time and drag";
        let named = Named { name: &name, unit: "", scale: 1.0, reason };
        fit.take(solution, priors, along::SHAPE + k, &named);
    }
    for (place, name) in [(along::BODY_LOSS, "exhaust_body_loss"), (along::FIN_LOSS, "exhaust_fin_loss")] {
        let reason = "while the motor burns the drag is too small a part of the force";
        fit.take(solution, priors, place, &Named { name, unit: "", scale: 1.0, reason });
    }
}

fn gimbal(fit: &mut Fit, turning: Result<Turning, &'static str>) {
    let names = [
        (turning::DELAY, "gimbal_delay", "s", 1.0),
        (turning::RATE, "gimbal_rate", "deg/s", 1.0_f64.to_degrees()),
        (turning::GAIN, "gimbal_gain", "", 1.0),
        (turning::PITCH, "gimbal_pitch_offset", "deg", 1.0_f64.to_degrees()),
        (turning::YAW, "gimbal_yaw_offset", "deg", 1.0_f64.to_degrees()),
        (turning::PLAY, "gimbal_play", "deg", 1.0_f64.to_degrees()),
    ];
    match turning {
        Ok(Turning { solution, priors, reported }) => {
            for (place, name, unit, scale) in names {
                if place == turning::RATE && !reported {
                    // Of 150 `field` flights 81 % of the intervals held it.
                    let reason = "the log has no feedback of the gimbal, and in the rotation a servo that is slow for a few \
                                  milliseconds looks like a late one";
                    fit.lacks(name, reason);
                    continue;
                }
                let reason = if reported {
                    "its commands changed too little"
                } else {
                    "the log has no feedback of the gimbal, and its commands changed too little to show it in the rotation"
                };
                fit.take(&solution, &priors, place, &Named { name, unit, scale, reason });
            }
        }
        Err(reason) => names.iter().for_each(|(_, name, ..)| fit.lacks(name, reason)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 2 % more than 100 N s for 3 kg are, over 110 N s for 3.3 kg, 1.02 100 / 110 1.1.
    #[test]
    fn val_hand_a_scale_over_other_data() {
        let basis = Basis { impulse_n_s: 100.0, burn_time_s: 5.0, drag_area_m2: 0.03, loaded_kg: 3.0 };
        let fit = Fit {
            source: String::new(),
            mission: String::new(),
            motor: String::new(),
            basis,
            found: vec![Parameter::normal("thrust_scale", "", 1.02, 0.01)],
            not_found: Vec::new(),
            damage: None,
        };
        let other = Basis { impulse_n_s: 110.0, loaded_kg: 3.3, ..basis };
        let found = &fit.over(&other).found[0];
        assert!((found.value - 1.02).abs() < 1e-12, "the two cancel: {found:?}");
        let heavier = Basis { loaded_kg: 3.3, ..basis };
        assert!((fit.over(&heavier).found[0].sigma - 0.011).abs() < 1e-12);
    }
}
