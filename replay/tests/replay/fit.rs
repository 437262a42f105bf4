//! Tests fits of flight logs, through the command and the library.

use std::io::Cursor;
use std::path::Path;
use std::process::Command;
use std::sync::LazyLock;

use proptest::prelude::*;
use replay::cli::Answer as _;
use replay::fit::{Fit, Trace, fit};
use replay::log::{FlightLog, Recording};
use sim::draw::draw;
use sim::recipe::Recipe;

use crate::command_line::run;
use crate::from_apogee::LANDED;
use crate::simulated::MK2;

fn run_fit(arguments: &[&str]) -> (i32, String, String) {
    run(Command::new(env!("CARGO_BIN_EXE_replay")).arg("fit").args(arguments))
}

fn fits(arguments: &[&str]) -> (Vec<Fit>, serde_json::Value) {
    let (code, stdout, stderr) = run_fit(&[arguments, ["--json"].as_slice()].concat());
    assert_eq!(code, 0, "{stderr}");
    let answer: serde_json::Value = serde_json::from_str(&stdout).unwrap();
    (serde_json::from_value(answer["fits"].clone()).unwrap(), answer)
}

fn close(fit: &Fit, name: &str, truth: f64, bar: f64) {
    let found = fit.get(name).unwrap_or_else(|| panic!("{name} in {:?}", fit.not_found));
    assert!((found.value - truth).abs() <= bar, "{name}: {found:?}, truth {truth}");
    assert!(found.low < found.value && found.value < found.high, "{found:?}");
}

#[test]
fn val_simulation_a_field_flight_is_fitted_within_its_intervals() {
    // Of the flights of seeds 1 to 10, the one in which the gimbal moves most: the standard
    // deviation of its gain is 0.009; in others it is up to 0.025, above the bar of 0.02.
    let recipe = Recipe { seed: 4, ..Recipe::built_in("mk2", "field").unwrap() };
    let truth = draw(&recipe.mission, &recipe.dispersion, 4, 3).truth;
    let flown = crate::from_apogee::fly_recipe(&recipe);
    let (found, _) = fits(&[flown.log.to_str().unwrap()]);
    let fit = &found[0];
    let (sin, cos) = libm::sincos(truth.wind_towards_rad);
    for (name, truth, bar) in [
        ("thrust_scale", truth.impulse_scale / truth.mass_scale, 0.01),
        ("burn_time_scale", truth.burn_time_scale, 0.01),
        ("drag_per_mass_scale", truth.drag_scale / truth.mass_scale, 0.03),
        ("ignition_delay", truth.ignition_delay_s, 0.005),
        ("gimbal_delay", 0.020, 0.005),
        ("gimbal_gain", 1.0, 0.02),
        ("wind_x", truth.wind_m_s * cos, 1.0),
        ("wind_y", truth.wind_m_s * sin, 1.0),
    ] {
        close(fit, name, truth, bar);
    }
    // A plan that leans around turns the gimbal steadily: the play may not show.
    match fit.not_found.iter().find(|lack| lack.name == "gimbal_play") {
        Some(lack) => assert_eq!(lack.reason, "its commands changed too little"),
        None => close(fit, "gimbal_play", 0.5, 0.1),
    }
    assert!(fit.not_found.iter().any(|lack| lack.name == "mass"), "{:?}", fit.not_found);
}

/// A broken part is reported with the reason, and the rest is found: a motor that was fired
/// and gives no thrust; a servo that stays at 3.7 degrees, whatever is commanded; a motor that goes
/// out after two seconds.
#[test]
fn a_broken_part_is_reported_with_its_reason_and_the_rest_is_found() {
    let (dark, not_its_model, not_its_curve) = (
        "no thrust was seen after the igniter was fired",
        "the gimbal is not its model: with any delay, rate and play its feedback stays ",
        "the thrust is not its curve's, however that is scaled: ",
    );
    let gimbal = ["gimbal_delay", "gimbal_gain", "gimbal_play"];
    for (fault, lacks, reason, found) in [
        ("no-light@0", &["thrust_scale"][..], dark, "drag_per_mass_scale"),
        ("gimbal-jams:3.7@ignition", &gimbal, not_its_model, "thrust_scale"),
        ("early-burnout:2@0", &["thrust_scale"], not_its_curve, "drag_per_mass_scale"),
    ] {
        let fit = fit(&trace(&crate::from_apogee::fly(&[fault]).log));
        for name in lacks {
            let lack = fit.not_found.iter().find(|lack| lack.name == *name).unwrap();
            assert!(lack.reason.starts_with(reason) && fit.get(name).is_none(), "{fault}: {lack:?}");
        }
        assert!(fit.get(found).is_some(), "{fault}: {:?}", fit.not_found);
    }
}

