//! Tests the other subcommands: exit codes, formats, and the messages if there is no answer.

use flight::guidance::powered::ControlLevel;
use flight::rules::phase::Phase;
use protocol::log::computer_v1::ComputerFrame;

use crate::command_line::{Files, replay, run};
use crate::flown::{FLIGHT, Recipe, WHOLE, write_log};
use crate::simulated::{DISPERSED, MK2, WITH_FRAMES};

#[test]
fn several_logs_are_verified_at_once_and_the_worst_decides() {
    let files = Files::new();
    let good = files.file(&WHOLE.bytes);
    let mut frames = FLIGHT.frames[..8].to_vec();
    frames[6].output.gimbal_rad[1] = 0.25;
    let bad = files.directory.path().join("bad <&>.mcap");
    std::fs::write(&bad, write_log(&frames, &Recipe::default()).bytes).unwrap();
    let (code, stdout, _) = run(replay("verify", &good).arg(&bad));
    assert_eq!(code, 1);
    // There is no landing in the log to fly on from.
    assert!(stdout.contains("verdict: whether it would change is not known"), "{stdout}");
    assert!(stdout.contains("bad <&>.mcap") && stdout.contains("output.gimbal_rad[1]"), "{stdout}");
    let (code, stdout, _) = run(replay("verify", &good).arg(&bad).arg("--json"));
    let reports: serde_json::Value = serde_json::from_str(&stdout).unwrap();
    assert_eq!((code, reports.as_array().unwrap().len()), (1, 2));
    assert_eq!(reports[1]["first_divergence"]["frame"], 7);
}

#[test]
fn a_comparison_exits_1_outside_its_tolerance() {
    let nominal = &MK2;
    let dispersed = &DISPERSED;
    let (code, stdout, _) = run(replay("compare", &nominal.log).arg(&nominal.log));
    assert_eq!(code, 0, "{stdout}");
    assert!(stdout.contains("is within tolerance of") && stdout.contains("are identical\n"), "{stdout}");
    let tolerances = nominal.beside("tolerances.toml");
    std::fs::write(&tolerances, "[signals.\"vehicle_truth3d.state.position_m.x\"]\nmax = 1e-6\n").unwrap();
    let compare = |flag: Option<&str>| {
        let mut command = replay("compare", &nominal.log);
        command.arg(&dispersed.log).arg("--tolerances").arg(&tolerances).args(flag);
        run(&mut command)
    };
    let (code, stdout, _) = compare(None);
    assert_eq!(code, 1);
    assert!(
        stdout.contains("\nvehicle_truth3d.state.position_m.x ") && stdout.contains("EXCEEDED"),
        "{stdout}"
    );
    let (code, stdout, _) = compare(Some("--json"));
    let found: serde_json::Value = serde_json::from_str(&stdout).unwrap();
    assert_eq!((code, found[0]["align"].as_str()), (1, Some("ignition")));
    std::fs::write(&tolerances, "[signals.\"vehicle_truth3d.stat.position_m.x\"]\nmax = 1e-6\n").unwrap();
    let (code, _, stderr) = compare(None);
    assert_eq!(code, 2);
    assert!(stderr.contains("the nearest is `vehicle_truth3d.state.position_m.x`"), "{stderr}");
}

#[test]
fn reports_say_open_or_closed_loop_and_unknown_names_exit_2() {
    let log = &MK2.log;
    for (question, kind) in [("evaluate", "open loop"), ("refly", "closed loop")] {
        let (code, stdout, _) = run(replay(question, log).args(["--set", "powered.weights.theta=75"]));
        assert_eq!(code, 0);
        assert!(stdout.contains(kind), "{stdout}");
        let (code, stdout, _) =
            run(replay(question, log).args(["--set", "powered.weights.theta=75", "--json"]));
        let report: serde_json::Value = serde_json::from_str(&stdout).unwrap();
        assert!(code == 0 && report["kind"].as_str().unwrap().starts_with(kind));
        let (code, stdout, stderr) = run(replay(question, log).args(["--set", "powered.wieghts.theta=75"]));
        assert_eq!((code, stdout.as_str()), (2, ""));
        assert!(stderr.contains("did you mean `powered.weights.theta`?"), "{stderr}");
    }
    let settings = MK2.beside("settings.toml");
    std::fs::write(&settings, "powered.weights.theta = 75\n").unwrap();
    let [by_file, by_flag] = ["by-file.csv", "by-flag.csv"].map(|name| MK2.beside(name));
    run(replay("evaluate", log).arg("--settings").arg(&settings).arg("--csv").arg(&by_file));
    run(replay("evaluate", log).args(["--set", "powered.weights.theta=75", "--csv"]).arg(&by_flag));
    assert_eq!(std::fs::read(by_file).unwrap(), std::fs::read(by_flag).unwrap());
}

/// One unreadable log among several is a separate error, and the others are still verified.
#[test]
fn an_unreadable_log_does_not_hide_the_others() {
    let files = Files::new();
    let good = files.file(&WHOLE.bytes);
    let none = files.directory.path().join("none.mcap");
    let (code, stdout, stderr) = run(replay("verify", &none).arg(&good));
    assert!(
        code == 2 && stdout.contains("frames identical") && stderr.contains("none.mcap"),
        "{stdout}{stderr}"
    );
}

