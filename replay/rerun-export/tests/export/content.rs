//! Tests the content of a recording.

use std::collections::BTreeSet;

use replay_rerun::{Overwrite, entity, export_file};

use crate::logs::{START_UNIX_NS, TICKS, folder, write_apogee_log, write_log, write_telemetry_log};
use crate::read_back::Recording;

#[test]
fn a_flight_is_exported_whole() {
    let (_folder, log, rrd) = folder();
    write_log(&log, true);
    let exported = export_file(&log, &rrd, Overwrite::Never).unwrap();
    assert_eq!((exported.ticks, exported.poses, exported.events), (TICKS, TICKS, 1));
    assert_eq!((exported.damage, exported.unreadable), (None, 0));

    let recording = Recording::read(&rrd);
    assert_eq!(recording.application, "touchdown");
    assert_eq!(recording.ids, BTreeSet::from([format!("recorded-{START_UNIX_NS}-flight")]));
    assert_eq!(recording.layouts, 1);
    assert!(recording.layout_chunks > 10);
    let ticks = TICKS as usize;
    for (path, rows) in [
        (entity::ROCKET, ticks),
        (entity::NOZZLE, ticks),
        (entity::THRUST, ticks),
        (entity::PHASE, 1),
        (entity::LEVEL, 1),
        (entity::LEVEL_REPLAYED, 1),
        (entity::EVENTS, 1),
        (entity::VERDICT, 1),
        ("plots/altitude_m/true", ticks),
        ("plots/gimbal_pitch_deg/commanded", ticks),
        ("plots/gimbal_pitch_deg/replayed", ticks),
        ("plots/gimbal_pitch_deg/limit_high", 2),
        ("plots/vertical_m_s/limit_low", 2),
    ] {
        assert_eq!(recording.rows(path), rows, "{path}");
    }
    for path in [entity::BODY, entity::PAD, entity::PAD_LIMIT, entity::FLOWN, entity::REPORT] {
        assert!(recording.is_static(path), "{path}");
    }
    assert_eq!(recording.times(entity::ROCKET, entity::TIMELINE_TICK), [1, 2, 3, 4]);
    let times_ns = recording.times(entity::ROCKET, entity::TIMELINE_FLIGHT_TIME);
    assert_eq!(times_ns, [5_000_000, 10_000_000, 15_000_000, 20_000_000]);
    assert_eq!(recording.times(entity::VERDICT, entity::TIMELINE_FLIGHT_TIME), [20_000_000]);
    let timelines: BTreeSet<String> =
        recording.chunks.iter().flat_map(|chunk| chunk.timelines().keys()).map(ToString::to_string).collect();
    assert_eq!(timelines, BTreeSet::from(["flight_time".to_owned(), "tick".to_owned()]));
}

#[test]
fn without_the_truth_the_decisions_are_shown() {
    let (_folder, log, rrd) = folder();
    write_log(&log, false);
    let exported = export_file(&log, &rrd, Overwrite::Never).unwrap();
    assert_eq!((exported.ticks, exported.poses), (TICKS, 0));
    let recording = Recording::read(&rrd);
    assert_eq!(recording.rows(entity::ROCKET), 0);
    assert_eq!(recording.rows("plots/fins_mean_deg/replayed"), TICKS as usize);
}

#[test]
fn a_flight_from_apogee_is_shown_in_space() {
    let (_folder, log, rrd) = folder();
    write_apogee_log(&log);
    let exported = export_file(&log, &rrd, Overwrite::Never).unwrap();
    assert_eq!((exported.ticks, exported.poses, exported.profile_problem), (TICKS, TICKS, None));
    let recording = Recording::read(&rrd);
    assert_eq!(recording.layouts, 1);
    for path in [
        entity::ROCKET,
        entity::NOZZLE,
        "plots/altitude_m/true",
        "plots/y_m/true",
        "plots/vertical_m_s/true",
        "plots/tilt_deg/true",
        "plots/gimbal_yaw_deg/actual",
        "plots/fins_mean_deg/commanded",
    ] {
        assert_eq!(recording.rows(path), TICKS as usize, "{path}");
    }
    assert_eq!(recording.rows(entity::PHASE), 1);
    assert_eq!(recording.rows("plots/gimbal_yaw_deg/limit_high"), 2);
    assert!(recording.is_static(entity::FLOWN) && recording.is_static(entity::PAD_LIMIT));
    assert_eq!(recording.times(entity::ROCKET, entity::TIMELINE_TICK), [1, 100, 200, 300]);
}

#[test]
fn without_a_vehicle_the_telemetry_is_shown() {
    let (_folder, log, rrd) = folder();
    write_telemetry_log(&log);
    let exported = export_file(&log, &rrd, Overwrite::Never).unwrap();
    assert_eq!((exported.ticks, exported.poses), (0, 2));
    let recording = Recording::read(&rrd);
    assert_eq!(recording.rows("plots/altitude_m/telemetry"), 2);
    assert_eq!(recording.rows("plots/level/controller"), 3);
    assert_eq!(recording.rows(entity::PHASE), 1);
    let times_ns = recording.times(entity::ROCKET, entity::TIMELINE_FLIGHT_TIME);
    assert_eq!(times_ns, [1_000_000_000, 2_000_000_000]);
}
