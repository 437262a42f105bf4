//! Every flight with a fault ends as expected.
#![expect(clippy::unwrap_used, reason = "a test that cannot be set up fails")]

use onboard_sim::row::Row;
use onboard_sim::tally;
use serde::Deserialize;
use sim::fault::TimedFault;
use sim::recipe::Recipe;

/// Nominal data, with sensors, in still air.
const SENSORS_ONLY: &str = "sensors = true";

/// The expected outcome of each fault with nominal data, sensors and still air, and why. With real
/// dispersions fewer flights land.
const EXPECTED: &str = include_str!("expected-faults.csv");

/// The expected outcome of a flight with a fault.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Expected {
    /// The vehicle stands undamaged.
    Land,
    /// The flight may not land, but the vehicle uses what still works: the motor is ignited inside
    /// the gate, and the vehicle reaches the ground more slowly than without the motor.
    Degrade,
    /// The landing motor is not ignited, or gives no thrust. The fins are open, and the loss is
    /// recorded.
    Inhibit,
    /// The vehicle comes down under the parachute.
    Parachute,
}

/// A degraded flight reaches the ground more slowly than this, m/s. Without braking the speed would
/// be 40 m/s.
const DEGRADED_M_S: f64 = 35.0;

impl Expected {
    /// Whether a flight ended as expected. A landing always counts as expected.
    fn met(self, row: &Row) -> bool {
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

fn fly(faults: &[&str]) -> Row {
    let mission = flight::vehicles::mission::BUILTIN[0];
    let faults = faults.iter().map(|fault| fault.parse().unwrap()).collect();
    let recipe = Recipe::from_texts(mission, ("sensors only", SENSORS_ONLY)).unwrap();
    tally::fly(&Recipe { faults, ..recipe }, 0).unwrap()
}

#[test]
fn every_fault_ends_as_expected() {
    let mut wrong = Vec::new();
    let expectations = csv::Reader::from_reader(EXPECTED.as_bytes()).into_deserialize();
    for expectation in expectations {
        let (fault, expected, _): (String, Expected, String) = expectation.unwrap();
        assert_eq!(fault.parse::<TimedFault>().unwrap().to_string(), fault);
        let row = fly(&[&fault]);
        assert_eq!(row.faults, 1, "{fault} did not happen");
        if !expected.met(&row) {
            wrong.push(format!(
                "{fault} should {expected:?}: {} in {}, {:?} m/s, rest {}",
                row.failure, row.phase, row.touchdown_vertical_m_s, row.rest
            ));
        }
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

#[test]
fn a_flight_without_faults_lands_and_a_silent_radio_changes_nothing() {
    let row = fly(&[]);
    assert!(row.stands, "{row:?}");
    let silent = fly(&["link-loss@0"]);
    assert_eq!(Row { faults: 0, ..silent }, row);
}
