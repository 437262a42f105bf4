//! Missions: a vehicle, where its flight begins, and how it is steered, read from TOML.
//!
//! A mission is data only. Keys carry their units; unknown keys are errors. Its airframe is a table of its own or the
//! name of a built-in one.

use serde::Deserialize;

use crate::aim::AimGains;
use crate::airframe::{Airframe, AirframeError};
use crate::descent::DescentGains;
use crate::estimator::EstimatorConfig;
use crate::ignition::IgnitionSettings;
use crate::motor_estimate::MotorPrior;
use crate::motors::{self, MotorError};
use crate::powered::PoweredSettings;
use crate::profile::{ArmingLimits, GateLimits, TouchdownBox};
use crate::site::Site;
use crate::thrust_curve::ThrustCurve;

/// Length of the countdown, s, where a mission does not say, and at most.
const COUNTDOWN_S: f64 = 5.0;
const COUNTDOWN_MAX_S: f64 = 600.0;

/// Altitudes of a pad, m: from the shore of the Dead Sea to above every road.
const PAD_ALTITUDES_M: core::ops::RangeInclusive<f64> = -450.0..=6_000.0;

/// Where a mission begins: at apogee, nose up.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ApogeeStart {
    /// From the crew's start command to the start, s, 0 to 600.
    #[serde(default = "countdown_s")]
    pub countdown_s: f64,
    /// Height of the centre of gravity above the pad, m.
    pub height_m: f64,
    /// Horizontal distance from the pad, m.
    pub distance_m: f64,
    /// Horizontal speed, away from the pad, m/s.
    pub speed_m_s: f64,
    /// Share of the mean wind there that the vehicle has taken on by then.
    pub carried_share: f64,
    /// Tilt of the nose from the vertical, along the motion, degrees.
    pub tilt_deg: f64,
}

/// What the legs take.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LegLimits {
    /// Largest vertical speed, m/s.
    pub vertical_m_s: f64,
    /// Largest lateral speed, m/s.
    pub lateral_m_s: f64,
    /// Largest tilt, degrees.
    pub tilt_deg: f64,
    /// Largest rotation rate, degrees per second.
    pub rate_deg_s: f64,
}

/// Everything that distinguishes one flight from apogee from another, but for chance.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mission {
    /// Short name, as given on a command line.
    pub name: String,
    /// One line for a person choosing.
    pub summary: String,
    /// The vehicle.
    #[serde(deserialize_with = "airframe")]
    pub airframe: Airframe,
    /// Gravity, m/s^2.
    pub gravity_m_s2: f64,
    /// Altitude of the pad above the sea, m.
    pub pad_altitude_m: f64,
    /// Where on the Earth the pad is.
    #[serde(default)]
    pub site: Site,
    /// The fins steer; otherwise they stay open and equal (passive descent).
    pub steered: bool,
    /// Place of the lidar along the axis, ahead of the feet, m.
    pub lidar_ahead_of_feet_m: f64,
    /// What is believed of the motor before it is lit.
    #[serde(default)]
    pub motor: MotorPrior,
    /// Standard deviations of the impulse to come that a plan takes the motor to be weaker than estimated.
    pub caution_sigmas: f64,
    /// The caution fades over so long before the thrust falls through the weight, s.
    pub caution_fades_s: f64,
    /// Standard deviations of the impulse to come, either way, that the fins leave room for.
    pub fin_sigmas: f64,
    /// Where the fins keep the vehicle in the band that is then left, 0 at its low end, 1 at its high end.
    pub fin_place: f64,
    /// How much of the fins' present opening a plan expects to last; the rest is expected to open as the motor that is
    /// planned with will ask.
    pub fins_kept: f64,
    /// Tilt that the landing may use throughout, at most, when the band of feasible heights is computed before the
    /// ignition, degrees.
    pub soft_tilt_deg: f64,
    /// The same for the fins after it: what is left of the tilt is kept for the planner, degrees.
    pub fin_soft_tilt_deg: f64,
    /// How long before touchdown the vehicle is upright already in that band, s.
    pub settle_s: f64,
    /// Where it begins.
    pub start: ApogeeStart,
    /// The estimator.
    #[serde(default)]
    pub estimator: EstimatorConfig,
    /// Steering by fins.
    pub descent: DescentGains,
    /// When to light.
    pub ignition: IgnitionSettings,
    /// The landing burn.
    pub powered: PoweredSettings,
    /// The gimbal loop.
    pub aim: AimGains,
    /// Limits of the pad checks before arming.
    #[serde(default)]
    pub arming: ArmingLimits,
    /// Limits of the checks before ignition.
    pub gate: GateLimits,
    /// What counts as a landing: the landing paper's Table 2.
    pub touchdown_limits: TouchdownBox,
    /// What the legs take.
    pub leg_limits: LegLimits,
}

