//! Keys typed by mistake: they do nothing, and the reason is shown.

use ground::key::Key;
use ground::model::Page;
use ground::view::{footer, top_lines};
use protocol::dialect::{TdInterlock, TdLatch, TdPhase};

use crate::rig::{MONO, Rig, is_abort, typed};
use crate::screens::{armed, descending, on_the_pad};

#[test]
fn a_letter_of_another_keyboard_layout_is_reported() {
    for letter in ['Ф', 'А', 'ф', 'あ', 'ä'] {
        let mut rig = on_the_pad();
        rig.key(Key::Char(letter));
        let words = format!("KEYBOARD LAYOUT: {letter} is no key here");
        rig.expect_event(&words);
        rig.expect_screen("KEYBOARD LAYOUT");
    }
    // In the middle of a word it is none of its letters.
    let mut rig = on_the_pad();
    rig.keys(&typed("AAЯ"));
    rig.expect_event("arming: cancelled; KEYBOARD LAYOUT: Я is no key here");
    assert_eq!(rig.model.dialog, None);
    // With caps lock the key of a ladder is a small letter.
    rig.key(Key::Char('a'));
    rig.expect_event("capital letters: A arms, S starts, D disarms (caps lock?)");
}

#[test]
fn an_enter_after_the_time_limit_of_an_abort_reports_that_nothing_was_sent() {
    let mut rig = descending();
    rig.key(Key::CtrlX);
    rig.run(2.3);
    rig.key(Key::Enter);
    assert!(!rig.take_commands().iter().any(is_abort));
    rig.expect_event("too late for the abort");
    rig.expect_screen("ABORT Ctrl-X Enter");
    // Once, and not for an Enter that means something else.
    let said = |rig: &Rig| rig.events().matches("too late for the abort").count();
    rig.key(Key::Enter);
    assert_eq!(said(&rig), 1);
    rig.key(Key::CtrlX);
    rig.run(2.3);
    rig.keys(&[Key::Char('5'), Key::Enter]);
    rig.key(Key::CtrlX);
    rig.run(15.0);
    rig.key(Key::Enter);
    assert_eq!(said(&rig), 1);
    rig.abort();
    assert!(rig.take_commands().iter().any(is_abort));
}

/// The key is refused, and the crew types on, slowly: no letter of it acts as a key.
#[test]
fn the_rest_of_a_refused_word_is_swallowed_until_enter() {
    for word in ["ARM", "CONFIRM"] {
        let mut rig = Rig::crewed();
        rig.uplink_alive = false;
        rig.run(4.0);
        rig.key(Key::Char('A'));
        rig.expect_event("cannot arm");
        let before = (rig.model.page(), rig.model.pages.held);
        rig.run(0.5);
        for letter in typed(word) {
            rig.key(letter);
            rig.run(1.5);
        }
        assert_eq!((rig.model.page(), rig.model.pages.held), before, "{word}");
        assert_eq!((rig.model.dialog.clone(), rig.model.pages.entry.clone()), (None, None), "{word}");
        rig.key(Key::Enter);
        assert_eq!(rig.events().matches("cannot arm").count(), 2, "it is said again: {}", rig.events());
        rig.key(Key::Char('f'));
        assert_eq!(rig.model.page(), Page::Find, "{word}: after Enter the keys act again");
    }
    // Typed after the key of a take-over, whose letter it begins with.
    let mut rig = Rig::crewed();
    rig.keys(&typed("CONFIRM"));
    assert_ne!(rig.model.page(), Page::Find);
}

/// A motor may not ignite on command.
#[test]
fn no_text_reports_a_lift_off_before_the_vehicle_has_moved() {
    let mut rig = armed();
    (rig.phase, rig.countdown_ms) = (TdPhase::TD_PHASE_BOOST, -600);
    rig.run(0.5);
    let said = |rig: &mut Rig| {
        // Neither an alarm nor a command hides the flight along its time.
        (0..5).for_each(|_| rig.key(Key::Char(' ')));
        let phase = top_lines::phase(&rig.model, MONO, rig.now).content.trim().to_owned();
        let row = footer::message_rows(&rig.model, MONO, rig.now, 119)[0].to_string();
        (phase, row.split('●').nth(1).map(|mark| mark.trim_end_matches(['━', '┄', '◆']).to_owned()))
    };
    rig.run(10.0);
    assert_eq!(said(&mut rig), ("IGN COMMANDED".to_owned(), Some("ignition commanded".to_owned())));
    // A motor that did not light: disarmed again, on the pad.
    let mut misfired = armed();
    (misfired.phase, misfired.countdown_ms) = (TdPhase::TD_PHASE_BOOST, -600);
    misfired.run(0.5);
    (misfired.phase, misfired.countdown_ms, misfired.armed) = (TdPhase::TD_PHASE_PAD_IDLE, i32::MAX, false);
    misfired.approach_wait_s = 58;
    misfired.interlocks |= TdInterlock::TD_INTERLOCK_ABORT_LATCHED;
    // After that the row of the commands is free.
    misfired.run(12.0);
    assert_eq!(said(&mut misfired), ("PAD_IDLE".to_owned(), Some("ignition commanded".to_owned())));
    rig.state(0.0, 2.0, 0.0, 12.0, 90.0);
    rig.run(0.1);
    assert_eq!(said(&mut rig), ("BOOST".to_owned(), Some("lift-off".to_owned())));
}

/// The vehicle gives the gate up by itself.
#[test]
fn the_alarm_of_an_inhibited_ignition_names_the_check() {
    let mut rig = descending();
    rig.text("ignition gate closed: tilt from vertical");
    rig.interlocks |= TdInterlock::TD_INTERLOCK_MOTOR_INHIBITED;
    rig.latch = TdLatch::TD_LATCH_GATE;
    rig.run(0.2);
    let line = |rig: &Rig| rig.screen(120, 36).lines().rev().nth(1).unwrap_or_default().to_owned();
    assert!(line(&rig).contains("MOTOR INHIBITED: gate stayed shut: tilt from vertical"), "{}", line(&rig));
    rig.finding(0, 1, 12.0, "ignition gate stayed shut: tilt from vertical, 31 of 20 deg");
    rig.run(0.2);
    assert!(line(&rig).contains("gate stayed shut: tilt from vertical, 31 of 20"), "{}", line(&rig));
}
