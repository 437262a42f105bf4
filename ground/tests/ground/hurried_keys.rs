//! Keys that arrive faster than a hand types: typed ones that a slow connection delivers in bunches
//! are never lost, and pasted ones never act by themselves.

use std::time::Duration;

use ground::key::Key;
use ground::model::{AGAIN_AFTER, KeyOwner, Role, Seat, Settings};
use ground::update::Msg;
use proptest::prelude::*;
use protocol::dialect::{MavCmd, TdCheck};

use crate::keys::{armed_on_pad, ladder, leaves, quit_ladder, start_ladder};
use crate::rig::{Rig, is_abort, is_arm, settings, typed};

/// A connection between a keyboard and the station. The order of keys stays.
#[derive(Debug, Clone)]
enum Connection {
    /// Each key is delayed by so many milliseconds.
    Jitter(Vec<u64>),
    /// Everything arrives at the end of each interval of so many milliseconds.
    Bunches(u64),
}

impl Connection {
    /// When keys that are pressed at these times arrive, in milliseconds.
    fn deliver(&self, pressed: &[u64]) -> Vec<u64> {
        let mut before = 0;
        let delayed = |(k, at): (usize, &u64)| {
            before = before.max(match self {
                Self::Jitter(delays) => at + delays[k % delays.len()],
                Self::Bunches(every) => at.next_multiple_of(*every),
            });
            before
        };
        pressed.iter().enumerate().map(delayed).collect()
    }
}

fn connection() -> impl Strategy<Value = Connection> {
    prop_oneof![
        prop::collection::vec(0_u64..=200, 1..12).prop_map(Connection::Jitter),
        (1_u64..=500).prop_map(Connection::Bunches),
    ]
}

/// Types keys at these intervals over a connection. What arrives within a millisecond arrives in
/// one read.
fn type_over(rig: &mut Rig, connection: &Connection, keys: &[Key], apart_ms: &[u64]) {
    let mut at = 0;
    let pressed: Vec<u64> = apart_ms
        .iter()
        .cycle()
        .take(keys.len())
        .map(|apart| {
            at += apart;
            at
        })
        .collect();
    let arrived: Vec<(u64, Key)> =
        connection.deliver(&pressed).into_iter().zip(keys.iter().copied()).collect();
    let begin = rig.now;
    for read in arrived.chunk_by(|one, next| one.0 == next.0) {
        pass_until(rig, begin + Duration::from_millis(read[0].0));
        let keys: Vec<Key> = read.iter().map(|(_, key)| *key).collect();
        rig.msg(Msg::Keys(keys));
    }
}

/// Ten ticks a second, and telemetry arrives.
fn pass_until(rig: &mut Rig, at: Duration) {
    while rig.now + Duration::from_millis(100) <= at {
        rig.now += Duration::from_millis(100);
        rig.heartbeat();
        rig.flight_status();
        rig.uplink();
        rig.msg(Msg::Tick);
    }
    rig.now = at;
}

fn pass(rig: &mut Rig, time: Duration) {
    let end = rig.now + time;
    pass_until(rig, end);
}

/// Presses the key that the screen asks for, if it asks, as a person does who has read it.
fn answer_the_question(rig: &mut Rig) -> bool {
    let prompted = rig.model.dialog.as_ref().is_some_and(|dialog| dialog.again_from.is_some());
    if prompted {
        let screen = rig.screen(80, 24);
        assert!(screen.contains("DID YOU TYPE THIS?") && screen.contains("Ctrl-Y within"), "{screen}");
        pass(rig, AGAIN_AFTER);
        rig.press(Key::CtrlY);
    }
    prompted
}

fn is_start(command: &protocol::dialect::COMMAND_LONG_DATA) -> bool {
    command.command == MavCmd::MAV_CMD_MISSION_START
}

