//! The safety of the hand: what keys can and cannot do, on a simulated clock.

use std::time::Duration;

use crate::bench::{Bench, is_abort, is_arm, typed};
use ground::attach::codec::Asked;
use ground::key::Key;
use ground::model::Role;
use ground::model::chord::ABORT_TIME_LIMIT;
use ground::model::command::CommandKind;
use ground::model::dialog::{ARM_TIME_LIMIT, Dialog, QUIT_TIME_LIMIT, START_TIME_LIMIT};
use ground::update::{Action, Msg};
use protocol::dialect::{MavCmd, TdInterlock, TdMotor, TdPhase};

const ARM: MavCmd = MavCmd::MAV_CMD_COMPONENT_ARM_DISARM;
const START: MavCmd = MavCmd::MAV_CMD_MISSION_START;
const ABORT: MavCmd = MavCmd::MAV_CMD_DO_FLIGHTTERMINATION;
const ACCEPTED: u8 = 0;
const TEMPORARILY_REJECTED: u8 = 1;
const DENIED: u8 = 2;

pub(crate) fn ladder() -> Vec<Key> {
    [vec![Key::Char('A')], typed("ARM"), vec![Key::Enter]].concat()
}

pub(crate) fn start_ladder() -> Vec<Key> {
    [vec![Key::Char('S')], typed("START"), vec![Key::Enter]].concat()
}

pub(crate) fn quit_ladder() -> Vec<Key> {
    [vec![Key::Char('q')], typed("QUIT"), vec![Key::Enter]].concat()
}

pub(crate) fn armed_on_pad() -> Bench {
    let mut bench = Bench::crewed();
    bench.armed = true;
    bench.phase = TdPhase::TD_PHASE_PAD_ARMED;
    bench.run(1.0);
    bench
}

/// Quits, or leaves the station to itself.
pub(crate) fn leaves(bench: &Bench) -> bool {
    bench.wants_to_quit() || bench.actions.contains(&Action::LeaveScreen)
}

#[test]
fn the_complete_ladder_arms_once_and_is_never_resent() {
    let mut bench = Bench::crewed();
    bench.keys(&ladder());
    bench.run(60.0);
    let arms = bench.take_commands().into_iter().filter(is_arm).count();
    assert_eq!(arms, 1);
    assert!(bench.events().contains("ARM not acknowledged after 1 attempts"));
}

#[test]
fn each_missing_rung_leaves_the_vehicle_disarmed() {
    for missing in 0..ladder().len() {
        let mut keys = ladder();
        keys.remove(missing);
        let mut bench = Bench::crewed();
        bench.keys(&keys);
        bench.run(20.0);
        assert!(!bench.take_commands().iter().any(is_arm), "without key {missing}");
    }
}

#[test]
fn the_offer_to_arm_ends_by_itself() {
    let mut bench = Bench::crewed();
    bench.keys(&typed("AARM"));
    bench.run(ARM_TIME_LIMIT.as_secs_f64() + 0.1);
    bench.key(Key::Enter);
    assert!(!bench.take_commands().iter().any(is_arm));
    assert!(bench.events().contains("time is up"));
}

#[test]
fn arming_is_not_even_asked_for_on_a_lost_link_or_off_the_pad() {
    let mut bench = Bench::crewed();
    bench.speaks = false;
    bench.run(5.0);
    bench.keys(&ladder());
    assert!(!bench.take_commands().iter().any(is_arm));
    let mut bench = Bench::crewed();
    bench.phase = TdPhase::TD_PHASE_POWERED;
    bench.run(1.0);
    bench.keys(&ladder());
    assert!(!bench.take_commands().iter().any(is_arm));
    assert!(bench.events().contains("cannot arm: phase POWERED"));
}

#[test]
fn a_vehicle_that_changed_while_the_word_was_typed_is_not_armed() {
    let mut bench = Bench::crewed();
    bench.keys(&typed("AARM"));
    bench.phase = TdPhase::TD_PHASE_BOOST;
    bench.run(1.0);
    bench.key(Key::Enter);
    assert!(!bench.take_commands().iter().any(is_arm));
}

/// Nothing open, each dialog, and one with letters in it.
const OPENINGS: [&[Key]; 7] = [
    &[],
    &[Key::Char('A')],
    &[Key::Char('A'), Key::Char('A')],
    &[Key::Char('S')],
    &[Key::Char('D')],
    &[Key::Char('?')],
    &[Key::Char('q')],
];

