//! The automatic mode, on a simulated clock.

use crate::rig::{Rig, is_arm, settings};
use ground::exit::{Exit, decide};
use ground::key::Key;
use ground::model::Settings;
use ground::update::Action;
use protocol::dialect::{MavCmd, TdHold, TdPhase};

const ARM: MavCmd = MavCmd::MAV_CMD_COMPONENT_ARM_DISARM;
const TEMPORARILY_REJECTED: u8 = 1;
const DENIED: u8 = 2;

/// The vehicle does what the automatic mode has commanded, and what it commands next.
fn arms_and_starts(rig: &mut Rig) {
    rig.answer(ARM, 0);
    rig.armed = true;
    rig.phase = TdPhase::TD_PHASE_PAD_ARMED;
    rig.run(1.0);
    rig.answer(MavCmd::MAV_CMD_MISSION_START, 0);
    rig.countdown_ms = 5_000;
}

#[test]
fn the_automatic_mode_arms_and_starts_once() {
    let mut rig = Rig::new(settings(true, false));
    rig.run(2.0);
    let commands = rig.take_commands();
    assert!(!commands.is_empty() && commands.iter().all(is_arm), "{commands:?}");
    assert!(commands.iter().all(|sent| sent.param2.to_bits() == commands[0].param2.to_bits()), "one command");
    arms_and_starts(&mut rig);
    rig.run(5.0);
    let commands = rig.take_commands();
    assert_eq!(commands.len(), 1);
    assert_eq!(commands[0].command, MavCmd::MAV_CMD_MISSION_START);
}

/// A computer that sleeps for a second makes the vehicle hold its countdown.
#[test]
fn a_countdown_that_silence_has_held_is_started_anew_and_one_that_a_person_has_held_is_not() {
    for (hold, starts) in [(TdHold::TD_HOLD_UPLINK_SILENT, 1), (TdHold::TD_HOLD_COMMANDED, 0)] {
        let mut rig = Rig::new(settings(true, false));
        rig.run(2.0);
        arms_and_starts(&mut rig);
        rig.run(1.0);
        rig.take_commands();
        rig.countdown_ms = i32::MAX;
        rig.hold = hold;
        // Not long enough for a second attempt of the same command.
        rig.run(0.4);
        let again = rig.take_commands();
        assert_eq!(again.len(), starts, "{hold:?}: {}", rig.events());
        assert!(again.iter().all(|sent| sent.command == MavCmd::MAV_CMD_MISSION_START), "{again:?}");
    }
}

/// The silence began before the station saw the countdown.
#[test]
fn a_countdown_that_was_held_before_it_was_seen_is_started_again() {
    let mut rig = Rig::new(settings(true, false));
    rig.run(2.0);
    arms_and_starts(&mut rig);
    rig.countdown_ms = i32::MAX;
    rig.hold = TdHold::TD_HOLD_UPLINK_SILENT;
    rig.run(1.0);
    rig.take_commands();
    rig.run(2.0);
    let again = rig.take_commands();
    assert!(!again.is_empty(), "{}", rig.events());
    assert!(again.iter().all(|sent| sent.command == MavCmd::MAV_CMD_MISSION_START), "{again:?}");
}

#[test]
fn failing_checks_prevent_arming_and_the_run_ends_with_the_reason() {
    let mut rig = Rig::new(settings(true, false));
    rig.checks_failed = 0b10;
    rig.run(10.5);
    assert_eq!(rig.model.outcome.refusal, None, "ten seconds from the first heartbeat, at 1 s");
    rig.run(4.0);
    assert!(rig.commands().is_empty());
    rig.expect_event("gave up 10 s after first contact: failing checks: ");
    assert!(rig.wants_to_quit());
    assert_eq!(decide(&rig.model.outcome, false), Exit::RefusedOrAborted);
}

#[test]
fn the_time_limit_starts_with_the_first_heartbeat() {
    let mut rig = Rig::new(settings(true, true));
    rig.speaks = false;
    rig.run(30.0);
    rig.speaks = true;
    rig.checks_failed = 0b10;
    rig.run(8.0);
    assert!(rig.take_commands().is_empty());
    rig.checks_failed = 0;
    rig.run(0.2);
    assert!(is_arm(&rig.take_commands()[0]));
}

#[test]
fn nothing_is_armed_before_the_vehicle_has_reported_its_checks() {
    let mut rig = Rig::new(settings(true, false));
    rig.speaks = false;
    for _ in 0..13 {
        rig.run(1.0);
        rig.heartbeat();
    }
    rig.expect_event("gave up 10 s after first contact: the vehicle has not reported");
    assert!(rig.commands().is_empty());
    assert!(rig.wants_to_quit());
    assert_eq!(decide(&rig.model.outcome, false), Exit::RefusedOrAborted);
}

