//! Tests that flights with an abort under thrust are executed again from their logs like any other.

use flight::guidance::controller::ControllerInput;
use flight::rules::phase::Phase;
use protocol::log::v1;
use replay::log::Recording;
use replay::refly::{ReflyOptions, StartAt, refly_flight};
use replay::verify::{Verification, verify};

use crate::flown::{self, Recipe, only, write_log};
use crate::from_apogee;

#[test]
fn an_aborted_flight_from_apogee_verifies_and_is_reflown_identically() {
    let aborted = from_apogee::fly(&["abort@powered+0..3"]);
    let recording = Recording::open(&aborted.log).unwrap();
    assert_eq!(recording.frames.iter().filter(|tick| tick.input.abort).count(), 1);
    let report = only(verify(&aborted.log).unwrap());
    assert_eq!((report.outcome, report.obstacle), (Verification::Identical, None));
    let landing = ReflyOptions { start: StartAt::Phase(Phase::Powered), ..ReflyOptions::default() };
    let (report, again) = refly_flight(&recording, &landing).unwrap();
    assert_eq!(report.commands_identical, report.ticks, "the moment that was drawn is drawn again");
    assert_eq!(again.verdict, recording.verdict);
    assert!(aborted.landed);
}

/// Verifies, through a file, the ticks of a planar landing whose controller inputs are changed.
fn verified(tell: impl Fn(&mut ControllerInput)) -> (Vec<v1::ControllerTick>, Verification) {
    let ticks = flown::fly(tell).ticks;
    let directory = tempfile::tempdir().unwrap();
    let log = directory.path().join("aborted.mcap");
    std::fs::write(&log, write_log(&ticks, &Recipe::default()).bytes).unwrap();
    let outcome = only(verify(&log).unwrap()).outcome;
    (ticks, outcome)
}

#[test]
fn a_planar_landing_with_an_abort_verifies() {
    let (ticks, outcome) = verified(|input| input.lands_here = input.tick >= 20);
    assert_eq!(outcome, Verification::Identical);
    let undisturbed = &flown::FLIGHT.ticks;
    assert_eq!(ticks[..20], undisturbed[..20]);
    assert_ne!(
        ticks[20].state_digest, undisturbed[20].state_digest,
        "it is the abort that is executed again"
    );
}

/// Flights of earlier builds flew upright after an abort, and their logs have no field for landing below.
#[test]
fn a_planar_flight_of_an_earlier_build_with_an_abort_verifies() {
    let (ticks, outcome) = verified(|input| input.degraded = input.tick >= 20);
    assert!(ticks.iter().all(|tick| tick.input.lands_here.is_none()), "as an earlier build wrote them");
    assert_eq!(outcome, Verification::Identical);
}
