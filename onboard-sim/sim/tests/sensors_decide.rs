//! What the flight computer detects on the way up, it detects from sensors.

use flight::computer::{Computer, Input, Output, SensedInput};
use flight::estimation::estimator::Measurements;
use flight::rules::phase::Phase;
use flight::vehicle::mission::StartPoint;
use sim::outside::{Outside, Watch};
use sim::recipe::Recipe;
use sim::sortie::Sortie;

/// The frames of a flight without requests.
struct Frames(Vec<(SensedInput, bool)>);

impl Watch for Frames {
    fn decided(&mut self, input: &Input<'_>, _: &Output, _: &Computer) {
        assert!(input.requests.is_empty() && input.rehearsed.is_none());
        self.0.push((input.sensed, input.plan_ready));
    }
}

/// The phases that a computer passes through.
fn phases(mut computer: Computer, frames: impl Iterator<Item = (SensedInput, bool)>) -> Vec<Phase> {
    let mut phases = Vec::new();
    for (sensed, plan_ready) in frames {
        computer.step(&Input { sensed, requests: &[], rehearsed: None, plan_ready });
        let phase = computer.mode().phase;
        if phases.last() != Some(&phase) {
            phases.push(phase);
        }
    }
    phases
}

/// The same flight a second time, with all but the sensors as it was: the sensors say that the
/// vehicle stands.
#[test]
fn a_flight_whose_sensors_stand_on_the_rail_is_never_detected() {
    let recipe = Recipe::built_in("mk2", "field").unwrap().starting_at(StartPoint::Pad).unwrap();
    let mut sortie = Sortie::new(&recipe, 0).unwrap();
    let computer = sortie.computer().clone();
    let mut frames = Frames(Vec::new());
    while sortie.computer().mode().phase.before_apogee() {
        sortie.step_with(&Outside::NOBODY, &mut frames);
    }
    let frames = frames.0;
    let flown = phases(computer.clone(), frames.iter().copied());
    assert!(flown.starts_with(&[Phase::Boost, Phase::Coast, Phase::Deploy]), "{flown:?}");
    let measured = Measurements { gnss: None, ..frames[0].0.measured };
    let stood = frames.iter().map(|&(sensed, ready)| (SensedInput { measured, ..sensed }, ready));
    let reported = phases(computer, stood);
    assert!(!reported.contains(&Phase::Coast) && !reported.contains(&Phase::Deploy), "{reported:?}");
}

/// The crew searches at the estimated position.
#[test]
fn a_vehicle_at_rest_without_gnss_has_a_position_at_rest() {
    for (mission, fault) in [
        ("mk2", Some("gnss-out@powered")),
        ("mk3", Some("gnss-out@armed")),
        ("mk3", Some("gnss-out@coast")),
        ("mk3", Some("gnss-stuck@descent")),
        ("mk3", None),
    ] {
        let mut recipe = Recipe::built_in(mission, "real").unwrap().starting_at(StartPoint::Pad).unwrap();
        recipe.faults = fault.into_iter().map(|name| name.parse().unwrap()).collect();
        let mut sortie = Sortie::new(&recipe, 0).unwrap();
        let run = |sortie: &mut Sortie, seconds: u32| (0..200 * seconds).for_each(|_| drop(sortie.step()));
        while sortie.computer().mode().phase != Phase::Touchdown {
            run(&mut sortie, 1);
        }
        let position_m = |sortie: &Sortie| sortie.computer().pilot().estimate().unwrap().state.position_m;
        // Until the motor is out.
        run(&mut sortie, 5);
        let before_m = position_m(&sortie);
        run(&mut sortie, 120);
        let moved_m = (position_m(&sortie) - before_m).norm();
        assert!(moved_m < 1.0, "{mission} {fault:?}: {moved_m} m");
    }
}