/// The frames are 5 ms apart, and nothing that is found lies on them.
#[test]
fn no_delay_lies_on_the_grid_of_the_frames() {
    let fit = fit(&TRACE);
    let found = fit.get("ignition_delay").unwrap();
    for end_s in [found.value, found.low, found.high] {
        let frames = end_s / 0.005;
        assert!((frames - frames.round()).abs() > 1e-3, "{found:?}");
    }
}

#[test]
fn intervals_state_on_how_many_flights_they_were_calibrated() {
    let flown = fit(&TRACE);
    let calibration = flown.calibration.as_ref().unwrap();
    assert!(calibration.own && calibration.vehicles == ["mk2"] && calibration.flights >= 100, "{flown:?}");
    assert!(flown.sentences()[1].starts_with("95 % intervals, calibrated on "), "{flown:?}");
    assert!(flown.get("thrust_scale").unwrap().systematic.is_some());
    // The same flight of a vehicle without calibration: the widest of the others', and it is
    // stated.
    let mission = flight::vehicle::mission::Mission { name: "ours".to_owned(), ..TRACE.mission.clone() };
    let ours = fit(&Trace { mission, ..TRACE.clone() });
    assert!(!ours.calibration.as_ref().unwrap().own);
    for name in ["thrust_scale", "drag_per_mass_scale", "wind_x"] {
        let [narrow, wide] = [&flown, &ours].map(|fit| fit.get(name).unwrap().sigma);
        assert!(wide >= narrow, "{name}: {wide} {narrow}");
    }
}

#[test]
fn val_simulation_the_gimbals_feedback_shows_its_delay_and_rate() {
    let fit = fit(&trace(&MK2.log));
    close(&fit, "gimbal_delay", 0.020, 0.001);
    close(&fit, "gimbal_rate", 250.0, 10.0);
}

#[test]
fn what_was_found_goes_into_the_missions_file() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("ours.toml");
    let log = LANDED.log.to_str().unwrap();
    let write = ["--out", path.to_str().unwrap()];
    // Without a file, the flown mission; then that file again, which has got heavier and a remark.
    let (found, _) = fits(&[[log].as_slice(), &write].concat());
    let text = std::fs::read_to_string(&path).unwrap();
    let mission = flight::vehicles::mission::from_toml(&text, "ours").unwrap();
    let delay = found[0].get("gimbal_delay").unwrap();
    assert!((mission.airframe.gimbal.servo.delay_s - delay.value).abs() < 0.01 * delay.sigma);
    let line = text.lines().find(|line| line.starts_with("delay_s = ")).unwrap();
    let stem = LANDED.log.file_stem().unwrap().to_str().unwrap();
    assert!(line.contains(&format!(" # flight {stem}, ")) && line.ends_with(" (was 0.02)"), "{line}");
    let loaded_kg = mission.airframe.mass.loaded_kg;
    let heavier = text.replace(&format!("loaded_kg = {loaded_kg:?}"), "# weighed\nloaded_kg = 3.3");
    assert_ne!(heavier, text);
    std::fs::write(&path, &heavier).unwrap();
    fits(&[[log].as_slice(), &write].concat());
    let again = std::fs::read_to_string(&path).unwrap();
    let heavy = flight::vehicles::mission::from_toml(&again, "ours").unwrap();
    assert!(again.contains("# weighed\nloaded_kg = 3.3\n"), "{again}");
    // Drag is per mass: as much more of it.
    let [before, after] = [mission, heavy]
        .map(|mission| mission.airframe.body.axial_drag_coefficient / mission.airframe.mass.loaded_kg);
    assert!((after / before - 1.0).abs() < 1e-3, "{before} {after}");
    // Another vehicle's file stays as it is.
    std::fs::write(&path, heavier.replace("name = \"mk2\"", "name = \"other\"")).unwrap();
    let (code, _, stderr) = run_fit(&[[log].as_slice(), &write].concat());
    assert!(code == 1 && stderr.contains("is the mission of other, and the log is of mk2"), "{stderr}");
}

