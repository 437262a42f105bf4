//! Frames that arrive over the radio, valid or hostile.

use crate::rig::{Rig, settings, typed};
use ground::exit::{Exit, decide};
use ground::key::Key;
use ground::model::LinkState;
use ground::update::{Action, Msg};
use proptest::prelude::*;
use protocol::dialect::{
    HEARTBEAT_DATA, MavMessage, RADIO_STATUS_DATA, STATUSTEXT_DATA, TIMESYNC_DATA, TdInterlock, TdLimit,
    TdPhase,
};
use protocol::frame::Framer;
use protocol::identity::Address;

#[test]
fn a_radio_that_reports_about_itself_is_not_the_vehicle() {
    let mut rig = Rig::crewed();
    rig.speaks = false;
    let radio = Address { system_id: 51, component_id: 68 };
    for _ in 0..40 {
        rig.run(0.1);
        rig.receive_from(radio, &MavMessage::RADIO_STATUS(RADIO_STATUS_DATA::default()));
    }
    assert!(matches!(rig.model.link.state(rig.now), LinkState::Lost(_)));
    rig.expect_event("LINK LOST");
    rig.receive_from(
        radio,
        &MavMessage::RADIO_STATUS(RADIO_STATUS_DATA {
            rssi: 190,
            remrssi: 188,
            noise: 45,
            remnoise: 255,
            ..RADIO_STATUS_DATA::default()
        }),
    );
    rig.key(Key::Char('5'));
    assert!(rig.screen(140, 40).contains("rssi 190/188 noise 45/--"), "{}", rig.screen(140, 40));
    rig.run(5.0);
    assert!(!rig.screen(140, 40).contains("rssi"), "no longer fresh");
    rig.speaks = true;
    rig.run(1.0);
    rig.expect_event("link restored");
}

/// The strength of the signal, its margin and the margin's trend over the last minute stand in the
/// first line, while a radio reports them.
#[test]
fn the_first_line_has_the_margin_of_the_radio_and_its_trend() {
    let radio = Address { system_id: 51, component_id: 68 };
    let mut rig = Rig::crewed();
    let first_line = |rig: &Rig| rig.screen(80, 24).lines().next().unwrap_or_default().to_owned();
    assert!(!first_line(&rig).contains("dB"), "{}", first_line(&rig));
    let report = |rig: &mut Rig, seconds: u32, rssi: u8| {
        for _ in 0..seconds {
            rig.run(1.0);
            let status =
                RADIO_STATUS_DATA { rssi, remrssi: 200, noise: 45, remnoise: 45, ..Default::default() };
            rig.receive_from(radio, &MavMessage::RADIO_STATUS(status));
        }
    };
    // RSSI = 1.9 (dBm + 127): 101 steps are -74 dBm, 56 steps over the noise 29 dB.
    report(&mut rig, 3, 101);
    assert!(first_line(&rig).contains(" -74 dBm +29 dB "), "{}", first_line(&rig));
    assert!(rig.screen(140, 45).contains(" rssi -74 dBm margin 29 dB "), "{}", rig.screen(140, 45));
    report(&mut rig, 80, 101);
    assert!(first_line(&rig).contains("+29 dB→"), "{}", first_line(&rig));
    report(&mut rig, 40, 91);
    assert!(first_line(&rig).contains("+24 dB↓"), "{}", first_line(&rig));
    report(&mut rig, 70, 91);
    report(&mut rig, 20, 111);
    assert!(first_line(&rig).contains("+35 dB↑"), "{}", first_line(&rig));
    rig.run(6.0);
    assert!(!first_line(&rig).contains("dB"), "no longer fresh: {}", first_line(&rig));
}

#[test]
fn other_systems_change_nothing() {
    let mut rig = Rig::crewed();
    let other = Address { system_id: 2, component_id: 1 };
    rig.receive_from(other, &MavMessage::HEARTBEAT(HEARTBEAT_DATA { custom_mode: 9, ..Default::default() }));
    assert_eq!(rig.model.vehicle.phase().map(|phase| phase.value), Some(TdPhase::TD_PHASE_PAD_IDLE));
    rig.expect_event("system 2 component 1");
}

#[test]
fn a_reboot_drops_old_values() {
    // A vehicle that reports no boot number.
    let mut rig = Rig::new(settings(false, true));
    rig.boot_number = 0;
    rig.run(11.0);
    rig.state(0.0, 15.0, 0.0, 0.0, 90.0);
    rig.switch_on();
    rig.run(2.5);
    rig.expect_event("rebooted");
    assert!(rig.model.vehicle.attitude.is_none());
}

#[test]
fn timesync_is_answered_and_the_round_trip_is_shown() {
    let mut rig = Rig::crewed();
    rig.receive(&MavMessage::TIMESYNC(TIMESYNC_DATA { tc1: 0, ts1: 77, ..Default::default() }));
    let answers = |message: &MavMessage| matches!(message, MavMessage::TIMESYNC(data) if data.ts1 == 77 && data.tc1 != 0);
    let answered =
        rig.actions.iter().any(|action| matches!(action, Action::Send(message) if answers(message)));
    assert!(answered);
    let requested_at = i64::try_from(rig.now.as_nanos()).unwrap();
    rig.run(0.2);
    rig.receive(&MavMessage::TIMESYNC(TIMESYNC_DATA { tc1: 5, ts1: requested_at, ..Default::default() }));
    rig.key(Key::Char('5'));
    rig.expect_screen("round trip 200 ms");
}

