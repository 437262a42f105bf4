//! Tests answers that could mislead: two kinds of flight, and a cut log.

use replay::log::Recording;
use replay::refly::{ReflyOptions, refly};

use crate::command_line::{data, replay};
use crate::flown::{Recipe, write_log};
use crate::from_apogee::LANDED;
use crate::simulated::MK2;

/// A flight and a log without signals have none in common, which does not count as agreement.
#[test]
fn flights_with_nothing_in_common_are_not_alike() {
    let nothing = MK2.beside("nothing.mcap");
    std::fs::write(&nothing, write_log(&[], &Recipe { with_frames: false, ..Recipe::default() }).bytes)
        .unwrap();
    let (code, found) = data(replay("compare", &MK2.log).arg(&nothing));
    assert_eq!((code, found[0]["signals"].as_array().unwrap().len()), (3, 0));
    assert!(found[0]["verdicts"][0]["landing"]["stands"] == true, "the verdict is still reported: {found}");
}

/// In a log that ends early, only the recorded part can be identical.
#[test]
fn a_cut_log_is_compared_up_to_its_end() {
    let mut recording = Recording::open(&LANDED.log).unwrap();
    let whole = refly(&recording, &ReflyOptions::default()).unwrap();
    assert_eq!(whole.commands_identical, whole.frames);
    recording.frames.truncate(recording.frames.len() - 700);
    let cut = refly(&recording, &ReflyOptions::default()).unwrap();
    assert_eq!(cut.commands_identical, whole.frames - 700);
    assert_eq!(cut.frames, whole.frames);
}
