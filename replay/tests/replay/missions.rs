//! Tests the answers about the mission of a log.

use replay::info::info;

use crate::command_line::{replay, run};
use crate::flown::{FLIGHT, Recipe, mission_toml, write_log};

#[test]
fn info_and_report_list_keys_that_differ_from_the_standard_controller() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("flight.mcap");
    let standard = mission_toml();
    let changed = format!("soft_tilt_deg = 39.0\n{standard}\n[powered.weights]\ntheta = 150.0\n");
    for (text, is_standard) in [(standard.to_owned(), true), (changed, false)] {
        let recipe = Recipe { profile_toml: Some(text), ..Recipe::default() };
        std::fs::write(&log, write_log(&FLIGHT.frames, &recipe).bytes).unwrap();
        let changed = info(&log).unwrap().profile.unwrap().changed;
        let expected = ["powered.weights.theta", "soft_tilt_deg"];
        assert_eq!(changed, if is_standard { &[][..] } else { &expected });
        let words = "not the standard one: powered.weights.theta, soft_tilt_deg";
        let answers = [run(&mut replay("info", &log)).1, replay::report::report(&log).unwrap().html];
        assert!(answers.iter().all(|said| said.contains(words) != is_standard));
    }
}