/// A mission that cannot be flown.
#[derive(Debug, thiserror::Error)]
pub enum MissionError {
    /// The text is not a mission.
    #[error("{origin}: {message}")]
    Parse {
        /// Where the text came from (a path or a built-in's name).
        origin: String,
        /// The parser's words, with line, column and key.
        message: String,
    },
    /// The airframe is out of range.
    #[error("{origin}")]
    Airframe {
        /// Where the text came from.
        origin: String,
        /// Why.
        #[source]
        source: AirframeError,
    },
    /// The countdown is no time to wait.
    #[error("{origin}: start.countdown_s = {found}: must be 0 to {COUNTDOWN_MAX_S}")]
    Countdown {
        /// Where the text came from.
        origin: String,
        /// The value found.
        found: f64,
    },
    /// The pad is nowhere.
    #[error("{origin}: {key} = {found}: must be {required}")]
    Site {
        /// Where the text came from.
        origin: String,
        /// The key, with its section.
        key: &'static str,
        /// The value found.
        found: f64,
        /// The accepted range, in words.
        required: &'static str,
    },
    /// The motor is not to be had.
    #[error(transparent)]
    Motor(#[from] MotorError),
}

/// The built-in missions: name and TOML text.
pub const BUILTIN: &[(&str, &str)] = &[
    ("mk2", include_str!("../missions/mk2.toml")),
    ("mk2-h53", include_str!("../missions/mk2-h53.toml")),
    ("mini-f10", include_str!("../missions/mini-f10.toml")),
];

impl Mission {
    /// Reads a mission from TOML; `origin` names it in messages.
    ///
    /// # Errors
    /// [`MissionError`] names the key and what would be accepted.
    pub fn from_toml(text: &str, origin: &str) -> Result<Self, MissionError> {
        let mission: Self = toml::from_str(text)
            .map_err(|error| MissionError::Parse { origin: origin.to_owned(), message: error.to_string() })?;
        mission
            .airframe
            .validate()
            .map_err(|source| MissionError::Airframe { origin: origin.to_owned(), source })?;
        let countdown_s = mission.start.countdown_s;
        if !(0.0..=COUNTDOWN_MAX_S).contains(&countdown_s) {
            return Err(MissionError::Countdown { origin: origin.to_owned(), found: countdown_s });
        }
        let altitude_m = mission.pad_altitude_m;
        let nowhere = (!PAD_ALTITUDES_M.contains(&altitude_m)).then_some((
            "pad_altitude_m",
            altitude_m,
            "-450 to 6000",
        ));
        if let Some((key, found, required)) = mission.site.bad_value().or(nowhere) {
            return Err(MissionError::Site { origin: origin.to_owned(), key, found, required });
        }
        mission.motor()?;
        Ok(mission)
    }

    /// Whether a text is meant as a mission rather than a [profile](crate::profile): a mission names an airframe or
    /// holds one.
    pub fn is_meant(text: &str) -> bool {
        toml::from_str::<toml::Table>(text).is_ok_and(|table| table.contains_key("airframe"))
    }

