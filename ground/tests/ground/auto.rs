//! The automatic mode, on a simulated clock.

use crate::bench::{Bench, is_arm, settings};
use ground::exit::{Exit, decide};
use ground::model::Settings;
use protocol::dialect::{MavCmd, TdPhase};

const ARM: MavCmd = MavCmd::MAV_CMD_COMPONENT_ARM_DISARM;
const TEMPORARILY_REJECTED: u8 = 1;
const DENIED: u8 = 2;

#[test]
fn the_automatic_mode_arms_and_starts_once() {
    let mut bench = Bench::new(settings(true, false));
    bench.run(2.0);
    let commands = bench.take_commands();
    assert!(commands.len() == 1 && is_arm(&commands[0]), "{commands:?}");
    bench.answer(ARM, 0);
    bench.armed = true;
    bench.phase = TdPhase::TD_PHASE_PAD_ARMED;
    bench.run(1.0);
    bench.answer(MavCmd::MAV_CMD_MISSION_START, 0);
    bench.countdown_ms = 5_000;
    bench.run(5.0);
    let commands = bench.take_commands();
    assert_eq!(commands.len(), 1);
    assert_eq!(commands[0].command, MavCmd::MAV_CMD_MISSION_START);
}

#[test]
fn a_vehicle_whose_checks_fail_is_never_asked_and_the_run_ends_with_the_reason() {
    let mut bench = Bench::new(settings(true, false));
    bench.checks_failed = 0b10;
    bench.run(10.5);
    assert!(!bench.events().contains("gives up"), "ten seconds from the first heartbeat, at 1 s");
    bench.run(4.0);
    assert!(bench.commands().is_empty());
    assert!(bench.events().contains("gives up 10 s after first contact: failing checks: "));
    assert!(bench.wants_to_quit());
    assert_eq!(decide(&bench.model.outcome, false), Exit::RefusedOrAborted);
}

#[test]
fn patience_begins_with_the_first_contact_and_checks_that_pass_in_time_are_enough() {
    let mut bench = Bench::new(settings(true, true));
    bench.speaks = false;
    bench.run(30.0);
    bench.speaks = true;
    bench.checks_failed = 0b10;
    bench.run(8.0);
    assert!(bench.take_commands().is_empty());
    bench.checks_failed = 0;
    bench.run(0.2);
    assert!(is_arm(&bench.take_commands()[0]));
}

#[test]
fn nothing_is_armed_before_the_vehicle_has_said_that_its_checks_pass() {
    let mut bench = Bench::new(settings(true, false));
    bench.speaks = false;
    for _ in 0..13 {
        bench.run(1.0);
        bench.heartbeat();
    }
    assert!(bench.events().contains("gives up 10 s after first contact: the vehicle has not said"));
    assert!(bench.commands().is_empty());
    assert!(bench.wants_to_quit());
    assert_eq!(decide(&bench.model.outcome, false), Exit::RefusedOrAborted);
}

#[test]
fn refused_for_now_is_asked_again_once_the_checks_pass() {
    let mut bench = Bench::new(settings(true, false));
    bench.run(2.0);
    assert!(is_arm(&bench.take_commands()[0]));
    bench.checks_failed = 0b10;
    bench.answer(ARM, TEMPORARILY_REJECTED);
    bench.run(3.0);
    assert!(bench.take_commands().is_empty(), "no timer sends it again");
    bench.checks_failed = 0;
    bench.run(0.2);
    let again = bench.take_commands();
    assert!(again.len() == 1 && is_arm(&again[0]) && again[0].confirmation == 0, "{again:?}");
    assert_eq!(bench.events().matches("the checks pass; arming").count(), 2, "each submission is logged");
    assert!(!bench.wants_to_quit());
}

#[test]
fn refused_for_now_again_and_again_ends_with_patience() {
    let mut bench = Bench::new(settings(true, false));
    let mut asked = 0;
    let mut quit = false;
    for _ in 0..200 {
        bench.run(0.1);
        quit |= bench.wants_to_quit();
        for _ in bench.take_commands().into_iter().filter(is_arm) {
            asked += 1;
            bench.answer(ARM, TEMPORARILY_REJECTED);
        }
    }
    assert!((5..=12).contains(&asked), "asked {asked} times");
    assert!(quit && bench.events().contains("gives up 10 s after first contact: refused for now"));
    assert_eq!(decide(&bench.model.outcome, false), Exit::RefusedOrAborted);
}

#[test]
fn refused_for_good_ends_with_its_own_code() {
    let mut bench = Bench::new(settings(true, false));
    bench.run(2.0);
    assert!(is_arm(&bench.take_commands()[0]));
    bench.answer(ARM, DENIED);
    bench.run(3.0);
    assert!(bench.commands().is_empty());
    assert!(bench.wants_to_quit());
    assert_eq!(decide(&bench.model.outcome, false), Exit::RefusedOrAborted);
}

/// A vehicle that does not say that it is simulated, or says so once only, is a real one.
#[test]
fn the_automatic_mode_is_refused_with_a_live_vehicle() {
    for interactive in [false, true] {
        let mut bench = Bench::new(settings(true, interactive));
        bench.simulated = false;
        bench.run(2.0);
        assert!(bench.take_commands().is_empty());
        assert!(bench.events().contains("automatic mode refused: the vehicle is live"), "{}", bench.events());
        bench.simulated = true;
        bench.armed = true;
        bench.phase = TdPhase::TD_PHASE_PAD_ARMED;
        bench.run(5.0);
        assert_eq!(bench.wants_to_quit(), !interactive);
        assert!(bench.take_commands().is_empty(), "refused is refused");
        assert_eq!(decide(&bench.model.outcome, false), Exit::RefusedOrAborted);
    }
    let mut own = Bench::new(Settings { demonstration: true, ..settings(true, false) });
    own.simulated = false;
    own.run(2.0);
    assert!(is_arm(&own.take_commands()[0]), "the vehicle of this very process");
}
