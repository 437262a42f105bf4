//! The lines of the field: on check and card, and in the log.
#![expect(clippy::unwrap_used, reason = "a test that cannot be set up fails")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use onboard_sim::field::{crowd_alarm, lines_m};
use sim::recipe::Recipe;

/// The crowd line of the example is 0.0025 degrees of latitude, 277 m, south of the pad.
const EXAMPLE: &str = include_str!("../../../docs/examples/mk3-field.geojson");

/// A folder with a mission like mk3 that names this file, and the file.
fn mission(folder: &Path, file: &str, text: &str) -> PathBuf {
    let (_, mk3) = flight::vehicles::mission::BUILTIN.iter().find(|(name, _)| *name == "mk3").unwrap();
    let path = folder.join("ours.toml");
    fs::write(&path, mk3.replace("[site]\n", &format!("[site]\nfield = \"{file}\"\n"))).unwrap();
    fs::write(folder.join(file), text).unwrap();
    path
}

/// What the program prints for a mission, with what it reports.
fn printed(mission: &Path, before: &[&str], after: &[&str]) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_onboard-sim"));
    let output = command.args(before).arg(mission).args(after).output().unwrap();
    String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned()
}

fn check(mission: &Path) -> String {
    printed(mission, &["check"], &["--flights", "0"])
}

#[test]
fn the_check_states_the_crowd_line_and_refuses_one_inside_the_fence() {
    let folder = tempfile::tempdir().unwrap();
    let page = check(&mission(folder.path(), "field.geojson", EXAMPLE));
    assert!(page.contains("ok    crowd      crowd line at 277 m"), "{page}");
    let near = EXAMPLE.replace("35.3445]", "35.3463]");
    let page = check(&mission(folder.path(), "field.geojson", &near));
    assert!(page.contains("no    crowd      crowd line at 78 m") && page.contains("\nno\n"), "{page}");
    let without = EXAMPLE.replace("crowd line", "road");
    let page = check(&mission(folder.path(), "field.geojson", &without));
    assert!(page.contains("tight crowd      the field has no crowd line"), "{page}");
}

#[test]
fn a_bad_field_is_refused_with_its_file_and_feature() {
    let folder = tempfile::tempdir().unwrap();
    let path = mission(folder.path(), "pond.geojson", &EXAMPLE.replace("\"trees\"", "\"pond\""));
    let refused = check(&path);
    let words = "pond.geojson: feature 4 (Joshua trees): its kind is not one of boundary, road, crowd line";
    assert!(refused.contains(words), "{refused}");
    fs::remove_file(folder.path().join("pond.geojson")).unwrap();
    assert!(check(&path).contains("pond.geojson: cannot be read"));
}

#[test]
fn a_radius_that_crosses_the_crowd_line_is_an_alarm_of_the_card() {
    let mut recipe = Recipe::built_in("mk3", "real").unwrap();
    assert!(crowd_alarm(&recipe, 1e3).is_none() && lines_m(&recipe).is_empty(), "there is no field");
    recipe.field = Some(EXAMPLE.to_owned());
    assert_eq!(crowd_alarm(&recipe, 270.0), None);
    let alarm = crowd_alarm(&recipe, 390.0).unwrap();
    assert!(
        alarm.starts_with("DO NOT FLY: the crowd line is 277 m from the pad, inside the 390 m"),
        "{alarm}"
    );
    let classes: Vec<_> = lines_m(&recipe).iter().map(|(class, _)| *class).collect();
    assert_eq!(classes, ["area", "crowd", "road", "trees", "area"]);
}

#[test]
fn a_log_has_the_text_of_the_field() {
    let folder = tempfile::tempdir().unwrap();
    let path = mission(folder.path(), "field.geojson", EXAMPLE);
    let log = folder.path().join("flight.mcap");
    printed(&path, &["fly", "--mission"], &["--speed", "max", "--log", log.to_str().unwrap()]);
    let text = String::from_utf8_lossy(&fs::read(log).unwrap()).into_owned();
    assert!(text.contains("Joshua trees"), "the field is a fact about the run");
}
