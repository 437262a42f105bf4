//! Tests logs whose ticks cannot all be re-executed: the reason is named, and the other ticks are compared.

use std::io::Cursor;

use protocol::log::v1::ControllerTick;
use replay::evaluate::evaluate;
use replay::info::{GradeLevel, Info, info_of};
use replay::log::{FlightLog, Recording};
use replay::verify::{Obstacle, Verification};

use crate::flown::{FLIGHT, PROFILE, Recipe, WHOLE, verify_bytes, verify_ticks, write_log};

fn info_of_bytes(bytes: &[u8]) -> Info {
    info_of(&mut FlightLog::read("test.mcap".to_owned(), bytes).unwrap(), || None).unwrap()
}

#[test]
fn a_log_without_ticks_is_refused() {
    let bytes = write_log(&[], &Recipe::default()).bytes;
    let report = verify_bytes(&bytes).unwrap();
    assert_eq!((report.outcome, report.obstacle), (Verification::NotReplayable, Some(Obstacle::NoTicks)));
    assert_eq!(info_of_bytes(&bytes).grade.level, GradeLevel::TelemetryOnly);
}

#[test]
fn a_log_without_a_profile_is_refused() {
    let bytes = write_log(&FLIGHT.ticks[..3], &Recipe { profile_toml: None, ..Recipe::default() }).bytes;
    let report = verify_bytes(&bytes).unwrap();
    assert_eq!((report.outcome, report.obstacle), (Verification::NotReplayable, Some(Obstacle::NoProfile)));
    assert_eq!(report.ticks_recorded, 3);
    assert_eq!(info_of_bytes(&bytes).grade.level, GradeLevel::Numeric);
}

#[test]
fn a_profile_of_another_kind_is_refused() {
    let profile_toml = Some("name = \"x\"\nwings = 2\n".to_owned());
    let bytes = write_log(&FLIGHT.ticks[..3], &Recipe { profile_toml, ..Recipe::default() }).bytes;
    let report = verify_bytes(&bytes).unwrap();
    assert_eq!(report.outcome, Verification::NotReplayable);
    let reason = report.obstacle.unwrap().to_string();
    assert!(reason.contains("profile.toml"), "{reason}");
    assert_eq!(info_of_bytes(&bytes).grade.level, GradeLevel::Numeric);
}

#[test]
fn a_log_without_its_first_ticks_is_refused() {
    let report = verify_ticks(&FLIGHT.ticks[2..5]);
    assert_eq!(report.obstacle, Some(Obstacle::BeginningMissing { first: 2 }));
    assert_eq!((report.outcome, report.ticks_compared), (Verification::NotReplayable, 0));
}

#[test]
fn ticks_before_a_gap_are_compared() {
    let mut ticks = FLIGHT.ticks[..9].to_vec();
    ticks.drain(4..6);
    let report = verify_ticks(&ticks);
    assert_eq!(report.obstacle, Some(Obstacle::Gap { after: 3, before: 6 }));
    assert_eq!((report.outcome, report.ticks_identical), (Verification::NotReplayable, 4));

    let info = info_of_bytes(&write_log(&ticks, &Recipe::default()).bytes);
    assert_eq!((info.completeness.complete, info.completeness.ticks_missing), (false, 2));
    assert!(info.grade.reason.starts_with("up to tick 3"), "{}", info.grade.reason);

    ticks[2].output.gimbal_command_rad = 0.5;
    let report = verify_ticks(&ticks);
    assert_eq!(report.outcome, Verification::Diverged, "a difference before the gap is still a difference");
}

#[test]
fn ticks_out_of_order_are_sorted() {
    let mut ticks = FLIGHT.ticks[..9].to_vec();
    ticks[1..7].reverse();
    let report = verify_ticks(&ticks);
    assert_eq!((report.ticks_identical, report.ticks_different, report.obstacle), (9, 0, None));
}

#[test]
fn a_repeated_tick_is_reported() {
    let mut ticks = FLIGHT.ticks[..4].to_vec();
    ticks.push(ticks[2].clone());
    let report = verify_ticks(&ticks);
    assert_eq!(report.obstacle, Some(Obstacle::Repeated { tick: 2 }));
    assert_eq!((report.outcome, report.ticks_identical), (Verification::NotReplayable, 4));
}

#[test]
fn a_phase_of_another_version_is_refused() {
    let mut ticks = FLIGHT.ticks[..4].to_vec();
    ticks[3].input.phase = 77;
    let report = verify_ticks(&ticks);
    assert_eq!((report.outcome, report.ticks_identical), (Verification::NotReplayable, 3));
    assert!(report.obstacle.unwrap().to_string().contains("phase 77"));
}

/// A tick with an unknown field was decided by code that this build does not have.
#[test]
fn a_tick_of_a_newer_version_is_refused() {
    let mut writer =
        mcap::WriteOptions::new().library("touchdown test").create(Cursor::new(Vec::new())).unwrap();
    let schema = writer.add_schema("touchdown.log.v1.ControllerTick", "protobuf", &[]).unwrap();
    let channel = writer
        .add_channel(schema, "/controller/tick", "protobuf", &std::collections::BTreeMap::new())
        .unwrap();
    let mut data = prost::Message::encode_to_vec(&ControllerTick::default());
    data.extend([0x78, 0x01]);
    let header =
        mcap::records::MessageHeader { channel_id: channel, sequence: 0, log_time: 1, publish_time: 1 };
    writer.write_to_known_channel(&header, &data).unwrap();
    writer.finish().unwrap();
    let bytes = writer.into_inner().into_inner();
    let report = verify_bytes(&bytes).unwrap();
    assert_eq!(report.outcome, Verification::NotReplayable);
    let reason = report.obstacle.unwrap().to_string();
    assert!(reason.contains("newer version"), "{reason}");
    let recording =
        Recording::read(&mut FlightLog::read("test.mcap".to_owned(), &bytes[..]).unwrap()).unwrap();
    let reason = evaluate(&recording, &[]).unwrap_err().to_string();
    assert!(reason.contains("newer version"), "{reason}");
    let reason = recording.replayable_ticks().unwrap_err().to_string();
    assert!(reason.contains("newer version"), "{reason}");
}

#[test]
fn the_whole_flight_is_described() {
    let info = info_of_bytes(&WHOLE.bytes);
    assert_eq!(info.grade.level, GradeLevel::BitExact);
    assert!(info.completeness.complete);
    assert_eq!(info.run.get("seed").map(String::as_str), Some("7"));
    assert_eq!(info.profile.unwrap().name.as_deref(), Some(PROFILE));
    assert_eq!(info.build_comparison.differences, []);
    let ticks = info.ticks.unwrap();
    assert_eq!((ticks.first, ticks.count, ticks.missing), (0, FLIGHT.ticks.len() as u64, 0));
    assert!((ticks.solve_time.max_s - 0.007).abs() < 1e-12);
    assert!((ticks.solve_time.median_s - 0.004).abs() < 1e-12);
    let phases: Vec<&str> = info.phases[0].spans.iter().map(|span| span.phase.as_str()).collect();
    assert_eq!(phases, ["PAD_IDLE", "PAD_ARMED", "IGNITION", "POWERED"]);
    assert_eq!(info.verdict.unwrap().limits.len(), 6);
    let frames = info.channels.iter().find(|channel| channel.topic == "/mavlink/tx/raw").unwrap();
    assert_eq!((frames.messages, frames.lost), (FLIGHT.ticks.len() as u64, 0));
}
