//! Every fault ends as is expected of it.
#![expect(clippy::unwrap_used, reason = "a test that cannot be set up fails")]

use campaign::baseline::Controller;
use campaign::dispersion::Dispersion;
use campaign::fault::EXPECTATIONS;
use campaign::order::Order;
use campaign::row::Row;
use campaign::sortie;
use flight::mission::{self, Mission};

/// The data as they stand, with sensors, in still air.
const SENSORS_ONLY: &str = "sensors = true";

fn fly(controller: Controller, faults: &[&str]) -> Row {
    let mission_toml = mission::BUILTIN[0].1.to_owned();
    let order = Order {
        mission: Mission::from_toml(&mission_toml, "test").unwrap(),
        mission_toml,
        dispersion: Dispersion::from_toml(SENSORS_ONLY, "test").unwrap(),
        dispersion_name: "sensors only".to_owned(),
        dispersion_toml: SENSORS_ONLY.to_owned(),
        seed: 1,
        flights: 1,
        controller,
        faults: faults.iter().map(|fault| fault.parse().unwrap()).collect(),
    };
    sortie::fly(&order, 0).unwrap()
}

#[test]
fn every_fault_ends_as_expected() {
    let mut wrong = Vec::new();
    for expectation in EXPECTATIONS {
        let row = fly(Controller::Nmpc, &[expectation.fault]);
        assert_eq!(row.faults, 1, "{} did not come about", expectation.fault);
        if !expectation.expected.met(&row) {
            wrong.push(format!(
                "{} should {}: {} in {}, {:?} m/s, rest {}",
                expectation.fault,
                expectation.expected.name(),
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
fn without_a_fault_it_lands_and_a_silent_radio_changes_nothing() {
    let row = fly(Controller::Nmpc, &[]);
    assert!(row.legs, "{row:?}");
    let silent = fly(Controller::Nmpc, &["link-loss@0"]);
    assert_eq!(Row { faults: 0, ..silent }, row);
}

/// They brake, which is what they are for; how well is a campaign's to say.
#[test]
fn the_simple_controllers_brake() {
    for controller in [Controller::OpenLoop, Controller::Oscillating] {
        let row = fly(controller, &[]);
        assert!(row.ignited && !row.ignition_outside_gate, "{}: {row:?}", controller.name());
        let vertical_m_s = row.touchdown_vertical_m_s.unwrap();
        assert!(vertical_m_s.abs() < 20.0, "{}: {vertical_m_s} m/s", controller.name());
    }
}
