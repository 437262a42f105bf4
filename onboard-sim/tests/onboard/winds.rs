//! Winds over height: flown, recorded, and on every page that depends on the wind.
#![expect(clippy::unwrap_used, reason = "a test that cannot be set up fails")]

use std::f64::consts::FRAC_PI_2;
use std::path::PathBuf;
use std::process::{Command, Output};

use flight::vehicle::mission::StartPoint;
use flight::vehicles::winds;
use onboard_sim::hazard::{Case, fly};
use sim::recipe::Recipe;
use sim::sortie::Sortie;

fn file(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/onboard/soundings").join(name)
}

fn program(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_onboard-sim")).args(arguments).output().unwrap()
}

/// mk3 from its pad on a day of these levels, with nearly exact sensors and no scatter.
fn on_the_day(levels: &str) -> Recipe {
    let set = format!("winds_aloft = [{levels}]");
    let mk3 = flight::vehicles::mission::BUILTIN.iter().find(|(name, _)| *name == "mk3").unwrap();
    Recipe::from_texts(*mk3, ("a day", &set)).unwrap().starting_at(StartPoint::Pad).unwrap()
}

#[test]
fn a_parachute_drifts_with_the_wind_of_its_height_and_not_of_the_ground() {
    let drift_m = |levels: &str| {
        let impacts = fly(&on_the_day(levels), &[Case::AbortInAscent], 0).unwrap();
        impacts[0].place_m.unwrap()
    };
    // 8 m/s from the west, and below 40 m none.
    let [_, aloft_m] = drift_m("[0.0, 0.0, 270.0], [40.0, 0.0, 270.0], [60.0, 8.0, 270.0]");
    let [_, calm_m] = drift_m("[10.0, 0.0, 270.0]");
    // World y is west: it comes down farther east, by some 20 s of descent.
    assert!(aloft_m < calm_m - 60.0, "{aloft_m} {calm_m}");
}

#[test]
fn the_world_has_the_wind_of_the_table() {
    let flight = Sortie::new(&on_the_day("[10.0, 4.0, 270.0], [210.0, 8.0, 360.0]"), 3).unwrap();
    let [north_m_s, west_m_s] = [0, 1].map(|axis: usize| flight.world().wind().mean_m_s(110.0)[axis]);
    assert!((north_m_s + 4.0).abs() < 1e-9 && (west_m_s + 2.0).abs() < 1e-9, "{north_m_s} {west_m_s}");
    let truth = flight.world().truth();
    assert!((truth.wind_m_s - 4.0).abs() < 1e-12 && (truth.wind_towards_rad + FRAC_PI_2).abs() < 1e-6);
}

#[test]
fn every_made_up_sounding_is_read() {
    for (name, levels, lowest) in [
        ("light.txt", 8, [10.0, 4.0 * 1852.0 / 3600.0, 200.0]),
        ("low-level-jet.txt", 8, [10.0, 3.0 * 1852.0 / 3600.0, 190.0]),
        ("front.txt", 8, [10.0, 14.0 * 1852.0 / 3600.0, 320.0]),
        ("tower.csv", 4, [2.0, 3.1, 250.0]),
    ] {
        let found = winds::read(&std::fs::read_to_string(file(name)).unwrap()).unwrap();
        let off: f64 = found[0].iter().zip(lowest).map(|(one, other): (&f64, f64)| (one - other).abs()).sum();
        assert!(found.len() == levels && off < 1e-9, "{name} {found:?}");
    }
}

#[test]
fn a_flight_in_winds_aloft_is_recorded_with_them() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("flight.mcap");
    let (winds, log) = (file("front.txt"), log.to_str().unwrap());
    let arguments = ["fly", "--speed", "max", "--log", log, "--winds", winds.to_str().unwrap()];
    let flown = program(&arguments);
    assert!(flown.status.code().is_some_and(|code| code < 2), "{flown:?}");
    let text = String::from_utf8_lossy(&std::fs::read(log).unwrap()).into_owned();
    assert!(text.contains("winds_aloft = [[10.0, 7.20"), "the header of the log has the levels");
}

#[test]
fn a_file_without_units_is_refused_by_every_command() {
    let folder = tempfile::tempdir().unwrap();
    let bad = folder.path().join("bad.csv");
    std::fs::write(&bad, "height_m,speed,from_deg\n10,4,270\n").unwrap();
    let (bad, out) = (bad.to_str().unwrap(), folder.path().join("out"));
    let out = out.to_str().unwrap();
    for command in
        [&["fly"][..], &["campaign", "--out", out], &["hazard"], &["card", "--out", out], &["check", "mk3"]]
    {
        let refused = program(&[command, &["--winds", bad]].concat());
        let words = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert!(!refused.status.success() && words.contains("bad.csv"), "{command:?} {words}");
        assert!(words.contains("speed is ''; a unit of m/s, km/h, kn"), "{command:?} {words}");
    }
    let refused = program(&["hazard", "--winds", bad, "--wind", "3"]);
    assert!(String::from_utf8_lossy(&refused.stderr).contains("cannot be used with"), "{refused:?}");
}

#[test]
fn the_check_states_which_winds_it_used() {
    let winds = file("low-level-jet.txt");
    let page = program(&["check", "mk3", "--flights", "0", "--winds", winds.to_str().unwrap()]);
    let page = String::from_utf8_lossy(&page.stdout).into_owned();
    let words = "Wind: 1.5 m/s from 190° at 10 m; levels: 8, 10 to 4500 m above the pad; below and above, the wind of the \
                 nearest level";
    assert!(page.contains(words), "{page}");
    let page = program(&["check", "mk3", "--flights", "0"]);
    assert!(String::from_utf8_lossy(&page.stdout).contains("Wind: power law from the mean wind at 10 m"));
}
