//! Tests the content of a recording.

use std::collections::BTreeSet;

use re_lenses::Selector;
use replay_rerun::{FLIGHT_TIME, PLOTS, component, export};

use crate::flown::{MK2, WITH_FRAMES};
use crate::logs::{FRAMES, START_UNIX_NS, cleared, folder, write_log, write_log_from};
use crate::read_back::Recording;
use crate::station::station_log;

#[test]
fn a_complete_flight_is_exported() {
    let (_folder, log, rrd) = folder();
    write_log(&log);
    let (_, exported) = export(&log, None, &rrd).unwrap();
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
    for drawn in ["rocket/body", "rocket/nose", "rocket/legs", "rocket/bell", "pad", "pad/limit", "flown"] {
        assert!(recording.is_static(&format!("world/{drawn}")), "{drawn}");
    }
    let times_ns = recording.times("world/rocket", FLIGHT_TIME);
    assert_eq!(times_ns, [5_000_000, 10_000_000, 15_000_000, 20_000_000]);
    assert_eq!(recording.times("verdict", FLIGHT_TIME), [20_000_000]);
}

/// The pose is the log's, and pose and text are of the kinds that a viewer draws.
#[test]
fn the_pose_and_the_events_are_what_a_viewer_draws() {
    let (_folder, log, rrd) = folder();
    write_log(&log);
    export(&log, None, &rrd).unwrap();
    let recording = Recording::read(&rrd);
    let rocket = recording.of("world/rocket");
    let drawn_m = rocket.flat_map(|chunk| chunk.iter_slices::<[f32; 3]>("Transform3D:translation".into()));
    let world = replay::log::Recording::open(&log).unwrap().world;
    let flown_m = world.iter().map(|truth| &truth.state.position_m);
    let flown_m = flown_m.map(|at| [at.x, at.y, at.z].map(|value| value as f32));
    assert_eq!(drawn_m.flatten().copied().collect::<Vec<_>>(), flown_m.collect::<Vec<_>>());
    let has = |entity: &str, component: &'static str| {
        recording.of(entity).any(|chunk| chunk.components().contains_key(&component.into()))
    };
    assert!(has("world/rocket", "Transform3D:quaternion") && has("events", "TextLog:text"));
    assert!(!has("world/followed", "Transform3D:quaternion"));
}

/// A plot whose field does not exist is empty in the viewer, and nothing says so.
#[test]
fn every_plot_of_the_layout_has_its_fields() {
    let (_folder, log, rrd) = folder();
    let station = station_log(&WITH_FRAMES.log, "station.mcap");
    write_log(&log);
    for (title, [topic, message], fields) in PLOTS {
        let log = match topic {
            "/pilot/timing" => &MK2.log,
            "/telemetry" => &station,
            _ => &log,
        };
        export(log, None, cleared(&rrd)).unwrap();
        let recording = Recording::read(&rrd);
        for field in fields {
            let selector: Selector = field.parse().unwrap();
            let component = rerun::ComponentIdentifier::try_new(component(message)).unwrap();
            let chunks = recording.of(topic.trim_start_matches('/'));
            let messages = chunks.filter_map(|chunk| chunk.components().get_array(component));
            let values = messages.map(|messages| {
                let selected = selector.execute_per_row(messages).unwrap();
                selected.map_or(0, |values| values.values().len())
            });
            assert!(values.sum::<usize>() > 0, "{title} {field}");
        }
    }
}

#[test]
fn two_flights_lie_in_one_recording_on_one_clock() {
    let (folder, log, rrd) = folder();
    let other = folder.path().join("other.mcap");
    write_log(&log);
    write_log_from(&other, START_UNIX_NS + 1_000_000_000);
    let (_, exported) = export(&log, Some(&other), &rrd).unwrap();
    assert!(exported.iter().map(|exported| exported.poses).eq([4, 4]), "{exported:?}");
    let both = Recording::read(&rrd);
    assert_eq!((both.ids.len(), both.layouts), (1, 1));
    for below in ["", "beside/"] {
        assert!(both.is_static(&format!("{below}world/rocket/body")));
        let times_ns = both.times(&format!("{below}world/rocket"), FLIGHT_TIME);
        assert_eq!(times_ns[..2], [5_000_000, 10_000_000]);
        assert_eq!(both.rows(&format!("{below}vehicle/truth3d")), FRAMES as usize);
    }
}
