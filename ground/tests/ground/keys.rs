//! What keys can and cannot do: arming, start, abort and quitting, on a simulated clock.

use crate::rig::{Rig, enter, is_abort, is_arm, typed};
use ground::key::Key;
use ground::model::{ABORT_TIME_LIMIT, AlarmKind, CommandKind, Role, WORD_TIME_LIMIT};
use ground::update::{Action, Msg, Request};
use protocol::dialect::{MavCmd, TdInterlock, TdPhase};

const ARM: MavCmd = MavCmd::MAV_CMD_COMPONENT_ARM_DISARM;
const START: MavCmd = MavCmd::MAV_CMD_MISSION_START;
const ABORT: MavCmd = MavCmd::MAV_CMD_DO_FLIGHTTERMINATION;
const ACCEPTED: u8 = 0;
const TEMPORARILY_REJECTED: u8 = 1;
const DENIED: u8 = 2;

pub(crate) fn ladder() -> Vec<Key> {
    enter("AARM")
}

pub(crate) fn start_ladder() -> Vec<Key> {
    enter("SSTART")
}

pub(crate) fn quit_ladder() -> Vec<Key> {
    enter("qQUIT")
}

pub(crate) fn armed_on_pad() -> Rig {
    let mut rig = Rig::crewed();
    rig.armed = true;
    rig.phase = TdPhase::TD_PHASE_PAD_ARMED;
    rig.run(1.0);
    rig
}

/// Whether the screen quits, with or without the station.
pub(crate) fn leaves(rig: &Rig) -> bool {
    rig.wants_to_quit() || rig.actions.contains(&Action::LeaveScreen)
}

#[test]
fn the_complete_ladder_arms_once_and_is_repeated_for_two_seconds_under_one_number() {
    let mut rig = Rig::crewed();
    rig.keys(&ladder());
    rig.run(60.0);
    let arms: Vec<_> = rig.take_commands().into_iter().filter(is_arm).collect();
    assert_eq!(arms.len(), 5);
    assert!(
        arms.iter().all(|arm| arm.param2.to_bits() == arms[0].param2.to_bits() && arm.param2 >= 65_536.0)
    );
    rig.expect_event("ARM not acknowledged after 5 attempts");
}

/// On every page, because only the pad page has the checks themselves.
#[test]
fn a_command_answered_long_ago_does_not_hide_no_go() {
    let mut rig = Rig::crewed();
    rig.keys(&ladder());
    rig.answer(ARM, DENIED);
    rig.text("arming refused: pin: found in, required out");
    rig.expect_screen("found in, required");
    rig.checks_failed = 0b1010;
    rig.key(Key::Char('5'));
    rig.run(5.0);
    let screen = rig.screen(80, 24);
    assert!(screen.contains("REFUSED (denied)") && screen.contains("NO-GO: "), "{screen}");
    rig.run(6.0);
    let screen = rig.screen(80, 24);
    assert!(screen.contains("NO-GO: ") && !screen.contains("REFUSED (denied)"), "{screen}");
}

#[test]
fn each_missing_step_leaves_the_vehicle_disarmed() {
    for missing in 0..ladder().len() {
        let mut keys = ladder();
        keys.remove(missing);
        let mut rig = Rig::crewed();
        rig.keys(&keys);
        rig.run(20.0);
        assert!(!rig.take_commands().iter().any(is_arm), "without key {missing}");
    }
}

#[test]
fn the_arming_dialog_expires() {
    let mut rig = Rig::crewed();
    rig.keys(&typed("AARM"));
    rig.run(WORD_TIME_LIMIT.as_secs_f64() + 0.1);
    rig.key(Key::Enter);
    assert!(!rig.take_commands().iter().any(is_arm));
    rig.expect_event("time is up");
}

#[test]
fn a_vehicle_that_changed_while_the_word_was_typed_is_not_armed() {
    let mut rig = Rig::crewed();
    rig.keys(&typed("AARM"));
    rig.phase = TdPhase::TD_PHASE_BOOST;
    rig.run(1.0);
    rig.key(Key::Enter);
    assert!(!rig.take_commands().iter().any(is_arm));
}

