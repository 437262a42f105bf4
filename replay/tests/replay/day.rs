//! What flights so far tell of the next one, through the command.

use std::path::Path;
use std::process::Command;

use flight::vehicle::mission::Mission;
use flight::vehicles::mission::BUILTIN;
use sim::dispersion::Dispersion;
use sim::recipe::Recipe;

use crate::command_line::run;
use crate::from_apogee::{LANDED, fly_recipe};

fn learn(arguments: &[&str]) -> (i32, String, String) {
    let few = ["--flights", "6", "--jobs", "2"];
    run(Command::new(env!("CARGO_BIN_EXE_replay")).arg("fit").args(arguments).args(few))
}

/// A fit of one burn, as `replay fit --json` writes it.
fn fits(path: &Path, thrusts: &[f64]) {
    let parameter = |name: &str, value: f64| {
        serde_json::json!({
            "name": name, "unit": "", "value": value, "sigma": 0.002, "low": value - 0.004, "high": value + 0.004,
        })
    };
    let mission = flight::vehicles::mission::builtin("mk2").unwrap().unwrap();
    let basis = serde_json::to_value(replay::fit::Basis::of(&mission)).unwrap();
    let fit = |(place, thrust): (usize, &f64)| {
        serde_json::json!({
            "basis": basis, "source": format!("flight {place}"), "mission": "mk2", "motor": "H45W", "not_found": [], "damage": null,
            "found": [parameter("thrust_scale", *thrust), parameter("burn_time_scale", 1.0),
                      parameter("ignition_delay", 0.16), parameter("drag_per_mass_scale", 1.02)],
        })
    };
    let all: Vec<_> = thrusts.iter().enumerate().map(fit).collect();
    std::fs::write(path, serde_json::json!({ "fits": all, "together": [] }).to_string()).unwrap();
}

#[test]
fn five_burns_become_a_day_that_the_campaigns_readers_take() {
    let directory = tempfile::tempdir().unwrap();
    let (file, out) = (directory.path().join("fits.json"), directory.path().join("day"));
    fits(&file, &[1.01, 1.02, 0.99, 1.00, 1.03]);
    let arguments = [file.to_str().unwrap(), "--mission", "mk2", "--json", "--day", out.to_str().unwrap()];
    let (code, stdout, stderr) = learn(&arguments);
    let answer: serde_json::Value = serde_json::from_str(&stdout).unwrap();
    let answer = &answer["day"];
    assert_eq!(code, 3 * i32::from(answer["go"] != true), "{stderr}");
    let thrust = &answer["lots"][0];
    // The prior's 1 counts as one more burn.
    assert!((thrust["mean"].as_f64().unwrap() - 6.05 / 6.0).abs() < 1e-12, "{thrust}");
    assert!(thrust["next_sigma"].as_f64() < thrust["prior_sigma"].as_f64(), "{thrust}");
    let mission_of = |text: &str| flight::vehicles::mission::from_toml(text, "day").unwrap();
    let text = |name: &str| std::fs::read_to_string(out.join(name)).unwrap();
    let (mission, built_in) = (mission_of(&text("mission.toml")), mission_of(BUILTIN[0].1));
    let impulse = |mission: &Mission| mission.motor_curve.total_impulse_n_s();
    assert!((impulse(&mission) / impulse(&built_in) - 6.05 / 6.0).abs() < 1e-9);
    // What is known of the motors stands in one place.
    let (set, real) = (Dispersion::from_toml(&text("dispersion.toml"), "day"), Dispersion::builtin("real"));
    let (set, real) = (set.unwrap(), real.unwrap());
    assert!((set.impulse_share - real.impulse_share).abs() < 1e-12 && set.sensors, "{set:?}");
    assert!(text("dispersion.toml").contains("# flight 3\n"));
    let lot = mission.lot.as_ref().unwrap();
    assert_eq!((lot.name.as_str(), lot.burns, mission.motor_burns()), ("H45W", 5, 5));
    assert!((lot.impulse.mean - 1.01).abs() < 1e-12 && (lot.impulse.scatter - 0.015_811).abs() < 1e-6);
    assert!(mission.motor.impulse_sigma < built_in.motor.impulse_sigma);
    // The table can be pasted.
    let pasted = format!("{}\n{}", BUILTIN[0].1, answer["lot_toml"].as_str().unwrap());
    assert_eq!(mission_of(&pasted).motor_curve, mission.motor_curve);
    // With the day's mission the same burns are learnt again, not on top of it.
    let again = directory.path().join("again");
    let day = [out.join("mission.toml"), again.clone()];
    let [mission_file, again_out] = day.each_ref().map(|path| path.to_str().unwrap());
    assert!(learn(&[arguments[0], "--mission", mission_file, "--day", again_out]).0 != 1);
    let learnt = mission_of(&std::fs::read_to_string(again.join("mission.toml")).unwrap());
    assert!((impulse(&learnt) / impulse(&mission) - 1.0).abs() < 1e-12);
    // The same question again gives the same answer, and replaces nothing.
    assert_eq!(learn(&arguments).1, stdout);
    assert!(out.with_file_name("day-2").join("mission.toml").is_file());
    assert_eq!(learn(&arguments[..4]).1, stdout);
}

