//! Checks vehicles that land and vehicles that do not, and reads motors from files.
#![expect(clippy::unwrap_used, reason = "a test that cannot be set up fails")]

use std::fs;
use std::path::Path;

use onboard_sim::check::{Page, Verdict, check};
use onboard_sim::motors::source::{self, SourceError};
use sim::recipe::Recipe;

/// A built-in mission at another mass, kg.
fn recipe(name: &str, mass_kg: Option<f64>) -> Recipe {
    let recipe = Recipe::built_in(name, "field").unwrap();
    let Some(mass_kg) = mass_kg else { return recipe };
    let own = format!("loaded_kg = {}", recipe.mission.airframe.mass.loaded_kg);
    assert!(recipe.mission_toml.contains(&own), "{own}");
    let text = recipe.mission_toml.replace(&own, &format!("loaded_kg = {mass_kg}"));
    Recipe::from_texts((name, &text), ("field", &recipe.dispersion_toml)).unwrap()
}

fn page(recipe: &Recipe) -> Page {
    let page = check(recipe, &source::built_in(), 0, &|_| {}).unwrap();
    let text = page.to_string();
    assert!(text.lines().count() <= 24, "{text}");
    assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
    page
}

#[test]
fn no_built_in_mission_is_refused() {
    for (name, _) in flight::vehicles::mission::BUILTIN {
        let page = page(&recipe(name, None));
        assert!(page.verdict() < Verdict::No, "{page}");
        assert!(page.rows.iter().all(|row| row.change.is_none() || row.verdict > Verdict::Ok), "{page}");
    }
}

/// A vehicle of the mass that is proposed is not refused, and one of a step less change is.
#[test]
fn too_heavy_and_too_light_are_refused_with_the_mass_that_is_not() {
    for (name, mass_kg, words) in [
        ("mk3", 5.0, "too heavy for its motor"),
        ("mk3", 2.2, "too light for its motor"),
        ("vlr", 1.46, "too heavy for its motor"),
    ] {
        let refused = page(&recipe(name, Some(mass_kg)));
        assert_eq!(refused.verdict(), Verdict::No, "{refused}");
        let row = refused.rows.iter().find(|row| row.found.starts_with(words)).unwrap();
        let change = row.change.as_ref().unwrap();
        let mut told = change.split([' ', ',']);
        let by_kg: f64 = told.next().unwrap().parse().unwrap();
        assert_eq!(told.next(), Some("kg"));
        let sign = if told.next() == Some("less") { -1.0 } else { 1.0 };
        let at = |by_kg: f64| page(&recipe(name, Some(mass_kg + sign * by_kg))).verdict();
        assert!(at(by_kg) < Verdict::No && at(by_kg - 0.1) == Verdict::No, "{refused}");
    }
}

#[test]
fn flights_are_a_row_of_their_own() {
    let page = check(&recipe("vlr", None), &[], 2, &|_| {}).unwrap();
    let row = page.rows.last().unwrap();
    assert!(row.what == "flights" && row.found.ends_with(" of 2 flights stand"), "{page}");
}

const GOOD: &str = "F10 29 93 4-6-8 0.0407 0.0841 Apogee\n0.015 28.22\n0.5 15\n6.8 10\n7.13 0\n";

fn broken_folder(folder: &Path) {
    for (name, text) in [
        ("good.eng", GOOD.to_owned()),
        ("grams.eng", GOOD.replace("0.0407 0.0841", "40.7 84.1")),
        ("overlap.eng", GOOD.replace("6.8 10", "0.4 10")),
        ("two.eng", format!("{GOOD};\nG20 29 93 4 0.04 0.08 X\n1 20\n2 0\n")),
        ("none.eng", "F0 29 93 4 0.0407 0.0841 Apogee\n1 0\n".to_owned()),
        ("notes.txt", "not a motor".to_owned()),
        (
            "kilograms.rse",
            "<engine code='T' mfg='M' dia='29' len='93' propWt='0.0407' initWt='0.0841'>\n<data>\n\
             <eng-data t='0' f='0'/><eng-data t='4' f='20'/><eng-data t='5' f='0'/></data></engine>"
                .to_owned(),
        ),
    ] {
        fs::write(folder.join(name), text).unwrap();
    }
}

#[test]
fn every_broken_file_of_a_folder_is_named_with_line_and_value() {
    let folder = tempfile::tempdir().unwrap();
    broken_folder(folder.path());
    let found = source::read(folder.path()).unwrap();
    assert_eq!(found.len(), 6, "{found:?}");
    let reason = |name: &str| {
        let broken = found.iter().filter_map(|found| found.as_ref().err());
        broken
            .filter(|broken| broken.origin.ends_with(name))
            .map(|broken| broken.reason.clone())
            .next()
            .unwrap()
    };
    let grams = reason("grams.eng");
    assert!(grams.starts_with("line 1: propellant mass is '40.7 kg for 91.1 N s'"), "{grams}");
    assert!(grams.ends_with("a .eng file has kilograms, a .rse file grams"), "{grams}");
    assert!(reason("kilograms.rse").starts_with("line 1: propellant mass is '0.0000407 kg for 50.0 N s'"));
    assert_eq!(reason("overlap.eng"), "line 4: time is '0.4'; times must increase from point to point");
    assert!(reason("two.eng").starts_with("line 7: a point is 'G20 29 93"), "{}", reason("two.eng"));
    assert!(reason("none.eng").starts_with("thrust is missing"), "{}", reason("none.eng"));
    let empty = tempfile::tempdir().unwrap();
    assert!(matches!(source::read(empty.path()), Err(SourceError::Empty(_))));
    assert!(matches!(source::read(&empty.path().join("x.eng")), Err(SourceError::Read { .. })));
}