/// Keys that open nothing, each dialog, and a dialog with a typed letter.
const OPENINGS: [&[Key]; 7] = [
    &[],
    &[Key::Char('A')],
    &[Key::Char('A'), Key::Char('A')],
    &[Key::Char('S')],
    &[Key::Char('D')],
    &[Key::Char('?')],
    &[Key::Char('q')],
];

fn opened(opening: &[Key]) -> Rig {
    let mut rig = Rig::crewed();
    rig.armed = matches!(opening, [Key::Char('q' | 'S')]);
    if rig.armed {
        rig.phase = TdPhase::TD_PHASE_PAD_ARMED;
    }
    rig.run(1.0);
    rig.keys(opening);
    rig.take_commands();
    rig
}

#[test]
fn an_abort_that_is_confirmed_too_late_neither_starts_nor_arms() {
    for opening in [vec![Key::Char('S')], typed("AARM"), vec![Key::Char('D')]] {
        let mut rig = opened(&opening);
        rig.key(Key::CtrlX);
        rig.run(ABORT_TIME_LIMIT.as_secs_f64() + 0.1);
        rig.key(Key::Enter);
        assert!(rig.take_commands().is_empty(), "{opening:?}");
        assert_eq!(rig.model.dialog, None);
    }
}

/// Other keys in between do not cancel an abort chord that has begun.
#[test]
fn other_keys_do_not_cancel_the_abort_chord() {
    for between in [Key::Escape, Key::Char(' '), Key::Char('q'), Key::Char('A'), Key::CtrlC, Key::Up] {
        let mut rig = Rig::crewed();
        rig.keys(&[Key::CtrlX, between, between]);
        rig.run(1.0);
        assert!(!rig.take_commands().iter().any(is_abort) && !rig.wants_to_quit(), "{between:?}");
        assert_eq!(rig.model.dialog, None, "{between:?} does nothing else");
        rig.key(Key::Enter);
        assert!(rig.take_commands().iter().any(is_abort), "{between:?}");
    }
}

/// Over a slow line both keys of the chord may arrive in one read among other keys; pastes do not
/// cancel it either.
#[test]
fn no_typing_speed_and_no_paste_blocks_the_abort() {
    for keys in [
        vec![Key::CtrlX, Key::Enter],
        [typed("Send"), vec![Key::CtrlX, Key::Char('x'), Key::Enter]].concat(),
        [vec![Key::CtrlX], typed("AARM"), vec![Key::Enter]].concat(),
    ] {
        let mut rig = Rig::crewed();
        rig.msg(Msg::Keys(keys.clone()));
        assert_eq!(rig.take_commands().iter().filter(|sent| is_abort(sent)).count(), 1, "{keys:?}");
    }
    let mut rig = Rig::crewed();
    rig.press(Key::CtrlX);
    rig.msg(Msg::Pasted);
    rig.press(Key::Enter);
    assert!(rig.take_commands().iter().any(is_abort));
}

#[test]
fn the_chord_aborts_in_every_phase_and_the_ladder_arms_only_on_the_pad() {
    for phase in (0..).map_while(ground::model::telemetry::phase_from_number) {
        let mut rig = Rig::crewed();
        rig.phase = phase;
        rig.run(1.0);
        rig.take_commands();
        rig.keys(&ladder());
        let on_pad = ground::model::is_on_pad(phase);
        assert_eq!(rig.take_commands().iter().any(is_arm), on_pad, "{phase:?}");
        let mut rig = Rig::crewed();
        rig.phase = phase;
        rig.run(1.0);
        rig.take_commands();
        rig.keys(&[Key::CtrlX, Key::Enter]);
        let sent = rig.take_commands();
        assert!(sent.len() == 1 && is_abort(&sent[0]), "{phase:?}: {sent:?}");
    }
}