#[test]
fn a_temporary_refusal_is_commanded_again_once_the_checks_pass() {
    let mut rig = Rig::new(settings(true, false));
    rig.run(2.0);
    assert!(is_arm(&rig.take_commands()[0]));
    rig.checks_failed = 0b10;
    rig.answer(ARM, TEMPORARILY_REJECTED);
    rig.run(3.0);
    assert!(rig.take_commands().is_empty(), "no timer sends it again");
    rig.checks_failed = 0;
    rig.run(0.2);
    let again = rig.take_commands();
    assert!(again.len() == 1 && is_arm(&again[0]) && again[0].confirmation == 0, "{again:?}");
    assert_eq!(rig.events().matches("the checks pass; arming").count(), 2, "each submission is logged");
    assert!(!rig.wants_to_quit());
}

#[test]
fn repeated_temporary_refusals_end_with_the_time_limit() {
    let mut rig = Rig::new(settings(true, false));
    let mut requests = 0;
    let mut quit = false;
    for _ in 0..200 {
        rig.run(0.1);
        quit |= rig.wants_to_quit();
        for _ in rig.take_commands().into_iter().filter(is_arm) {
            requests += 1;
            rig.answer(ARM, TEMPORARILY_REJECTED);
        }
    }
    assert!((5..=12).contains(&requests), "{requests} requests");
    let why = rig.model.outcome.refusal.as_ref().map(|(why, _)| why.as_str());
    assert_eq!(why, Some("ARM not sent: temporarily refused, although no check fails"));
    assert!(quit);
    assert_eq!(decide(&rig.model.outcome, false), Exit::RefusedOrAborted);
}

#[test]
fn a_final_refusal_ends_with_its_exit_code() {
    let mut rig = Rig::new(settings(true, false));
    rig.run(2.0);
    assert!(is_arm(&rig.take_commands()[0]));
    rig.answer(ARM, DENIED);
    rig.run(3.0);
    assert!(rig.commands().is_empty());
    assert!(rig.wants_to_quit());
    assert_eq!(decide(&rig.model.outcome, false), Exit::RefusedOrAborted);
}

/// A vehicle that does not always report to be simulated counts as real.
#[test]
fn the_automatic_mode_is_refused_with_a_live_vehicle() {
    for interactive in [false, true] {
        let mut rig = Rig::new(settings(true, interactive));
        rig.simulated = false;
        rig.run(2.0);
        assert!(rig.take_commands().is_empty());
        rig.expect_event("automatic mode refused: the vehicle is live");
        rig.simulated = true;
        rig.armed = true;
        rig.phase = TdPhase::TD_PHASE_PAD_ARMED;
        rig.run(5.0);
        assert_eq!(rig.wants_to_quit(), !interactive);
        assert!(rig.take_commands().is_empty(), "refused is refused");
        assert_eq!(decide(&rig.model.outcome, false), Exit::RefusedOrAborted);
    }
    let mut own = Rig::new(Settings { demonstration: true, ..settings(true, false) });
    own.simulated = false;
    own.run(2.0);
    assert!(own.take_commands().is_empty(), "the demonstration asks for both marks, too");
    // One mark is not enough: of the status alone, and, in `identity`, of the heartbeat alone.
    let mut half = Rig::new(settings(true, false));
    half.hil = false;
    half.run(2.0);
    let why = half.model.outcome.refusal.as_ref().map(|(why, _)| why.as_str());
    assert_eq!(why, Some("the automatic mode: the vehicle is live: it does not report that it is simulated"));
    assert!(half.take_commands().is_empty());
}

#[test]
fn only_a_demonstration_s_pin_is_moved_here_and_not_in_flight() {
    for (demonstration, phase, moved) in [
        (true, TdPhase::TD_PHASE_PAD_IDLE, Some(Action::MovePin(false))),
        (true, TdPhase::TD_PHASE_TOUCHDOWN, Some(Action::MovePin(false))),
        (true, TdPhase::TD_PHASE_CHUTE, None),
        (false, TdPhase::TD_PHASE_PAD_IDLE, None),
    ] {
        let mut rig = Rig::new(Settings { demonstration, ..settings(false, true) });
        rig.phase = phase;
        rig.run(1.0);
        rig.key(Key::Char('I'));
        let found = rig.actions.iter().find(|action| matches!(action, Action::MovePin(_)));
        assert_eq!(found.cloned(), moved, "{phase:?}");
    }
}
