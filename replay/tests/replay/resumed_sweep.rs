//! A sweep that goes on where another run of it stopped.

use std::num::NonZeroUsize;

use replay::log::Recording;
use replay::refly::ReflyOptions;
use replay::sweep::{State, SweepReport, grid, sweep};

use crate::from_apogee::LANDED;
use crate::simulated::NOMINAL;

/// Only what is missing is made ready: a flight whose outcomes are known need not even be one that can be flown again.
#[test]
fn a_flight_that_nothing_is_missing_of_is_not_flown_up_to_its_start() {
    let points = grid(&["nmpc.weights.w=50,110".parse().unwrap()], &[]).unwrap();
    let fly = |flight: &Recording, state: &mut State| -> Result<SweepReport, String> {
        let flights = std::slice::from_ref(flight);
        let options = ReflyOptions::default();
        sweep(flights, &points, &options, NonZeroUsize::MIN, state, &mut |_| {})
            .map_err(|error| format!("{:#}", anyhow::Error::from(error)))
    };
    let mut state = State::in_memory(points.len());
    let swept = fly(&NOMINAL.recording(), &mut state).unwrap();
    let mut without_recipe = Recording::open(&LANDED.log).unwrap();
    without_recipe.head.run.remove("flight");
    without_recipe.name.clone_from(&swept.flights[0]);
    assert_eq!(fly(&without_recipe, &mut state).unwrap(), swept);
    let refusal = fly(&without_recipe, &mut State::in_memory(points.len())).unwrap_err();
    assert!(refusal.contains("`flight`"), "{refusal}");
}
