//! What arrives over the radio, well-meant or not.

use crate::bench::{Bench, settings, typed};
use ground::exit::{Exit, decide};
use ground::key::Key;
use ground::model::link::LinkState;
use ground::update::{Action, Msg};
use proptest::prelude::*;
use protocol::dialect::{
    HEARTBEAT_DATA, MavMessage, RADIO_STATUS_DATA, STATUSTEXT_DATA, TIMESYNC_DATA, TdInterlock, TdLimit,
    TdPhase,
};
use protocol::frame::Framer;
use protocol::identity::{Address, GROUND};

#[test]
fn a_radio_that_reports_about_itself_is_not_the_vehicle() {
    let mut bench = Bench::crewed();
    bench.speaks = false;
    let radio = Address { system_id: 51, component_id: 68 };
    for _ in 0..40 {
        bench.run(0.1);
        bench.hear_from(radio, &MavMessage::RADIO_STATUS(RADIO_STATUS_DATA::default()));
    }
    assert!(matches!(bench.model.link.state(bench.now), LinkState::Lost(_)));
    assert!(bench.events().contains("LINK LOST"));
    bench.hear_from(
        radio,
        &MavMessage::RADIO_STATUS(RADIO_STATUS_DATA {
            rssi: 190,
            remrssi: 188,
            noise: 45,
            remnoise: 255,
            ..RADIO_STATUS_DATA::default()
        }),
    );
    assert!(bench.screen(140, 40).contains("rssi 190/188 noise 45/--"), "{}", bench.screen(140, 40));
    bench.run(5.0);
    assert!(!bench.screen(140, 40).contains("rssi"), "no longer fresh");
    bench.speaks = true;
    bench.run(1.0);
    assert!(bench.events().contains("link restored"));
}

#[test]
fn a_second_ground_station_with_our_ids_is_named_now_and_then() {
    let mut bench = Bench::crewed();
    for _ in 0..50 {
        bench.run(0.1);
        bench.hear_from(GROUND, &MavMessage::HEARTBEAT(HEARTBEAT_DATA::default()));
    }
    assert_eq!(bench.events().matches("another ground station").count(), 1);
}

#[test]
fn other_systems_change_nothing() {
    let mut bench = Bench::crewed();
    let other = Address { system_id: 2, component_id: 1 };
    bench.hear_from(other, &MavMessage::HEARTBEAT(HEARTBEAT_DATA { custom_mode: 9, ..Default::default() }));
    assert_eq!(bench.model.vehicle.phase().map(|phase| phase.value), Some(TdPhase::TD_PHASE_PAD_IDLE));
    assert!(bench.events().contains("system 2 component 1"));
}

#[test]
fn a_reboot_forgets_what_was_known() {
    // Of a vehicle that tells no boot number.
    let mut bench = Bench::new(settings(false, true));
    bench.boot_number = 0;
    bench.run(11.0);
    bench.state(0.0, 15.0, 0.0, 0.0, 90.0);
    let mut rebooted = Bench::new(settings(false, true));
    rebooted.boot_number = 0;
    rebooted.now = std::time::Duration::from_millis(500);
    rebooted.model = bench.model;
    rebooted.flight_status();
    assert!(rebooted.events().contains("rebooted"));
    assert!(rebooted.model.vehicle.attitude.is_none());
}

#[test]
fn an_escape_sequence_cannot_reach_the_terminal() {
    let mut bench = Bench::crewed();
    bench.text("\u{1b}[2Jgone\u{7}");
    let screen = bench.screen(80, 24);
    assert!(screen.contains("[2Jgone") && !screen.contains('\u{1b}') && !screen.contains('\u{7}'));
}

