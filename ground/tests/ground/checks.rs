//! An arming check that fails while the vehicle is armed, in the countdown, and before the start.

use ground::key::Key;
use ground::model::{Act, AlarmKind, CommandKind};
use ground::view::headline::pad;
use protocol::dialect::{MavMessage, MavSeverity, TD_MISSION_DATA, TdCheck, TdHold, TdPhase, TdStart};

use crate::rig::{Rig, typed};

const GNSS: TdCheck = TdCheck::TD_CHECK_GNSS;

fn armed() -> Rig {
    let mut rig = Rig::crewed();
    (rig.armed, rig.phase) = (true, TdPhase::TD_PHASE_PAD_ARMED);
    rig.run(1.0);
    rig
}

fn is_alarmed(rig: &Rig, words: &str) -> bool {
    let mut alarms = rig.model.alarms.list().iter();
    alarms.any(|alarm| alarm.what.kind == AlarmKind::Unfit && alarm.is_active() && alarm.what.text == words)
}

/// The uplink comes and goes with every lost heartbeat, and has an alarm of its own.
#[test]
fn every_check_that_fails_while_it_is_armed_is_an_alarm_with_its_name_and_no_go() {
    for (name, check) in TdCheck::all().iter_names() {
        let mut rig = armed();
        assert_eq!(pad(&rig.model, rig.now).text, "ARMED");
        rig.checks_failed = check.bits();
        rig.run(0.2);
        let words = ground::model::words::check(name);
        let is_reported = check != TdCheck::TD_CHECK_UPLINK;
        assert_eq!(is_alarmed(&rig, &format!("ARMED, and NO-GO: {words}")), is_reported, "{name}");
        assert_eq!(pad(&rig.model, rig.now).text == "NO-GO", is_reported, "{name}");
        if is_reported {
            for (columns, rows) in [(80, 24), (120, 40), (200, 60)] {
                let screen = rig.screen(columns, rows);
                assert!(screen.contains(&format!("ALARM ARMED, and NO-GO: {words}")), "{screen}");
            }
        }
        rig.checks_failed = 0;
        rig.run(0.2);
        assert_eq!(pad(&rig.model, rig.now).text, "ARMED", "{name}");
    }
}

#[test]
fn a_hold_names_the_check_for_which_the_vehicle_held_also_when_it_passes_again() {
    // The text may come before the status or after it, or be lost; the check may pass again before
    // a status shows it.
    for (text_first, text_last, seen_failing) in
        [(true, false, true), (true, false, false), (false, true, false), (false, false, true)]
    {
        let mut rig = armed();
        rig.countdown_ms = 5_000;
        rig.run(0.2);
        let say = |rig: &mut Rig| rig.text_of(MavSeverity::MAV_SEVERITY_CRITICAL, "no GNSS fix for 3 s");
        if text_first {
            say(&mut rig);
        }
        rig.checks_failed = if seen_failing { (GNSS | TdCheck::TD_CHECK_SPEED).bits() } else { 0 };
        (rig.countdown_ms, rig.hold) = (i32::MAX, TdHold::TD_HOLD_CHECK_FAILED);
        rig.run(0.2);
        if text_last {
            say(&mut rig);
        }
        rig.checks_failed = 0;
        rig.run(2.0);
        let words = if text_first || text_last { "no GNSS fix" } else { "gnss" };
        let screen = rig.screen(80, 24);
        assert!(screen.contains(&format!("HOLD: {words}; start again; disarms in 42 s")), "{screen}");
        assert_eq!(pad(&rig.model, rig.now).text, "HOLD");
        // Another hold has its own check.
        rig.hold = TdHold::TD_HOLD_NONE;
        rig.run(0.2);
        rig.checks_failed = TdCheck::TD_CHECK_FINS.bits();
        rig.hold = TdHold::TD_HOLD_CHECK_FAILED;
        rig.run(0.2);
        rig.expect_screen("HOLD: fins; start again");
    }
}

#[test]
fn no_start_is_offered_or_sent_while_any_check_fails_and_the_line_names_it() {
    for (name, check) in TdCheck::all().iter_names().filter(|(_, check)| *check != TdCheck::TD_CHECK_UPLINK) {
        let mut rig = armed();
        assert!(Act::Start.works(&rig.model, rig.now));
        rig.checks_failed = check.bits();
        rig.run(0.2);
        assert!(!Act::Start.works(&rig.model, rig.now), "{name}");
        rig.key(Key::Char('S'));
        rig.keys(&typed("START"));
        rig.key(Key::Enter);
        let why = format!("cannot start: NO-GO: {}", ground::model::words::check(name));
        assert!(rig.events().contains(&why), "{name}: {}", rig.events());
        assert!(rig.take_commands().is_empty(), "{name}");
        // It fails between the question and the answer.
        rig.checks_failed = 0;
        rig.run(3.0);
        rig.key(Key::Char('S'));
        rig.keys(&typed("START"));
        rig.checks_failed = check.bits();
        rig.run(0.2);
        rig.key(Key::Enter);
        assert!(rig.model.commands.of(CommandKind::Start).is_none(), "{name}");
    }
}

#[test]
fn the_pad_page_the_prompt_and_the_line_quote_the_vehicle_on_a_failing_check() {
    let mut rig = Rig::crewed();
    rig.checks_failed = (GNSS | TdCheck::TD_CHECK_SPEED).bits();
    rig.text("not ready: no GNSS fix for 3 s");
    rig.run(0.2);
    let failing =
        |rig: &Rig| rig.model.vehicle.failing().into_iter().map(|(_, words)| words).collect::<Vec<_>>();
    assert_eq!(failing(&rig), ["no GNSS fix", "speed"]);
    let row = |rig: &Rig, begin: &str| rig.screen(80, 24).lines().any(|row| row.contains(begin));
    assert!(row(&rig, " NO  no GNSS fix") && row(&rig, " NO  speed"), "{}", rig.screen(80, 24));
    rig.key(Key::Char('A'));
    assert!(row(&rig, "  NO no GNSS fix"), "{}", rig.screen(80, 24));
    rig.key(Key::Escape);
    // Words for what has passed since are not used for what fails later.
    rig.checks_failed = 0;
    rig.run(0.2);
    rig.checks_failed = GNSS.bits();
    rig.run(0.2);
    assert_eq!(failing(&rig), ["gnss"]);
}

#[test]
fn the_height_below_a_drone_counts_only_for_a_vehicle_that_hangs() {
    let all = TdCheck::all().iter().count();
    for (start, made) in [(TdStart::TD_START_PAD, all - 1), (TdStart::TD_START_DRONE, all)] {
        let mut rig = Rig::crewed();
        rig.receive(&MavMessage::TD_MISSION(TD_MISSION_DATA { start, ..TD_MISSION_DATA::default() }));
        rig.run(0.2);
        let screen = rig.screen(200, 60);
        assert!(screen.contains(&format!("{made} of {made} checks")), "{screen}");
    }
}
