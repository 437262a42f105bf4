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
    let told = phases(computer, stood);
    assert!(!told.contains(&Phase::Coast) && !told.contains(&Phase::Deploy), "{told:?}");
}
