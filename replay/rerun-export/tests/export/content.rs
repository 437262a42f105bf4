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
    assert_eq!((exported.ticks, exported.poses, exported.events), (TICKS, 10 * TICKS, 1));
    assert_eq!((exported.damage, exported.unreadable), (None, 0));

    let recording = Recording::read(&rrd);
    assert_eq!(recording.application, "touchdown");
    assert_eq!(recording.ids, BTreeSet::from([format!("recorded-{START_UNIX_NS}-flight")]));
    assert_eq!(recording.layouts, 1);
    assert!(recording.layout_chunks > 10);
    let (ticks, poses) = (TICKS as usize, 10 * TICKS as usize);
    for (path, rows) in [
        (entity::ROCKET, poses),
        (entity::NOZZLE, poses),
        (entity::THRUST, poses),
        (entity::PREDICTED, ticks),
        (entity::PREDICTED_TOUCHDOWN, ticks),
        (entity::PHASE, 1),
        (entity::LEVEL, 1),
        (entity::EVENTS, 1),
        (entity::VERDICT, 1),
        ("plots/altitude_m/true", poses),
        ("plots/altitude_m/estimated", ticks),
        ("plots/gimbal_deg/commanded", poses),
        ("plots/gimbal_deg/limit_high", 2),
        ("plots/u_m_s/limit_low", 2),
        ("plots/q_deg_s/limit_high", 2),
        ("plots/solve_time_ms/controller", ticks),
        ("plots/iterations/controller", ticks),
        ("plots/level/controller", ticks),
    ] {
        assert_eq!(recording.rows(path), rows, "{path}");
    }
    for path in
        [entity::BODY, entity::PAD, entity::PAD_LIMIT, entity::FLOWN, entity::FIRST_PLAN, entity::REPORT]
    {
        assert!(recording.is_static(path), "{path}");
    }
    assert_eq!(recording.times(entity::PREDICTED, entity::TIMELINE_TICK), [0, 1, 2, 3]);
    let times_ns = recording.times(entity::PREDICTED, entity::TIMELINE_FLIGHT_TIME);
    assert_eq!(times_ns, [0, 100_000_000, 200_000_000, 300_000_000]);
    assert_eq!(recording.times(entity::VERDICT, entity::TIMELINE_FLIGHT_TIME), [400_000_000]);
    let timelines: BTreeSet<String> =
        recording.chunks.iter().flat_map(|chunk| chunk.timelines().keys()).map(ToString::to_string).collect();
    assert_eq!(timelines, BTreeSet::from(["flight_time".to_owned(), "tick".to_owned()]));
}

#[test]
fn without_a_plant_the_estimate_is_shown() {
    let (_folder, log, rrd) = folder();
    write_log(&log, false);
    let exported = export_file(&log, &rrd, Overwrite::Never).unwrap();
    assert_eq!((exported.ticks, exported.poses), (TICKS, TICKS));
    let recording = Recording::read(&rrd);
    assert_eq!(recording.rows(entity::ROCKET), TICKS as usize);
    assert_eq!(recording.rows(entity::THRUST), 0);
    assert_eq!(recording.rows("plots/gimbal_deg/actual"), TICKS as usize);
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
    assert_eq!(recording.times(entity::ROCKET, entity::TIMELINE_TICK), [1, 2, 3, 4]);
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
