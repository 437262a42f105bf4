//! The field: on the pad's check list, and in a replay.

use ground::model::{Degrees, Role, Settings};
use ground::replay::Player;
use ground::replay::recording::Recording;
use protocol::dialect::{
    GLOBAL_POSITION_INT_DATA, HEARTBEAT_DATA, HOME_POSITION_DATA, MavMessage, TD_FLIGHT_STATUS_DATA,
};
use protocol::field::{Field, Kind};
use protocol::frame::Encoder;
use protocol::identity::{Address, VEHICLE};
use protocol::log::record::{Direction, RawFrame, Record};
use protocol::log::recorder::Recorder;
use protocol::log::writer::LogHeader;

use crate::rig::{Rig, is_arm, settings, typed};

const PAD: Degrees = Degrees { latitude: 35.347, longitude: -117.809 };

/// A crowd line so far south of the pad, degrees of latitude; one is 110,947 m there.
fn text(south_deg: f64) -> String {
    let latitude = PAD.latitude - south_deg;
    format!(
        "{{\"type\":\"FeatureCollection\",\"features\":[{{\"type\":\"Feature\",\"properties\":{{\"kind\":\"crowd line\"}},\
         \"geometry\":{{\"type\":\"LineString\",\"coordinates\":[[-117.82,{latitude}],[-117.8,{latitude}]]}}}}]}}"
    )
}

fn home() -> MavMessage {
    let [latitude, longitude] = [PAD.latitude, PAD.longitude].map(|degrees| (degrees * 1e7).round() as i32);
    MavMessage::HOME_POSITION(HOME_POSITION_DATA { latitude, longitude, ..Default::default() })
}

/// A vehicle on its pad, ready but for the crowd line at this distance.
fn on_the_pad(south_deg: f64) -> Rig {
    let field = Field::parse(&text(south_deg), PAD, "test").ok();
    let mut rig = Rig::new(Settings { field, ..settings(false, true) });
    rig.run(1.0);
    rig.state(0.0, 0.0, 0.0, 0.0, 90.0);
    rig.limits();
    rig.receive(&home());
    rig.run(1.0);
    rig
}

#[test]
fn a_crowd_line_inside_the_fence_is_a_failed_check_and_is_not_armed() {
    let mut rig = on_the_pad(0.001);
    rig.keys(&typed("AARM"));
    rig.key(ground::key::Key::Enter);
    assert!(!rig.take_commands().iter().any(is_arm));
    rig.expect_event("cannot arm: CROWD LINE INSIDE THE FENCE: 111 m of 120 m from the pad");
    rig.expect_screen("NO-GO: CROWD LINE INSIDE THE FENCE");
    for (columns, rows) in [(80, 24), (140, 45), (200, 60)] {
        let screen = rig.screen(columns, rows);
        assert!(screen.contains("NO  crowd line  111 m, fence 120 m"), "{screen}");
    }
}

#[test]
fn a_crowd_line_outside_the_fence_passes() {
    let mut rig = on_the_pad(0.002);
    let screen = rig.screen(140, 45);
    assert!(screen.contains("     crowd line  222 m, fence 120 m"), "{screen}");
    rig.keys(&typed("AARM"));
    rig.key(ground::key::Key::Enter);
    assert!(rig.take_commands().iter().any(is_arm));
}

/// A station's log and a vehicle's have the field among the facts about the run.
#[test]
fn a_replay_draws_the_field_of_the_log() {
    let folder = tempfile::tempdir().unwrap();
    let played = |name: &str, run: &[(&str, &str)], frames: &[MavMessage]| {
        let path = folder.path().join(name);
        let run = run.iter().map(|(fact, text)| ((*fact).to_owned(), (*text).to_owned())).collect();
        let log = Recorder::create(&path, false, &LogHeader { run, ..LogHeader::default() }).unwrap();
        let mut encoder = Encoder::new(VEHICLE);
        for message in frames {
            let bytes = encoder.encode(message).as_bytes().to_vec();
            let link = "udp".to_owned();
            let frame = RawFrame { direction: Direction::Rx, endpoint: "ground", link, bytes };
            log.record(Record::RawFrame(frame), 0);
        }
        log.finish().unwrap();
        let recording = Recording::load(&path, None).unwrap();
        Player::new(recording, Settings { role: Role::Replaying, ..settings(false, true) }).model
    };
    let model = played("station.mcap", &[("field", &text(0.001))], &[home()]);
    let kinds: Vec<Kind> =
        model.settings.field.iter().flat_map(|field| &field.lines).map(|of| of.kind).collect();
    assert_eq!(kinds, [Kind::CrowdLine]);
    for (name, run, frames) in [
        ("no field.mcap", vec![], vec![home()]),
        ("not a field.mcap", vec![("field", "pond")], vec![home()]),
        ("no pad.mcap", vec![("field", "{}")], vec![MavMessage::HEARTBEAT(HEARTBEAT_DATA::default())]),
    ] {
        assert_eq!(played(name, &run, &frames).settings.field, None, "{name}");
    }
}

/// A tracker may be received first; its position is played, too.
#[test]
fn a_replay_shows_the_vehicle_and_not_a_tracker_that_was_received_before() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("station.mcap");
    let log = Recorder::create(&path, false, &LogHeader::default()).unwrap();
    let tracker = Address { system_id: 7, ..VEHICLE };
    let position = MavMessage::GLOBAL_POSITION_INT(GLOBAL_POSITION_INT_DATA {
        lat: 353_470_000,
        lon: -1_178_090_000,
        ..Default::default()
    });
    let status = MavMessage::TD_FLIGHT_STATUS(TD_FLIGHT_STATUS_DATA { boot_number: 5, ..Default::default() });
    for (source, message) in
        [(tracker, &position), (VEHICLE, &status), (VEHICLE, &home()), (tracker, &position)]
    {
        let bytes = Encoder::new(source).encode(message).as_bytes().to_vec();
        let frame = RawFrame { direction: Direction::Rx, endpoint: "ground", link: "udp".to_owned(), bytes };
        log.record(Record::RawFrame(frame), 0);
    }
    log.finish().unwrap();
    let recording = Recording::load(&path, None).unwrap();
    assert_eq!(recording.vehicle, Some(VEHICLE));
    let model = Player::new(recording, Settings { role: Role::Replaying, ..settings(false, true) }).model;
    assert!(model.events.newest(9).any(|event| event.text.starts_with("system 7 reports its position")));
}
