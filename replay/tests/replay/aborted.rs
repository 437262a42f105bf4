//! Tests that flights with an abort under thrust are executed again from their logs like any other.

use avionics::log::frame::accepts_abort;
use flight::rules::phase::Phase;
use replay::log::{Moment, Recording};
use replay::refly::{ReflyOptions, refly};
use replay::verify::{Verification, verify};

use crate::flown::only;
use crate::from_apogee;

#[test]
fn an_aborted_flight_from_apogee_verifies_and_is_reflown_identically() {
    let aborted = from_apogee::fly(&["abort@powered+0..3"]);
    let recording = Recording::open(&aborted.log).unwrap();
    assert_eq!(recording.frames.iter().filter(|frame| accepts_abort(frame)).count(), 1);
    let report = only(verify(&aborted.log).unwrap());
    assert_eq!((report.outcome, report.obstacle), (Verification::Identical, None));
    let landing = ReflyOptions { start: Some(Moment::Phase(Phase::Powered)), ..ReflyOptions::default() };
    let report = refly(&recording, &landing).unwrap();
    assert_eq!(report.commands_identical, report.frames, "the moment that was drawn is drawn again");
    assert_eq!(report.reflown, recording.verdict);
    assert!(aborted.landed);
}
