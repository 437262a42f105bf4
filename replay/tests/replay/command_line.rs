//! Tests the command: exit codes, text, JSON, and the same bits on another processor.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;
use tempfile::TempDir;

use crate::flown::{COMPLETE, FLIGHT, FRAME_S, Recipe, write_log};
use crate::foreign::foreign_mcap;
use crate::from_apogee::LANDED;

pub(crate) struct Files {
    pub(crate) directory: TempDir,
}

impl Files {
    pub(crate) fn new() -> Self {
        Self { directory: tempfile::tempdir().unwrap() }
    }

    pub(crate) fn file(&self, bytes: &[u8]) -> PathBuf {
        let path = self.directory.path().join("flight.mcap");
        std::fs::write(&path, bytes).unwrap();
        path
    }
}

pub(crate) fn replay(question: &str, file: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_replay"));
    command.arg(question).arg(file);
    command
}

pub(crate) fn run(command: &mut Command) -> (i32, String, String) {
    let Output { status, stdout, stderr } = command.output().unwrap();
    (status.code().unwrap(), String::from_utf8(stdout).unwrap(), String::from_utf8(stderr).unwrap())
}

/// The answer of a command as data, with its exit code.
pub(crate) fn data(command: &mut Command) -> (i32, Value) {
    let (code, stdout, stderr) = run(command.arg("--json"));
    (code, serde_json::from_str(&stdout).unwrap_or_else(|error| panic!("{error}: {stdout}{stderr}")))
}

/// A command that is refused: what it says, after checking that it says only that.
pub(crate) fn refusal(command: &mut Command) -> String {
    let (code, stdout, stderr) = run(command);
    assert_eq!((code, stdout.as_str()), (1, ""), "{command:?}: {stderr}");
    stderr
}

/// The C library picks its mathematical functions by processor; the controller's results must not
/// depend on that. (Our solver asks the processor itself: this test does not change its answer.)
#[test]
fn a_log_is_identical_also_with_other_functions_of_the_c_library() {
    let files = Files::new();
    for log in [&files.file(&COMPLETE.bytes), &LANDED.log] {
        for tunables in ["", "glibc.cpu.hwcaps=-FMA,-AVX2,-FMA4"] {
            let (code, report) = data(replay("verify", log).env("GLIBC_TUNABLES", tunables));
            assert_eq!((code, &report["outcome"]), (0, &"identical".into()));
            assert_eq!(report["frames_identical"], report["frames_recorded"]);
        }
    }
}

#[test]
fn a_divergence_exits_1_with_both_values_and_bits() {
    let files = Files::new();
    let mut frames = FLIGHT.frames[..8].to_vec();
    let recorded_rad = &mut frames[6].output.fins_rad[2];
    let recomputed_rad = *recorded_rad;
    *recorded_rad = f64::from_bits(recorded_rad.to_bits() ^ 1);
    let (recorded_rad, bits) = (*recorded_rad, recomputed_rad.to_bits());
    let file = files.file(&write_log(&frames, &Recipe::default()).bytes);
    let (code, stdout, _) = run(&mut replay("verify", &file));
    assert_eq!(code, 3, "{stdout}");
    for part in [
        "1 of 8 frames differ, in 1 field",
        "first at frame 7 (T+0.035 s, DEPLOY), 1 field:",
        "output.fins_rad[2]",
        &format!("{recorded_rad:?}"),
        &format!("{recomputed_rad:?}"),
        &format!("0x{bits:016x}"),
        "1 ULP",
    ] {
        assert!(stdout.contains(part), "{part} is not in\n{stdout}");
    }
}

/// What is lost behind that is for `recover`.
#[test]
fn a_log_broken_in_the_middle_states_until_when_it_was_read() {
    let files = Files::new();
    let (at, frames) = COMPLETE.synced[4];
    let mut bytes = COMPLETE.bytes.clone();
    bytes[usize::try_from(at).unwrap() + 200] ^= 0x10;
    let (code, info) = data(&mut replay("info", &files.file(&bytes)));
    let until_s = frames as f64 * FRAME_S;
    assert_eq!(code, 0);
    let read_s = info["completeness"]["readable_until_s"].as_f64().unwrap();
    assert!((read_s - until_s).abs() < 1e-6, "{read_s}");
}

/// What is not a log is refused by every command, with the file's name.
#[test]
fn a_question_without_an_answer_exits_1_with_the_reason() {
    let files = Files::new();
    let output = files.directory.path().join("output").display().to_string();
    let questions: [&[&str]; 8] = [
        &["info"],
        &["verify"],
        &["evaluate"],
        &["refly"],
        &["verify", "--explain", "1"],
        &["report", "--out", "-"],
        &["export", "--out", &output],
        &["compare"],
    ];
    for bytes in [&b""[..], b"\x89PNG\r\n\x1a\n", &foreign_mcap("/pose"), b"\x89MCAP0\r\n"] {
        let file = files.file(bytes);
        for question in questions {
            let mut command = replay(question[0], &file);
            command.args(&question[1..]).args((question[0] == "compare").then_some(&file));
            assert!(refusal(&mut command).contains("flight.mcap: "), "{question:?}");
        }
    }
    let empty = tempfile::tempdir().unwrap();
    for (none, why) in [
        (files.directory.path().join("none.mcap"), "cannot be read"),
        (empty.path().to_owned(), "holds no log (*.mcap)"),
    ] {
        assert!(refusal(&mut replay("info", &none)).contains(why));
    }
    let (code, report) = data(&mut replay("verify", &files.file(&write_log(&[], &Recipe::default()).bytes)));
    assert_eq!((code, &report["outcome"]), (5, &"not-replayable".into()));
    assert_eq!(run(Command::new(env!("CARGO_BIN_EXE_replay")).arg("guess")).0, 2);
}

#[test]
fn a_number_that_json_lacks_is_text() {
    let files = Files::new();
    let mut frames = FLIGHT.frames[..8].to_vec();
    frames[7].output.fins_rad[1] = f64::NAN;
    let file = files.file(&write_log(&frames, &Recipe::default()).bytes);
    let (code, report) = data(&mut replay("verify", &file));
    assert_eq!((code, &report["first_divergence"]["frame"]), (3, &8.into()));
    assert_eq!(report["first_divergence"]["fields"][0]["recorded"]["value"], "NaN");
}

#[test]
fn help_lists_the_exit_codes() {
    let (code, stdout, _) = run(Command::new(env!("CARGO_BIN_EXE_replay")).arg("--help"));
    assert_eq!(code, 0);
    assert!(stdout.contains("\nExit codes:\n  0  yes"), "{stdout}");
    let (code, page, _) = run(Command::new(env!("CARGO_BIN_EXE_replay")).args(["man", "verify"]));
    assert!(code == 0 && page.contains("replay\\-verify"), "{page}");
}
