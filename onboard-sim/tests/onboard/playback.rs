//! Recorded sensors of a real flight, played to the flight computer: `../recorded/SOURCE.md`.
#![expect(clippy::unwrap_used, reason = "a test that cannot be set up fails")]

use std::path::Path;
use std::process::{Command, Output};

use flight::vehicle::mission::StartPoint;
use onboard_sim::playback::{CLIMB_MAX_M_S, Played, applies, play, sensor_file};
use protocol::log::record::Record;
use sim::recipe::Recipe;

const HEDY: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/recorded/hedy.csv.zst");
/// From the source: lift-off in the file, s; apogee after it, s, and above the pad, m; burn time,
/// s.
const LIFT_OFF_S: f64 = 20.0;
const APOGEE_S: f64 = 34.2;
const APOGEE_M: f64 = 5_234.0;
const BURN_TIME_S: f64 = 8.0;

fn mk3() -> Recipe {
    let recipe = Recipe::built_in("mk3", "none").unwrap().starting_at(StartPoint::Pad).unwrap();
    recipe.ascending_for(BURN_TIME_S).unwrap()
}

fn played(recipe: &Recipe, log: impl FnMut(Record, u64)) -> Played {
    let file = zstd::Decoder::new(std::fs::File::open(HEDY).unwrap()).unwrap();
    let recorded = sensor_file::read(file, None, "+x,+y,+z".parse().unwrap()).unwrap();
    assert_eq!(recorded.frames.len(), 11_439);
    play(&recorded.frames, &recipe.mission, log)
}

#[test]
fn val_rocketpy_hedy_the_computer_recognises_a_real_flight() {
    let (mut starts, mut frames, mut estimates) = (0, 0, 0);
    let played = played(&mk3(), |record, _| match record {
        Record::ComputerStart(_) => starts += 1,
        Record::ComputerFrame(_) => frames += 1,
        Record::Estimate(_) => estimates += 1,
        _ => {}
    });
    let at = |name: &str| played.moment(name).unwrap_or_else(|| panic!("no {name}")).clone();
    let (lift_off, apogee) = (at("lift-off"), at("apogee"));
    assert!((lift_off.recording_s - LIFT_OFF_S).abs() <= 0.25, "{lift_off:?}");
    assert!((apogee.recording_s - LIFT_OFF_S - APOGEE_S).abs() <= 1.5, "{apogee:?}");
    assert!((apogee.height_m / APOGEE_M - 1.0).abs() <= 0.03, "{apogee:?}");
    let burnout = at("burnout");
    assert!((burnout.flight_s - BURN_TIME_S).abs() < 1.0, "{burnout:?}");
    for fired in [at("separation"), at("parachute")] {
        assert!(fired.climb_m_s <= CLIMB_MAX_M_S && !fired.too_fast, "{fired:?}");
    }
    for never in ["ascent igniter", "landing igniter"] {
        assert_eq!(played.moment(never), None);
    }
    assert_eq!((played.restarts, played.aids.imu.refused), (0, 0));
    assert!(played.moments.iter().all(|moment| moment.height_m.is_finite() && moment.climb_m_s.is_finite()));
    assert_eq!(
        (starts, frames, frames - estimates),
        (2, 11_439, (lift_off.recording_s * 200.0).round() as i32)
    );
}

/// The file has neither satellites nor a lidar. An arming check that is renamed would no longer
/// apply.
#[test]
fn arming_checks_name_what_the_recording_lacks() {
    let played = played(&mk3(), |_, _| {});
    assert_eq!(played.checked_s, 10);
    let refusals = |name: &str| {
        let (_, refusals) = played.checks.iter().find(|(check, _)| *check == name).unwrap();
        (refusals.len(), refusals.first().map(ToString::to_string).unwrap_or_default())
    };
    assert_eq!(refusals("GNSS"), (10, "no GNSS fix for 19.0 s".to_owned()));
    assert_eq!(refusals("lidar").0, 10);
    assert_eq!(refusals("barometer"), (0, String::new()));
    assert_eq!(played.checks.iter().filter(|(name, _)| applies(name)).count(), 9);
}

/// A computer that is reset in the air takes itself for one on its pad.
#[test]
fn a_computer_that_is_switched_on_in_a_fall_cannot_be_armed() {
    let file = zstd::Decoder::new(std::fs::File::open(HEDY).unwrap()).unwrap();
    let recorded = sensor_file::read(file, None, "+x,+y,+z".parse().unwrap()).unwrap();
    let coasts = &recorded.frames[(200.0 * (LIFT_OFF_S + 12.0)) as usize..];
    let mut texts = Vec::new();
    play(coasts, &mk3().mission, |record, _| {
        if let Record::Event(event) = record {
            texts.push(event.message);
        }
    });
    let latched = |text: &String| text.contains("switched on while it moves: it cannot be armed");
    assert_eq!(texts.iter().filter(|text| latched(text)).count(), 1, "{texts:?}");
}

#[test]
fn a_mission_without_an_ascent_motor_has_no_burn_time() {
    let error = Recipe::built_in("vlr", "none").unwrap().ascending_for(3.0).unwrap_err();
    assert!(error.to_string().contains("no section `launch`"), "{error}");
    let stretched = mk3().mission.launch.unwrap().booster.motor_curve;
    assert!((stretched.burn_time_s() - BURN_TIME_S).abs() < 1e-9, "{}", stretched.burn_time_s());
}

fn playback(folder: &Path, arguments: &[&str]) -> Output {
    let mut program = Command::new(env!("CARGO_BIN_EXE_onboard-sim"));
    program.arg("playback").args(arguments).current_dir(folder).output().unwrap()
}

#[test]
fn the_command_prints_the_flight_and_writes_its_log() {
    let folder = tempfile::tempdir().unwrap();
    let ended = playback(folder.path(), &[HEDY, "--burn-time", "8", "--out", "hedy.mcap"]);
    let (out, error) = (String::from_utf8_lossy(&ended.stdout), String::from_utf8_lossy(&ended.stderr));
    assert_eq!(ended.status.code(), Some(0), "{out}{error}");
    for words in [
        "OVERRIDE: the ascent motor burns for 8 s",
        "REFUSES 10 of 10 s  no GNSS fix",
        "\napogee ",
        "log hedy.mcap",
    ] {
        assert!(out.contains(words), "{words}: {out}");
    }
    assert!(!out.contains("TOO FAST") && !out.contains("NaN"), "{out}");
    assert!(folder.path().join("hedy.mcap").exists());
}

/// With the board on its side the accelerometer measures no push along the nose: no lift-off, and
/// no answer.
#[test]
fn wrong_axes_are_noticed() {
    let folder = tempfile::tempdir().unwrap();
    let ended = playback(folder.path(), &[HEDY, "--axes", "-y,+x,+z", "--burn-time", "8"]);
    let out = String::from_utf8_lossy(&ended.stdout);
    assert!(out.contains("NO LIFT-OFF: check --axes"), "{out}");
    assert_eq!(ended.status.code(), Some(5));
    for (arguments, reason) in [
        ([HEDY, "--axes", "+x,+y,-z"], "right-handed"),
        ([HEDY, "--mission", "vlr"], "a section `launch`"),
        ([HEDY, "--burn-time", "0"], "0.1 to 60 s"),
        (["none.csv", "--mission", "mk3"], "none.csv: cannot be read"),
    ] {
        let ended = playback(folder.path(), &arguments);
        let error = String::from_utf8_lossy(&ended.stderr);
        assert!(!ended.status.success() && error.contains(reason), "{error}");
    }
}
