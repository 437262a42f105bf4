//! Tests logs whose frames cannot all be re-executed: the reason is named, and the other frames are
//! compared.

use std::io::Cursor;
use std::path::PathBuf;

use prost::Message as _;
use protocol::log::computer_v1::ComputerFrame;
use protocol::log::record::TOPIC_COMPUTER_START;
use replay::evaluate::evaluate;
use replay::info::{GradeLevel, Info, info, info_of};
use replay::log::{FlightLog, Gap, Recording};
use replay::verify::{Obstacle, Verification, verify};

use crate::flown::{COMPLETE, FLIGHT, MISSION, Recipe, only, verify_bytes, verify_frames, write_log};
use crate::tampered::Held;

fn info_of_bytes(bytes: &[u8]) -> Info {
    info_of(&mut FlightLog::read("test.mcap".to_owned(), bytes).unwrap()).unwrap()
}

#[test]
fn a_log_without_a_profile_or_with_one_of_another_kind_is_refused() {
    for (profile_toml, is_there) in [(None, false), (Some("name = \"x\"\nwings = 2\n".to_owned()), true)] {
        let bytes = write_log(&FLIGHT.frames[..3], &Recipe { profile_toml, ..Recipe::default() }).bytes;
        let report = verify_bytes(&bytes).unwrap();
        assert_eq!((report.outcome, report.frames_recorded), (Verification::NotReplayable, 3));
        match report.obstacle {
            Some(Obstacle::NoProfile) => assert!(!is_there),
            Some(Obstacle::ProfileUnreadable(_)) => assert!(is_there),
            other => panic!("{other:?}"),
        }
        assert_eq!(info_of_bytes(&bytes).grade.level, GradeLevel::Numeric);
    }
}

/// The log of these frames, which has lost some of them: the numbers of its records have a gap.
fn lossy(frames: &[ComputerFrame], kept: impl Fn(u64) -> bool) -> (tempfile::TempDir, PathBuf) {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("lossy.mcap");
    std::fs::write(&path, write_log(frames, &Recipe::default()).bytes).unwrap();
    let mut held = Held::read(&path);
    held.retain(|message| {
        !message.is_frame() || kept(ComputerFrame::decode(message.data.as_slice()).unwrap().input.frame)
    });
    held.write(&path);
    (directory, path)
}

#[test]
fn a_log_without_its_first_frames_is_refused() {
    let (_directory, path) = lossy(&FLIGHT.frames[..5], |frame| frame > 2);
    let report = only(verify(&path).unwrap());
    assert_eq!(report.obstacle, Some(Obstacle::BeginningMissing(3)));
    assert_eq!((report.outcome, report.frames_compared), (Verification::NotReplayable, 0));
}

#[test]
fn frames_before_a_gap_are_compared() {
    let mut frames = FLIGHT.frames[..9].to_vec();
    let kept = |frame| !(5..7).contains(&frame);
    let (_directory, path) = lossy(&frames, kept);
    let report = only(verify(&path).unwrap());
    assert_eq!(report.obstacle, Some(Obstacle::Gap(Gap { after: 4, before: 7 })));
    assert_eq!((report.outcome, report.frames_identical), (Verification::NotReplayable, 4));

    let info = info(&path).unwrap();
    assert_eq!((info.completeness.complete, info.completeness.messages_lost), (false, 2));
    assert!(info.grade.reason.starts_with("up to frame 4"), "{}", info.grade.reason);

    frames[2].output.gimbal_rad[0] = 0.5;
    let (_directory, path) = lossy(&frames, kept);
    let report = only(verify(&path).unwrap());
    assert_eq!(report.outcome, Verification::Diverged, "a difference before the gap is still a difference");
}

#[test]
fn an_input_of_another_version_is_refused() {
    let mut frames = FLIGHT.frames[..4].to_vec();
    frames[3].input.fins_rad.pop();
    let report = verify_frames(&frames);
    assert_eq!((report.outcome, report.frames_identical), (Verification::NotReplayable, 3));
    assert!(matches!(report.obstacle, Some(Obstacle::Frame(_))), "{report:?}");
}

/// What the computer began from is lost, or a frame is there twice.
#[test]
fn a_log_without_its_start_or_with_a_frame_twice_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("flight.mcap");
    std::fs::write(&path, &COMPLETE.bytes).unwrap();
    let mut held = Held::read(&path);
    held.retain(|message| message.topic != TOPIC_COMPUTER_START);
    held.write(&path);
    assert_eq!(only(verify(&path).unwrap()).obstacle, Some(Obstacle::NoStart));
    assert_eq!(info(&path).unwrap().grade.level, GradeLevel::Numeric);
    let mut twice = FLIGHT.frames[..9].to_vec();
    twice.push(twice[8].clone());
    let report = verify_frames(&twice);
    assert!(matches!(report.obstacle, Some(Obstacle::Frame(_))), "{report:?}");
    assert_eq!(report.frames_identical, 9);
}

/// A frame with an unknown field was decided by code that this build does not have.
#[test]
fn a_frame_of_a_newer_version_is_refused() {
    let mut writer =
        mcap::WriteOptions::new().library("touchdown test").create(Cursor::new(Vec::new())).unwrap();
    let schema = writer.add_schema("touchdown.computer.v1.ComputerFrame", "protobuf", &[]).unwrap();
    let channel = writer
        .add_channel(schema, "/computer/frame", "protobuf", &std::collections::BTreeMap::new())
        .unwrap();
    let mut data = ComputerFrame::default().encode_to_vec();
    data.extend([0x78, 0x01]);
    let header =
        mcap::records::MessageHeader { channel_id: channel, sequence: 0, log_time: 1, publish_time: 1 };
    writer.write_to_known_channel(&header, &data).unwrap();
    writer.finish().unwrap();
    let bytes = writer.into_inner().into_inner();
    let report = verify_bytes(&bytes).unwrap();
    assert_eq!(report.outcome, Verification::NotReplayable);
    let recording =
        Recording::read(&mut FlightLog::read("test.mcap".to_owned(), &bytes[..]).unwrap()).unwrap();
    for reason in [
        report.obstacle.unwrap().to_string(),
        evaluate(&recording, &[]).unwrap_err().to_string(),
        recording.replayable_frames().unwrap_err().to_string(),
    ] {
        assert!(reason.contains("newer version"), "{reason}");
    }
}

#[test]
fn the_complete_flight_is_described() {
    let info = info_of_bytes(&COMPLETE.bytes);
    assert_eq!(info.grade.level, GradeLevel::BitExact);
    assert!(info.completeness.complete);
    assert_eq!(info.run.get("seed").map(String::as_str), Some("1"));
    assert_eq!(info.profile.unwrap().name.as_deref(), Some(MISSION));
    assert_eq!(info.build_comparison.differences, []);
    let frames = info.frames.unwrap();
    assert_eq!((frames.first, frames.last, frames.lost), (1, FLIGHT.frames.len() as u64, 0));
    let latency = frames.latency.unwrap();
    assert!((latency.max_s - 0.007).abs() < 1e-12);
    assert!((latency.median_s - 0.004).abs() < 1e-12);
    let phases: Vec<&str> = info.phases[0].spans.iter().map(|span| span.phase.as_str()).collect();
    assert_eq!(phases, ["DEPLOY", "AERO_DESCENT"]);
    assert_eq!(info.verdict.unwrap().envelope.len(), 4);
    let frames = info.channels.iter().find(|channel| channel.topic == "/mavlink/tx/raw").unwrap();
    assert_eq!((frames.messages, frames.lost), (FLIGHT.frames.len() as u64, 0));
}