fn opened(opening: &[Key]) -> Bench {
    let mut bench = Bench::crewed();
    bench.armed = matches!(opening, [Key::Char('q' | 'S')]);
    if bench.armed {
        bench.phase = TdPhase::TD_PHASE_PAD_ARMED;
    }
    bench.run(1.0);
    bench.keys(opening);
    bench.take_commands();
    bench
}

#[test]
fn an_abort_that_is_confirmed_too_late_neither_starts_nor_arms() {
    for opening in [vec![Key::Char('S')], typed("AARM"), vec![Key::Char('D')]] {
        let mut bench = opened(&opening);
        bench.key(Key::CtrlX);
        bench.run(ABORT_TIME_LIMIT.as_secs_f64() + 0.1);
        bench.key(Key::Enter);
        assert!(bench.take_commands().is_empty(), "{opening:?}");
        assert_eq!(bench.model.dialog, Dialog::Closed);
    }
}

/// Whatever else is pressed in between: who has begun an abort means the abort.
#[test]
fn the_offer_of_an_abort_stands_its_two_seconds() {
    for between in [Key::Escape, Key::Char(' '), Key::Char('q'), Key::Char('A'), Key::CtrlC, Key::Up] {
        let mut bench = Bench::crewed();
        bench.keys(&[Key::CtrlX, between, between]);
        bench.run(1.0);
        assert!(!bench.take_commands().iter().any(is_abort) && !bench.wants_to_quit(), "{between:?}");
        assert_eq!(bench.model.dialog, Dialog::Closed, "{between:?} does nothing else");
        bench.key(Key::Enter);
        assert!(bench.take_commands().iter().any(is_abort), "{between:?}");
    }
}

/// Over a slow line both keys of the chord arrive in one read, among whatever else; and pastes take nothing away.
#[test]
fn no_speed_and_no_paste_takes_the_abort_away() {
    for keys in [
        vec![Key::CtrlX, Key::Enter],
        [typed("Send"), vec![Key::CtrlX, Key::Char('x'), Key::Enter]].concat(),
        [vec![Key::CtrlX], typed("AARM"), vec![Key::Enter]].concat(),
    ] {
        let mut bench = Bench::crewed();
        bench.msg(Msg::Keys(keys.clone()));
        assert_eq!(bench.take_commands().iter().filter(|sent| is_abort(sent)).count(), 1, "{keys:?}");
    }
    let mut bench = Bench::crewed();
    bench.press(Key::CtrlX);
    bench.msg(Msg::Pasted);
    bench.press(Key::Enter);
    assert!(bench.take_commands().iter().any(is_abort));
}

#[test]
fn in_every_phase_the_chord_sends_an_abort_and_the_ladder_arms_on_the_pad_alone() {
    for phase in (0..).map_while(ground::model::telemetry::phase_from_number) {
        let mut bench = Bench::crewed();
        bench.phase = phase;
        bench.run(1.0);
        bench.take_commands();
        bench.keys(&ladder());
        let on_pad = ground::model::vehicle::is_on_pad(phase);
        assert_eq!(bench.take_commands().iter().any(is_arm), on_pad, "{phase:?}");
        let mut bench = Bench::crewed();
        bench.phase = phase;
        bench.run(1.0);
        bench.take_commands();
        bench.keys(&[Key::CtrlX, Key::Enter]);
        let sent = bench.take_commands();
        assert!(sent.len() == 1 && is_abort(&sent[0]), "{phase:?}: {sent:?}");
    }
}

#[test]
fn ctrl_x_and_enter_abort_at_once_from_every_dialog_and_close_it() {
    for opening in OPENINGS {
        let mut bench = opened(opening);
        bench.key(Key::CtrlX);
        assert!(bench.take_commands().is_empty(), "one press is not enough");
        bench.key(Key::Enter);
        let sent = bench.take_commands();
        assert!(sent.len() == 1 && is_abort(&sent[0]), "{opening:?}: {sent:?}");
        assert_eq!(bench.model.dialog, Dialog::Closed);
        bench.answer(ABORT, ACCEPTED);
        bench.interlocks |= TdInterlock::TD_INTERLOCK_ABORT_LATCHED;
        bench.key(Key::Enter);
        bench.run(3.0);
        assert!(bench.take_commands().is_empty(), "once");
    }
}

