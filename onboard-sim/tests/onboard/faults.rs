//! Every flight with a fault ends as expected.
#![expect(clippy::unwrap_used, reason = "a test that cannot be set up fails")]

use onboard_sim::row::Row;
use onboard_sim::scenario::Expected;
use onboard_sim::tally;
use sim::fault::TimedFault;
use sim::recipe::Recipe;

/// Nominal data, with sensors, in still air.
const SENSORS_ONLY: &str = "sensors = true";

/// The expected outcome of each fault with nominal data, sensors and still air, and why. With real dispersions fewer flights
/// land.
const EXPECTED: &str = include_str!("expected-faults.csv");

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
                "{fault} should {}: {} in {}, {:?} m/s, rest {}",
                expected.name(),
                row.failure,
                row.phase,
                row.touchdown_vertical_m_s,
                row.rest
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
