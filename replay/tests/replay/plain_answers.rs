//! Tests answers that could mislead: two kinds of flight, telemetry only, and a cut log.

use replay::log::Recording;
use replay::refly::{ReflyOptions, refly};

use crate::command_line::{data, refusal, replay};
use crate::flown::{Recipe, write_log};
use crate::foreign::foreign_mcap;
use crate::from_apogee::LANDED;
use crate::simulated::{MK2, WITH_FRAMES, tlog};

/// A flight and a log without signals have none in common, which does not count as agreement.
#[test]
fn flights_with_nothing_in_common_are_not_within_tolerance() {
    let nothing = MK2.beside("nothing.mcap");
    std::fs::write(&nothing, write_log(&[], &Recipe { with_frames: false, ..Recipe::default() }).bytes)
        .unwrap();
    let (code, found) = data(replay("compare", &MK2.log).arg(&nothing));
    assert_eq!((code, found[0]["signals"].as_array().unwrap().len()), (3, 0));
    assert!(found[0]["verdicts"][0]["landing"]["stands"] == true, "the verdict is still told: {found}");
}

/// A file that is not a flight log leaves no output behind.
#[test]
fn a_foreign_file_exports_to_no_folder() {
    let (foreign, tables) = (MK2.beside("foreign.mcap"), MK2.beside("no-tables"));
    std::fs::write(&foreign, foreign_mcap("/pose")).unwrap();
    refusal(replay("export", &foreign).args(["--to", "csv", "--out"]).arg(&tables));
    assert!(!tables.exists());
}

#[test]
fn telemetry_alone_is_refused_because_it_has_no_frames() {
    let log = tlog(&WITH_FRAMES, "only.tlog");
    let mut frame = replay("verify", &log);
    frame.args(["--explain", "3"]);
    for mut command in [replay("evaluate", &log), replay("refly", &log), frame] {
        assert!(refusal(&mut command).contains("has no frames of a flight computer"));
    }
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