#[test]
fn enter_alone_or_too_late_aborts_nothing() {
    let mut bench = Bench::crewed();
    bench.keys(&[Key::Enter, Key::Enter, Key::CtrlX]);
    bench.run(ABORT_TIME_LIMIT.as_secs_f64() + 0.1);
    bench.key(Key::Enter);
    bench.run(3.0);
    assert!(!bench.take_commands().iter().any(is_abort));
}

#[test]
fn abort_works_from_every_dialog_and_closes_it() {
    for opening in OPENINGS {
        let mut bench = opened(opening);
        bench.key(Key::CtrlX);
        assert!(!bench.take_commands().iter().any(is_abort), "one press is not enough");
        assert!(bench.screen(80, 24).contains("ENTER ABORTS (or Ctrl-X)"));
        bench.run(0.4);
        bench.key(Key::CtrlX);
        assert!(!bench.take_commands().iter().any(is_abort), "it may be the first repeat of a held key");
        bench.run(0.2);
        assert_eq!(bench.take_commands().iter().filter(|command| is_abort(command)).count(), 1);
        assert_eq!(bench.model.dialog, Dialog::Closed);
    }
}

#[test]
fn half_an_abort_chord_expires() {
    let mut bench = Bench::crewed();
    bench.key(Key::CtrlX);
    bench.run(ABORT_TIME_LIMIT.as_secs_f64() + 0.1);
    bench.key(Key::CtrlX);
    bench.run(1.0);
    assert!(!bench.take_commands().iter().any(is_abort));
}

#[test]
fn an_abort_is_repeated_until_acknowledged_and_its_attempts_are_shown() {
    let mut bench = Bench::crewed();
    bench.abort_chord();
    bench.speaks = false;
    bench.run(10.0);
    let aborts: Vec<_> = bench.take_commands().into_iter().filter(is_abort).collect();
    // On a clock of ten ticks a second: ten in the first second, five in each of the nine after it.
    assert!((54..=57).contains(&aborts.len()), "{}", aborts.len());
    assert!(aborts.iter().zip(0..).all(|(abort, resends)| abort.confirmation == resends));
    assert!(bench.screen(80, 24).contains(&format!("x{}", aborts.len())));
    bench.answer(ABORT, ACCEPTED);
    bench.run(1.0);
    assert_eq!(
        bench.take_commands().iter().filter(|command| is_abort(command)).count(),
        5,
        "not latched yet"
    );
    bench.speaks = true;
    bench.interlocks |= TdInterlock::TD_INTERLOCK_ABORT_LATCHED;
    bench.run(10.0);
    assert!(bench.take_commands().is_empty(), "latched");
}

/// A stabiliser that flies without an abort shows the same degradation as one that flies after it.
#[test]
fn an_abort_goes_on_until_the_latch_itself_is_seen() {
    let mut bench = Bench::crewed();
    bench.interlocks |= TdInterlock::TD_INTERLOCK_DEGRADED;
    bench.run(0.5);
    bench.abort();
    bench.answer(ABORT, ACCEPTED);
    bench.take_commands();
    bench.run(3.0);
    assert!(bench.take_commands().len() > 15);
    bench.interlocks |= TdInterlock::TD_INTERLOCK_ABORT_LATCHED;
    bench.run(3.0);
    assert!(bench.take_commands().is_empty());
}

/// There is nothing to abort: saying it again changes nothing.
#[test]
fn a_refused_abort_ends() {
    let mut bench = Bench::crewed();
    bench.abort();
    bench.answer(ABORT, 4);
    bench.take_commands();
    bench.run(3.0);
    assert!(bench.take_commands().is_empty() && bench.events().contains("ABORT REFUSED: failed"));
}

#[test]
fn not_now_is_no_answer_to_an_abort() {
    let mut bench = Bench::crewed();
    bench.abort_chord();
    bench.take_commands();
    bench.answer(ABORT, TEMPORARILY_REJECTED);
    bench.run(1.0);
    assert!(bench.take_commands().iter().any(is_abort));
}