fn answers(rig: &mut Rig) -> usize {
    let is_answer = |message: &MavMessage| matches!(message, MavMessage::TIMESYNC(data) if data.tc1 != 0);
    let sent = std::mem::take(&mut rig.actions);
    let is_ours = |action: &&Action| matches!(action, Action::Send(m) if is_answer(m));
    sent.iter().filter(is_ours).count()
}

#[test]
fn only_questions_to_this_station_are_answered() {
    let mut rig = Rig::crewed();
    let timesync = |target_system, target_component| {
        let data = TIMESYNC_DATA { tc1: 0, ts1: 77, target_system, target_component };
        MavMessage::TIMESYNC(data)
    };
    for sent in [timesync(0, 0), timesync(255, 190)] {
        rig.receive(&sent);
        assert_eq!(answers(&mut rig), 1, "{sent:?}");
    }
    for other in [timesync(254, 190), timesync(255, 1)] {
        rig.receive(&other);
        assert_eq!(answers(&mut rig), 0, "{other:?}");
    }
    let another_grounds = TIMESYNC_DATA { tc1: 5, ts1: 1, target_system: 254, target_component: 190 };
    rig.receive(&MavMessage::TIMESYNC(another_grounds));
    assert_eq!(rig.model.link.round_trip, None);
}

#[test]
fn stale_values_are_marked_without_colour() {
    let mut rig = Rig::crewed();
    rig.state(0.0, 12.0, 0.0, -4.0, 90.0);
    rig.key(Key::Char('t'));
    let height = |rig: &Rig| {
        let row = rig.screen(80, 24).lines().nth(4)?.chars().skip(2).take(31).collect::<String>();
        Some(row.trim_end().to_owned())
    };
    assert_eq!(height(&rig).as_deref(), Some(">height                 12.0 m"));
    rig.run(2.0);
    assert_eq!(height(&rig).as_deref(), Some(">height           ~     12.0 m"));
}

#[test]
fn a_run_without_auto_sends_no_command() {
    let mut rig = Rig::new(settings(false, false));
    rig.run(60.0);
    assert!(rig.take_commands().is_empty());
}

#[test]
fn a_run_without_a_screen_ends_after_the_verdict() {
    for (landed, violated, expected) in
        [(true, TdLimit::empty(), Exit::Yes), (false, TdLimit::TD_LIMIT_VERTICAL_SPEED, Exit::No)]
    {
        let mut rig = Rig::new(settings(false, false));
        rig.phase = TdPhase::TD_PHASE_POWERED;
        rig.run(2.0);
        rig.phase = TdPhase::TD_PHASE_TOUCHDOWN;
        rig.verdict(landed, violated);
        rig.run(1.0);
        assert!(!rig.wants_to_quit(), "the vehicle may have more to say");
        rig.run(2.0);
        assert!(rig.wants_to_quit());
        assert_eq!(decide(&rig.model.outcome, false), expected);
    }
}

#[test]
fn a_run_without_a_screen_ends_when_the_link_stays_lost() {
    let mut rig = Rig::new(settings(true, false));
    rig.speaks = false;
    rig.run(11.0);
    assert!(rig.wants_to_quit(), "nothing was ever received");
    let mut rig = Rig::new(settings(false, false));
    rig.phase = TdPhase::TD_PHASE_POWERED;
    rig.run(2.0);
    rig.speaks = false;
    rig.run(11.0);
    assert!(rig.wants_to_quit());
    assert_eq!(decide(&rig.model.outcome, false), Exit::NotSeen);
}

#[test]
fn an_abort_under_thrust_is_an_aborted_flight_even_if_it_lands() {
    let mut rig = Rig::new(settings(false, false));
    rig.phase = TdPhase::TD_PHASE_POWERED;
    rig.run(2.0);
    rig.interlocks = TdInterlock::TD_INTERLOCK_ARMED | TdInterlock::TD_INTERLOCK_ABORT_LATCHED;
    rig.run(3.0);
    assert!(!rig.wants_to_quit(), "it still flies");
    rig.phase = TdPhase::TD_PHASE_SAFED;
    rig.verdict(true, TdLimit::empty());
    rig.run(3.0);
    assert!(rig.wants_to_quit());
    assert_eq!(decide(&rig.model.outcome, false), Exit::RefusedOrAborted);
}

/// Message ids that the ground uses, and some that it does not.
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
        let mut rig = Rig::crewed();
        rig.speaks = false;
        for (id, payload, pause_ms) in frames {
            rig.receive_payload(id, &payload);
            rig.run((pause_ms / 100) as f64 / 10.0);
        }
        rig.screen(columns, rows);
        rig.keys(&typed(&keys));
        rig.screen(columns, rows);
        rig.screen(80, 24);
    }

    #[test]
    fn random_bytes_do_not_panic(bytes in prop::collection::vec(any::<u8>(), 0..2_000)) {
        let mut rig = Rig::crewed();
        let mut framer = Framer::new();
        framer.push(&bytes);
        while let Some(frame) = framer.next_frame() {
            rig.msg(Msg::Frame(frame));
        }
        rig.msg(Msg::Received { bytes: bytes.len(), framing: framer.counters() });
        rig.screen(80, 24);
    }

    #[test]
    fn any_text_is_shown_without_controls(text in prop::collection::vec(any::<u8>(), 50)) {
        let mut rig = Rig::crewed();
        let text: [u8; 50] = text.try_into().unwrap_or([0; 50]);
        rig.receive(&MavMessage::STATUSTEXT(STATUSTEXT_DATA { text: text.into(), ..Default::default() }));
        let screen = rig.screen(80, 24);
        prop_assert!(!screen.chars().any(|c| c.is_control() && c != '\n'));
    }
}
