//! Tests the verification of logs that only look whole, or hold several flights: a log without comparisons is never
//! "identical", every flight gets its own verdict, and a flight without its end is reported as cut.

use std::path::{Path, PathBuf};

use prost::Message as _;
use protocol::log::computer_v1::ComputerFrame;
use protocol::log::record::{TOPIC_COMPUTER_START, TOPIC_VERDICT};

use crate::command_line::{replay, run};
use crate::from_apogee::LANDED;
use crate::simulated::MK2;
use crate::tampered::{Held, Kept};

/// The log of a campaign, and that of a vehicle, which begins at power-up.
fn logs() -> [&'static Path; 2] {
    [&LANDED.log, &MK2.log]
}

fn written(held: &Held, directory: &tempfile::TempDir, name: &str) -> PathBuf {
    let path = directory.path().join(name);
    held.write(&path);
    path
}

/// Turns a bit of what a frame decided.
fn tamper(message: &mut Kept) {
    let turned = |number: f64| f64::from_bits(number.to_bits() ^ 1);
    let mut frame = ComputerFrame::decode(message.data.as_slice()).unwrap();
    frame.output.fins_rad[0] = turned(frame.output.fins_rad[0]);
    message.data = frame.encode_to_vec();
}

fn verify(path: &Path, arguments: &[&str]) -> (i32, String, String) {
    run(replay("verify", path).args(arguments))
}

#[test]
fn a_whole_log_that_was_only_rewritten_is_identical() {
    let directory = tempfile::tempdir().unwrap();
    for log in logs() {
        let held = Held::read(log);
        let (code, stdout, _) = verify(&written(&held, &directory, "same.mcap"), &["--strict"]);
        let count = held.frames();
        assert_eq!(code, 0, "{stdout}");
        assert!(stdout.contains(&format!("{count} of {count} frames identical\n")), "{stdout}");
    }
}

/// The start record again after all frames, all of which were changed.
#[test]
fn a_start_copied_to_the_end_hides_no_tampered_frame() {
    let directory = tempfile::tempdir().unwrap();
    let mut held = Held::read(&LANDED.log);
    let start = held.messages.iter().find(|message| message.topic == TOPIC_COMPUTER_START).unwrap().clone();
    let last_ns = held.messages.last().unwrap().log_time_ns;
    let honest = {
        let mut honest = held.clone();
        honest.messages.push(start.at(last_ns));
        written(&honest, &directory, "honest.mcap")
    };
    held.messages.iter_mut().filter(|message| message.is_frame()).for_each(tamper);
    held.messages.push(start.at(last_ns));
    let count = held.frames();
    let (code, stdout, _) = verify(&written(&held, &directory, "tampered.mcap"), &[]);
    assert_eq!(code, 1, "{stdout}");
    assert!(stdout.contains(&format!("DIVERGED: {count} of {count} frames differ")), "{stdout}");
    assert!(!stdout.contains("0 of 0"), "{stdout}");

    // Nothing follows the copy, so it must not be called "identical".
    let (code, stdout, _) = verify(&honest, &[]);
    assert_eq!(code, 2, "{stdout}");
    assert!(stdout.contains(&format!("flight 1 of 2: {count} of {count} frames identical")), "{stdout}");
    assert!(stdout.contains("flight 2 of 2: nothing was compared"), "{stdout}");
    assert!(!stdout.contains("0 of 0"), "{stdout}");
}

/// The start record again in the middle: the frames after it do not begin a new flight.
#[test]
fn a_start_copied_into_the_middle_is_no_flight() {
    let directory = tempfile::tempdir().unwrap();
    let mut held = Held::read(&LANDED.log);
    let place = held.messages.len() / 2;
    let start = held.messages.iter().find(|message| message.topic == TOPIC_COMPUTER_START).unwrap().clone();
    held.messages.insert(place, start.at(held.messages[place].log_time_ns));
    let (code, stdout, _) = verify(&written(&held, &directory, "middle.mcap"), &[]);
    assert_eq!(code, 2, "{stdout}");
    assert!(stdout.contains("flight 1 of 2") && stdout.contains("INCOMPLETE flight: ends at T+"), "{stdout}");
    assert!(stdout.contains("flight 2 of 2: nothing was compared: it begins with frame"), "{stdout}");
}

