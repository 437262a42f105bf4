//! The way from the station's own position, and a second vehicle that reports its position.

use ground::key::Key;
use ground::model::{Amount, Degrees, Page, Settings, Talk};
use ground::update::{Action, Msg};
use protocol::dialect::{GLOBAL_POSITION_INT_DATA, HEARTBEAT_DATA, HOME_POSITION_DATA, MavMessage, TdPhase};
use protocol::identity::{Address, VEHICLE};

use crate::rig::{Rig, enter, is_abort, is_arm, settings, typed};
use crate::screens::{armed, descending, on_the_pad};

const PAD: Degrees = Degrees { latitude: 35.347, longitude: -117.809 };
const TRACKER: Address = Address { system_id: 7, component_id: 1 };

fn e7(at: Degrees) -> [i32; 2] {
    [at.latitude, at.longitude].map(|degrees| (degrees * 1e7).round() as i32)
}

fn home() -> MavMessage {
    let [latitude, longitude] = e7(PAD);
    MavMessage::HOME_POSITION(HOME_POSITION_DATA { latitude, longitude, ..Default::default() })
}

fn at(at: Degrees) -> MavMessage {
    let [lat, lon] = e7(at);
    MavMessage::GLOBAL_POSITION_INT(GLOBAL_POSITION_INT_DATA {
        lat,
        lon,
        relative_alt: 4_200,
        ..Default::default()
    })
}

/// A vehicle that stands 30 m north and 5 m east of its pad.
fn landed() -> Rig {
    let talk = Talk { amount: Amount::Normal, has_voice: true, ..Talk::default() };
    let mut rig = Rig::new(Settings { talk, ..settings(false, true) });
    rig.receive(&home());
    rig.phase = TdPhase::TD_PHASE_AERO_DESCENT;
    rig.run(1.0);
    rig.state_in_space([30.0, 5.0, 2.0], [0.0; 3], (200.0, 4.0));
    rig.phase = TdPhase::TD_PHASE_TOUCHDOWN;
    rig.run(1.0);
    rig.key(Key::Char('f'));
    rig.actions.clear();
    rig
}

fn stands_at(rig: &mut Rig, north_m: f64, east_m: f64) {
    rig.msg(Msg::Here(Ok(PAD.moved(north_m, east_m))));
}

fn called(rig: &Rig) -> Vec<&str> {
    let calls = rig.actions.iter().filter_map(|action| match action {
        Action::CallOut(text) => Some(text.as_str()),
        _ => None,
    });
    calls.collect()
}

#[test]
fn the_way_begins_where_the_searcher_stands_and_both_ages_are_shown() {
    let mut rig = landed();
    stands_at(&mut rig, -70.0, 5.0);
    rig.run(3.0);
    for (columns, rows) in [(80, 24), (140, 45), (200, 60)] {
        let screen = rig.screen(columns, rows);
        for words in ["from here", "100 m, bearing 000 deg", "4 s ago", "own position 3 s ago"] {
            assert!(screen.contains(words), "{words}: {screen}");
        }
    }
    // The receiver counts, not the setting.
    rig.model.settings.here = Some(PAD);
    stands_at(&mut rig, 30.0, 105.0);
    rig.expect_screen("100 m, bearing 270 deg");
}

#[test]
fn the_way_is_called_out_every_10_s_on_page_find() {
    let mut rig = landed();
    for _ in 0..25 {
        stands_at(&mut rig, -70.0, 5.0);
        rig.run(1.0);
    }
    assert_eq!(called(&rig), ["bearing 000, 100 metres"; 3]);
    rig.actions.clear();
    rig.run(21.0);
    assert_eq!(called(&rig).last(), Some(&"own position 16 seconds old"));
    rig.key(Key::Char('5'));
    rig.actions.clear();
    rig.run(21.0);
    assert!(called(&rig).is_empty(), "{:?}", called(&rig));
}

#[test]
fn trouble_of_the_receiver_is_reported_and_the_last_position_stays() {
    let mut rig = landed();
    rig.msg(Msg::Here(Err("no position for 10 s".to_owned())));
    stands_at(&mut rig, -70.0, 5.0);
    rig.expect_event("own position received");
    assert!(!rig.screen(80, 24).contains("no position for"));
    rig.msg(Msg::Here(Err("no fix\u{1b}[2J".to_owned())));
    rig.run(30.0);
    rig.expect_event("own position: no fix");
    rig.expect_screen("own position: no fix");
    rig.expect_screen("100 m, bearing 000 deg");
    rig.expect_screen("own position 30 s ago");
    stands_at(&mut rig, -70.0, 5.0);
    assert!(!rig.screen(80, 24).contains("no fix"));
}

