//! Tests the verification of logs that only look whole, or hold several flights: a log without
//! comparisons is never "identical", every flight gets its own verdict, and a flight without its
//! end is reported as cut.

use std::path::{Path, PathBuf};

use prost::Message as _;
use protocol::log::computer_v1::ComputerFrame;
use protocol::log::record::{TOPIC_COMPUTER_START, TOPIC_VERDICT};
use replay::info::info;
use replay::verify::{Obstacle, Verification, VerifyReport, verify, verify_strictly};

use crate::command_line::{data, refusal, replay, run};
use crate::flown::only;
use crate::from_apogee::LANDED;
use crate::simulated::MK2;
use crate::tampered::{Held, LogMessage};

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
fn tamper(message: &mut LogMessage) {
    let turned = |number: f64| f64::from_bits(number.to_bits() ^ 1);
    let mut frame = ComputerFrame::decode(message.data.as_slice()).unwrap();
    frame.output.fins_rad[0] = turned(frame.output.fins_rad[0]);
    message.data = frame.encode_to_vec();
}

/// The number of frames of each flight of a log, and how many of them are identical, with the
/// outcome of each.
fn flights(path: &Path) -> Vec<(Verification, u64, u64)> {
    let of = |report: VerifyReport| (report.outcome, report.frames_recorded, report.frames_identical);
    verify(path).unwrap().into_iter().map(of).collect()
}

/// The start record again after all frames, all of which were changed.
#[test]
fn a_start_copied_to_the_end_hides_no_tampered_frame() {
    let directory = tempfile::tempdir().unwrap();
    let mut held = Held::read(&LANDED.log);
    let start = held.messages.iter().find(|message| message.topic == TOPIC_COMPUTER_START).unwrap().clone();
    let last_ns = held.messages.last().unwrap().log_time_ns;
    held.messages.push(start.at(last_ns));
    let honest = written(&held, &directory, "honest.mcap");
    let count = held.frames() as u64;
    held.messages.iter_mut().filter(|message| message.is_frame()).for_each(tamper);
    let nothing = (Verification::NotReplayable, 0, 0);
    let tampered = written(&held, &directory, "tampered.mcap");
    assert_eq!(flights(&tampered), [(Verification::Diverged, count, 0), nothing]);
    // Nothing follows the copy, so it must not be called "identical".
    assert_eq!(flights(&honest), [(Verification::Identical, count, count), nothing]);
    for (path, expected) in [(&tampered, 3), (&honest, 5)] {
        let (code, stdout, _) = run(&mut replay("verify", path));
        assert!(code == expected && !stdout.contains("0 of 0"), "{stdout}");
    }
}

/// The start record again in the middle: the frames after it do not begin a new flight.
#[test]
fn a_start_copied_into_the_middle_is_no_flight() {
    let directory = tempfile::tempdir().unwrap();
    let mut held = Held::read(&LANDED.log);
    let place = held.messages.len() / 2;
    let start = held.messages.iter().find(|message| message.topic == TOPIC_COMPUTER_START).unwrap().clone();
    held.messages.insert(place, start.at(held.messages[place].log_time_ns));
    let reports = verify(&written(&held, &directory, "middle.mcap")).unwrap();
    assert!(reports[0].outcome == Verification::IdenticalReadablePart && reports[0].cut.is_some());
    assert!(matches!(reports[1].obstacle, Some(Obstacle::BeginningMissing(_))), "{:?}", reports[1]);
}

#[test]
fn two_flights_in_one_file_have_two_verdicts_and_the_worst_decides() {
    let directory = tempfile::tempdir().unwrap();
    for log in logs() {
        let (a, mut b) = (Held::read(log), Held::read(log));
        let both = |b: &Held, name: &str| {
            let mut both = a.clone();
            both.append(b, 100_000_000_000);
            written(&both, &directory, name)
        };
        let path = both(&b, "both.mcap");
        let identical = (Verification::Identical, a.frames() as u64, a.frames() as u64);
        assert_eq!(flights(&path), [identical; 2]);
        // Strictly, each flight would have to be flown again from facts of its own.
        assert!(verify_strictly(&path).unwrap().iter().all(|report| !report.is_all_compared()));
        assert_eq!(
            [run(replay("verify", &path).arg("--strict")).0, run(&mut replay("verify", &path)).0],
            [3, 0]
        );
        let (_, reports) = data(&mut replay("verify", &path));
        assert_eq!((&reports[0]["flight"]["number"], &reports[1]["flight"]["of"]), (&1.into(), &2.into()));
        b.messages.iter_mut().filter(|message| message.is_frame()).skip(30).take(1).for_each(tamper);
        let (code, reports) = data(&mut replay("verify", &both(&b, "tampered.mcap")));
        assert_eq!((code, &reports[1]["outcome"]), (3, &"diverged".into()));
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
        for arguments in [
            &["evaluate"][..],
            &["refly"],
            &["verify", "--explain", "1"],
            &["report", "--out", "-"],
            &["compare"],
        ] {
            let mut command = replay(arguments[0], &path);
            command.args(&arguments[1..]).args((arguments[0] == "compare").then_some(&path));
            assert!(refusal(&mut command).contains("holds 2 flights"), "{arguments:?}");
        }
        assert_eq!(info(&path).unwrap().completeness.flights, 2);
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
        frames_only.retain(|message| {
            seen += usize::from(message.is_frame());
            !message.is_frame() || seen <= kept
        });
        let mut everything = whole.clone();
        everything.retain(|message| message.log_time_ns < last_ns);
        let mut no_verdict = whole.clone();
        no_verdict.retain(|message| message.topic != TOPIC_VERDICT);
        for (held, name) in [(frames_only, "frames"), (everything, "all"), (no_verdict, "verdict")] {
            let path = written(&held, &directory, &format!("{name}.mcap"));
            let count = held.frames() as u64;
            assert_eq!(flights(&path), [(Verification::IdenticalReadablePart, count, count)], "{name}");
            let cut = only(verify(&path).unwrap()).cut.unwrap();
            assert!(name == "verdict" || cut.phase == "POWERED", "{name}: {cut}");
            let codes = [&[][..], &["--strict"]].map(|more| run(replay("verify", &path).args(more)).0);
            assert_eq!(codes, [0, 3], "{name}");
            assert!(!info(&path).unwrap().completeness.complete, "{name}");
            let (_, page, _) = run(replay("report", &path).args(["--out", "-"]));
            let answers = [run(&mut replay("verify", &path)).1, run(&mut replay("info", &path)).1, page];
            assert!(answers.iter().all(|said| said.contains(&cut.to_string())), "{name}");
        }
    }
}