#[test]
fn an_abort_ends_a_start_that_is_still_being_resent() {
    let mut bench = Bench::crewed();
    bench.armed = true;
    bench.phase = TdPhase::TD_PHASE_PAD_ARMED;
    bench.run(1.0);
    bench.keys(&start_ladder());
    bench.abort_chord();
    bench.take_commands();
    bench.run(5.0);
    assert!(bench.take_commands().iter().all(is_abort));
}

#[test]
fn a_start_takes_its_typed_word_and_is_resent_a_few_times() {
    let mut bench = armed_on_pad();
    bench.keys(&[Key::Char('S'), Key::Enter]);
    bench.run(1.0);
    assert!(bench.take_commands().is_empty(), "Enter alone does not start");
    for missing in 0..start_ladder().len() {
        let mut keys = start_ladder();
        keys.remove(missing);
        let mut bench = armed_on_pad();
        bench.keys(&keys);
        bench.run(20.0);
        assert!(bench.take_commands().is_empty(), "without key {missing}");
    }
    bench.keys(&start_ladder());
    bench.run(10.0);
    let starts = bench.take_commands();
    assert_eq!(starts.len(), 4);
    assert!(starts.iter().all(|command| command.command == START));
    bench.keys(&start_ladder()[..6]);
    bench.run(START_TIME_LIMIT.as_secs_f64() + 0.1);
    bench.key(Key::Enter);
    assert!(bench.take_commands().is_empty(), "the offer to start has ended");
}

#[test]
fn any_foreign_key_cancels_an_offer() {
    let foreign = [
        Key::Escape,
        Key::Backspace,
        Key::F1,
        Key::Up,
        Key::CtrlL,
        Key::CtrlC,
        Key::Char('x'),
        Key::Char('7'),
        Key::Char(' '),
        Key::Enter,
    ];
    for key in foreign {
        for ladder in [ladder(), start_ladder(), quit_ladder()] {
            let mut bench = armed_on_pad();
            if ladder == crate::hand::ladder() {
                bench = Bench::crewed();
            }
            bench.take_commands();
            let (last, before) = ladder.split_last().unwrap();
            bench.keys(&before[..2]);
            assert_ne!(bench.model.dialog, Dialog::Closed);
            bench.key(key);
            assert_eq!(bench.model.dialog, Dialog::Closed, "{key:?} in {ladder:?}");
            bench.keys(&[&before[2..], &[*last]].concat());
            bench.run(1.0);
            assert!(bench.take_commands().is_empty() && !leaves(&bench), "{key:?} in {ladder:?}");
        }
    }
}

#[test]
fn what_is_pasted_is_dropped_with_a_word_and_cancels_what_is_offered() {
    let mut bench = armed_on_pad();
    bench.keys(&start_ladder()[..6]);
    bench.msg(Msg::Pasted);
    assert!(bench.events().contains("a paste was dropped"));
    assert_eq!(bench.model.dialog, Dialog::Closed);
    bench.key(Key::Enter);
    assert!(bench.take_commands().is_empty());
}

/// A console that does not mark what is pasted: at once, or a letter a millisecond (9,600 baud) or eight (1,200 baud).
#[test]
fn a_ladder_faster_than_fingers_does_nothing() {
    for apart_ms in [0, 1, 8, 20] {
        for ladder in [ladder(), start_ladder(), quit_ladder()] {
            let mut bench = if ladder == crate::hand::ladder() { Bench::crewed() } else { armed_on_pad() };
            bench.take_commands();
            for key in &ladder {
                bench.now += Duration::from_millis(apart_ms);
                bench.press(*key);
            }
            bench.run(1.0);
            assert!(bench.take_commands().is_empty() && !leaves(&bench), "{apart_ms} ms: {ladder:?}");
            assert!(bench.events().contains("faster than a hand types"));
        }
    }
    let mut bench = armed_on_pad();
    bench.msg(Msg::Keys(start_ladder()));
    assert!(bench.take_commands().is_empty());
}

#[test]
fn a_held_q_neither_quits_nor_leaves_while_armed() {
    for delay_ms in [250, 500, 600] {
        let mut bench = armed_on_pad();
        bench.hold(Key::Char('q'), delay_ms, 33, 20);
        bench.run(1.0);
        assert!(!leaves(&bench), "first repeat after {delay_ms} ms");
    }
}

