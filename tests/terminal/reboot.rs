//! A vehicle that reboots in flight.

use e2e::{ARM, Program, Running, START, Signal, Terminal, program, unshared_address};

use super::rig::{Rig, SIZE, ground};

#[test]
fn a_reboot_in_the_descent_is_reported_and_nothing_is_armed_again_automatically() {
    let mut rig = Rig::new("mk2");
    rig.fly();
    rig.terminal.wait_for("AERO_DESCENT");
    let (arms, starts) = (rig.sent(ARM, 1.0), rig.sent(START, 0.0));
    rig.reboot_vehicle();
    rig.terminal.wait_for("the vehicle has REBOOTED");
    rig.terminal.wait_until("a pad and nothing armed", |window| {
        let top = window.rows()[..2].concat();
        (top.contains(" PAD_IDLE ") && top.contains(" disarmed ") && top.contains(" down 0s up 0s"))
            .then_some(())
    });
    // What was known before the reboot is gone: the flight, and commands that were waiting.
    assert!(!rig.terminal.window().shows("commanded "));
    rig.terminal.wait_for("every arming check passes");
    assert_eq!(
        (rig.sent(ARM, 1.0), rig.sent(START, 0.0)),
        (arms, starts),
        "the ground sent a command automatically"
    );
    assert!(!rig.terminal.window().shows(" ARMED "));
    // Commands work again.
    rig.fly();
    rig.terminal.wait_for("AERO_DESCENT");
    rig.abort();
    rig.wait_for_fact("ABORT", "acknowledged accepted  observed yes");
    rig.terminal.signal(Signal::SIGTERM);
    assert_eq!(rig.terminal.wait_for_end(), Some(4), "the exit code of an aborted flight");
}

#[test]
fn a_power_cycle_in_the_countdown_is_an_alarm_and_start_is_no_longer_observed() {
    let mut rig = Rig::new("mk2");
    rig.arm();
    rig.start();
    rig.reboot_vehicle();
    rig.terminal.wait_for("the vehicle has REBOOTED in the countdown");
    // The alarm is there with the first frame of the new boot, the facts with its first state.
    rig.terminal.wait_until("a start that is no longer observed", |window| {
        (!window.shows("observed yes")).then_some(())
    });
    rig.terminal.signal(Signal::SIGTERM);
    rig.terminal.wait_for_end();
}

/// The vehicle stays switched on: neither its boot nor its clock shows it.
#[test]
fn a_reset_in_the_countdown_is_an_alarm_and_hides_go_until_somebody_has_seen_it() {
    let mut rig = Rig::with_fault("mk2", "reboot:0.1@pad-armed+7");
    rig.arm();
    rig.start();
    rig.terminal.wait_for("the vehicle has REBOOTED in the countdown");
    rig.terminal.wait_for("every arming check passes");
    // It stays for longer than its cause holds, until somebody has seen it.
    rig.terminal.wait_for("ended alarm: the vehicle has REBOOTED");
    rig.terminal.type_bytes(b" ");
    rig.terminal.wait_for("alarm acknowledged: the vehicle has REBOOTED");
    rig.terminal.signal(Signal::SIGTERM);
    rig.terminal.wait_for_end();
}

/// A countdown that was aborted: people must keep away.
fn aborted() -> Rig {
    let mut rig = Rig::new("mk2");
    rig.arm();
    rig.start();
    rig.abort();
    rig.wait_for_fact("ABORT", "acknowledged accepted  observed yes");
    rig.terminal.wait_for("do not approach for");
    rig
}

#[test]
fn the_wait_after_an_abort_goes_on_over_a_power_cycle() {
    let mut rig = aborted();
    rig.reboot_vehicle();
    rig.terminal.wait_for("the vehicle has REBOOTED");
    rig.terminal.wait_until("a vehicle that is new and must not be approached", |window| {
        let fresh = window.rows()[0].contains(" down 0s up 0s");
        (fresh && window.shows("do not approach for")).then_some(())
    });
    rig.type_until(b"0AARM\r", "cannot arm: do not approach for");
    rig.terminal.signal(Signal::SIGTERM);
    rig.terminal.wait_for_end();
}

/// Vehicle and station are both switched off during the wait, and started again by the same
/// commands.
#[test]
fn the_wait_after_an_abort_goes_on_when_vehicle_and_station_are_started_again() {
    let mut rig = aborted();
    rig.terminal.type_by_hand(b"q");
    rig.terminal.wait_for("people must keep away, DO NOT APPROACH");
    rig.type_until(b"qquit\r", "the screen was quit; people must keep away, so the station");
    rig.terminal.signal(Signal::SIGTERM);
    assert_eq!(rig.terminal.wait_for_end(), Some(4), "the exit code of an aborted flight");
    rig.reboot_vehicle();
    let link = rig.proxy.ground_link();
    let again = ground(rig.folder.path(), &["--connect", &link, "--log", "ground.mcap"]);
    rig.terminal = Terminal::start(&again, SIZE, false);
    rig.terminal.wait_until("a vehicle that must not be approached", |window| {
        let fresh = window.rows()[0].contains(" down 0s up 0s");
        (fresh && window.shows("do not approach for")).then_some(())
    });
    rig.type_until(b"0AARM\r", "cannot arm: do not approach for");
    rig.terminal.signal(Signal::SIGTERM);
    rig.terminal.wait_for_end();
}

/// The vehicle listens. It is killed in its descent and started again at the same address.
#[test]
fn a_vehicle_killed_in_its_descent_and_restarted_waits_disarmed_for_new_commands() {
    let folder = tempfile::tempdir().unwrap();
    let address = unshared_address();
    let vehicle = || {
        let mut command = program(Program::OnboardSim);
        command.args(["fly", "--stay", "--mission", "mk2", "--mavlink", &format!("udpin:{address}")]);
        command.arg("--uid-file").arg(folder.path().join("vehicle.uid"));
        Running::start(&mut command)
    };
    let mut first = vehicle();
    let link = format!("udpout:{address}");
    let mut station =
        Terminal::start(&ground(folder.path(), &["--connect", &link, "--log", "none"]), SIZE, false);
    let fly = |station: &mut Terminal, flying: &mut Running| {
        station.wait_for("every arming check passes");
        station.type_until(b"AARM\r", " ARMED ");
        flying.wait_for_line("PAD_ARMED");
        station.wait_for("✓ armed (HEARTBEAT)");
        station.type_until(b"SSTART\r", "START  commanded");
        flying.wait_for_line("AERO_DESCENT");
        station.wait_for("AERO_DESCENT");
    };
    fly(&mut station, &mut first);
    first.signal(Signal::SIGKILL);
    first.wait();
    station.wait_for("LINK LOST");
    let mut second = vehicle();
    station.wait_for("the vehicle has REBOOTED");
    station.wait_until("a disarmed pad", |window| {
        let top = window.rows().swap_remove(1);
        (top.contains(" PAD_IDLE ") && top.contains(" disarmed ")).then_some(())
    });
    fly(&mut station, &mut second);
    second.signal(Signal::SIGTERM);
    let ended = second.wait();
    // Only the second arming sequence armed and started it.
    assert_eq!(ended.output.matches("to PAD_ARMED").count(), 1, "{}", ended.output);
    assert_eq!(ended.output.matches("countdown started").count(), 1, "{}", ended.output);
}
