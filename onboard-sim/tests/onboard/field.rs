//! The lines of the field: on check and card, and in the log.
#![expect(clippy::unwrap_used, reason = "a test that cannot be set up fails")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The crowd line of the example is 277 m from the pad, its trees 214 m.
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
    assert!(page.contains("no    crowd      crowd line at 78 m") && page.ends_with("no\n"), "{page}");
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
fn a_card_whose_radius_crosses_the_crowd_line_has_an_alarm_and_draws_the_field() {
    let folder = tempfile::tempdir().unwrap();
    let near = EXAMPLE.replace("35.3445]", "35.3467]");
    let path = mission(folder.path(), "field.geojson", &near);
    let out = folder.path().join("card");
    let more = ["--wind", "3", "--wind-from", "270", "--flights", "100", "--hazard-flights", "368", "--out"];
    let card = printed(&path, &["card", "--mission"], &[&more[..], &[out.to_str().unwrap()]].concat());
    assert!(card.contains("DO NOT FLY: the crowd line is 33 m from the pad, inside the "), "{card}");
    assert!(card.contains("crowd line 33 m, trees 214 m"), "{card}");
    let html = fs::read_to_string(out.join("card.html")).unwrap();
    assert!(html.contains("<polyline class=\"crowd\" points=\""), "the plan has the crowd line");
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
