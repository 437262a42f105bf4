//! Tests the content of a recording.

use std::collections::BTreeSet;

use re_lenses::Selector;
use replay_rerun::{BESIDE, FLIGHT_TIME, PLOTS, export};

use crate::flown::MK2;
use crate::logs::{FRAMES, START_UNIX_NS, folder, forced, write_apogee_log, write_log, write_telemetry_log};
use crate::read_back::Recording;

#[test]
fn a_flight_is_exported_whole() {
    let (_folder, log, rrd) = folder();
    write_log(&log, true);
    let exported = export(&log, None, (&rrd).into()).unwrap();
    let [own] = exported.as_slice() else { panic!("{exported:?}") };
    assert_eq!((own.poses, own.events), (FRAMES as usize, 1));
    assert_eq!((&own.damage, &own.mission_problem), (&None, &None));

    let recording = Recording::read(&rrd);
    assert_eq!(recording.application, "touchdown");
    assert_eq!(recording.ids, BTreeSet::from([format!("{START_UNIX_NS}-flight")]));
    assert_eq!(recording.layouts, 1);
    assert!(recording.layout_chunks > 10);
    for topic in ["tf", "vehicle/truth3d", "computer/frame", "world/rocket", "world/followed"] {
        assert_eq!(recording.rows(topic), FRAMES as usize, "{topic}");
    }
    assert_eq!(recording.rows("verdict"), 1);
    for drawn in ["rocket/body", "rocket/legs", "rocket/bell", "pad", "pad/limit", "flown"] {
        assert!(recording.is_static(&format!("world/{drawn}")), "{drawn}");
    }
    let times_ns = recording.times("world/rocket", FLIGHT_TIME);
    assert_eq!(times_ns, [5_000_000, 10_000_000, 15_000_000, 20_000_000]);
    assert_eq!(recording.times("verdict", FLIGHT_TIME), [20_000_000]);
}

/// The pose and the text are of the kinds that a viewer draws.
#[test]
fn the_pose_and_the_events_are_what_a_viewer_draws() {
    let (_folder, log, rrd) = folder();
    write_apogee_log(&log);
    export(&log, None, (&rrd).into()).unwrap();
    let recording = Recording::read(&rrd);
    let translations_m: Vec<[f32; 3]> = recording
        .of("world/rocket")
        .flat_map(|chunk| chunk.iter_slices::<[f32; 3]>("Transform3D:translation".into()))
        .flatten()
        .copied()
        .collect();
    assert_eq!(translations_m.len(), FRAMES as usize);
    assert_eq!((translations_m[0], translations_m[3]), ([3.0, -4.0, 100.0], [3.0, -4.0, 85.0]));
    let has = |entity: &str, component: &'static str| {
        recording.of(entity).any(|chunk| chunk.components().contains_key(&component.into()))
    };
    assert!(
        has("world/rocket", "Transform3D:quaternion") && !has("world/followed", "Transform3D:quaternion")
    );
    write_log(&log, true);
    export(&log, None, forced(&rrd)).unwrap();
    let recording = Recording::read(&rrd);
    assert!(recording.of("events").any(|chunk| chunk.components().contains_key(&"TextLog:text".into())));
}

/// A plot whose field does not exist is empty in the viewer, and nothing says so.
#[test]
fn every_plot_of_the_layout_has_its_fields() {
    let (folder, log, station) = folder();
    let rrd = folder.path().join("both.rrd");
    write_apogee_log(&log);
    write_telemetry_log(&station);
    for plot in &PLOTS {
        let log = match plot.topic {
            "/pilot/timing" => &MK2.log,
            "/telemetry" => &station,
            _ => &log,
        };
        export(log, None, forced(&rrd)).unwrap();
        let recording = Recording::read(&rrd);
        for field in plot.fields {
            let selector: Selector = field.parse().unwrap();
            let component = rerun::ComponentIdentifier::try_new(plot.component()).unwrap();
            let chunks = recording.of(plot.topic.trim_start_matches('/'));
            let messages = chunks.filter_map(|chunk| chunk.components().get_array(component));
            let values = messages.map(|messages| {
                let selected = selector.execute_per_row(messages).unwrap();
                selected.map_or(0, |values| values.values().len())
            });
            assert!(values.sum::<usize>() > 0, "{} {field}", plot.topic);
        }
    }
}

#[test]
fn two_flights_lie_in_one_recording_on_one_clock() {
    let (folder, log, rrd) = folder();
    let other = folder.path().join("other.mcap");
    write_log(&log, true);
    write_apogee_log(&other);
    let exported = export(&log, Some(&other), (&rrd).into()).unwrap();
    assert_eq!(exported.iter().map(|exported| exported.poses).collect::<Vec<_>>(), [4, 4]);
    let both = Recording::read(&rrd);
    assert_eq!((both.ids.len(), both.layouts), (1, 1));
    let beside = |entity: &str| format!("{}/{entity}", BESIDE.trim_start_matches('/'));
    assert!(both.is_static(&beside("world/rocket/body")) && both.is_static("world/rocket/body"));
    assert_eq!(both.times("world/rocket", FLIGHT_TIME)[..2], [5_000_000, 10_000_000]);
    assert_eq!(both.times(&beside("world/rocket"), FLIGHT_TIME)[..2], [0, 500_000_000]);
    assert_eq!(both.rows("vehicle/truth3d"), both.rows(&beside("vehicle/truth3d")));
}