/// Ten thousand letters of a paste without marks, in whatever pieces: no key of it quits, not even disarmed.
#[test]
fn a_q_among_other_keys_does_not_quit() {
    let text = typed(&"the quick brown fox quits q".repeat(40));
    for piece in [1, 2, 7, 1_000] {
        let mut bench = Bench::crewed();
        for keys in text.chunks(piece) {
            bench.now += Duration::from_millis(1);
            bench.msg(if let [key] = keys { Msg::Key(*key) } else { Msg::Keys(keys.to_vec()) });
        }
        bench.run(1.0);
        assert!(!bench.wants_to_quit(), "pieces of {piece}");
    }
}

#[test]
fn acknowledged_is_not_observed() {
    let mut bench = Bench::crewed();
    bench.keys(&ladder());
    bench.answer(ARM, ACCEPTED);
    bench.run(4.0);
    assert!(bench.events().contains("ARM acknowledged, not observed"));
    assert!(bench.screen(80, 24).contains("acknowledged accepted  observed NOT OBSERVED"));
    bench.armed = true;
    bench.run(1.0);
    assert!(bench.screen(80, 24).contains("observed yes"));
}

#[test]
fn a_refusal_shows_the_answer_and_the_vehicles_words() {
    let mut bench = Bench::crewed();
    bench.keys(&ladder());
    bench.answer(ARM, DENIED);
    bench.text("arming refused: pin: found in, required out");
    let screen = bench.screen(80, 24);
    assert!(
        screen.contains("REFUSED (denied)")
            && screen.contains("found in,")
            && screen.contains("required out"),
        "{screen}"
    );
}

#[test]
fn an_answer_for_another_ground_station_is_not_ours() {
    let mut bench = Bench::crewed();
    bench.keys(&ladder());
    let other = protocol::identity::Address { system_id: 254, component_id: 190 };
    bench.answer_to(other, ARM, ACCEPTED);
    assert!(!bench.events().contains("acknowledged"));
}

#[test]
fn quitting_takes_a_key_before_and_a_typed_word_while_armed() {
    for key in [Key::Char('q'), Key::CtrlC] {
        let mut bench = Bench::crewed();
        bench.key(key);
        bench.run(0.1);
        assert!(bench.wants_to_quit());
        let mut bench = armed_on_pad();
        bench.keys(&[key, key]);
        bench.run(1.0);
        assert!(!leaves(&bench), "two keys do not");
        bench.run(QUIT_TIME_LIMIT.as_secs_f64() + 0.1);
        bench.keys(&[vec![key], typed("quit")].concat());
        bench.run(QUIT_TIME_LIMIT.as_secs_f64() + 0.1);
        bench.key(Key::Enter);
        assert!(!leaves(&bench), "the offer has ended");
        bench.keys(&[vec![key], typed("Quit"), vec![Key::Enter]].concat());
        assert!(leaves(&bench));
        assert!(bench.take_commands().is_empty(), "quitting neither disarms nor aborts");
    }
}

/// What comes of the station's own ticks is the station's to do; a chord or a quit must not be used up by them.
#[test]
fn the_stations_clock_takes_nothing_from_the_hand_at_an_attached_screen() {
    let mut bench = Bench::crewed();
    bench.model.settings.role = Role::Attached;
    bench.key(Key::CtrlX);
    bench.run(0.4);
    bench.key(Key::CtrlX);
    bench.run(0.3);
    let asks = |bench: &Bench| bench.actions.contains(&Action::Request(Asked::Command(CommandKind::Abort)));
    assert!(!asks(&bench));
    bench.msg(Msg::ScreenTick);
    assert!(asks(&bench));
    bench.key(Key::Char('q'));
    bench.run(0.3);
    assert!(!bench.wants_to_quit());
    bench.msg(Msg::ScreenTick);
    assert!(bench.wants_to_quit());
}

/// A live station goes on without its screen; a demonstration ends with it, and so does a screen of another station.
#[test]
fn quitting_a_screen_never_ends_a_live_station_in_flight() {
    for (role, demonstration, ends) in
        [(Role::Station, false, false), (Role::Station, true, true), (Role::Attached, false, true)]
    {
        let mut bench = armed_on_pad();
        (bench.model.settings.role, bench.model.settings.demonstration) = (role, demonstration);
        bench.keys(&quit_ladder());
        assert_eq!(bench.actions.contains(&Action::Quit), ends, "{role:?}");
        assert_eq!(bench.actions.contains(&Action::LeaveScreen), !ends, "{role:?}");
    }
    let mut watching = armed_on_pad();
    watching.model.settings.role = Role::Watching;
    watching.key(Key::Char('q'));
    watching.run(0.1);
    watching.msg(Msg::ScreenTick);
    assert!(watching.wants_to_quit(), "who only watches is not needed");
}