#[test]
fn enter_alone_or_too_late_aborts_nothing() {
    let mut rig = Rig::crewed();
    rig.keys(&[Key::Enter, Key::Enter, Key::CtrlX]);
    rig.run(ABORT_TIME_LIMIT.as_secs_f64() + 0.1);
    rig.key(Key::Enter);
    rig.run(3.0);
    assert!(!rig.take_commands().iter().any(is_abort));
}

/// With Enter at once; with a second Ctrl-X once it is no repeat of a held key.
#[test]
fn abort_works_once_from_every_dialog_and_closes_it() {
    for opening in OPENINGS {
        for second in [Key::Enter, Key::CtrlX] {
            let mut rig = opened(opening);
            rig.key(Key::CtrlX);
            assert!(rig.take_commands().is_empty(), "one press is not enough");
            rig.expect_screen("ENTER ABORTS (or Ctrl-X)");
            rig.run(0.4);
            rig.key(second);
            if second == Key::CtrlX {
                assert!(rig.take_commands().is_empty(), "it may be the first repeat of a held key");
                rig.run(0.2);
            }
            let sent = rig.take_commands();
            assert!(sent.iter().filter(|sent| sent.confirmation == 0).count() == 1, "{opening:?}: {sent:?}");
            assert!(sent.iter().all(is_abort), "{opening:?}: {sent:?}");
            assert_eq!(rig.model.dialog, None);
            rig.answer(ABORT, ACCEPTED);
            rig.interlocks |= TdInterlock::TD_INTERLOCK_ABORT_LATCHED;
            rig.key(Key::Enter);
            rig.run(3.0);
            assert!(rig.take_commands().is_empty(), "once");
        }
    }
}

#[test]
fn an_abort_is_repeated_until_acknowledged_and_its_attempts_are_shown() {
    let mut rig = Rig::crewed();
    rig.abort_chord();
    rig.speaks = false;
    rig.run(10.0);
    let aborts: Vec<_> = rig.take_commands().into_iter().filter(is_abort).collect();
    // With each of the rig's ten ticks a second.
    assert!((99..=101).contains(&aborts.len()), "{}", aborts.len());
    assert!(aborts.iter().zip(0..).all(|(abort, resends)| abort.confirmation == resends));
    assert!(rig.screen(80, 24).contains(&format!("x{}", aborts.len())));
    rig.answer(ABORT, ACCEPTED);
    rig.run(1.0);
    assert_eq!(rig.take_commands().iter().filter(|command| is_abort(command)).count(), 5, "not latched yet");
    rig.speaks = true;
    rig.interlocks |= TdInterlock::TD_INTERLOCK_ABORT_LATCHED;
    rig.run(10.0);
    assert!(rig.take_commands().is_empty(), "latched");
}

/// The vehicle refuses for good, so repeating changes nothing.
#[test]
fn a_finally_refused_abort_is_not_repeated() {
    let mut rig = Rig::crewed();
    rig.abort();
    rig.answer(ABORT, 4);
    rig.take_commands();
    rig.run(3.0);
    assert!(rig.take_commands().is_empty() && rig.events().contains("ABORT REFUSED: failed"));
}

#[test]
fn a_temporary_refusal_does_not_end_an_abort() {
    let mut rig = Rig::crewed();
    rig.abort_chord();
    rig.take_commands();
    rig.answer(ABORT, TEMPORARILY_REJECTED);
    rig.run(1.0);
    assert!(rig.take_commands().iter().any(is_abort));
}

#[test]
fn an_abort_ends_a_start_that_is_still_being_resent() {
    let mut rig = Rig::crewed();
    rig.armed = true;
    rig.phase = TdPhase::TD_PHASE_PAD_ARMED;
    rig.run(1.0);
    rig.keys(&start_ladder());
    rig.abort_chord();
    rig.take_commands();
    rig.run(5.0);
    assert!(rig.take_commands().iter().all(is_abort));
}

