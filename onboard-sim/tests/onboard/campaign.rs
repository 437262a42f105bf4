//! A campaign's results do not depend on how it was run.
#![expect(clippy::unwrap_used, reason = "a test that cannot be set up fails")]

use std::fs;
use std::path::Path;

use flight::rules::verdict::Landing;
use onboard_sim::row::Row;
use onboard_sim::run::{run, threads};
use onboard_sim::store::{Manifest, Store, StoreError};
use onboard_sim::tally;
use sim::dispersion;
use sim::recipe::Recipe;

const FLIGHTS: u64 = 13;

/// Flights from a low height, which are quick to simulate.
fn recipe(seed: u64) -> Recipe {
    let (name, text) = flight::vehicles::mission::BUILTIN[0];
    let low = text.replace("height_m = 300.0", "height_m = 60.0");
    Recipe { seed, ..Recipe::from_texts((name, &low), dispersion::BUILTIN[2]).unwrap() }
}

fn open(out: &Path, recipe: &Recipe, build: &str) -> Result<Store, StoreError> {
    Store::open(out, recipe, Manifest::of(recipe, FLIGHTS, build))
}

/// How many flights were flown.
fn fly(recipe: &Recipe, jobs: usize, out: &Path) -> u64 {
    let store = open(out, recipe, "test").unwrap();
    let flown = threads(Some(jobs)).unwrap().install(|| run(recipe, &store, &|_| ()).unwrap().flown);
    store.publish().unwrap();
    flown
}

fn assert_same(one: &Path, two: &Path) {
    for file in ["flights.csv", "summary.json", "summary.md"] {
        assert!(fs::read(one.join(file)).unwrap() == fs::read(two.join(file)).unwrap(), "{file} differs");
    }
}

#[test]
fn the_results_do_not_depend_on_threads_or_a_stop() {
    let root = tempfile::tempdir().unwrap();
    let at = |name: &str| root.path().join(name);
    let recipe = recipe(1);
    assert_eq!(fly(&recipe, 1, &at("one")), FLIGHTS);
    assert_eq!(fly(&recipe, 3, &at("killed")), FLIGHTS);
    assert_same(&at("one"), &at("killed"));

    // As a killed campaign leaves it: some flights in the order in which they ended, and a part of
    // a line.
    let csv = fs::read_to_string(at("one").join("flights.csv")).unwrap();
    let lines: Vec<&str> = csv.split_inclusive('\n').collect();
    let cut = lines[4].trim_end();
    fs::write(at("killed").join("flights.csv"), [lines[0], lines[8], lines[3], cut].concat()).unwrap();
    assert_eq!(fly(&recipe, 2, &at("killed")), FLIGHTS - 2);
    assert_same(&at("one"), &at("killed"));
    assert_eq!(fly(&recipe, 2, &at("killed")), 0);

    read_them(&at("one"));
}

/// The formats that other programs read.
fn read_them(out: &Path) {
    let rows = csv::Reader::from_path(out.join("flights.csv")).unwrap().into_deserialize();
    let rows: Vec<Row> = rows.collect::<Result<_, _>>().unwrap();
    assert!(rows.iter().map(|row| row.number).eq(0..FLIGHTS));
    assert!(rows.iter().all(|row| row.touchdown_vertical_m_s.is_some_and(f64::is_finite)));
    let summary: serde_json::Value =
        serde_json::from_slice(&fs::read(out.join("summary.json")).unwrap()).unwrap();
    for word in Landing::COLUMNS {
        assert_eq!(summary[word]["of"], FLIGHTS, "{word}");
    }
}

#[test]
fn a_directory_of_another_campaign_or_in_use_is_refused_with_the_reason() {
    let root = tempfile::tempdir().unwrap();
    let own = recipe(1);
    let store = open(root.path(), &own, "test").unwrap();
    let again = open(root.path(), &own, "test").unwrap_err();
    assert!(matches!(again, StoreError::InUse { .. }), "{again}");
    drop(store);
    for (recipe, build, difference) in [
        (&recipe(2), "test", "its seed is 1, this run's is 2"),
        (&own, "other", "its build is \"test\", this run's is \"other\""),
    ] {
        let error = open(root.path(), recipe, build).unwrap_err().to_string();
        let holds = format!("{} holds other results: {difference}", root.path().display());
        assert_eq!(error, format!("{holds}; give another directory"));
    }
    let mut heavier = own.clone();
    heavier.mission_toml.push('\n');
    assert!(open(root.path(), &heavier, "test").is_err());
}

/// Rows with the columns of another program, and a flight beyond the campaign's last.
#[test]
fn rows_that_are_not_of_the_campaign_are_refused() {
    let root = tempfile::tempdir().unwrap();
    let own = recipe(1);
    let store = open(root.path(), &own, "test").unwrap();
    store.add(tally::fly(&own, 0).unwrap()).unwrap();
    drop(store);
    let path = root.path().join("flights.csv");
    let text = fs::read_to_string(&path).unwrap();
    for (wrong, why) in [
        (text.replacen("\n0,", "\n1000000,", 1), "flight 1000000, which is not of it"),
        (text.replacen("touchdown_", "contact_", 1), "the columns of another version"),
    ] {
        fs::write(&path, wrong).unwrap();
        let error = open(root.path(), &own, "test").unwrap_err().to_string();
        assert!(error.contains(why), "{error}");
    }
}

/// A directory with files of the same names from another program.
#[test]
fn files_that_no_campaign_wrote_are_never_overwritten() {
    for name in ["mission.toml", "flights.csv", "summary.md"] {
        let root = tempfile::tempdir().unwrap();
        let path = root.path().join(name);
        fs::write(&path, "notes").unwrap();
        let refused = open(root.path(), &recipe(1), "test");
        assert!(matches!(refused, Err(StoreError::Foreign(_))), "{name}");
        assert_eq!(fs::read_to_string(&path).unwrap(), "notes", "{name}");
    }
}
