//! What must not be forgotten: an abort that was not sent or not confirmed, and that people must
//! keep away.

use std::time::Duration;

use ground::key::Key;
use ground::model::{Action, AlarmKind, CommandKind, Danger, Prompt, Role, Seat, Settings, Unfinished};
use ground::update::{Msg, Request};
use protocol::dialect::{MavCmd, TdInterlock, TdMotor, TdPhase};

use crate::endings::reason;
use crate::keys::ladder;
use crate::rig::{Rig, enter, settings};
use crate::screens::counting;

const ABORT: MavCmd = MavCmd::MAV_CMD_DO_FLIGHTTERMINATION;

/// What was kept last.
fn stored(rig: &Rig) -> Option<Unfinished> {
    rig.actions.iter().rev().find_map(|action| match action {
        Action::StoreUnfinished(stored) => Some(stored.clone()),
        _ => None,
    })
}

/// The vehicle has aborted on its pad.
fn latched(rig: &mut Rig) {
    rig.interlocks |= TdInterlock::TD_INTERLOCK_ABORT_LATCHED | TdInterlock::TD_INTERLOCK_MOTOR_INHIBITED;
    (rig.armed, rig.phase, rig.countdown_ms) = (false, TdPhase::TD_PHASE_PAD_IDLE, i32::MAX);
    rig.approach_wait_s = 58;
    rig.run(1.0);
}

#[test]
fn an_abort_and_its_wait_are_stored_until_it_is_confirmed_and_people_may_approach() {
    let mut rig = counting();
    assert_eq!(stored(&rig), None, "nothing is unfinished");
    rig.abort();
    rig.run(0.2);
    let abort = stored(&rig).and_then(|stored| stored.abort).expect("it is not confirmed");
    assert!(abort.contains("UTC"), "{abort}");
    rig.answer(ABORT, 0);
    latched(&mut rig);
    assert_eq!(stored(&rig), Some(Unfinished { abort: None, danger: Some(Danger::Live) }));
    rig.actions.clear();
    for _ in 0..10 {
        rig.approach_wait_s -= 1;
        rig.run(1.0);
    }
    assert_eq!(stored(&rig), None, "a time that passes is not stored");
    rig.approach_wait_s = 0;
    rig.run(0.2);
    assert_eq!(stored(&rig).and_then(|stored| stored.danger), Some(Danger::LiveWaited));
    rig.motor = TdMotor::TD_MOTOR_PIN_IN;
    rig.run(0.2);
    assert_eq!(stored(&rig), Some(Unfinished::default()));
}

#[test]
fn a_permanently_refused_abort_is_not_stored() {
    let mut rig = counting();
    rig.abort();
    rig.run(0.2);
    assert!(stored(&rig).is_some_and(|stored| stored.abort.is_some()));
    rig.answer(ABORT, 4);
    rig.run(0.2);
    assert_eq!(stored(&rig), Some(Unfinished::default()));
}

#[test]
fn a_demonstration_and_an_attached_screen_store_nothing() {
    for change in [
        |settings: &mut Settings| settings.demonstration = true,
        |settings: &mut Settings| settings.role = Role::Attached,
    ] {
        let mut settings = settings(false, true);
        change(&mut settings);
        let mut rig = Rig::new(settings);
        latched(&mut rig);
        assert_eq!(stored(&rig), None);
    }
}

/// The station was quit during the wait, or after it, and vehicle and station were switched on
/// again.
#[test]
fn a_restarted_station_waits_again_in_full_and_then_requests_the_pin() {
    for danger in [Danger::Live, Danger::LiveWaited, Danger::NotReported] {
        let mut rig = Rig::new(settings(false, true));
        rig.msg(Msg::Unfinished(Box::new(Unfinished { abort: None, danger: Some(danger) })));
        let shown = reason(&rig).unwrap();
        assert!(shown.starts_with(" do not approach for 60 s: "), "not received: {shown}");
    }
    let mut rig = Rig::new(settings(false, true));
    rig.msg(Msg::Unfinished(Box::new(Unfinished { abort: None, danger: Some(Danger::Live) })));
    rig.run(2.0);
    assert_eq!(reason(&rig).as_deref(), Some(" do not approach for 58 s: LIVE MOTOR"));
    rig.keys(&ladder());
    assert_eq!(rig.take_commands(), []);
    rig.expect_event("cannot arm: do not approach for 5");
    rig.run(60.0);
    let live = " one person: pin in: the motor is LIVE, and the waiting time is over";
    assert_eq!(reason(&rig).as_deref(), Some(live));
    // It is kept for the next start, too.
    assert_eq!(stored(&rig).and_then(|stored| stored.danger), Some(Danger::LiveWaited));
    rig.motor = TdMotor::TD_MOTOR_PIN_IN;
    rig.run(1.0);
    rig.motor = TdMotor::TD_MOTOR_LIVE;
    rig.run(1.0);
    assert_eq!(reason(&rig), None);
    assert_eq!(stored(&rig), Some(Unfinished::default()));
}