#[test]
fn the_second_confirmation_needs_a_different_key_after_a_pause() {
    for key in [Key::Enter, Key::Char('y'), Key::Char('Y'), Key::Escape, Key::Char(' '), Key::Up] {
        let mut rig = Rig::crewed();
        rig.msg(Msg::Keys(ladder()));
        pass(&mut rig, AGAIN_AFTER);
        rig.press(key);
        assert_eq!(rig.model.dialog, None, "{key:?} cancels");
        rig.key(Key::CtrlY);
        assert!(!rig.take_commands().iter().any(is_arm), "{key:?}");
    }
    // Too early, or held: it asks for the key once more.
    let mut rig = Rig::crewed();
    rig.msg(Msg::Keys([ladder(), vec![Key::CtrlY]].concat()));
    rig.hold(Key::CtrlY, 400, 33, 2);
    assert!(!rig.take_commands().iter().any(is_arm));
    assert!(answer_the_question(&mut rig));
    assert!(rig.take_commands().iter().any(is_arm));
    // It does not wait for ever.
    let mut rig = Rig::crewed();
    rig.msg(Msg::Keys(ladder()));
    pass(&mut rig, Duration::from_secs(11));
    rig.press(Key::CtrlY);
    assert!(!rig.take_commands().iter().any(is_arm) && rig.events().contains("arming: time is up"));
}

/// A key that stops something needs no second confirmation.
#[test]
fn hold_and_disarm_act_at_any_speed() {
    for (key, command) in
        [('D', MavCmd::MAV_CMD_COMPONENT_ARM_DISARM), ('H', MavCmd::MAV_CMD_DO_PAUSE_CONTINUE)]
    {
        let mut rig = armed_on_pad();
        rig.countdown_ms = 8_000;
        rig.run(0.5);
        rig.take_commands();
        rig.msg(Msg::Keys(vec![Key::Char(key), Key::Enter]));
        assert!(rig.take_commands().iter().any(|sent| sent.command == command), "{key}");
    }
}

#[test]
fn a_question_closes_when_the_vehicle_reboots() {
    let mut rig = Rig::crewed();
    rig.msg(Msg::Keys(ladder()));
    rig.reboot();
    rig.run(2.5);
    assert_eq!(rig.model.dialog, None);
}

/// A paste on a console that does not mark pastes: at once, or one letter per 1 ms (9,600 baud) or
/// 8 ms (1,200 baud).
#[test]
fn a_pasted_ladder_does_nothing_by_itself() {
    for apart_ms in [0, 1, 8, 20] {
        for ladder in [ladder(), start_ladder(), quit_ladder()] {
            let mut rig = if ladder == crate::keys::ladder() { Rig::crewed() } else { armed_on_pad() };
            rig.take_commands();
            for key in &ladder {
                rig.now += Duration::from_millis(apart_ms);
                rig.press(*key);
            }
            rig.run(12.0);
            assert!(rig.take_commands().is_empty() && !leaves(&rig), "{apart_ms} ms: {ladder:?}");
            rig.expect_event("time is up");
        }
    }
}

#[test]
fn keys_without_a_meaning_among_fast_ones_are_dropped_with_an_event() {
    let mut rig = Rig::crewed();
    rig.msg(Msg::Keys(typed("12 Send the crew away")));
    rig.expect_event("faster than a hand types");
    assert_eq!(rig.model.dialog, None);
    // What only shows something works.
    let mut rig = Rig::crewed();
    rig.msg(Msg::Keys(typed("15")));
    rig.expect_screen("[5Link]");
}

/// The letters that the crew types on after a refusal are no keys.
#[test]
fn what_is_left_of_a_refused_word_does_nothing() {
    for (armed, keys) in
        [(false, "AARM"), (false, "SSTART"), (true, "SSXART"), (true, "SSTRT"), (false, "CTAKE")]
    {
        let mut rig = if armed { armed_on_pad() } else { Rig::crewed() };
        rig.checks_failed = TdCheck::TD_CHECK_PIN.bits();
        rig.uplink_alive = armed;
        rig.run(6.0);
        rig.take_commands();
        let page = rig.model.page();
        for key in [typed(keys), vec![Key::Enter]].concat() {
            rig.now += Duration::from_millis(140);
            rig.press(key);
        }
        let last = rig.model.events.newest(1).next().map(|event| event.text.clone()).unwrap_or_default();
        assert!(
            last.starts_with("cannot ") || last.contains("cancelled, nothing was done"),
            "{keys}: {last}"
        );
        assert_eq!((rig.model.page(), &rig.model.dialog), (page, &None), "{keys}");
        assert!(rig.take_commands().is_empty());
        // A pause, or another key, and keys are keys again.
        rig.key(Key::Char('5'));
        assert!(rig.screen(80, 24).contains("[5Link]"), "{keys}");
    }
}

