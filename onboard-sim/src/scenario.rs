//! Scenarios: faults and the expected outcome of the flight, as data.

use serde::de::Error as _;
use serde::{Deserialize, Deserializer};
use sim::fault::TimedFault;

use crate::row::Row;

flight::numbered_enum! {
/// The expected outcome of a flight with a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Expected {
    /// The vehicle stands undamaged.
    Land = "land",
    /// The flight may not land, but the vehicle uses what still works: the motor is lit inside the gate, and the
    /// vehicle reaches the ground more slowly than without the motor.
    Degrade = "degrade",
    /// The landing motor is not lit, or gives no thrust. The fins are open, and the loss is recorded.
    Inhibit = "inhibit",
    /// The vehicle comes down under the parachute.
    Parachute = "parachute",
}
}

/// A degraded flight reaches the ground more slowly than this, m/s. Without braking the speed would be 40 m/s.
const DEGRADED_M_S: f64 = 35.0;

impl Expected {
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
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    pub name: String,
    /// What breaks.
    #[serde(deserialize_with = "parsed")]
    pub faults: Vec<TimedFault>,
    /// The expected outcome.
    pub expected: Option<Expected>,
}

fn parsed<'de, D: Deserializer<'de>>(faults: D) -> Result<Vec<TimedFault>, D::Error> {
    let faults = Vec::<String>::deserialize(faults)?;
    faults.iter().map(|fault| fault.parse().map_err(D::Error::custom)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scenario_is_parsed_and_errors_name_the_key() {
        let text =
            "name = \"dark\"\nfaults = [\"gnss-out@5\", \"no-light@ignition\"]\nexpected = \"inhibit\"";
        let scenario: Scenario = toml::from_str(text).unwrap();
        assert_eq!((scenario.faults.len(), scenario.expected), (2, Some(Expected::Inhibit)));
        for (from, to, words) in [("gnss-out", "gps", "`gps"), ("faults", "fault", "unknown field `fault`")] {
            let error = toml::from_str::<Scenario>(&text.replace(from, to)).unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
    }
}