#[test]
fn a_frame_is_shown_and_a_missing_frame_exits_2() {
    let recording = MK2.recording();
    let frames = &recording.frames;
    let planned = |frame: &&ComputerFrame| {
        frame.output.phase == u32::from(Phase::Powered.index()) && frame.input.plan_ready
    };
    let planning = frames.iter().filter(planned).nth(5).unwrap().input.frame;
    let planning = (recording.release_frame + planning).to_string();
    let (code, stdout, _) = run(replay("verify", &MK2.log).args(["--explain", &planning]));
    assert_eq!(code, 0);
    for part in [
        "the judge agrees",
        "identical bit for bit",
        "flown    converged",
        "judge    converged",
        "cold     ",
        "path     +0.00 s",
    ] {
        assert!(stdout.contains(part), "{part} is not in\n{stdout}");
    }
    let (code, stdout, _) = run(replay("verify", &MK2.log).args(["--explain", &planning, "--json"]));
    let report: serde_json::Value = serde_json::from_str(&stdout).unwrap();
    assert_eq!((code, report["frame"].as_u64()), (0, planning.parse().ok()));
    let (code, _, stderr) = run(replay("verify", &MK2.log).args(["--explain", "300000"]));
    assert!(code == 2 && stderr.contains("no frame 300000"), "{stderr}");
}

/// The judge shares no function with the solver that flies. It finds the plan that flew, if its solve converged, or one that costs
/// at most a per cent less.
#[test]
fn val_judge_finds_no_better_plan_than_the_one_that_flew() {
    let recording = MK2.recording();
    let (_, frames) = recording.replayable_frames().unwrap();
    let planned = |frame: &&ComputerFrame| {
        frame.output.phase == u32::from(Phase::Powered.index())
            && frame.input.plan_ready
            && frame.output.level == u32::from(ControlLevel::Converged.index())
    };
    let planning = frames.iter().filter(planned).map(|frame| frame.input.frame);
    let mut same = 0;
    for frame in planning.skip(2).step_by(10).take(5) {
        let judged = replay::verify::explain::explain(&recording, recording.release_frame + frame)
            .unwrap()
            .judged
            .unwrap();
        assert!(judged.flown_dearer < 0.01, "{frame}: {judged:?}");
        if judged.flown_dearer.abs() < 1e-4 {
            same += 1;
            assert!(judged.first_input_deg < 0.1, "{frame}: {judged:?}");
            let [ours, theirs] = [&judged.flown, &judged.judge].map(|plan| plan.touchdown_m);
            assert!(libm::hypot(ours[0] - theirs[0], ours[1] - theirs[1]) < 0.05, "{frame}: {judged:?}");
        }
    }
    assert!(same >= 3, "{same} of 5 plans are the judge's");
}

/// Exports to every format and imports again.
#[test]
fn the_command_exports_and_imports_logs() {
    let directory = tempfile::tempdir().unwrap();
    let at = |name: &str| directory.path().join(name);
    for format in ["csv", "parquet"] {
        let (code, stdout, _) =
            run(replay("export", &WITH_FRAMES.log).args(["--to", format, "--output"]).arg(at(format)));
        assert!(code == 0 && stdout.contains("vehicle_truth3d"), "{stdout}");
        assert!(at(format).join(format!("computer_frame.{format}")).exists());
    }
    let tlog = at("flight.tlog");
    std::fs::rename(crate::simulated::tlog(&WITH_FRAMES, "export.tlog"), &tlog).unwrap();
    let (code, stdout, _) = run(&mut replay("export", &tlog));
    assert!(code == 0 && stdout.contains("flight.mcap: "), "{stdout}");
    let (code, _, stderr) = run(&mut replay("export", &tlog));
    assert!(code == 2 && stderr.contains("cannot be written"), "{stderr}");
    let (code, stdout, _) = run(replay("report", &at("flight.mcap")).arg("--output").arg(at("page.html")));
    assert!(code == 0 && stdout.contains("page.html"), "{stdout}");
    assert!(std::fs::read_to_string(at("page.html")).unwrap().starts_with("<!DOCTYPE html>"));
}

#[test]
fn a_recovery_is_reported_and_never_overwrites() {
    let files = Files::new();
    let (at, frames) = WHOLE.synced[4];
    let cut = files.file(&WHOLE.bytes[..usize::try_from(at).unwrap() + 5]);
    let output = files.directory.path().join("whole.mcap");
    let (code, stdout, _) = run(replay("recover", &cut).arg(&output));
    assert_eq!(code, 0);
    assert!(stdout.contains("kept ") && stdout.contains("no end mark"), "{stdout}");
    let (code, stdout, _) = run(&mut replay("verify", &output));
    assert!(
        code == 0
            && stdout.contains(&format!("{frames} of {frames} frames identical of the readable part"))
            && stdout.contains("it was made of a damaged log"),
        "{stdout}"
    );
    let (code, _, _) = run(replay("verify", &output).arg("--strict"));
    assert_eq!(code, 1, "the repair does not make a whole flight of it");
    let (code, _, stderr) = run(replay("recover", &cut).arg(&output));
    assert!(code == 2 && stderr.contains("cannot be written"), "{stderr}");
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
            &["verify", "--explain", "1"],
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
