//! Tests the other subcommands: exit codes, formats, and the messages if there is no answer.

use crate::command_line::{Files, replay, run};
use crate::flown::{FLIGHT, Recipe, WHOLE, write_log};
use crate::simulated::{DISPERSED, NOMINAL, WITH_FRAMES};

#[test]
fn several_logs_are_verified_at_once_and_the_worst_decides() {
    let files = Files::new();
    let good = files.file(&WHOLE.bytes);
    let mut ticks = FLIGHT.ticks[..8].to_vec();
    ticks[6].output.gimbal_command_rad = 0.25;
    let bad = files.directory.path().join("bad <&>.mcap");
    std::fs::write(&bad, write_log(&ticks, &Recipe::default()).bytes).unwrap();
    let (code, stdout, _) = run(replay("verify", &good).arg(&bad).arg("--junit"));
    assert_eq!(code, 1);
    assert!(stdout.contains("tests=\"2\" skipped=\"0\" failures=\"1\" errors=\"0\""), "{stdout}");
    // The hand-made log ends slightly below the ground; the simulation does not.
    assert!(stdout.contains("verdict: would CHANGE: recorded NOT LANDED"), "{stdout}");
    assert!(
        stdout.contains("bad &lt;&amp;&gt;.mcap") && stdout.contains("output.gimbal_command_rad"),
        "{stdout}"
    );
    let (code, stdout, _) = run(replay("verify", &good).arg(&bad).arg("--json"));
    let reports: serde_json::Value = serde_json::from_str(&stdout).unwrap();
    assert_eq!((code, reports.as_array().unwrap().len()), (1, 2));
    assert_eq!(reports[1]["growth"]["steps"][0]["tick"], 6);
    assert_eq!(reports[1]["growth"]["peak"]["tick"], 6);
}

/// The record claims another command; this build, flying on from there, lands as the vehicle did.
#[test]
fn a_divergence_report_says_whether_the_verdict_would_change() {
    let recording = NOMINAL.recording();
    let path = NOMINAL.beside("forged.mcap");
    let options = replay::refly::ReflyOptions::default();
    let (report, mut flight) = replay::refly::refly_flight(&recording, &options).unwrap();
    flight.ticks[20].record.output.gimbal_command_rad = 0.2;
    replay::refly::write_log(&path, &recording, &options, &report, &flight).unwrap();
    let (code, stdout, _) = run(&mut replay("verify", &path));
    assert_eq!(code, 1);
    assert!(stdout.contains("how it grows"), "{stdout}");
    assert!(
        stdout.contains("verdict: would not change: recorded LANDED, flown on by this build from tick"),
        "{stdout}"
    );
    // A motor that is weak in the record is weak again when the flight is continued.
    let weak = replay::refly::ReflyOptions {
        plant_settings: vec!["plant.thrust_scale=0.95".parse().unwrap()],
        ..options
    };
    let (report, mut flight) = replay::refly::refly_flight(&recording, &weak).unwrap();
    flight.ticks[20].record.output.gimbal_command_rad = 0.2;
    let path = NOMINAL.beside("crashed.mcap");
    replay::refly::write_log(&path, &recording, &weak, &report, &flight).unwrap();
    let (_, stdout, _) = run(&mut replay("verify", &path));
    assert!(stdout.contains("verdict: would not change: recorded NOT LANDED"), "{stdout}");
}

#[test]
fn a_comparison_exits_1_outside_its_tolerance() {
    let nominal = &NOMINAL;
    let dispersed = &DISPERSED;
    let (code, stdout, _) = run(replay("compare", &nominal.log).arg(&nominal.log));
    assert_eq!(code, 0, "{stdout}");
    assert!(stdout.contains("**Within tolerance.**"), "{stdout}");
    let tolerances = nominal.beside("tolerances.toml");
    std::fs::write(&tolerances, "[signals.\"vehicle_truth.state.x_m\"]\nmax = 1e-6\n").unwrap();
    let compare = |flag: Option<&str>| {
        let mut command = replay("compare", &nominal.log);
        command.arg(&dispersed.log).arg("--tolerances").arg(&tolerances).args(flag);
        run(&mut command)
    };
    let (code, stdout, _) = compare(None);
    assert_eq!(code, 1);
    assert!(stdout.contains("| vehicle_truth.state.x_m |") && stdout.contains("**EXCEEDED**"), "{stdout}");
    let (code, stdout, _) = compare(Some("--junit"));
    assert_eq!(code, 1);
    assert!(stdout.contains("failures=\"1\"") && stdout.contains("vehicle_truth.state.x_m"), "{stdout}");
    let (code, stdout, _) = compare(Some("--json"));
    let found: serde_json::Value = serde_json::from_str(&stdout).unwrap();
    assert_eq!((code, found[0]["align"].as_str()), (1, Some("ignition")));
    std::fs::write(&tolerances, "[signals.\"vehicle_truth.stat.x_m\"]\nmax = 1e-6\n").unwrap();
    let (code, _, stderr) = compare(None);
    assert_eq!(code, 2);
    assert!(stderr.contains("the nearest is `vehicle_truth.state.x_m`"), "{stderr}");
}

