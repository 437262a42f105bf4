//! How often it lands: a few flights of each set, so that a change that costs landings is seen at once. The rates
//! themselves are for a campaign of a thousand.
#![expect(clippy::unwrap_used, reason = "a test that cannot be set up fails")]

use campaign::baseline::Controller;
use campaign::dispersion::Dispersion;
use campaign::order::Order;
use campaign::row::Row;
use campaign::sortie;
use flight::mission::{self, Mission};

fn flown(dispersion: &str, controller: Controller, flights: u64) -> Vec<Row> {
    let mission_toml = mission::BUILTIN[0].1.to_owned();
    let order = Order {
        mission: Mission::from_toml(&mission_toml, "test").unwrap(),
        mission_toml,
        dispersion: Dispersion::builtin(dispersion).unwrap(),
        dispersion_name: dispersion.to_owned(),
        dispersion_toml: String::new(),
        seed: 1,
        flights,
        controller,
        faults: Vec::new(),
    };
    let rows: Vec<Row> = (0..flights).map(|number| sortie::fly(&order, number).unwrap()).collect();
    assert!(rows.iter().all(|row| !row.ignition_outside_gate), "{dispersion}");
    rows
}

#[test]
fn regress_nothing_uncertain_and_the_motor_alone_land_strictly() {
    assert!(flown("none", Controller::Nmpc, 2).iter().all(|row| row.strict));
    assert!(flown("thrust-only", Controller::Nmpc, 10).iter().all(|row| row.strict));
}

/// Of a thousand such flights some 987 land, and none of the baselines'.
#[test]
fn regress_a_day_at_the_field_lands_on_its_legs_and_the_baselines_do_not() {
    let landed = |controller| flown("field", controller, 20).iter().filter(|row| row.legs).count();
    let by_nmpc = landed(Controller::Nmpc);
    assert!(by_nmpc >= 18, "{by_nmpc} of 20");
    assert_eq!([Controller::OpenLoop, Controller::Oscillating].map(landed), [0, 0]);
}
