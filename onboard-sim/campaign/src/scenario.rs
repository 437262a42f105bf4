//! Scenarios: faults and the expected outcome of the flight, as data; and the expected outcome of each kind of fault.

use serde::Deserialize;

use crate::row::Row;
use sim::fault::{FaultError, TimedFault};

/// The expected outcome of a flight with a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Expected {
    /// The flight lands within the limits of the legs.
    Land,
    /// The flight may not land, but the vehicle uses what still works: the motor is lit inside the gate, and the
    /// vehicle reaches the ground more slowly than without the motor.
    Degrade,
    /// The landing motor is not lit, or gives no thrust. The fins are open, and the loss is recorded.
    Inhibit,
    /// The vehicle comes down under the parachute.
    Parachute,
}

/// A degraded flight reaches the ground more slowly than this, m/s. Without braking the speed would be 40 m/s.
const DEGRADED_M_S: f64 = 35.0;

impl Expected {
    /// The name in a table.
    pub fn name(self) -> &'static str {
        match self {
            Self::Land => "land",
            Self::Degrade => "degrade",
            Self::Inhibit => "inhibit",
            Self::Parachute => "parachute",
        }
    }

    /// Whether a flight ended as expected. A landing always counts as expected.
    pub fn met(self, row: &Row) -> bool {
        if row.ignition_outside_gate || row.failure == "not a number" {
            return false;
        }
        match self {
            Self::Land => row.legs,
            Self::Degrade => {
                let slow = row.touchdown_vertical_m_s.is_some_and(|m_s| m_s.abs() < DEGRADED_M_S);
                row.legs || (row.ignited && !row.parachute && slow)
            }
            Self::Inhibit => row.onset_height_m.is_none() && !row.parachute,
            Self::Parachute => row.parachute && !row.ignited,
        }
    }
}

/// A fault, the expected outcome of a flight with it, and the reason.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Expectation {
    /// The fault, as written on a command line.
    pub fault: &'static str,
    /// The expected outcome.
    pub expected: Expected,
    pub because: &'static str,
}

/// The expected outcome of each fault, with nominal data, sensors and still air. With real dispersions fewer flights
/// land.
pub const EXPECTATIONS: &[Expectation] = &[
    expectation("link-loss@0", Expected::Land, "nothing on board depends on the radio"),
    expectation(
        "link-delay:1@0",
        Expected::Land,
        "nothing on board depends on the radio; an abort is late by the delay",
    ),
    expectation(
        "gnss-out@5",
        Expected::Degrade,
        "without satellites the lateral velocity is known less well than the legs' limit",
    ),
    expectation("barometer-out@5", Expected::Land, "satellite heights and the lidar remain"),
    expectation(
        "lidar-out@0",
        Expected::Land,
        "satellites and barometer remain, accurate to some decimetres",
    ),
    expectation(
        "accelerometer-bias:30@5",
        Expected::Land,
        "the filter estimates the bias before the landing",
    ),
    expectation(
        "gyro-bias:1@5",
        Expected::Parachute,
        "satellites contradict the estimate, so the gate stays closed; the parachute is what is left",
    ),
    expectation(
        "fin-stuck:2@descent+2",
        Expected::Parachute,
        "the fin does not follow its command, so the gate stays closed, and there is room for the parachute",
    ),
    expectation("fin-stuck:1@armed", Expected::Parachute, "the same, even seconds before the ignition"),
    expectation(
        "gimbal-slow:0.3@ignition",
        Expected::Degrade,
        "three of four `field` flights land; the others are still turning at contact",
    ),
    expectation("gimbal-stuck@powered+0.5", Expected::Degrade, "the thrust brakes, but nothing steers"),
    expectation("no-light@0", Expected::Inhibit, "no thrust within half a second latches the inhibit"),
    expectation(
        "late-light:0.3@0",
        Expected::Degrade,
        "the thrust begins 13 m lower than chosen, at the edge of the band",
    ),
    expectation(
        "weak-motor:0.8@0",
        Expected::Degrade,
        "a loss of a fifth of the impulse is more than the band allows for",
    ),
    expectation("early-burnout:2@0", Expected::Degrade, "the vehicle falls the rest of the way"),
    expectation("reboot:0.2@descent+3", Expected::Land, "the restart keeps the phase and the last estimate"),
    expectation("parachute-fails@0", Expected::Land, "a landing does not need the parachute"),
    expectation("abort@descent+1", Expected::Parachute, "there is room for the parachute"),
];

const fn expectation(fault: &'static str, expected: Expected, because: &'static str) -> Expectation {
    Expectation { fault, expected, because }
}

/// The faults of a flight, from a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Scenario {
    pub name: String,
    /// What breaks.
    pub faults: Vec<TimedFault>,
    /// The expected outcome.
    pub expected: Option<Expected>,
}

/// Why a scenario cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ScenarioError {
    /// The text is not a scenario.
    #[error("{origin}: {message}")]
    Parse {
        /// Where the text came from.
        origin: String,
        /// The parser's words.
        message: String,
    },
    /// The text of a fault is wrong.
    #[error("{origin}")]
    Fault {
        /// Where the text came from.
        origin: String,
        #[source]
        source: FaultError,
    },
}

impl Scenario {
    /// Reads a scenario from TOML: `name`, `faults` (a list of texts) and, if wanted, `expected`.
    ///
    /// # Errors
    /// [`ScenarioError`] names the key or the fault.
    pub fn from_toml(text: &str, origin: &str) -> Result<Self, ScenarioError> {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct File {
            name: String,
            faults: Vec<String>,
            expected: Option<Expected>,
        }
        let file: File = toml::from_str(text).map_err(|error| ScenarioError::Parse {
            origin: origin.to_owned(),
            message: error.to_string(),
        })?;
        let faults = file.faults.iter().map(|fault| fault.parse()).collect::<Result<Vec<_>, _>>();
        let faults = faults.map_err(|source| ScenarioError::Fault { origin: origin.to_owned(), source })?;
        Ok(Self { name: file.name, faults, expected: file.expected })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_expectation_names_a_known_fault() {
        for expectation in EXPECTATIONS {
            assert_eq!(expectation.fault.parse::<TimedFault>().unwrap().to_string(), expectation.fault);
        }
    }

    #[test]
    fn a_scenario_is_parsed_and_errors_name_the_key() {
        let text =
            "name = \"dark\"\nfaults = [\"gnss-out@5\", \"no-light@ignition\"]\nexpected = \"inhibit\"";
        let scenario = Scenario::from_toml(text, "dark.toml").unwrap();
        assert_eq!((scenario.faults.len(), scenario.expected), (2, Some(Expected::Inhibit)));
        let error = Scenario::from_toml(&text.replace("gnss-out", "gps"), "dark.toml").unwrap_err();
        assert_eq!(error.to_string(), "dark.toml");
        let error = Scenario::from_toml(&text.replace("faults", "fault"), "dark.toml").unwrap_err();
        assert!(error.to_string().contains("fault"), "{error}");
    }
}
