//! Tests the command: exit codes, text, JSON, and the same bits on another processor.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use tempfile::TempDir;

use crate::flown::{FLIGHT, FRAME_S, Recipe, WHOLE, write_log};
use crate::foreign::foreign_mcap;

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

#[test]
fn an_identical_log_exits_0_with_the_count() {
    let files = Files::new();
    let (code, stdout, _) = run(&mut replay("verify", &files.file(&WHOLE.bytes)));
    let count = FLIGHT.frames.len();
    assert!(stdout.contains(&format!("{count} of {count} frames identical\n")), "{stdout}");
    assert_eq!(code, 0);
}

/// The C library picks its mathematical functions by processor; the controller's results must not depend on that. (Our
/// solver asks the processor itself: this test does not change its answer.)
#[test]
fn the_log_is_identical_with_other_functions_of_the_c_library() {
    let files = Files::new();
    let mut command = replay("verify", &files.file(&WHOLE.bytes));
    command.env("GLIBC_TUNABLES", "glibc.cpu.hwcaps=-FMA,-AVX2,-FMA4");
    let (code, stdout, _) = run(&mut command);
    assert_eq!(code, 0, "{stdout}");
    assert!(stdout.contains("frames identical"), "{stdout}");
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
    assert_eq!(code, 1, "{stdout}");
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

#[test]
fn a_cut_log_exits_0_with_a_warning() {
    let files = Files::new();
    let (at, frames) = WHOLE.synced[4];
    let file = files.file(&WHOLE.bytes[..usize::try_from(at).unwrap() + 5]);
    let (code, stdout, stderr) = run(&mut replay("verify", &file));
    assert_eq!(code, 0);
    assert!(
        stdout.contains(&format!("{frames} of {frames} frames identical of the readable part")),
        "{stdout}"
    );
    assert!(stderr.contains("warning"), "{stderr}");

    let (code, stdout, stderr) = run(&mut replay("info", &file));
    assert_eq!(code, 0);
    assert!(stdout.contains("complete    NO: ends after"), "{stdout}");
    assert!(stderr.contains("warning"), "{stderr}");
}

/// A file broken in its middle still says at its end how much is missing.
#[test]
fn a_log_broken_in_the_middle_says_what_span_is_lost() {
    let files = Files::new();
    let (at, frames) = WHOLE.synced[4];
    let mut bytes = WHOLE.bytes.clone();
    bytes[usize::try_from(at).unwrap() + 200] ^= 0x10;
    let (code, stdout, _) = run(&mut replay("info", &files.file(&bytes)));
    let until_s = frames as f64 * FRAME_S;
    let lost_s = FLIGHT.frames.len() as f64 * FRAME_S - until_s;
    assert_eq!(code, 0);
    assert!(stdout.contains(&format!("readable until {until_s:.3} s")), "{stdout}");
    assert!(stdout.contains(&format!("{lost_s:.3} s after that are lost")), "{stdout}");
}

#[test]
fn a_question_without_an_answer_exits_2_with_the_reason() {
    let files = Files::new();
    for bytes in [&b""[..], b"\x89PNG\r\n\x1a\n", &foreign_mcap("/pose"), b"\x89MCAP0\r\n"] {
        let file = files.file(bytes);
        for question in ["info", "verify"] {
            let (code, stdout, stderr) = run(&mut replay(question, &file));
            assert_eq!((code, stdout.as_str()), (2, ""), "{stderr}");
            assert!(stderr.contains("flight.mcap: "), "{stderr}");
        }
    }
    let (code, _, stderr) = run(&mut replay("info", &files.directory.path().join("none.mcap")));
    assert_eq!(code, 2);
    assert!(stderr.contains("none.mcap: cannot be read"), "{stderr}");
    let (code, _, stderr) = run(&mut replay("info", files.directory.path()));
    assert_eq!(code, 2, "{stderr}");
    let (code, stdout, _) =
        run(&mut replay("verify", &files.file(&write_log(&[], &Recipe::default()).bytes)));
    assert_eq!(code, 2);
    assert!(stdout.contains("no frames of a flight computer"), "{stdout}");
    let (code, _, _) = run(Command::new(env!("CARGO_BIN_EXE_replay")).arg("guess"));
    assert_eq!(code, 2);
}

#[test]
fn the_answers_are_json_too() {
    let files = Files::new();
    let mut frames = FLIGHT.frames[..8].to_vec();
    frames[7].output.fins_rad[1] = f64::NAN;
    let file = files.file(&write_log(&frames, &Recipe::default()).bytes);
    let (code, stdout, _) = run(replay("verify", &file).arg("--json"));
    assert_eq!(code, 1);
    let report: serde_json::Value = serde_json::from_str(&stdout).unwrap();
    assert_eq!(report["outcome"], "diverged");
    assert_eq!(report["first_divergence"]["frame"], 8);
    assert_eq!(report["first_divergence"]["fields"][0]["recorded"]["value"], "NaN");

    let (code, stdout, _) = run(replay("info", &file).arg("--json"));
    assert_eq!(code, 0);
    let info: serde_json::Value = serde_json::from_str(&stdout).unwrap();
    assert_eq!(info["grade"]["level"], "bit-exact");
    assert_eq!(info["frames"]["last"], 8);
}

#[test]
fn help_lists_the_exit_codes() {
    let (code, stdout, _) = run(Command::new(env!("CARGO_BIN_EXE_replay")).arg("--help"));
    assert_eq!(code, 0);
    assert!(stdout.contains("Exit codes:"), "{stdout}");
    assert!(stdout.contains("\n  1  verify: something differs or cannot be"), "{stdout}");
}
