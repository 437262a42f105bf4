//! After the flight: the flight again, its report, and where to look for the vehicle.

use ground::key::Key;
use ground::model::{Degrees, LastPlace, Role, Settings};
use ground::update::{Action, Msg, Request};
use protocol::dialect::{GLOBAL_POSITION_INT_DATA, HOME_POSITION_DATA, MavMessage, TdPhase};

use crate::rig::{MONO, Rig, settings};

const PAD: Degrees = Degrees { latitude: 35.347, longitude: -117.809 };

fn station(role: Role) -> Rig {
    let mut rig = Rig::new(Settings { role, start_unix_s: 1_800_000_000, ..settings(false, true) });
    rig.run(1.0);
    let (latitude, longitude) = (353_470_000, -1_178_090_000);
    rig.receive(&MavMessage::HOME_POSITION(HOME_POSITION_DATA {
        latitude,
        longitude,
        ..HOME_POSITION_DATA::default()
    }));
    rig
}

/// Falls at 20 m/s from 200 m, 30 m north of the pad.
fn falling(role: Role) -> Rig {
    let mut rig = station(role);
    rig.phase = TdPhase::TD_PHASE_AERO_DESCENT;
    rig.run(0.5);
    for k in 0..20_u8 {
        rig.state_in_space([30.0, 5.0, 200.0 - 2.0 * f32::from(k)], [0.0, 0.0, -20.0], (200.0, 4.0));
        rig.run(0.1);
    }
    rig
}

fn requests(rig: &mut Rig, key: char) -> Vec<Action> {
    rig.actions.clear();
    rig.key(Key::Char(key));
    let asked = |action: &Action| matches!(action, Action::WriteReport | Action::Request(Request::Report));
    rig.actions.iter().filter(|action| asked(action)).cloned().collect()
}

/// Unreceived values may have been greater.
#[test]
fn the_review_shows_the_longest_silence_of_the_flight() {
    let mut rig = falling(Role::Station);
    rig.key(Key::Char('4'));
    let said = |rig: &Rig| {
        let screen = rig.screen(140, 45);
        let row = screen.lines().find(|row| row.contains("no verdict")).unwrap_or_default();
        row.trim_matches(['"', ' ']).to_owned()
    };
    assert_eq!(said(&rig), "no verdict received yet");
    rig.speaks = false;
    rig.run(5.0);
    assert_eq!(said(&rig), "no verdict received yet; link LOST before touchdown");
    assert!(rig.screen(140, 45).contains("not reported yet"), "{}", rig.screen(140, 45));
    rig.speaks = true;
    rig.phase = TdPhase::TD_PHASE_SAFED;
    rig.run(2.0);
    assert!(
        said(&rig).starts_with("no verdict received yet; silent for 5.0 s of the flight"),
        "{}",
        said(&rig)
    );
}

#[test]
fn the_report_waits_for_the_end_of_a_flight() {
    let mut rig = station(Role::Station);
    assert_eq!(requests(&mut rig, 'W'), []);
    rig.expect_event("no report: no flight has been flown yet");
    let mut rig = falling(Role::Station);
    assert_eq!(requests(&mut rig, 'W'), []);
    rig.expect_event("no report: the vehicle is armed or in flight");
    rig.phase = TdPhase::TD_PHASE_SAFED;
    rig.run(1.0);
    assert_eq!(requests(&mut rig, 'W'), [Action::Request(Request::Report), Action::WriteReport]);
    rig.msg(Msg::Report(Ok("flight.html".to_owned())));
    rig.expect_event("the report is written: flight.html");
    rig.armed = true;
    rig.heartbeat();
    assert_eq!(requests(&mut rig, 'W'), []);
}

#[test]
fn an_attached_screen_requests_the_report_from_the_station() {
    for (role, report) in
        [(Role::Attached, vec![Action::Request(Request::Report)]), (Role::Watching, Vec::new())]
    {
        let mut rig = falling(role);
        rig.phase = TdPhase::TD_PHASE_SAFED;
        rig.run(1.0);
        assert_eq!(requests(&mut rig, 'W'), report);
    }
}

fn stored(rig: &Rig) -> Vec<LastPlace> {
    let place = |action: &Action| match action {
        Action::StorePlace(place) => Some(**place),
        _ => None,
    };
    rig.actions.iter().filter_map(place).collect()
}

#[test]
fn the_last_position_is_stored_in_flight_and_predicted_after_the_loss() {
    let mut rig = station(Role::Station);
    rig.state(0.0, 0.0, 0.0, 0.0, 90.0);
    rig.run(5.0);
    assert_eq!(stored(&rig), [], "on the pad there is nothing to look for");
    let mut rig = falling(Role::Station);
    let places = stored(&rig);
    assert!((1..=2).contains(&places.len()), "every 2 s: {places:?}");
    assert!(places[0].predicted.is_none() && (places[0].received.north_m - 30.0).abs() < 0.1);
    rig.speaks = false;
    rig.actions.clear();
    rig.run(20.0);
    let places = stored(&rig);
    let last = places.last().unwrap();
    let predicted = last.predicted.unwrap();
    assert!(predicted.error_m > last.received.error_m && last.received_unix_s <= 1_800_000_004, "{last:?}");
    assert!((places.len()) <= 11, "{}", places.len());
    rig.key(Key::Char('f'));
    for (columns, rows) in [(80, 24), (140, 45), (200, 60)] {
        let screen = rig.screen(columns, rows);
        for words in ["PREDICTED: look here first", "from the pad", "bearing 0", "19 of 20 cases", "35.347"] {
            assert!(screen.contains(words), "{words}: {screen}");
        }
    }
}