#[test]
fn a_second_vehicle_is_on_the_map_and_has_its_own_way() {
    let mut rig = landed();
    stands_at(&mut rig, 0.0, 0.0);
    rig.receive_from(TRACKER, &at(PAD.moved(0.0, 60.0)));
    rig.expect_event("system 7 reports its position");
    rig.run(2.0);
    rig.expect_screen("also system 7, 2 s ago");
    rig.expect_screen("30 m, bearing 009 deg");
    rig.key(Key::Down);
    for (columns, rows) in [(80, 24), (140, 45), (200, 60)] {
        let screen = rig.screen(columns, rows);
        for words in
            ["SYSTEM 7, from here", "60 m, bearing 090 deg", "2 s ago, 4.2 m up", "35.347000, -117.80834"]
        {
            assert!(screen.contains(words), "{words}: {screen}");
        }
    }
    assert_eq!(rig.screen(140, 45).matches("system 7").count(), 1, "{}", rig.screen(140, 45));
    rig.key(Key::Down);
    rig.key(Key::Up);
    rig.expect_screen("Last received, from here");
}

/// Without the pad, the station knows no way; where it is, is shown.
#[test]
fn a_second_vehicle_without_a_pad_shows_its_coordinates() {
    let mut rig = Rig::new(settings(false, true));
    rig.receive_from(TRACKER, &at(PAD));
    rig.run(1.0);
    rig.keys(&[typed("f"), vec![Key::Down]].concat());
    rig.expect_screen("35.347000, -117.809000");
}

/// A vehicle that may be in the air does not hide the booster's tracker.
#[test]
fn a_second_vehicle_is_found_while_the_first_may_be_in_the_air() {
    let mut rig = crate::screens::counting();
    rig.receive(&home());
    rig.receive_from(TRACKER, &at(PAD.moved(0.0, 60.0)));
    rig.speaks = false;
    rig.run(12.0);
    rig.key(Key::Char('f'));
    rig.expect_screen("MAY BE IN THE AIR since T-0");
    rig.expect_screen("also system 7, 12 s ago");
    rig.key(Key::Down);
    rig.expect_screen("60 m, bearing 090 deg");
}

/// Its frames look like the vehicle's in everything but the system id.
#[test]
fn a_second_vehicle_changes_nothing_of_the_shown_one() {
    for make in [on_the_pad, armed, descending] {
        let mut rigs = [make(), make()];
        for rig in &mut rigs {
            rig.receive(&home());
        }
        let [alone, beside] = &mut rigs;
        for _ in 0..30 {
            beside.receive_from(TRACKER, &at(PAD.moved(1e5, 0.0)));
            beside.receive_from(TRACKER, &MavMessage::HEARTBEAT(HEARTBEAT_DATA::default()));
            alone.run(0.1);
            beside.run(0.1);
        }
        assert_eq!(format!("{:?}", beside.model.vehicle), format!("{:?}", alone.model.vehicle));
        assert_eq!(beside.model.boots.shown(), alone.model.boots.shown());
        assert_eq!((beside.model.beside(beside.now), beside.model.page()), (None, alone.model.page()));
        beside.take_commands();
        beside.abort();
        let commands = beside.take_commands();
        assert!(commands.iter().any(is_abort));
        assert!(commands.iter().all(|command| command.target_system == VEHICLE.system_id));
    }
}

/// Neither does one that is chosen on page Find, whatever else is pressed there.
#[test]
fn the_chosen_second_vehicle_is_not_commanded() {
    let mut rig = on_the_pad();
    rig.receive(&home());
    rig.receive_from(TRACKER, &at(PAD.moved(0.0, 60.0)));
    rig.keys(&[typed("f"), vec![Key::Down], typed("A"), enter("ARM")].concat());
    assert_eq!(rig.model.page(), Page::Find);
    let commands = rig.take_commands();
    assert!(commands.iter().any(is_arm));
    assert!(commands.iter().all(|command| command.target_system == VEHICLE.system_id), "{commands:?}");
}

/// At most eight are shown, and a position of 0, 0 is none.
#[test]
fn a_flood_of_system_ids_is_bounded() {
    let mut rig = Rig::crewed();
    rig.receive(&home());
    for system_id in 0..=u8::MAX {
        for place in [Degrees { latitude: 0.0, longitude: 0.0 }, PAD] {
            rig.receive_from(Address { system_id, component_id: 1 }, &at(place));
        }
    }
    rig.run(1.0);
    rig.key(Key::Char('f'));
    assert_eq!(rig.events().matches("reports its position").count(), 8);
    let screen = rig.screen(200, 60);
    assert!(screen.contains("also system 0,") && !screen.contains("system 9,"), "{screen}");
}