#[test]
fn our_clock_question_is_answered_and_the_round_trip_is_shown() {
    let mut bench = Bench::crewed();
    bench.hear(&MavMessage::TIMESYNC(TIMESYNC_DATA { tc1: 0, ts1: 77, ..Default::default() }));
    let answers = |message: &MavMessage| matches!(message, MavMessage::TIMESYNC(data) if data.ts1 == 77 && data.tc1 != 0);
    let answered =
        bench.actions.iter().any(|action| matches!(action, Action::Send(message) if answers(message)));
    assert!(answered);
    let asked_at = i64::try_from(bench.now.as_nanos()).unwrap();
    bench.run(0.2);
    bench.hear(&MavMessage::TIMESYNC(TIMESYNC_DATA { tc1: 5, ts1: asked_at, ..Default::default() }));
    bench.key(Key::Char('5'));
    assert!(bench.screen(80, 24).contains("rtt 200 ms"));
}

fn answers(bench: &mut Bench) -> usize {
    let is_answer = |message: &MavMessage| matches!(message, MavMessage::TIMESYNC(data) if data.tc1 != 0);
    #[expect(deprecated, reason = "superseded by TIMESYNC, yet vehicles in use still ask")]
    let is_ping = |message: &MavMessage| matches!(message, MavMessage::PING(_));
    let sent = std::mem::take(&mut bench.actions);
    let is_ours = |action: &&Action| matches!(action, Action::Send(m) if is_answer(m) || is_ping(m));
    sent.iter().filter(is_ours).count()
}

#[test]
#[expect(deprecated, reason = "superseded by TIMESYNC, yet vehicles in use still ask")]
fn questions_to_others_and_answers_are_not_answered() {
    let mut bench = Bench::crewed();
    let timesync = |target_system, target_component| {
        let data = TIMESYNC_DATA { tc1: 0, ts1: 77, target_system, target_component };
        MavMessage::TIMESYNC(data)
    };
    let ping = |target_system, target_component| {
        MavMessage::PING(protocol::dialect::PING_DATA {
            time_usec: 5,
            seq: 1,
            target_system,
            target_component,
        })
    };
    for asked in [timesync(0, 0), timesync(255, 190), ping(0, 0)] {
        bench.hear(&asked);
        assert_eq!(answers(&mut bench), 1, "{asked:?}");
    }
    // A PING with a target is an answer already.
    for other in [timesync(254, 190), timesync(255, 1), ping(254, 190), ping(255, 1), ping(255, 190)] {
        bench.hear(&other);
        assert_eq!(answers(&mut bench), 0, "{other:?}");
    }
    let another_grounds = TIMESYNC_DATA { tc1: 5, ts1: 1, target_system: 254, target_component: 190 };
    bench.hear(&MavMessage::TIMESYNC(another_grounds));
    assert_eq!(bench.model.link.round_trip, None);
}

#[test]
fn stale_values_are_marked_without_colour() {
    let mut bench = Bench::crewed();
    bench.state(0.0, 12.0, 0.0, -4.0, 90.0);
    assert!(bench.screen(80, 24).contains("     12.00 m"));
    bench.run(2.0);
    assert!(bench.screen(80, 24).contains("~    12.00 m"));
}

#[test]
fn a_ground_that_only_watches_sends_no_command() {
    let mut bench = Bench::new(settings(false, false));
    bench.run(60.0);
    assert!(bench.take_commands().is_empty());
}

#[test]
fn a_flight_without_a_screen_ends_by_its_verdict() {
    for (landed, violated, expected) in
        [(true, TdLimit::empty(), Exit::Landed), (false, TdLimit::TD_LIMIT_AXIAL_SPEED, Exit::OutsideLimits)]
    {
        let mut bench = Bench::new(settings(false, false));
        bench.phase = TdPhase::TD_PHASE_POWERED;
        bench.run(2.0);
        bench.phase = TdPhase::TD_PHASE_TOUCHDOWN;
        bench.verdict(landed, violated);
        bench.run(1.0);
        assert!(!bench.wants_to_quit(), "the vehicle may have more to say");
        bench.run(2.0);
        assert!(bench.wants_to_quit());
        assert_eq!(decide(&bench.model.outcome, false), expected);
    }
}

