//! Tests a sweep that continues where an earlier run stopped.

use std::num::NonZeroUsize;

use replay::log::Recording;
use replay::refly::ReflyOptions;
use replay::refly::vary::{State, SweepReport, grid, sweep};

use crate::from_apogee::LANDED;
use crate::simulated::MK2;

/// Only flights with missing jobs are prepared: if all outcomes are known, the flight need not even be flyable.
#[test]
fn a_finished_flight_is_not_prepared_again() {
    let points = grid(&["powered.weights.theta=50,110".parse().unwrap()], &[]).unwrap();
    let fly = |flight: &Recording, state: &mut State| -> Result<SweepReport, String> {
        let flights = std::slice::from_ref(flight);
        let options = ReflyOptions::default();
        sweep(flights, &points, &options, NonZeroUsize::MIN, state, &mut |_, _| {})
            .map_err(|error| format!("{:#}", anyhow::Error::from(error)))
    };
    let mut state = State::in_memory(points.len());
    let swept = fly(&MK2.recording(), &mut state).unwrap();
    let mut without_recipe = Recording::open(&LANDED.log).unwrap();
    without_recipe.head.run.remove("flight");
    without_recipe.name.clone_from(&swept.flights[0]);
    assert_eq!(fly(&without_recipe, &mut state).unwrap(), swept);
    let refusal = fly(&without_recipe, &mut State::in_memory(points.len())).unwrap_err();
    assert!(refusal.contains("`flight`"), "{refusal}");
}
