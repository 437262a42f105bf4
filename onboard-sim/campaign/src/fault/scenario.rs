//! Scenarios: faults with what is expected of the flight, as data; and the expectation for each kind of fault.

use serde::Deserialize;

use super::TimedFault;
use crate::row::Row;

/// What is expected of a flight with a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Expected {
    /// It lands within what the legs take.
    Land,
    /// It may not land, but goes on with what is left: the motor is lit inside the gate, and it reaches the ground
    /// slower than without it.
    Degrade,
    /// The landing motor is not lit, or gives no thrust; fins open, the loss is recorded.
    Inhibit,
    /// It comes down under the parachute.
    Parachute,
}

/// A degraded flight reaches the ground slower than this, m/s; unbraked it would be 40.
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

    /// Whether a flight did what is expected. Landing is never held against it.
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

/// A fault, what is expected of a flight with it, and why.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Expectation {
    /// The fault, as written on a command line.
    pub fault: &'static str,
    /// What is expected.
    pub expected: Expected,
    /// Why.
    pub because: &'static str,
}

/// What is expected of each fault, on the data as they stand with sensors, in still air; a day at the field lands fewer.
pub const EXPECTATIONS: &[Expectation] = &[
    expectation("link-loss@0", Expected::Land, "nothing on board waits for the radio"),
    expectation("link-delay:1@0", Expected::Land, "nor for what comes late; an abort comes late by as much"),
    expectation(
        "gnss-out@5",
        Expected::Degrade,
        "without satellites the drift sideways is not known to the legs' limit",
    ),
    expectation("barometer-out@5", Expected::Land, "satellite heights and the lidar are left"),
    expectation("lidar-out@0", Expected::Land, "satellites and barometer are left, to some decimetres"),
    expectation("accelerometer-bias:30@5", Expected::Land, "the filter follows a bias, in its time"),
    expectation(
        "gyro-bias:1@5",
        Expected::Inhibit,
        "satellites contradict the estimate: the gate stays shut",
    ),
    expectation(
        "fin-stuck:2@descent+2",
        Expected::Parachute,
        "it does not move when told to: the gate stays shut, and there is room for the parachute",
    ),
    expectation("fin-stuck:1@armed", Expected::Parachute, "and as late as seconds before the ignition"),
    expectation("gimbal-slow:0.3@ignition", Expected::Land, "the loop has that much in reserve"),
    expectation("gimbal-stuck@powered+0.5", Expected::Degrade, "thrust brakes, nothing steers"),
    expectation("no-light@0", Expected::Inhibit, "no thrust within half a second latches the inhibit"),
    expectation("late-light:0.3@0", Expected::Degrade, "13 m lower than chosen, at the edge of the band"),
    expectation(
        "weak-motor:0.8@0",
        Expected::Degrade,
        "a fifth of the impulse is more than the band allows for",
    ),
    expectation("early-burnout:2@0", Expected::Degrade, "the rest of the way is a fall"),
    expectation("reboot:0.2@descent+3", Expected::Land, "the phase and the last estimate are kept"),
    expectation("abort@descent+1", Expected::Parachute, "there is room for the parachute"),
];

const fn expectation(fault: &'static str, expected: Expected, because: &'static str) -> Expectation {
    Expectation { fault, expected, because }
}

/// Faults of a flight, from a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Scenario {
    /// Its name.
    pub name: String,
    /// What breaks.
    pub faults: Vec<TimedFault>,
    /// What is expected.
    pub expected: Option<Expected>,
}

/// A scenario that cannot be used.
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
    /// A fault is not one.
    #[error("{origin}")]
    Fault {
        /// Where the text came from.
        origin: String,
        /// Why.
        #[source]
        source: super::FaultError,
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
    fn every_expectation_is_of_a_fault_that_exists() {
        for expectation in EXPECTATIONS {
            assert_eq!(expectation.fault.parse::<TimedFault>().unwrap().to_string(), expectation.fault);
        }
    }

    #[test]
    fn a_scenario_is_read_and_its_mistakes_are_named() {
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
