//! Tests that the log of a re-flown flight from apogee is one flight from its first frame to its
//! last.

use flight::rules::phase::Phase;
use replay::log::{Moment, Recording};
use replay::refly::{ReflyOptions, refly, refly_flight, write_log};
use replay::verify::{Verification, verify};

use crate::flown::only;
use crate::from_apogee::LANDED;
use crate::lost_frames::RECOVERED;
use crate::settings::{settings, with};

/// Flies again, writes the log, and verifies it with this build.
fn written(name: &str, recording: &Recording, options: &ReflyOptions) -> Recording {
    let (_, flown) = refly_flight(recording, options).unwrap();
    let path = LANDED.beside(name);
    write_log(&path, recording, &flown).unwrap();
    let verified = only(verify(&path).unwrap());
    assert_eq!((verified.outcome, verified.first_divergence), (Verification::Identical, None), "{name}");
    assert_eq!(verified.obstacle, None, "{name}");
    Recording::open(&path).unwrap()
}

/// The frame numbers; none may be left out.
fn assert_complete(again: &Recording) {
    assert!(again.frames.iter().map(|frame| frame.input.frame).eq(1..=again.frames.len() as u64));
}

/// If another build flew differently before the start, its frames are not put before those of this
/// build.
#[test]
fn a_reflown_log_holds_only_frames_of_this_build() {
    let whole = Recording::open(&LANDED.log).unwrap();
    let mut forged = whole.clone();
    forged.frames[99].state_digest ^= 1;
    forged.frames[99].output.gimbal_rad[1] += 0.1;
    forged.start.as_mut().unwrap().believed.position_m.x += 0.1;
    let again = written("of_another_build.mcap", &forged, &ReflyOptions::default());
    assert_complete(&again);
    assert_eq!((again.start, again.frames), (whole.start, whole.frames));
}

/// Frames that the log has lost are flown again too: the new log says nothing of a restart.
#[test]
fn a_log_reflown_from_a_recovered_log_has_no_gap() {
    let recovered = Recording::open(&RECOVERED).unwrap();
    assert!(recovered.gap().is_some());
    let last = recovered.frames.last().unwrap().input.frame;
    let again = written(
        "of_a_recovered.mcap",
        &recovered,
        &ReflyOptions { start: Some(Moment::Frame(last)), ..with(&[]) },
    );
    assert_complete(&again);
    assert_eq!(again.frames, Recording::open(&LANDED.log).unwrap().frames);
}

/// A setting with a time before the start applies from the start, in the flight and in its log.
#[test]
fn a_setting_timed_before_the_start_applies_from_the_start() {
    let recording = Recording::open(&LANDED.log).unwrap();
    let start = Some(Moment::Phase(Phase::AeroDescent));
    let timed = ReflyOptions { start, ..with(&["ignition.fixed_height_m=80@0.1"]) };
    let again = written("timed_early.mcap", &recording, &timed);
    let lasting = ReflyOptions { start, settings: settings(&["ignition.fixed_height_m=80"]), ..timed };
    assert_eq!(again.verdict, refly(&recording, &lasting).unwrap().reflown);
    assert_ne!(again.frames, recording.frames);
}