#[test]
fn a_place_from_before_a_restart_is_shown_with_the_way_from_the_station() {
    let place = *stored(&falling(Role::Station)).last().unwrap();
    // 40 m south of the pad.
    let here = Some(PAD.moved(-40.0, 5.0));
    let mut rig = Rig::new(Settings { here, start_unix_s: 1_800_000_100, ..settings(false, true) });
    rig.msg(Msg::Place(Box::new(place)));
    rig.run(1.0);
    rig.key(Key::Char('f'));
    let screen = rig.screen(80, 24);
    assert!(screen.contains("from here") && screen.contains("70 m, bearing 000 deg"), "{screen}");
    assert!(screen.contains("boot 1A2B3C4D"), "{screen}");
}

/// A station that was switched on after the touchdown: the vehicle's own place is enough.
#[test]
fn the_position_of_a_vehicle_without_a_reported_pad_is_shown() {
    let mut rig = Rig::new(settings(false, true));
    rig.phase = TdPhase::TD_PHASE_AERO_DESCENT;
    rig.run(1.0);
    rig.state_in_space([30.0, 5.0, 2.0], [0.0; 3], (200.0, 4.0));
    let there = PAD.moved(30.0, 5.0);
    let [lat, lon] = [there.latitude, there.longitude].map(|degrees| (degrees * 1e7).round() as i32);
    rig.receive(&MavMessage::GLOBAL_POSITION_INT(GLOBAL_POSITION_INT_DATA {
        lat,
        lon,
        ..Default::default()
    }));
    rig.run(1.0);
    let place = rig.model.last_place(rig.now).unwrap();
    let (north_m, east_m) = there.to(place.degrees(&place.received).unwrap());
    assert!(north_m.abs() < 0.1 && east_m.abs() < 0.1, "{place:?}");
    assert!(place.pad.is_some_and(|pad| (pad.latitude - PAD.latitude).abs() < 1e-6), "{place:?}");
    // Where it lies, for a phone's camera, beside DO NOT APPROACH on the smallest screen, too.
    rig.phase = TdPhase::TD_PHASE_TOUCHDOWN;
    rig.run(1.0);
    rig.key(Key::Char('f'));
    for (columns, rows) in [(80, 24), (120, 36), (200, 50)] {
        let screen = rig.screen(columns, rows);
        let code = screen.lines().filter(|row| row.contains('▀') && row.contains('█')).count();
        assert!(code >= 11 && screen.contains("█▀▀▀▀▀█"), "{code}: {screen}");
    }
}

/// The columns and rows of the dots in the panel of the arrow.
fn dots(rig: &Rig, (columns, rows): (u16, u16)) -> Vec<(f64, f64)> {
    let terminal = rig.draw(columns, rows, MONO);
    let cells = terminal.backend().buffer().content.chunks(usize::from(columns)).enumerate();
    let width = if columns == 80 { 14 } else { 33 };
    let mut dots = Vec::new();
    for (row, cells) in cells {
        for (column, cell) in cells[..width].iter().enumerate() {
            let pattern = cell.symbol().chars().next().and_then(|c| u32::from(c).checked_sub(0x2800));
            let count = pattern.filter(|pattern| *pattern < 0x100).map_or(0, u32::count_ones);
            dots.extend((0..count).map(|_| (column as f64, row as f64)));
        }
    }
    dots
}

/// The arrow is heavier where its head is: there the vehicle is, at every size.
#[test]
fn the_arrow_points_to_the_vehicle() {
    for (north_m, east_m) in [(50.0, 0.0), (-50.0, 0.0), (0.0, 50.0), (0.0, -50.0)] {
        let mut place = *stored(&falling(Role::Station)).last().unwrap();
        (place.received.north_m, place.received.east_m, place.predicted) = (north_m, east_m, None);
        let mut rig = Rig::new(settings(false, true));
        rig.msg(Msg::Place(Box::new(place)));
        rig.run(1.0);
        rig.key(Key::Char('f'));
        for size in [(80, 24), (120, 36), (140, 45), (200, 50)] {
            // How far each dot is towards the vehicle.
            let dots = dots(&rig, size).into_iter().map(|(column, row)| column * east_m - row * north_m);
            let dots: Vec<f64> = dots.collect();
            let least = dots.iter().copied().fold(f64::INFINITY, f64::min);
            let most = dots.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let middle = f64::midpoint(least, most);
            let head = dots.iter().filter(|along| **along > middle).count();
            let tail = dots.iter().filter(|along| **along < middle).count();
            let screen = rig.screen(size.0, size.1);
            assert!(tail > 0 && head > tail, "{size:?} {north_m} {east_m}: {head}, {tail}\n{screen}");
        }
    }
}
