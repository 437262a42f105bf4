//! Logs with flipped bits, killed recorders and other CPUs.

use std::path::Path;

use e2e::{
    Ended, Program, Running, Signal, auto_ground, expect_landing, program, rewrite_log, ticks_of, vehicle,
};
use prost::Message as _;

/// Hides the instructions by which glibc chooses its mathematical functions.
const OTHER_CPU: (&str, &str) = ("GLIBC_TUNABLES", "glibc.cpu.hwcaps=-FMA,-AVX2,-FMA4");

fn fly(folder: &Path, log: &str, environment: Option<(&str, &str)>) -> Ended {
    let mut command = program(Program::OnboardSim);
    command
        .args(["fly", "--profile", "paper-dispersed", "--seed", "3", "--speed", "max", "--log", log])
        .current_dir(folder)
        .envs(environment);
    Running::to_end(&mut command)
}

fn verify(log: &Path, environment: Option<(&str, &str)>) -> Ended {
    Running::to_end(program(Program::Replay).arg("verify").arg(log).envs(environment))
}

#[test]
fn the_same_flight_on_another_cpu_is_identical_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    let here = fly(folder.path(), "here.mcap", None);
    let there = fly(folder.path(), "there.mcap", Some(OTHER_CPU));
    assert_eq!((here.code, there.code), (Some(0), Some(0)), "{}\n{}", here.output, there.output);
    let bits = |log: &str| -> Vec<_> {
        let ticks = ticks_of(&folder.path().join(log));
        ticks
            .into_iter()
            .map(|tick| (tick.input.encode_to_vec(), tick.output.encode_to_vec(), tick.state_digest))
            .collect()
    };
    let (here, there) = (bits("here.mcap"), bits("there.mcap"));
    assert!(here.len() > 50);
    assert_eq!(here, there);
    for environment in [None, Some(OTHER_CPU)] {
        let verified = verify(&folder.path().join("here.mcap"), environment);
        assert_eq!(verified.code, Some(0), "{}", verified.output);
        let all = format!("{0} of {0} ticks identical", bits("here.mcap").len());
        assert!(verified.output.contains(&all), "{}", verified.output);
    }
}

#[test]
fn one_flipped_bit_in_one_output_is_found_at_its_tick() {
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(fly(folder.path(), "good.mcap", None).code, Some(0));
    let bad = folder.path().join("bad.mcap");
    rewrite_log(&folder.path().join("good.mcap"), &bad, |ticks| {
        assert_eq!(ticks[30].input.tick, 30);
        let output = &mut ticks[30].output;
        output.gimbal_command_rad = f64::from_bits(output.gimbal_command_rad.to_bits() ^ 1);
    });
    let verified = verify(&bad, None);
    assert_eq!(verified.code, Some(1), "{}", verified.output);
    assert!(
        verified.output.contains("first at tick 30 ") && verified.output.contains("gimbal_command_rad"),
        "{}",
        verified.output
    );
}

#[test]
fn a_killed_recorder_loses_a_fraction_of_a_second() {
    let folder = tempfile::tempdir().unwrap();
    let mut command = program(Program::OnboardSim);
    command.args(["fly", "--log", "killed.mcap"]).current_dir(folder.path());
    let mut flight = Running::start(&mut command);
    // The vehicle is killed as soon as it reports that its motor has burnt out.
    flight.wait_for_line("burn-out");
    flight.signal(Signal::SIGKILL);
    flight.wait();
    let log = folder.path().join("killed.mcap");
    let last = ticks_of(&log).last().cloned().expect("ticks");
    assert!(last.input.time_since_ignition_s >= 4.5, "{} s", last.input.time_since_ignition_s);
    let verified = verify(&log, None);
    assert!(verified.output.contains("identical"), "{}", verified.output);
    assert_eq!(verified.code, Some(0), "{}", verified.output);
}

#[test]
fn a_file_that_is_no_log_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let picture = folder.path().join("picture.mcap");
    std::fs::write(&picture, b"\x89PNG\r\n\x1a\n and so on").unwrap();
    let refused = verify(&picture, None);
    assert_eq!(refused.code, Some(2), "{}", refused.output);
    assert!(
        refused.output.contains("not a flight log") && refused.output.contains("picture.mcap"),
        "{}",
        refused.output
    );
}