    /// The built-in mission of a name.
    pub fn builtin(name: &str) -> Option<Result<Self, MissionError>> {
        BUILTIN.iter().find(|(known, _)| *known == name).map(|(name, text)| Self::from_toml(text, name))
    }

    /// The landing motor's certified thrust curve.
    ///
    /// # Errors
    /// No built-in motor has that name, or the text given in its place is that of no motor.
    pub fn motor(&self) -> Result<ThrustCurve, MissionError> {
        Ok(motors::named(&self.airframe.motor)?)
    }
}

fn countdown_s() -> f64 {
    COUNTDOWN_S
}

/// An airframe's name, or the airframe itself.
fn airframe<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<Airframe, D::Error> {
    #[derive(Deserialize)]
    #[serde(untagged)]
    enum NameOrTable {
        Name(String),
        Table(Box<Airframe>),
    }
    match NameOrTable::deserialize(deserializer)? {
        NameOrTable::Name(name) => Airframe::builtin(&name).map_err(serde::de::Error::custom),
        NameOrTable::Table(airframe) => Ok(*airframe),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_builtin_mission_is_sound() {
        for (name, text) in BUILTIN {
            let mission = Mission::from_toml(text, name).expect("sound");
            assert_eq!(mission.name, *name);
        }
    }

    #[test]
    fn a_countdown_is_a_time_to_wait_and_five_seconds_unless_said() {
        let (name, text) = BUILTIN[0];
        let of = |countdown: &str| Mission::from_toml(&text.replace("[start]", countdown), name);
        assert!((of("[start]").expect("sound").start.countdown_s - 5.0).abs() < 1e-12);
        assert!((of("[start]\ncountdown_s = 0").expect("sound").start.countdown_s).abs() < 1e-12);
        for wrong in ["-1.0", "nan", "601.0"] {
            let message = of(&format!("[start]\ncountdown_s = {wrong}")).expect_err("wrong").to_string();
            assert!(
                message.contains("start.countdown_s") && message.contains("must be 0 to 600"),
                "{message}"
            );
        }
        assert!(Mission::is_meant(text) && !Mission::is_meant("name = \"x\"") && !Mission::is_meant("="));
    }

    #[test]
    fn a_site_is_a_place_on_the_earth_and_a_known_field_unless_said() {
        let (name, text) = BUILTIN[0];
        let of = |site: &str| Mission::from_toml(&text.replace("[start]", &format!("{site}\n[start]")), name);
        assert_eq!(of("").expect("sound").site, Site::default());
        let given = of("[site]\nlatitude_deg = 48.1\nlongitude_deg = 11.6").expect("sound").site;
        assert_eq!(given, Site { latitude_deg: 48.1, longitude_deg: 11.6 });
        let message = of("[site]\nlatitude_deg = 89.0\nlongitude_deg = 11.6").expect_err("wrong").to_string();
        assert!(message.contains("site.latitude_deg = 89") && message.contains("-85 to 85"), "{message}");
        assert!(of("[site]\nlatitude_deg = 48.1").is_err(), "half a place is none");
        let sunken = text.replace("pad_altitude_m = 0.0", "pad_altitude_m = -500.0");
        let message = Mission::from_toml(&sunken, name).expect_err("wrong").to_string();
        assert!(message.contains("pad_altitude_m = -500"), "{message}");
    }

    #[test]
    fn an_unknown_airframe_or_key_is_named() {
        let (name, text) = BUILTIN[0];
        let message = Mission::from_toml(&text.replace("airframe = \"mk2\"", "airframe = \"mk9\""), name)
            .expect_err("unknown")
            .to_string();
        assert!(message.contains("no airframe is named 'mk9'"), "{message}");
        let message =
            Mission::from_toml(&format!("colour = 1\n{text}"), name).expect_err("unknown").to_string();
        assert!(message.contains("colour"), "{message}");
    }
}