#[test]
fn reports_say_open_or_closed_loop_and_unknown_names_exit_2() {
    let log = &NOMINAL.log;
    for (question, kind) in [("evaluate", "open loop"), ("refly", "closed loop")] {
        let (code, stdout, _) = run(replay(question, log).args(["--set", "nmpc.weights.w=75"]));
        assert_eq!(code, 0);
        assert!(stdout.contains(kind), "{stdout}");
        let (code, stdout, _) = run(replay(question, log).args(["--set", "nmpc.weights.w=75", "--json"]));
        let report: serde_json::Value = serde_json::from_str(&stdout).unwrap();
        assert!(code == 0 && report["kind"].as_str().unwrap().starts_with(kind));
        let (code, stdout, stderr) = run(replay(question, log).args(["--set", "nmpc.wieghts.w=75"]));
        assert_eq!((code, stdout.as_str()), (2, ""));
        assert!(stderr.contains("did you mean `nmpc.weights.w`?"), "{stderr}");
    }
    let settings = NOMINAL.beside("settings.toml");
    std::fs::write(&settings, "nmpc.weights.w = 75\n").unwrap();
    let (_, from_file, _) = run(replay("evaluate", log).arg("--settings").arg(&settings).arg("--csv"));
    let (_, from_flag, _) = run(replay("evaluate", log).args(["--set", "nmpc.weights.w=75", "--csv"]));
    assert_eq!(from_file, from_flag);
}

/// A sweep on two threads, and one with the functions that the C library has for a processor without fused multiply-add,
/// say the same as one on one thread.
#[test]
fn a_sweep_says_the_same_on_any_number_of_threads() {
    let log = &DISPERSED.log;
    let sweep = |jobs: &str, tunables: &str| {
        let mut command = replay("sweep", log);
        command.args(["--vary", "nmpc.weights.w=50:110:3", "--vary-plant", "plant.thrust_scale=0.99,1.0"]);
        command.args(["--csv", "--jobs", jobs]).env("GLIBC_TUNABLES", tunables);
        run(&mut command)
    };
    let (code, one, stderr) = sweep("1", "");
    assert_eq!((code, one.lines().count()), (0, 7), "{stderr}");
    assert_eq!(sweep("2", "").1, one);
    assert_eq!(sweep("2", "glibc.cpu.hwcaps=-FMA,-AVX2,-FMA4").1, one);
}

/// One unreadable log among several is a separate error, and the others are still verified.
#[test]
fn an_unreadable_log_does_not_hide_the_others() {
    let files = Files::new();
    let good = files.file(&WHOLE.bytes);
    let none = files.directory.path().join("none.mcap");
    let (code, stdout, _) = run(replay("verify", &none).arg(&good).arg("--junit"));
    assert_eq!(code, 2);
    assert!(stdout.contains("failures=\"0\" errors=\"1\""), "{stdout}");
    assert!(stdout.contains("none.mcap: cannot be read"), "{stdout}");
    let (code, stdout, stderr) = run(replay("verify", &none).arg(&good));
    assert!(
        code == 2 && stdout.contains("ticks identical") && stderr.contains("none.mcap"),
        "{stdout}{stderr}"
    );
}

#[test]
fn a_tick_is_shown_and_a_missing_tick_exits_2() {
    let (code, stdout, _) = run(replay("tick", &NOMINAL.log).arg("30"));
    assert_eq!(code, 0);
    for part in [
        "identical bit for bit",
        "warm     converged",
        "cold     converged",
        "active   z_m = 0",
        "path     +0.1 s",
    ] {
        assert!(stdout.contains(part), "{part} is not in\n{stdout}");
    }
    let (code, stdout, _) = run(replay("tick", &NOMINAL.log).args(["30", "--json"]));
    let report: serde_json::Value = serde_json::from_str(&stdout).unwrap();
    assert_eq!((code, report["tick"].as_u64()), (0, Some(30)));
    let (code, _, stderr) = run(replay("tick", &NOMINAL.log).arg("3000"));
    assert!(code == 2 && stderr.contains("no tick 3000"), "{stderr}");
}