/// A log that a real ground station has written is read by every command, and is the vehicle's flight as it was heard.
#[test]
fn the_log_of_a_ground_station_is_described_reported_exported_and_compared() {
    let folder = tempfile::tempdir().unwrap();
    let mut ground = Running::start(&mut auto_ground(folder.path(), &["udpin:127.0.0.1:0"]));
    let vehicle = Running::start(&mut vehicle(folder.path(), &[&ground.udp_link()]));
    expect_landing(vehicle, ground);
    let replay = |arguments: &[&str]| {
        Running::to_end(program(Program::Replay).args(arguments).current_dir(folder.path()))
    };
    let described = replay(&["info", "ground.mcap"]);
    assert_eq!(described.code, Some(0), "{}", described.output);
    assert!(described.output.contains("verdict     LANDED inside every limit"), "{}", described.output);

    let reported = replay(&["report", "ground.mcap", "--output", "ground.html"]);
    assert_eq!(reported.code, Some(0), "{}", reported.output);
    let page = std::fs::read_to_string(folder.path().join("ground.html")).unwrap();
    assert!(page.contains("LANDED inside every limit") && page.contains(">touchdown<"));

    let exported = replay(&["export", "ground.mcap", "--to", "csv", "--output", "tables"]);
    assert_eq!(exported.code, Some(0), "{}", exported.output);
    for (table, rows) in [("mavlink_1_1_td_landing_verdict", 1), ("mavlink_1_1_attitude_quaternion", 50)] {
        let text = std::fs::read_to_string(folder.path().join(format!("tables/{table}.csv"))).unwrap();
        assert!(text.lines().count() > rows, "{table}: {text}");
    }

    // The station ends a moment before the vehicle, which goes on sending, so that the last frames are not compared.
    let mut compare = program(Program::Replay);
    compare.args(["compare", "vehicle.mcap", "ground.mcap", "--json"]).current_dir(folder.path());
    let compared = compare.output().unwrap();
    let report: serde_json::Value = serde_json::from_slice(&compared.stdout).unwrap();
    let signals = report[0]["signals"].as_array().unwrap();
    assert!(signals.len() > 50, "{report}");
    let differ: Vec<_> =
        signals.iter().filter(|signal| signal["max"].as_f64().is_some_and(|max| max > 0.0)).collect();
    assert!(differ.is_empty(), "{differ:?}");
}

/// A shadow on a link of its own flags a gimbal that is stuck, says which checks ran, and its log gives the same again.
#[test]
fn a_shadow_flags_a_stuck_gimbal_in_flight_and_again_from_its_log() {
    let folder = tempfile::tempdir().unwrap();
    let mut listen = program(Program::Replay);
    listen.args([
        "shadow",
        "--connect",
        "udpin:127.0.0.1:0",
        "--profile",
        "mk2",
        "--once",
        "--log",
        "shadow.mcap",
    ]);
    let mut shadow = Running::start(listen.current_dir(folder.path()));
    let link = shadow.wait_for_line("listening on udpin:");
    let port = link.split("udpin:127.0.0.1:").nth(1).unwrap().split(';').next().unwrap().to_owned();
    let mut fly = vehicle(folder.path(), &[&format!("udpout:127.0.0.1:{port}")]);
    fly.args(["--profile", "mk2", "--start", "apogee", "--auto-start", "--speed", "4"]);
    let flight = Running::start(fly.args(["--fault", "gimbal-stuck@powered+1"]));
    let (seen, flown) = (shadow.wait(), flight.wait());
    assert_eq!(seen.code, Some(1), "{}{}", seen.output, flown.output);
    assert!(seen.output.contains("gimbal: TD_GIMBAL."), "{}", seen.output);
    assert!(seen.output.contains("not in telemetry:") && !seen.output.contains("NOT RUN"), "{}", seen.output);

    let flags = |output: &str| -> Vec<String> {
        output.lines().filter(|line| line.starts_with("boot")).map(str::to_owned).collect()
    };
    let mut again = program(Program::Replay);
    again.args(["shadow", "--connect", "shadow.mcap", "--log", "none"]).current_dir(folder.path());
    let again = Running::to_end(&mut again);
    assert_eq!((again.code, flags(&again.output)), (Some(1), flags(&seen.output)), "{}", again.output);
    let described =
        Running::to_end(program(Program::Replay).args(["info", "shadow.mcap"]).current_dir(folder.path()));
    assert_eq!(described.code, Some(0), "{}", described.output);
}