#[test]
fn a_log_brings_its_mission_and_its_answer_ends_in_a_word() {
    let (code, stdout, stderr) = learn(&[LANDED.log.to_str().unwrap()]);
    assert!(code != 1, "{stderr}");
    assert!(stdout.ends_with(if code == 0 { "\nGO\n" } else { "\nNO-GO\n" }), "{stdout}");
    // The default prior is `real`, not the most benign one.
    assert!(
        stdout.contains("prior real\n") && stdout.contains("6 simulated flights in real landed\n"),
        "{stdout}"
    );
    let asked = [LANDED.log.to_str().unwrap(), "--prior", "field", "--limit", "0.01"];
    let (code, stdout, stderr) = learn(&asked);
    assert!(
        code == 0 && stdout.ends_with("\nGO in field only, which may be kinder than real\n"),
        "{stdout}{stderr}"
    );
}

/// Eleven crashes speak against any rate that a club wants, whatever is simulated; and one log is
/// one flight.
#[test]
fn flights_that_did_not_land_are_no_go_and_one_log_counts_once() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("fits.json");
    fits(&path, &[1.0; 11]);
    let mut all: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap();
    for fit in all["fits"].as_array_mut().unwrap() {
        fit["landed"] = false.into();
    }
    std::fs::write(&path, all.to_string()).unwrap();
    let asked = [path.to_str().unwrap(), "--mission", "mk2", "--prior", "field", "--limit", "0.5"];
    let (code, stdout, stderr) = learn(&asked);
    assert!(code == 3 && stdout.contains("flown     0 of 11 landed"), "{stdout}{stderr}");

    let log = LANDED.log.to_str().unwrap();
    let again = directory.path().join("again.mcap");
    std::fs::copy(log, &again).unwrap();
    let (_, stdout, stderr) = learn(&[log, again.to_str().unwrap(), log]);
    assert!(stdout.contains("flown     1 of 1 landed") && stdout.contains("after 1 fit,"), "{stdout}");
    assert_eq!(stderr.matches("is the same as").count(), 2, "{stderr}");
}

#[test]
fn what_cannot_be_learnt_is_refused_with_the_reason() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("fits.json");
    fits(&file, &[1.0]);
    let file = file.to_str().unwrap();
    let [broken, nothing] = ["broken.json", "nothing.json"].map(|name| directory.path().join(name));
    std::fs::write(&broken, "{}").unwrap();
    fits(&nothing, &[]);
    let [broken, nothing] = [&broken, &nothing].map(|path| path.to_str().unwrap());
    for (arguments, words) in [
        (&[file][..], "--mission is missing"),
        (&[file, "--mission", "mk2", "--limit", "95"], "--limit 95: must be 0 to 1"),
        (&[file, "--mission", "mk9"], "'mk9' is neither a built-in mission"),
        (&[broken, "--mission", "mk2"], "is no answer of `replay fit --json`"),
        (&[nothing, "--mission", "mk2"], "no burn was found in 0 fits"),
    ] {
        let (code, _, stderr) = learn(arguments);
        assert!(code == 1 && stderr.contains(words), "{stderr}");
    }
}

