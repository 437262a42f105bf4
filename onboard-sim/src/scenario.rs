//! Scenarios: faults and the expected outcome of the flight, as data.

use serde::Deserialize;

use crate::row::Row;
use sim::fault::{FaultError, TimedFault};

/// The expected outcome of a flight with a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Expected {
    /// The vehicle stands undamaged.
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
            Self::Land => row.stands,
            Self::Degrade => {
                let slow = row.touchdown_vertical_m_s.is_some_and(|m_s| m_s.abs() < DEGRADED_M_S);
                row.stands || (row.ignited && !row.parachute && slow)
            }
            Self::Inhibit => row.onset_height_m.is_none() && !row.parachute,
            Self::Parachute => row.parachute && !row.ignited,
        }
    }
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