/// Ctrl-C on the terminal of a station without a screen.
#[test]
fn an_interrupt_does_not_end_a_live_station_in_flight_and_a_termination_does() {
    let mut bench = armed_on_pad();
    bench.msg(Msg::Terminate("SIGINT"));
    assert!(!bench.wants_to_quit() && bench.events().contains("SIGINT: the station goes on"));
    bench.msg(Msg::Terminate("SIGTERM"));
    assert!(bench.wants_to_quit());
    for (armed, demonstration) in [(false, false), (true, true)] {
        let mut bench = if armed { armed_on_pad() } else { Bench::crewed() };
        bench.model.settings.demonstration = demonstration;
        bench.msg(Msg::Terminate("SIGINT"));
        assert!(bench.wants_to_quit());
    }
}

#[test]
fn a_letter_that_does_not_fit_closes_the_offer_to_arm() {
    for word in ["AARMA", "AARN", "AAM", "AB"] {
        let mut bench = Bench::crewed();
        bench.keys(&typed(word));
        assert_eq!(bench.model.dialog, Dialog::Closed, "{word}");
        bench.keys(&[Key::Backspace, Key::Enter]);
        assert!(!bench.take_commands().iter().any(is_arm));
    }
}

#[test]
fn the_wait_after_an_abort_on_the_pad_is_shown_at_every_size() {
    let mut bench = Bench::crewed();
    bench.abort_chord();
    bench.answer(ABORT, ACCEPTED);
    bench.pad_wait_s = 57;
    bench.run(0.1);
    assert!(bench.screen(80, 24).contains("LIVE MOTOR: do not approach for 57 s"));
    assert!(bench.screen(20, 5).contains("LIVE MOTOR"), "{}", bench.screen(20, 5));
    bench.motor = TdMotor::TD_MOTOR_PIN_IN;
    bench.run(0.1);
    assert!(bench.screen(80, 24).contains("STAY OFF THE PAD for 57 s"));
    assert!(bench.screen(20, 5).contains("STAY OFF THE PAD"));
}

/// The first repeat of a held key comes when a second press would; the ones after it tell.
#[test]
fn a_held_ctrl_x_does_not_abort_and_one_more_press_does() {
    for delay_ms in [250, 400, 500, 600] {
        let mut bench = Bench::crewed();
        bench.speaks = false;
        bench.hold(Key::CtrlX, delay_ms, 33, 5);
        bench.run(0.5);
        assert!(!bench.take_commands().iter().any(is_abort), "first repeat after {delay_ms} ms");
        assert!(bench.screen(80, 24).contains("ENTER ABORTS (or Ctrl-X)"));
        bench.key(Key::CtrlX);
        bench.run(0.2);
        assert!(bench.take_commands().iter().any(is_abort), "released and pressed again");
    }
}

#[test]
fn nothing_takes_back_a_complete_abort_chord() {
    let mut bench = Bench::crewed();
    bench.key(Key::CtrlX);
    bench.run(0.4);
    bench.press(Key::CtrlX);
    bench.press(Key::Escape);
    assert!(bench.take_commands().iter().any(is_abort));
}

/// Where repeats are told apart, the second press is one, and is not waited for.
#[test]
fn the_second_press_acts_at_once_where_the_terminal_tells_repeats() {
    // A busy machine may hand over both at once.
    for pause_s in [0.0, 0.1, 0.3, 1.9] {
        let mut bench = Bench::crewed();
        bench.model.repeats_told = true;
        bench.key(Key::CtrlX);
        bench.run(pause_s);
        assert!(!bench.take_commands().iter().any(is_abort));
        bench.key(Key::CtrlX);
        assert_eq!(bench.take_commands().iter().filter(|command| is_abort(command)).count(), 1);
        bench.answer(ABORT, ACCEPTED);
        bench.interlocks |= TdInterlock::TD_INTERLOCK_ABORT_LATCHED;
        bench.run(3.0);
        assert!(bench.take_commands().is_empty(), "once");
    }
}
