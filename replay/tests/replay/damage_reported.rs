//! Tests a log with a flipped byte: every command says what was not read.

use std::path::{Path, PathBuf};

use replay::verify::verify;

use crate::command_line::{refusal, replay, run};
use crate::flown::only;
use crate::from_apogee::LANDED;
use crate::simulated::{MK2, WITH_FRAMES};
use crate::tampered::Held;

/// The log with one byte changed in the middle of a chunk, a quarter of the way in.
fn flipped(log: &Path, directory: &tempfile::TempDir) -> PathBuf {
    let mut bytes = std::fs::read(log).unwrap();
    let chunks = mcap::Summary::read(&bytes).unwrap().unwrap().chunk_indexes;
    let chunk = &chunks[chunks.len() / 4];
    bytes[usize::try_from(chunk.chunk_start_offset + chunk.chunk_length / 2).unwrap()] ^= 0xff;
    let path = directory.path().join("flipped.mcap");
    std::fs::write(&path, bytes).unwrap();
    path
}

#[test]
fn a_log_with_a_flipped_byte_does_not_pass() {
    let directory = tempfile::tempdir().unwrap();
    for log in [&LANDED.log, &MK2.log] {
        let all = Held::read(log).frames() as u64;
        let path = flipped(log, &directory);
        let report = only(verify(&path).unwrap());
        assert!(0 < report.frames_recorded && report.frames_recorded < all, "{report:?}");
        assert!(report.damage.is_some());
        let (code, _, _) = run(replay("verify", &path).arg("--strict"));
        assert_eq!(code, 3);
    }
}

/// A log that was cut before its first message says nothing about who wrote it.
#[test]
fn a_log_cut_before_its_first_message_has_no_answer() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("cut.mcap");
    let tables = directory.path().join("csv").display().to_string();
    let questions: [&[&str]; 4] = [&["info"], &["verify"], &["evaluate"], &["export", "--out", &tables]];
    for log in [&LANDED.log, &MK2.log] {
        std::fs::write(&path, &std::fs::read(log).unwrap()[..100]).unwrap();
        for question in questions {
            let refused = refusal(replay(question[0], &path).args(&question[1..]));
            assert!(
                refused.contains("before its first message: ends after 100 bytes"),
                "{question:?}: {refused}"
            );
        }
        assert!(!Path::new(&tables).exists());
    }
}

/// Every command that reads a damaged log says so.
#[test]
fn no_command_is_silent_about_damage() {
    let directory = tempfile::tempdir().unwrap();
    let path = flipped(&WITH_FRAMES.log, &directory);
    let at = |name: &str| directory.path().join(name).display().to_string();
    let (html, csv, whole, again) = (at("p.html"), at("csv"), at("whole.mcap"), at("again.mcap"));
    let questions: [&[&str]; 9] = [
        &["info"],
        &["verify"],
        &["evaluate"],
        &["refly", "--out", &again],
        &["verify", "--explain", "20"],
        &["report", "--out", &html],
        &["export", "--out", &csv],
        &["recover", &whole],
        &["compare", path.to_str().unwrap()],
    ];
    for question in questions {
        let (_, stdout, stderr) = run(replay(question[0], &path).args(&question[1..]));
        let told = if question[0] == "recover" { &stdout } else { &stderr };
        assert!(
            told.contains("unreadable near byte") || told.contains("lost"),
            "{question:?}: {stdout}{stderr}"
        );
    }
}
