//! A vehicle that loses its power in flight.

use e2e::{Bound, Program, Running, Signal, Terminal, program};

use crate::stage::{ARM, SIZE, START, Stage, ground};

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
        let top = window.rows().swap_remove(1);
        (top.starts_with(" PAD_IDLE ") && top.contains(" disarmed ") && top.contains(" down 0s up 0s"))
            .then_some(())
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

/// The vehicle listens; it is killed as it falls and started again on the very port.
#[test]
fn a_vehicle_that_is_killed_in_its_descent_and_started_again_waits_disarmed_for_new_commands() {
    let folder = tempfile::tempdir().unwrap();
    let vehicle = |port: u16| {
        let mut command = program(Program::OnboardSim);
        command.args(["fly", "--stay", "--profile", "mk2", "--mavlink", &format!("udpin:127.0.0.1:{port}")]);
        Running::start(&mut command)
    };
    let mut first = vehicle(0);
    let port = first.bound_port(Bound::Udp);
    let link = format!("udpout:127.0.0.1:{port}");
    let mut station =
        Terminal::start(&ground(folder.path(), &["--connect", &link, "--log", "none"]), SIZE, false);
    let fly = |station: &mut Terminal, flying: &mut Running| {
        station.wait_for("GO: every arming check passes");
        station.type_until(b"AARM\r", " ARMED ");
        flying.wait_for_line("PAD_ARMED");
        station.wait_for("[x] armed, says HEARTBEAT");
        station.type_until(b"SSTART\r", "START  commanded");
        flying.wait_for_line("AERO_DESCENT");
        station.wait_for("AERO_DESCENT");
    };
    fly(&mut station, &mut first);
    first.signal(Signal::SIGKILL);
    first.wait();
    station.wait_for("LINK LOST");
    let mut second = vehicle(port);
    station.wait_for("the vehicle has REBOOTED");
    station.wait_until("a disarmed pad", |window| {
        let top = window.rows().swap_remove(1);
        (top.starts_with(" PAD_IDLE ") && top.contains(" disarmed ")).then_some(())
    });
    fly(&mut station, &mut second);
    second.signal(Signal::SIGTERM);
    let ended = second.wait();
    // It was armed and started by the second ladder alone.
    assert_eq!(ended.output.matches("to PAD_ARMED").count(), 1, "{}", ended.output);
    assert_eq!(ended.output.matches("countdown started").count(), 1, "{}", ended.output);
}