#[test]
fn a_flight_without_a_screen_ends_when_the_link_is_gone_for_good() {
    let mut bench = Bench::new(settings(true, false));
    bench.speaks = false;
    bench.run(11.0);
    assert!(bench.wants_to_quit(), "nothing was ever heard");
    let mut bench = Bench::new(settings(false, false));
    bench.phase = TdPhase::TD_PHASE_POWERED;
    bench.run(2.0);
    bench.speaks = false;
    bench.run(11.0);
    assert!(bench.wants_to_quit());
    assert_eq!(decide(&bench.model.outcome, false), Exit::NotSeen);
}

#[test]
fn an_abort_under_thrust_is_an_aborted_flight_even_if_it_lands() {
    let mut bench = Bench::new(settings(false, false));
    bench.phase = TdPhase::TD_PHASE_POWERED;
    bench.run(2.0);
    bench.interlocks = TdInterlock::TD_INTERLOCK_ARMED | TdInterlock::TD_INTERLOCK_DEGRADED;
    bench.run(3.0);
    assert!(!bench.wants_to_quit(), "it still flies");
    bench.phase = TdPhase::TD_PHASE_SAFED;
    bench.verdict(true, TdLimit::empty());
    bench.run(3.0);
    assert!(bench.wants_to_quit());
    assert_eq!(decide(&bench.model.outcome, false), Exit::RefusedOrAborted);
}

/// Ids that the ground reads, and some it does not.
const IDS: [u32; 24] = [
    0, 1, 2, 4, 22, 30, 31, 32, 74, 77, 109, 111, 245, 253, 54_000, 54_001, 54_002, 54_003, 54_004, 54_005,
    54_006, 54_007, 54_008, 54_009,
];

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn no_frame_and_no_size_panics(
        frames in prop::collection::vec(
            (proptest::sample::select(IDS.to_vec()), prop::collection::vec(any::<u8>(), 0..120), 0_u64..2_000),
            0..40,
        ),
        columns in 1_u16..140,
        rows in 1_u16..50,
        keys in "[AaRMSDq?]{0,4}",
    ) {
        let mut bench = Bench::crewed();
        bench.speaks = false;
        for (id, payload, pause_ms) in frames {
            bench.hear_payload(id, &payload);
            bench.run((pause_ms / 100) as f64 / 10.0);
        }
        bench.screen(columns, rows);
        bench.keys(&typed(&keys));
        bench.screen(columns, rows);
        bench.screen(80, 24);
    }

    #[test]
    fn random_bytes_do_not_panic(bytes in prop::collection::vec(any::<u8>(), 0..2_000)) {
        let mut bench = Bench::crewed();
        let mut framer = Framer::new();
        framer.push(&bytes);
        while let Some(frame) = framer.next_frame() {
            bench.msg(Msg::Frame(frame));
        }
        bench.msg(Msg::Received { bytes: bytes.len(), framing: framer.counters() });
        bench.screen(80, 24);
    }

    #[test]
    fn any_text_is_shown_without_controls(text in prop::collection::vec(any::<u8>(), 50)) {
        let mut bench = Bench::crewed();
        let text: [u8; 50] = text.try_into().unwrap_or([0; 50]);
        bench.hear(&MavMessage::STATUSTEXT(STATUSTEXT_DATA { text: text.into(), ..Default::default() }));
        let screen = bench.screen(80, 24);
        prop_assert!(!screen.chars().any(|c| c.is_control() && c != '\n'));
    }
}

#[test]
fn the_smallest_terminals_are_drawn() {
    let mut bench = Bench::crewed();
    bench.state(0.0, 15.0, 0.0, 0.0, 90.0);
    bench.plan(TdLimit::empty());
    for columns in 1..90 {
        for rows in 1..30 {
            bench.screen(columns, rows);
        }
    }
}