#[test]
fn two_flights_in_one_file_have_two_verdicts_and_the_worst_decides() {
    let directory = tempfile::tempdir().unwrap();
    for log in logs() {
        let (a, mut b) = (Held::read(log), Held::read(log));
        let (count_a, count_b) = (a.frames(), b.frames());
        let both = |b: &Held, name: &str| {
            let mut both = a.clone();
            both.append(b, 100_000_000_000);
            written(&both, &directory, name)
        };
        let path = both(&b, "both.mcap");
        // Strictly, each flight would have to be flown again from facts of its own.
        let (code, stdout, _) = verify(&path, &["--strict"]);
        assert!(code == 1 && stdout.contains("a file with several flights is not flown again"), "{stdout}");
        let (code, stdout, _) = verify(&path, &[]);
        assert_eq!(code, 0, "{stdout}");
        assert!(
            stdout.contains(&format!("flight 1 of 2: {count_a} of {count_a} frames identical")),
            "{stdout}"
        );
        assert!(
            stdout.contains(&format!("flight 2 of 2: {count_b} of {count_b} frames identical")),
            "{stdout}"
        );
        let (_, stdout, _) = verify(&path, &["--json"]);
        let reports: serde_json::Value = serde_json::from_str(&stdout).unwrap();
        assert_eq!(
            (reports[0]["flight"]["number"].as_u64(), reports[1]["flight"]["of"].as_u64()),
            (Some(1), Some(2))
        );
        b.messages.iter_mut().filter(|message| message.is_frame()).skip(30).take(1).for_each(tamper);
        let (code, stdout, _) = verify(&both(&b, "tampered.mcap"), &[]);
        assert_eq!(code, 1, "{stdout}");
        assert!(stdout.contains("flight 2 of 2: DIVERGED"), "{stdout}");
    }
}

/// Commands that need one flight refuse a log with two.
#[test]
fn commands_for_one_flight_refuse_a_log_with_two() {
    let directory = tempfile::tempdir().unwrap();
    for log in logs() {
        let a = Held::read(log);
        let mut both = a.clone();
        both.append(&a, 100_000_000_000);
        let path = written(&both, &directory, "both.mcap");
        for arguments in
            [&["evaluate"][..], &["refly"], &["verify", "--explain", "1"], &["report", "--output", "-"]]
        {
            let (code, stdout, stderr) = run(replay(arguments[0], &path).args(&arguments[1..]));
            assert_eq!((code, stdout.as_str()), (2, ""), "{arguments:?}: {stderr}");
            assert!(stderr.contains("holds 2 flights"), "{arguments:?}: {stderr}");
        }
        let (code, _, stderr) = run(replay("compare", &path).arg(&path));
        assert!(code == 2 && stderr.contains("holds 2 flights"), "{stderr}");
        let (code, stdout, _) = run(&mut replay("info", &path));
        assert!(code == 0 && stdout.contains("flights     2"), "{stdout}");
    }
}

/// A log rewritten without its last frames: with and without the verdict after them.
#[test]
fn a_log_without_its_last_frames_is_not_complete() {
    let directory = tempfile::tempdir().unwrap();
    for (log, lost) in logs().into_iter().zip([500, 600]) {
        let whole = Held::read(log);
        let kept = whole.frames() - lost;
        let last_ns =
            whole.messages.iter().filter(|message| message.is_frame()).nth(kept).unwrap().log_time_ns;
        let mut frames_only = whole.clone();
        let mut seen = 0;
        frames_only.keep(|message| {
            seen += usize::from(message.is_frame());
            !message.is_frame() || seen <= kept
        });
        let mut everything = whole.clone();
        everything.keep(|message| message.log_time_ns < last_ns);
        let mut no_verdict = whole.clone();
        no_verdict.keep(|message| message.topic != TOPIC_VERDICT);
        for (held, name) in [(frames_only, "frames"), (everything, "all"), (no_verdict, "verdict")] {
            let path = written(&held, &directory, &format!("{name}.mcap"));
            let count = held.frames();
            let (code, stdout, _) = verify(&path, &[]);
            assert_eq!(code, 0, "{name}: {stdout}");
            assert!(
                stdout.contains(&format!(
                    "{count} of {count} frames identical of an INCOMPLETE flight: ends at T+"
                )),
                "{name}: {stdout}"
            );
            assert!(name == "verdict" || stdout.contains(" in POWERED"), "{name}: {stdout}");
            let (code, stdout, _) = verify(&path, &["--strict"]);
            assert_eq!(code, 1, "{name}: {stdout}");
            let (code, stdout, _) = verify(&path, &["--json"]);
            let report: serde_json::Value = serde_json::from_str(&stdout).unwrap();
            assert_eq!((code, report["outcome"].as_str()), (0, Some("identical-readable-part")), "{name}");
            assert!(report["cut"]["time_s"].is_number(), "{name}: {stdout}");
            let (_, stdout, _) = run(&mut replay("info", &path));
            assert!(stdout.contains("complete    NO: the flight ends at T+"), "{name}: {stdout}");
            let (_, stdout, _) = run(replay("report", &path).args(["--output", "-"]));
            assert!(stdout.contains("ends at T+"), "{name}");
        }
    }
}