#[test]
fn a_bisection_is_shown() {
    let arguments =
        ["plant.thrust_scale", "--of-plant", "--value", "1", "--lowest", "0.95", "--highest", "1.01"];
    let (code, stdout, _) = run(replay("bisect", &NOMINAL.log).args(arguments));
    assert_eq!(code, 0);
    assert!(stdout.contains("the smallest change that changes the verdict: -"), "{stdout}");
    let (code, _, stderr) =
        run(replay("bisect", &NOMINAL.log).args(["a.b", "--lowest", "2", "--highest", "1"]));
    assert!(code == 2 && stderr.contains("must be below"), "{stderr}");
}

/// Exports to every format and imports again.
#[test]
fn the_command_exports_and_imports_logs() {
    let directory = tempfile::tempdir().unwrap();
    let at = |name: &str| directory.path().join(name);
    for format in ["csv", "parquet"] {
        let (code, stdout, _) =
            run(replay("export", &WITH_FRAMES.log).args(["--to", format, "--output"]).arg(at(format)));
        assert!(code == 0 && stdout.contains("vehicle_truth"), "{stdout}");
        assert!(at(format).join(format!("controller_tick.{format}")).exists());
    }
    let tlog = at("flight.tlog");
    let (code, stdout, _) =
        run(replay("export", &WITH_FRAMES.log).args(["--to", "tlog", "--output"]).arg(&tlog));
    assert!(code == 0 && stdout.contains("sent by the vehicle"), "{stdout}");
    let (code, stdout, _) = run(&mut replay("import", &tlog));
    assert!(code == 0 && stdout.contains("flight.mcap: "), "{stdout}");
    let (code, _, stderr) = run(&mut replay("import", &tlog));
    assert!(code == 2 && stderr.contains("cannot be created"), "{stderr}");
    let (code, stdout, _) = run(replay("report", &at("flight.mcap")).arg("--output").arg(at("page.html")));
    assert!(code == 0 && stdout.contains("page.html"), "{stdout}");
    assert!(std::fs::read_to_string(at("page.html")).unwrap().starts_with("<!DOCTYPE html>"));
    let (code, _, stderr) =
        run(replay("export", &NOMINAL.log).args(["--to", "tlog", "--output"]).arg(at("none.tlog")));
    assert!(code == 2 && stderr.contains("no raw MAVLink frames"), "{stderr}");
}

#[test]
fn a_recovery_is_reported_and_never_overwrites() {
    let files = Files::new();
    let (at, ticks) = WHOLE.synced[4];
    let cut = files.file(&WHOLE.bytes[..usize::try_from(at).unwrap() + 5]);
    let output = files.directory.path().join("whole.mcap");
    let (code, stdout, _) = run(replay("recover", &cut).arg(&output));
    assert_eq!(code, 0);
    assert!(stdout.contains("kept ") && stdout.contains("no end mark"), "{stdout}");
    let (code, stdout, _) = run(&mut replay("verify", &output));
    assert!(
        code == 0
            && stdout.contains(&format!("{ticks} of {ticks} ticks identical of the readable part"))
            && stdout.contains("it was recovered from a damaged log"),
        "{stdout}"
    );
    let (code, _, _) = run(replay("verify", &output).arg("--strict"));
    assert_eq!(code, 1, "the repair does not make a whole flight of it");
    let (code, _, stderr) = run(replay("recover", &cut).arg(&output));
    assert!(code == 2 && stderr.contains("cannot be created"), "{stderr}");
    let (code, _, stderr) =
        run(replay("recover", &files.file(b"nothing")).arg(files.directory.path().join("x")));
    assert!(code == 2 && stderr.contains("is not a flight log"), "{stderr}");
}

/// Every command refuses a file that is not a log, with the file's name and exit code 2.
#[test]
fn every_command_refuses_a_file_that_is_not_a_log() {
    let files = Files::new();
    let output = files.directory.path().join("output");
    let output = output.to_str().unwrap();
    for bytes in [&b""[..], b"\x89PNG\r\n\x1a\n", b"\x89MCAP0\r\n"] {
        let file = files.file(bytes);
        for arguments in [
            &["evaluate"][..],
            &["refly"],
            &["tick", "1"],
            &["sweep", "--vary", "nmpc.weights.w=1:2:2"],
            &["bisect", "nmpc.weights.w", "--lowest", "1", "--highest", "2"],
            &["report", "--output", "-"],
            &["export", "--to", "csv", "--output", output],
            &["compare"],
        ] {
            let mut command = replay(arguments[0], &file);
            command.args(&arguments[1..]);
            if arguments[0] == "compare" {
                command.arg(&file);
            }
            let (code, stdout, stderr) = run(&mut command);
            assert_eq!((code, stdout.as_str()), (2, ""), "{arguments:?}: {stderr}");
            assert!(stderr.contains("flight.mcap: "), "{arguments:?}: {stderr}");
        }
    }
}