#[test]
fn a_start_needs_its_typed_word_and_is_resent_a_few_times() {
    let mut rig = armed_on_pad();
    rig.keys(&[Key::Char('S'), Key::Enter]);
    rig.run(1.0);
    assert!(rig.take_commands().is_empty(), "Enter alone does not start");
    for missing in 0..start_ladder().len() {
        let mut keys = start_ladder();
        keys.remove(missing);
        let mut rig = armed_on_pad();
        rig.keys(&keys);
        rig.run(20.0);
        assert!(rig.take_commands().is_empty(), "without key {missing}");
    }
    rig.keys(&start_ladder());
    rig.run(10.0);
    let starts = rig.take_commands();
    assert_eq!(starts.len(), 5);
    assert!(starts.iter().all(|command| command.command == START));
    rig.keys(&start_ladder()[..6]);
    rig.run(WORD_TIME_LIMIT.as_secs_f64() + 0.1);
    rig.key(Key::Enter);
    assert!(rig.take_commands().is_empty(), "the offer to start has ended");
}

#[test]
fn any_other_key_cancels_a_dialog() {
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
            let mut rig = armed_on_pad();
            if ladder == crate::keys::ladder() {
                rig = Rig::crewed();
            }
            rig.take_commands();
            let (last, before) = ladder.split_last().unwrap();
            rig.keys(&before[..2]);
            assert_ne!(rig.model.dialog, None);
            rig.key(key);
            assert_eq!(rig.model.dialog, None, "{key:?} in {ladder:?}");
            rig.keys(&[&before[2..], &[*last]].concat());
            rig.run(1.0);
            assert!(rig.take_commands().is_empty() && !leaves(&rig), "{key:?} in {ladder:?}");
        }
    }
}

#[test]
fn a_paste_is_dropped_with_an_event_and_cancels_the_dialog() {
    let mut rig = armed_on_pad();
    rig.keys(&start_ladder()[..6]);
    rig.msg(Msg::Pasted);
    rig.expect_event("a paste was dropped");
    assert_eq!(rig.model.dialog, None);
    rig.key(Key::Enter);
    assert!(rig.take_commands().is_empty());
}

#[test]
fn acknowledged_is_not_observed() {
    let mut rig = Rig::crewed();
    rig.keys(&ladder());
    rig.answer(ARM, ACCEPTED);
    rig.run(4.0);
    rig.expect_event("ARM acknowledged, not observed");
    rig.expect_screen("acknowledged accepted  observed NOT OBSERVED");
    assert!(rig.model.alarms.is_unseen(AlarmKind::Disagreement(CommandKind::Arm)));
    rig.armed = true;
    rig.run(1.0);
    rig.expect_screen("observed yes");
}

#[test]
fn an_answer_for_another_ground_station_is_not_ours() {
    let mut rig = Rig::crewed();
    rig.keys(&ladder());
    let other = protocol::identity::Address { system_id: 254, component_id: 190 };
    rig.answer_to(other, ARM, ACCEPTED);
    assert!(!rig.events().contains("acknowledged"));
}

#[test]
fn quitting_takes_one_key_and_while_armed_a_typed_word() {
    for key in [Key::Char('q'), Key::CtrlC] {
        let mut rig = Rig::crewed();
        rig.key(key);
        rig.run(0.1);
        assert!(rig.wants_to_quit());
        let mut rig = armed_on_pad();
        rig.keys(&[key, key]);
        rig.run(1.0);
        assert!(!leaves(&rig), "two keys do not");
        rig.run(WORD_TIME_LIMIT.as_secs_f64() + 0.1);
        rig.keys(&[vec![key], typed("quit")].concat());
        rig.run(WORD_TIME_LIMIT.as_secs_f64() + 0.1);
        rig.key(Key::Enter);
        assert!(!leaves(&rig), "the offer has ended");
        rig.keys(&[vec![key], typed("Quit"), vec![Key::Enter]].concat());
        assert!(leaves(&rig));
        assert!(rig.take_commands().is_empty(), "quitting neither disarms nor aborts");
    }
}