#[test]
fn several_logs_are_put_together_and_a_bad_one_does_not_hide_the_others() {
    let (landed, mk2) = (LANDED.log.to_str().unwrap(), MK2.log.to_str().unwrap());
    let (found, answer) = fits(&[landed, mk2]);
    let together = answer["together"].as_array().unwrap();
    let delay = together.iter().find(|one| one["mean"]["name"] == "gimbal_delay").unwrap();
    assert_eq!((found.len(), &delay["flights"]), (2, &2.into()));
    let (code, stdout, stderr) = run_fit(&[landed, "none.mcap"]);
    assert!(code == 5 && stdout.contains("thrust_scale") && stderr.contains("none.mcap: cannot"), "{stderr}");
}

/// Two vehicles have no drag in common.
#[test]
fn flights_of_different_missions_are_not_put_together() {
    let other = crate::simulated::simulate_recipe(Recipe::built_in("mk3", "field").unwrap(), &[]);
    let files = [LANDED.log.to_str().unwrap(), other.log.to_str().unwrap()];
    let (found, answer) = fits(&files);
    assert!(found.len() == 2 && answer["together"].as_array().unwrap().is_empty(), "{answer}");
    let (_, stdout, _) = run_fit(&files);
    assert!(stdout.ends_with("not put together: these are flights of mk2 and mk3\n"), "{stdout}");
}

#[test]
fn a_stands_table_needs_its_motor() {
    let directory = tempfile::tempdir().unwrap();
    let table = directory.path().join("burn.csv");
    let curve = flight::vehicles::motors::builtin("H45W").unwrap();
    let rows = (0..3500).map(|row| f64::from(row) * 2e-3);
    let rows = rows.map(|time_s| format!("{time_s},{}\n", 0.97 * curve.thrust_at_n(time_s - 0.12)));
    std::fs::write(&table, format!("time_s,thrust_n\n{}", rows.collect::<String>())).unwrap();
    let table = table.to_str().unwrap();
    let (found, _) = fits(&[table, "--motor", "H45W"]);
    close(&found[0], "thrust_scale", 0.97, 0.005);
    close(&found[0], "ignition_delay", 0.12, 0.002);
    for (arguments, words) in [
        (&[table][..], "--motor is missing"),
        (&[LANDED.log.to_str().unwrap(), "--motor", "H45W"], "--motor H45W: only a table of a test stand"),
        (&[table, "--motor", "G99"], "is neither a built-in motor"),
    ] {
        let (code, _, stderr) = run_fit(arguments);
        assert!(code == 1 && stderr.contains(words), "{stderr}");
    }
}

/// The log of a flight, for damage.
static BYTES: LazyLock<Vec<u8>> = LazyLock::new(|| std::fs::read(&LANDED.log).unwrap());

/// Frames of a flight without the rest of its log, for cuts and losses.
fn trace(log: &Path) -> Trace {
    Trace::of(&Recording::open(log).unwrap()).unwrap()
}

static TRACE: LazyLock<Trace> = LazyLock::new(|| trace(&LANDED.log));

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn no_damage_to_a_log_panics(at in 0.0..1.0_f64, bit in 0..8_u8, cut in 0.0..1.0_f64) {
        let mut bytes = BYTES[..(cut * BYTES.len() as f64) as usize].to_vec();
        let place = (at * bytes.len() as f64) as usize;
        if let Some(byte) = bytes.get_mut(place) {
            *byte ^= 1 << bit;
        }
        if let Ok(mut log) = FlightLog::read("test.mcap".to_owned(), Cursor::new(bytes))
            && let Ok(recording) = Recording::read(&mut log)
            && let Ok(trace) = Trace::of(&recording)
        {
            prop_assert!(fit(&trace).found.iter().all(|found| found.value.is_finite()));
        }
    }

    #[test]
    fn lost_frames_and_wild_numbers_do_not_panic(
        from in 0.0..1.0_f64,
        lost in 0..2000_usize,
        wild in -1e9..1e9_f64,
        at in 0.0..1.0_f64,
    ) {
        let mut trace = TRACE.clone();
        let place = |share: f64, length: usize| (share * length as f64) as usize;
        let first = place(from, trace.frames.len());
        let last = (first + lost).min(trace.frames.len());
        trace.frames.drain(first..last);
        let at = place(at, trace.frames.len());
        if let Some(frame) = trace.frames.get_mut(at) {
            frame.measured.imu.specific_force_m_s2.x = wild;
            frame.gimbal_rad[0] = wild;
        }
        prop_assert!(fit(&trace).found.iter().all(|found| found.value.is_finite()));
    }
}
