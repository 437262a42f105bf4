//! What stations tell the vehicle about themselves: the end of their book, and the mission that they expect.

use protocol::dialect::{TD_BOOK_HEAD_DATA, TD_BOOK_KEPT_DATA};
use protocol::mission::MissionHash;

use super::*;

const ARM: u16 = 400;

fn tell(wire: &mut Wire, head: TD_BOOK_HEAD_DATA) -> Vec<TD_BOOK_KEPT_DATA> {
    let frame = wire.ground.encode(&MavMessage::TD_BOOK_HEAD(head));
    wire.endpoint.on_frame(0, &frame, &wire.vehicle);
    let sent = wire.run(0.5);
    let kept = sent.iter().filter_map(|frame| match frame.decode() {
        Ok(MavMessage::TD_BOOK_KEPT(kept)) => Some(kept),
        _ => None,
    });
    kept.collect()
}

#[test]
fn the_end_of_a_book_is_confirmed_to_the_station_that_sent_it() {
    let mut wire = Wire::new();
    let head = TD_BOOK_HEAD_DATA {
        book: 77,
        entries: 5,
        target_system: 1,
        target_component: 1,
        ..TD_BOOK_HEAD_DATA::default()
    };
    let kept = tell(&mut wire, head.clone());
    let [kept] = &kept[..] else { panic!("{kept:?}") };
    assert_eq!((kept.book, kept.entries), (77, 5));
    assert_eq!((kept.target_system, kept.target_component), (GROUND.system_id, GROUND.component_id));
    assert!(
        tell(&mut wire, TD_BOOK_HEAD_DATA { target_system: 2, ..head }).is_empty(),
        "for another vehicle"
    );
}

/// A flood of ends takes no more of the link than any other requests.
#[test]
fn a_flood_of_ends_is_answered_within_the_budget() {
    let mut wire = Wire::new();
    for entries in 0..2_000 {
        let head = TD_BOOK_HEAD_DATA {
            entries,
            target_system: 1,
            target_component: 1,
            ..TD_BOOK_HEAD_DATA::default()
        };
        let frame = wire.ground.encode(&MavMessage::TD_BOOK_HEAD(head));
        wire.endpoint.on_frame(0, &frame, &wire.vehicle);
    }
    let sent = wire.run(1.0);
    let bytes: usize = sent.iter().map(|frame| frame.as_bytes().len()).sum();
    assert!(bytes <= 2 * RADIO_BUDGET_BYTES_S as usize, "{bytes} B");
    assert!(count(&sent, HEARTBEAT_DATA::ID) >= 1);
}

fn arm_for(wire: &mut Wire, params: [f32; 3]) -> (u8, String) {
    wire.beats = true;
    wire.beat();
    wire.run(0.5);
    let [param4, param5, param6] = params;
    let arm = COMMAND_LONG_DATA {
        command: MavCmd::MAV_CMD_COMPONENT_ARM_DISARM,
        param1: 1.0,
        param4,
        param5,
        param6,
        target_system: 1,
        target_component: 1,
        ..COMMAND_LONG_DATA::default()
    };
    let frame = wire.ground.encode(&MavMessage::COMMAND_LONG(arm));
    wire.endpoint.on_frame(0, &frame, &wire.vehicle);
    let sent = wire.run(0.5);
    let answers: Vec<_> = sent.iter().filter_map(CommandAnswer::from_frame).collect();
    assert_eq!((answers.len(), answers[0].command), (1, ARM));
    (answers[0].result, texts(&sent).join("; "))
}

#[test]
fn another_mission_is_not_armed_whatever_the_station_shows() {
    let fresh = || {
        let mut wire = Wire::new();
        wire.vehicle = rocket().of_mission("mk2", "the right one");
        wire
    };
    let ours = MissionHash::of("the right one");
    let other = MissionHash::of("another one");
    let mut wire = fresh();
    let (result, words) = arm_for(&mut wire, other.to_params());
    assert_eq!(result, MavResult::MAV_RESULT_DENIED as u8, "{words}");
    assert!(words.contains(&format!("this vehicle flies mk2 {ours}, not {other}")), "{words}");
    assert!(!wire.vehicle.mode().interlocks.armed);
    let (result, words) = arm_for(&mut wire, [1.0, 0.0, 0.0]);
    assert_eq!(result, MavResult::MAV_RESULT_DENIED as u8, "{words}");
    assert!(!wire.vehicle.mode().interlocks.armed);
    for params in [ours.to_params(), [0.0; 3], [f32::NAN; 3]] {
        let mut wire = fresh();
        let (result, words) = arm_for(&mut wire, params);
        assert_eq!(result, MavResult::MAV_RESULT_ACCEPTED as u8, "{words}");
    }
}

proptest! {
    /// Whatever a station writes there, it arms no vehicle of another mission.
    #[test]
    fn no_parameters_but_the_own_hash_or_none_arm(params in prop::array::uniform3(any::<u32>())) {
        let params = params.map(f32::from_bits);
        let arms = match protocol::mission::Expected::of_params(params) {
            protocol::mission::Expected::Any => true,
            protocol::mission::Expected::Hash(hash) => hash == MissionHash::of("the right one"),
            protocol::mission::Expected::Unreadable => false,
        };
        let request = CommandRequest {
            source: GROUND,
            target: VEHICLE,
            command: ARM,
            params: [1.0, 0.0, 0.0, params[0], params[1], params[2], 0.0],
            confirmation: 0,
        };
        let vehicle = rocket().of_mission("mk2", "the right one");
        let why = vehicle_link::endpoint::meant::why_other_mission(&request, &vehicle);
        prop_assert_eq!(why.is_none(), arms);
    }
}
