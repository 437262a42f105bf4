//! Tests the comparison of missions.

use std::path::Path;

use replay::info::info;
use serde_json::Value;

use crate::command_line::{data, refusal, replay, run};
use crate::flown::{FLIGHT, Recipe, mission_toml, write_log};

#[test]
fn missions_are_compared_setting_by_setting() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("mine.toml");
    let (_, text) = flight::vehicles::mission::BUILTIN.iter().find(|(name, _)| *name == "mk2").unwrap();
    std::fs::write(&file, text).unwrap();
    let against_mk2 = |other: &Path| data(replay("compare", Path::new("mk2")).arg(other));
    let (code, found) = against_mk2(&file);
    assert_eq!((code, &found[0]["differences"]), (0, &Value::Array(Vec::new())));

    let changed = text.replacen("height_m = ", "height_m = 1", 1);
    assert_ne!(*text, changed);
    std::fs::write(&file, changed).unwrap();
    let (code, found) = against_mk2(&file);
    let differences = found[0]["differences"].as_array().unwrap();
    assert_eq!((code, differences.len()), (3, 1));
    let [before, after] = ["baseline", "other"].map(|side| differences[0][side].as_str().unwrap());
    assert_eq!(format!("1{before}"), after);
    let (_, said, _) = run(replay("compare", Path::new("mk2")).arg(&file));
    assert!(said.contains(&format!("{before} -> {after}\n")), "{said}");

    // The airframe is compared, too, and a mission is no log.
    let (code, found) = against_mk2(Path::new("mk3"));
    let of_airframe = |difference: &Value| difference["setting"].as_str().unwrap().starts_with("airframe.");
    assert!(code == 3 && found[0]["differences"].as_array().unwrap().iter().any(of_airframe), "{found}");
    refusal(replay("compare", Path::new("mk2")).arg("flight.mcap"));
}

#[test]
fn info_and_report_say_which_keys_are_not_those_of_the_standard_controller() {
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