/// The same where the screen itself may not command: one that watches, and one of another operator.
#[test]
fn what_is_left_of_a_word_that_this_screen_refuses_does_nothing() {
    let watching = Settings { role: Role::Watching, ..settings(false, true) };
    let owner = KeyOwner { number: 1, name: "Ann".to_owned() };
    let other = Settings { seat: Seat::new(2, "Bob"), key_owner: Some(owner), ..settings(false, true) };
    for refused in [watching, other] {
        for keys in ["AARM", "Aarm", "SSTART", "Sstart", "CTAKE", "Ctake"] {
            let mut rig = Rig::new(refused.clone());
            rig.run(6.0);
            let page = rig.model.page();
            rig.actions.clear();
            for key in typed(keys) {
                rig.now += Duration::from_millis(140);
                rig.press(key);
                let last = rig.model.events.newest(1).next().map(|event| event.text.clone());
                let last = last.unwrap_or_default();
                assert!(last.contains("this screen "), "{keys}: {last}");
            }
            assert_eq!((rig.model.page(), &rig.model.dialog), (page, &None), "{keys}");
        }
    }
}

#[test]
fn the_next_request_is_not_taken_for_the_rest_of_a_refused_word() {
    let mut rig = Rig::crewed();
    rig.take_commands();
    // Not armed: the start is refused, and the crew arms first.
    rig.keys(&[vec![Key::Char('S')], ladder()].concat());
    assert!(rig.take_commands().iter().any(is_arm));
    // A wrong letter, and the whole ladder again.
    let mut rig = Rig::crewed();
    rig.take_commands();
    rig.keys(&[typed("AARN"), ladder()].concat());
    assert!(rig.take_commands().iter().any(is_arm));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(600))]

    /// Over 0 to 200 ms of jitter, or bunches of up to half a second, at 120 to 150 ms a letter.
    #[test]
    fn a_typed_word_is_never_lost(
        connection in connection(),
        apart_ms in prop::collection::vec(120_u64..=150, 1..10),
        start in any::<bool>(),
    ) {
        let mut rig = if start { armed_on_pad() } else { Rig::crewed() };
        rig.take_commands();
        type_over(&mut rig, &connection, &if start { start_ladder() } else { ladder() }, &apart_ms);
        let prompted = answer_the_question(&mut rig);
        let sent = rig.take_commands();
        let count = sent.iter().filter(|sent| if start { is_start(sent) } else { is_arm(sent) }).count();
        prop_assert_eq!(count, 1, "second confirmation: {}\n{}", prompted, rig.events());
    }

    /// The keys of an abort act whatever comes with them.
    #[test]
    fn a_typed_abort_is_never_lost(
        connection in connection(),
        apart_ms in prop::collection::vec(120_u64..=400, 1..10),
        before in prop::sample::select(vec!["", "A", "AAR", "5", "xyz", "SSTART"]),
    ) {
        let mut rig = Rig::crewed();
        rig.take_commands();
        let keys = [typed(before), vec![Key::CtrlX, Key::Enter]].concat();
        type_over(&mut rig, &connection, &keys, &apart_ms);
        prop_assert!(rig.take_commands().iter().any(is_abort), "{}", rig.events());
    }

    /// Scripts of the station's own words, in pieces of any size with stalls between them; each
    /// line has keys that came together.
    #[test]
    fn a_pasted_script_never_arms_starts_or_quits(
        lines in prop::collection::vec(
            prop::sample::select(vec!["AARM", "SSTART", "ARM", "qQUIT", "CTAKE", "y", "Y", "yes", "X", "", "Send it"]),
            1..12,
        ),
        pieces in prop::collection::vec((6_usize..40, 0_u64..2_000), 1..8),
        armed in any::<bool>(),
    ) {
        let mut rig = if armed { armed_on_pad() } else { Rig::crewed() };
        rig.take_commands();
        let keys: Vec<Key> =
            lines.iter().flat_map(|line| [typed(line), vec![Key::Enter]].concat()).collect();
        let mut rest = &keys[..];
        for (length, stall_ms) in pieces.iter().cycle() {
            if rest.is_empty() {
                break;
            }
            let (piece, later) = rest.split_at((*length).min(rest.len()));
            rig.msg(Msg::Keys(piece.to_vec()));
            pass(&mut rig, Duration::from_millis(*stall_ms));
            rest = later;
        }
        prop_assert!(rig.take_commands().is_empty() && !leaves(&rig), "{}", rig.events());
    }
}