/// A log whose accelerometer is broken, or whose computer was restarted, beside healthy ones: its
/// burn is not found, with the reason and the log, and the lot is that of the healthy logs.
#[test]
fn a_burn_of_a_broken_sensor_is_not_found_and_leaves_the_lot_as_it_is() {
    let fly = |seed, faults: &[&str]| {
        let recipe = Recipe::built_in("mk3", "field").unwrap();
        let faults = faults.iter().map(|fault| fault.parse().unwrap()).collect();
        fly_recipe(&Recipe { faults, seed, ..recipe })
    };
    let healthy: Vec<_> = (11..15).map(|seed| fly(seed, &[])).collect();
    let logs: Vec<&str> = healthy.iter().map(|flown| flown.log.to_str().unwrap()).collect();
    // Fitted once: the answer stands for the logs.
    let directory = tempfile::tempdir().unwrap();
    let fitted = directory.path().join("healthy.json");
    let (_, stdout, stderr) = learn(&[&logs[..], &["--prior", "field", "--json"]].concat());
    assert!(!stdout.is_empty(), "{stderr}");
    std::fs::write(&fitted, stdout).unwrap();
    let lot = |logs: &[&str]| {
        let (_, stdout, stderr) =
            learn(&[logs, &["--mission", "mk3", "--prior", "field", "--json"]].concat());
        let answer: serde_json::Value = serde_json::from_str(&stdout).unwrap_or_else(|_| panic!("{stderr}"));
        answer["day"]["lots"].clone()
    };
    let fitted = fitted.to_str().unwrap();
    let expected = lot(&[fitted]);
    assert!(expected[0]["burns"].as_u64().unwrap() >= 3, "{expected}");
    for (fault, reason) in [
        ("accelerometer-stuck@powered+1", "the accelerometer repeats one sample from T+"),
        ("accelerometer-bias:300@powered", "the accelerometer contradicts the "),
        ("accelerometer-scale:1.2@powered", "the accelerometer contradicts the "),
        ("reboot:0.3@powered", " s of frames are missing from T+"),
    ] {
        let sick = fly(15, &[fault]);
        let logs = [fitted, sick.log.to_str().unwrap()];
        assert_eq!(lot(&logs), expected, "{fault}");
        let (_, stdout, _) = learn(&[&logs[..], &["--prior", "field"]].concat());
        let of_log = format!("  {}: ", logs[1]);
        let is_line = |line: &&str| line.starts_with(&of_log) && line.contains("thrust_scale");
        let line = stdout.lines().find(is_line).unwrap_or_else(|| panic!("{stdout}"));
        assert!(line.contains("burn_time_scale") && line.contains(reason), "{fault}: {line}");
    }
}

/// A burn that no sensor contradicts and that is not of the lot: it has no weight, and no GO is
/// given beside it.
#[test]
fn a_distant_burn_has_no_weight_and_there_is_no_go_beside_it() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("fits.json");
    fits(&path, &[1.0, 1.01, 0.99, 1.5]);
    let asked = [path.to_str().unwrap(), "--mission", "mk2", "--prior", "field", "--limit", "0.01"];
    let (code, stdout, stderr) = learn(&asked);
    assert!(
        code == 3
            && stdout.ends_with(
                "\nNO-GO as long as flight 3 is here: its burn is not of this lot, or its log is faulty\n"
            ),
        "{stdout}{stderr}"
    );
    let lot = stdout.lines().rfind(|line| line.starts_with("  thrust_scale")).unwrap();
    assert!(lot.contains("     3    1.0000"), "{lot}");
    // What makes a mission of it impossible is named.
    let mut all: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap();
    all["fits"][0]["basis"]["impulse_n_s"] = 0.into();
    std::fs::write(&path, all.to_string()).unwrap();
    let (code, _, stderr) = learn(&asked);
    assert!(
        code == 1 && stderr.contains("flight 0: basis.impulse_n_s and basis.burn_time_s must be above 0"),
        "{stderr}"
    );
}
