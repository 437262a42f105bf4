//! Tests the comparison of missions.

use std::path::Path;

use crate::command_line::{replay, run};

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