/// The ticks of the station must not complete a chord or a quit at an attached screen.
#[test]
fn ticks_of_the_station_do_not_affect_the_keys_of_an_attached_screen() {
    let mut rig = Rig::crewed();
    rig.model.settings.role = Role::Attached;
    rig.key(Key::CtrlX);
    rig.run(0.4);
    rig.key(Key::CtrlX);
    rig.run(0.3);
    let asks = |rig: &Rig| rig.actions.contains(&Action::Request(Request::Command(CommandKind::Abort)));
    assert!(!asks(&rig));
    rig.msg(Msg::ScreenTick);
    assert!(asks(&rig));
    rig.key(Key::Char('q'));
    rig.run(0.3);
    assert!(!rig.wants_to_quit());
    rig.msg(Msg::ScreenTick);
    assert!(rig.wants_to_quit());
}

/// A live station keeps running without its screen; a demonstration and an attached screen end.
#[test]
fn quitting_a_screen_never_ends_a_live_station_in_flight() {
    for (role, demonstration, ends) in
        [(Role::Station, false, false), (Role::Station, true, true), (Role::Attached, false, true)]
    {
        let mut rig = armed_on_pad();
        (rig.model.settings.role, rig.model.settings.demonstration) = (role, demonstration);
        rig.keys(&quit_ladder());
        assert_eq!(rig.actions.contains(&Action::Quit), ends, "{role:?}");
        assert_eq!(rig.actions.contains(&Action::LeaveScreen), !ends, "{role:?}");
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
fn sigint_does_not_end_a_live_station_at_risk_and_sigterm_does() {
    let mut rig = armed_on_pad();
    rig.msg(Msg::Terminate("SIGINT"));
    assert!(!rig.wants_to_quit() && rig.events().contains("SIGINT: the station continues"));
    rig.msg(Msg::Terminate("SIGTERM"));
    assert!(rig.wants_to_quit());
    for (armed, demonstration) in [(false, false), (true, true)] {
        let mut rig = if armed { armed_on_pad() } else { Rig::crewed() };
        rig.model.settings.demonstration = demonstration;
        rig.msg(Msg::Terminate("SIGINT"));
        assert!(rig.wants_to_quit());
    }
}

/// The first repeat of a held key looks like a second press; only the later repeats show that it is
/// held.
#[test]
fn a_held_ctrl_x_does_not_abort_and_one_more_press_does() {
    for delay_ms in [250, 400, 500, 600] {
        let mut rig = Rig::crewed();
        rig.speaks = false;
        rig.hold(Key::CtrlX, delay_ms, 33, 5);
        rig.run(0.5);
        assert!(!rig.take_commands().iter().any(is_abort), "first repeat after {delay_ms} ms");
        rig.expect_screen("ENTER ABORTS (or Ctrl-X)");
        rig.key(Key::CtrlX);
        rig.run(0.2);
        assert!(rig.take_commands().iter().any(is_abort), "released and pressed again");
    }
}

#[test]
fn another_key_does_not_cancel_a_complete_abort_chord() {
    let mut rig = Rig::crewed();
    rig.key(Key::CtrlX);
    rig.run(0.4);
    rig.press(Key::CtrlX);
    rig.press(Key::Escape);
    assert!(rig.take_commands().iter().any(is_abort));
}

/// On a terminal that reports repeats, the second press counts without waiting.
#[test]
fn the_second_press_counts_at_once_on_a_terminal_that_reports_repeats() {
    // On a busy machine both may arrive at once.
    for pause_s in [0.0, 0.1, 0.3, 1.9] {
        let mut rig = Rig::crewed();
        rig.model.repeats_reported = true;
        rig.key(Key::CtrlX);
        rig.run(pause_s);
        assert!(!rig.take_commands().iter().any(is_abort));
        rig.key(Key::CtrlX);
        assert_eq!(rig.take_commands().iter().filter(|command| is_abort(command)).count(), 1);
        rig.answer(ABORT, ACCEPTED);
        rig.interlocks |= TdInterlock::TD_INTERLOCK_ABORT_LATCHED;
        rig.run(3.0);
        assert!(rig.take_commands().is_empty(), "once");
    }
}