/// A motor that was burnt out is no live one.
#[test]
fn after_the_wait_for_a_hot_motor_no_pin_is_requested() {
    let mut rig = Rig::new(settings(false, true));
    rig.msg(Msg::Unfinished(Box::new(Unfinished { abort: None, danger: Some(Danger::Hot) })));
    rig.run(2.0);
    rig.expect_screen("do not approach for 58 s: MOTOR HOT");
    rig.run(60.0);
    assert_eq!(reason(&rig), None);
}

#[test]
fn a_new_station_reports_the_unconfirmed_abort() {
    let mut rig = Rig::new(settings(false, true));
    let abort = Some("12:03:05 UTC (screen 2, Ann)".to_owned());
    rig.msg(Msg::Unfinished(Box::new(Unfinished { abort: abort.clone(), danger: None })));
    rig.run(1.0);
    let words = "ABORT requested at 12:03:05 UTC (screen 2, Ann) NOT CONFIRMED";
    assert!(rig.screen(120, 36).contains(words), "{}", rig.screen(120, 36));
    rig.expect_event("an ABORT was requested at 12:03:05 UTC (screen 2, Ann)");
    assert!(rig.take_commands().is_empty(), "nothing is sent by itself");
    // It ends when somebody has seen it, or with another abort.
    rig.key(Key::Char(' '));
    rig.run(0.2);
    let is_open =
        |rig: &Rig| rig.model.alarms.list().iter().any(|alarm| alarm.what.kind == AlarmKind::AbortBefore);
    assert!(!is_open(&rig));
    assert_eq!(stored(&rig), Some(Unfinished::default()));
    rig.msg(Msg::Unfinished(Box::new(Unfinished { abort, danger: None })));
    rig.run(0.1);
    assert!(is_open(&rig));
    rig.abort();
    rig.run(0.2);
    rig.key(Key::Char(' '));
    assert!(!is_open(&rig));
}

/// Whoever ends the station takes the words away.
#[test]
fn quitting_takes_the_word_while_people_must_stay_away() {
    for key in ['q', 'Q'] {
        let mut rig = counting();
        latched(&mut rig);
        rig.key(Key::Char(key));
        rig.run(0.2);
        assert_eq!(rig.model.dialog.as_ref().map(|dialog| dialog.prompt), Some(Prompt::Quit), "{key}");
        assert!(rig.screen(80, 24).contains("people must keep away, DO NOT APPROACH"), "{key}");
        assert!(!rig.wants_to_quit());
        rig.keys(&enter("QUIT"));
        assert!(rig.actions.contains(&Action::LeaveScreen) && !rig.wants_to_quit(), "the station goes on");
    }
    let mut rig = counting();
    rig.model.settings.demonstration = true;
    latched(&mut rig);
    rig.key(Key::Char('q'));
    rig.run(0.2);
    assert!(rig.wants_to_quit(), "a demonstration has no people near its vehicle");
}

/// An attached screen whose station hangs.
fn hung() -> Rig {
    let mut rig = Rig::new(Settings { role: Role::Attached, ..settings(false, true) });
    rig.run(2.0);
    rig.model.alarms.history_ends();
    rig.run(1.0);
    rig
}

fn hangs(rig: &mut Rig, seconds: u64) {
    for _ in 0..10 * seconds {
        rig.now += Duration::from_millis(100);
        rig.msg(Msg::ScreenTick);
    }
}

/// What the run loop notes when the station's socket has taken the request.
fn requests(rig: &mut Rig) {
    rig.actions.clear();
    rig.abort();
    assert!(rig.actions.contains(&Action::Request(Request::Command(CommandKind::Abort))));
    rig.model.link.abort_requested_at = Some(rig.now);
}

#[test]
fn an_abort_that_a_hung_station_has_not_sent_is_the_largest_word_of_every_page() {
    let mut before = hung();
    hangs(&mut before, 3);
    before.expect_screen("abort now: NOT SENT while the station hangs");
    requests(&mut before);
    // It may be requested before the silence counts as one.
    let mut after = hung();
    requests(&mut after);
    after.expect_screen("ABORT requested, not yet accepted by the station");
    hangs(&mut after, 3);
    for mut rig in [before, after] {
        for digit in "123456789".chars() {
            rig.key(Key::Char(digit));
            let screen = rig.screen(80, 24);
            let words = " ABORT NOT SENT: the station hangs; it sends it when it resumes";
            assert!(screen.lines().nth(2).is_some_and(|row| row.contains(words)), "{digit}: {screen}");
            assert!(screen.lines().nth(3).is_some_and(|row| row.contains(words)), "{digit}: {screen}");
            assert!(screen.lines().nth(4).is_some_and(|row| row.contains('▀')), "{digit} large: {screen}");
        }
        assert!(rig.screen(20, 5).contains("ABORT NOT SENT"), "{}", rig.screen(20, 5));
        hangs(&mut rig, 1);
        assert!(rig.screen(120, 36).contains("ALARM ABORT NOT SENT: the station hangs"));
        // The station goes on, and takes it.
        rig.run(0.1);
        rig.msg(Msg::command(CommandKind::Abort, Seat::new(2, "Ann")));
        rig.run(0.1);
        let screen = rig.screen(80, 24);
        assert!(!screen.contains(" ABORT NOT SENT: the station hangs; it sends"), "{screen}");
        assert!(screen.contains(" ABORT x") || screen.contains(" ABORT  commanded"), "{screen}");
    }
}
