//! Tests the comparison of missions.

use std::path::Path;

use crate::command_line::{replay, run};
use crate::flown::{FLIGHT, Recipe, mission_toml, write_log};

#[test]
fn missions_are_compared_setting_by_setting() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("mine.toml");
    let (_, text) = flight::vehicles::mission::BUILTIN.iter().find(|(name, _)| *name == "mk2").unwrap();
    std::fs::write(&file, text).unwrap();
    let (code, said, _) = run(replay("compare", Path::new("mk2")).arg(&file));
    assert!(code == 0 && said.contains("is the same mission as mk2"), "{said}");

    let changed = text.replacen("height_m = ", "height_m = 1", 1);
    assert_ne!(*text, changed);
    std::fs::write(&file, changed).unwrap();
    let (code, said, _) = run(replay("compare", Path::new("mk2")).arg(&file));
    assert_eq!(code, 1);
    assert!(said.contains("differs from mk2 in 1 setting;"), "{said}");
    let row = said.lines().find(|line| line.contains("height_m")).unwrap();
    let (before, after) = row.split_once("height_m").unwrap().1.split_once(" -> ").unwrap();
    assert_eq!(format!("1{}", before.trim()), after.trim());

    // The airframe is compared, too, and a mission is no log.
    let (code, said, _) = run(replay("compare", Path::new("mk2")).arg("mk3"));
    assert!(code == 1 && said.contains("airframe."), "{said}");
    let (code, _, why) = run(replay("compare", Path::new("mk2")).arg("flight.mcap"));
    assert!(code == 2 && why.contains("flight.mcap: is no mission"), "{why}");
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
        let (_, said, _) = run(&mut replay("info", &log));
        let row = "controller  not the standard one: powered.weights.theta, soft_tilt_deg\n";
        assert_eq!(said.contains(row), !is_standard, "{said}");
        assert_eq!(said.contains("not the standard one"), !is_standard, "{said}");
        let page = replay::report::report(&log, None).unwrap().html;
        let words = "Controller: not the standard one: powered.weights.theta, soft_tilt_deg.";
        assert_eq!(page.contains(words), !is_standard);
    }
}
