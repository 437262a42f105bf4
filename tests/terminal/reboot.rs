//! A vehicle that loses its power in flight.

use e2e::Signal;

use crate::stage::{ARM, START, Stage};

#[test]
fn a_vehicle_that_reboots_in_its_descent_is_said_to_and_nothing_is_armed_by_itself() {
    let mut stage = Stage::set("mk2");
    stage.arm();
    stage.start();
    stage.terminal.wait_for("AERO_DESCENT");
    let (arms, starts) = (stage.sent(ARM, 1.0), stage.sent(START, 0.0));
    stage.reboot_vehicle();
    stage.terminal.wait_for("the vehicle has REBOOTED");
    stage.terminal.wait_until("a pad and nothing armed", |window| {
        let top = window.rows().swap_remove(0);
        (top.starts_with(" PAD_IDLE ") && top.contains(" disarmed ") && top.contains("link ok")).then_some(())
    });
    // What was known before is forgotten: no flight, no command that still waits.
    assert!(!stage.terminal.look().shows("commanded "));
    stage.terminal.wait_for("GO: every arming check passes");
    assert_eq!((stage.sent(ARM, 1.0), stage.sent(START, 0.0)), (arms, starts), "nothing is asked by itself");
    assert!(!stage.terminal.look().shows(" ARMED "));
    // Commands work anew.
    stage.arm();
    stage.start();
    stage.terminal.wait_for("AERO_DESCENT");
    stage.abort();
    stage.wait_for_fact("ABORT", "acknowledged accepted  observed yes");
    stage.terminal.signal(Signal::SIGTERM);
    assert_eq!(stage.terminal.wait_for_end(), Some(4), "aborted");
}
