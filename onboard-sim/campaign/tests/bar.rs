//! Landing rates with a few flights of each set of dispersions, so that a change that costs landings is seen at once.
//! For exact rates run a campaign of a thousand flights.
#![expect(clippy::unwrap_used, reason = "a test that cannot be set up fails")]

use campaign::row::Row;
use campaign::tally;
use flight::guidance::baseline::Controller;
use sim::recipe::Recipe;

fn flown(dispersion: &str, controller: Controller, flights: u64) -> Vec<Row> {
    let recipe = Recipe { controller, ..Recipe::built_in("mk2", dispersion).unwrap() };
    let rows: Vec<Row> = (0..flights).map(|number| tally::fly(&recipe, number).unwrap()).collect();
    assert!(rows.iter().all(|row| !row.ignition_outside_gate), "{dispersion}");
    rows
}

#[test]
fn regress_flights_without_dispersions_or_with_motor_scatter_only_land_strictly() {
    assert!(flown("none", Controller::Nmpc, 2).iter().all(|row| row.strict));
    assert!(flown("thrust-only", Controller::Nmpc, 10).iter().all(|row| row.strict));
}

/// About 987 of a thousand such flights land, and none with the baselines.
#[test]
fn regress_flights_with_field_dispersions_land_on_their_legs_and_the_baselines_do_not() {
    let landed = |controller| flown("field", controller, 20).iter().filter(|row| row.legs).count();
    let by_nmpc = landed(Controller::Nmpc);
    assert!(by_nmpc >= 18, "{by_nmpc} of 20");
    assert_eq!([Controller::OpenLoop, Controller::Oscillating].map(landed), [0, 0]);
}
