//! Comparisons of two folders of logs.

use std::path::Path;

use sim::recipe::Recipe;
use tempfile::TempDir;

use crate::command_line::{data, replay, run};
use crate::from_apogee::fly_recipe;

const SEEDS: [u64; 6] = [1, 2, 3, 4, 5, 6];

/// Flights of these seeds, and how many of them stand.
fn folder(seeds: &[u64], fault: Option<&str>) -> (TempDir, usize) {
    let folder = tempfile::tempdir().unwrap();
    let mut stand = 0;
    for seed in seeds {
        let recipe = Recipe::built_in("mk3", "field").unwrap();
        let faults = fault.iter().map(|fault| fault.parse().unwrap()).collect();
        let flown = fly_recipe(&Recipe { seed: *seed, faults, ..recipe });
        stand += usize::from(flown.landed);
        std::fs::copy(&flown.log, folder.path().join(format!("{seed}.mcap"))).unwrap();
    }
    (folder, stand)
}

fn compared(first: &Path, second: &Path) -> (i32, serde_json::Value) {
    data(replay("compare", first).arg(second))
}

#[test]
fn sets_of_flights_are_paired_and_their_rates_compared() {
    let (healthy, stand) = folder(&SEEDS, None);
    let (broken, none) = folder(&SEEDS, Some("no-light@0"));
    assert!(stand == 6 && none == 0, "{stand} {none}");
    let (healthy, broken) = (healthy.path(), broken.path());
    let (code, found) = compared(healthy, healthy);
    assert_eq!((code, &found["paired"], &found["flips"]), (0, &6.into(), &serde_json::json!([])));
    let (code, found) = compared(healthy, broken);
    assert_eq!((code, &found["saved"], &found["lost"]), (3, &0.into(), &6.into()), "{found}");
    assert_eq!(found["sets"][0]["rate"][0], 1.0);
    // Flips to one side only, six of six: twice 2^-6.
    assert!((found["chance"].as_f64().unwrap() - 2.0 / 64.0).abs() < 1e-12, "{found}");
    assert_eq!(found["flips"][0]["flight"], "seed 1, flight 3");
    let (code, stdout, _) = run(replay("compare", healthy).arg(broken));
    for words in [
        "6 of 6 stand undamaged: 100.0 %",
        "saves 0 and loses 6: shows a difference",
        "LOST   seed 1, flight 3: STANDS",
    ] {
        assert!(code == 3 && stdout.contains(words), "{words}: {stdout}");
    }
    assert_eq!(compared(broken, healthy).0, 0, "what lands more often is not worse");
}

#[test]
fn a_flight_without_its_pair_and_a_log_without_a_verdict_are_named() {
    let (first, _) = folder(&SEEDS[..2], None);
    let (second, _) = folder(&SEEDS[1..3], None);
    std::fs::write(second.path().join("broken.mcap"), "no log").unwrap();
    let (code, stdout, _) = run(replay("compare", first.path()).arg(second.path()));
    for words in [": seed 1, flight 3\n", ": seed 3, flight 3\n", "/broken.mcap: ", "of 1 flights of both"] {
        assert!(code == 3 && stdout.contains(words), "{words}: {stdout}");
    }
    let (code, _, stderr) = run(replay("compare", first.path()).arg(&crate::from_apogee::LANDED.log));
    assert!(code == 1 && stderr.contains("is no folder, and "), "{stderr}");
}
