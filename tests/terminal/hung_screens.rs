//! Screens that hang in a countdown: a stopped process, a connection that died, a terminal without
//! a screen.

use e2e::{Running, Signal, Terminal};

use super::rig::{Pad, Rig, ground};

/// What the station says when it holds.
const HELD: &str = "no commanding screen in the countdown: HOLD";

fn start(screen: &mut Terminal) {
    screen.wait_for("every arming check passes");
    screen.type_until(b"AARM\r", " ARMED ");
    screen.wait_for("✓ armed (HEARTBEAT)");
    screen.type_until(b"SSTART\r", "START  commanded");
    screen.wait_for_fact("START", "observed yes");
}

fn status(pad: &Pad) -> String {
    Running::to_end(&mut ground(pad.folder.path(), &["status"])).output
}

#[test]
fn a_screen_whose_process_is_stopped_holds_the_countdown() {
    let pad = Pad::new();
    let mut daemon = pad.daemon("flight.mcap");
    let mut screen = pad.attach(&["--operator", "anna"], &[]);
    start(&mut screen);
    screen.signal(Signal::SIGSTOP);
    daemon.wait_for_line(HELD);
    daemon.wait_for_line("HOLD: no countdown");
    let report = status(&pad);
    assert!(report.contains("PAD_ARMED") && report.contains("anna (does not answer)"), "{report}");
    screen.signal(Signal::SIGCONT);
    daemon.wait_for_line("at the controls: screen 1, anna");
}

/// As over SSH when the network dies: what is written goes into buffers that have room for minutes.
#[test]
fn a_screen_whose_connection_died_holds_the_countdown() {
    let pad = Pad::new();
    let mut daemon = pad.daemon("flight.mcap");
    let mut screen = pad.attach(&[], &[]);
    start(&mut screen);
    let dead = screen.stop_reading();
    daemon.wait_for_line(HELD);
    daemon.wait_for_line("HOLD: no countdown");
    assert!(status(&pad).contains("PAD_ARMED"));
    drop(dead);
    daemon.wait_for_line("at the controls: screen 1");
}

#[test]
fn a_station_whose_local_terminal_hangs_holds_the_countdown() {
    let mut rig = Rig::new("mk2");
    start(&mut rig.terminal);
    let Rig { terminal, vehicle, .. } = &mut rig;
    let hanging = terminal.stop_reading();
    vehicle.wait_for_line("HOLD: no countdown");
    drop(hanging);
    terminal.wait_for("HOLD");
}

#[test]
fn a_terminal_without_a_screen_reports_its_limits_and_does_not_count() {
    let pad = Pad::new();
    let _daemon = pad.daemon("flight.mcap");
    let lines = pad.attach(&[], &[("TERM", "dumb")]);
    lines.wait_for("can neither hold nor abort");
    assert!(status(&pad).contains("(watches)"), "{}", status(&pad));
}

/// A late answer would be typed into the shell.
#[test]
fn a_screen_that_ends_leaves_no_answer_behind() {
    let pad = Pad::new();
    let mut daemon = pad.daemon("flight.mcap");
    let mut screen = pad.attach(&[], &[]);
    daemon.wait_for_line("at the controls: screen 1");
    screen.wait_for("every arming check passes");
    screen.type_bytes(b"q");
    assert_eq!(screen.wait_for_end(), Some(0));
    let queried = screen.window().bytes().windows(4).any(|bytes| bytes == b"\x1b[5n");
    assert!(queried && screen.is_restored());
    daemon.wait_for_line("no commanding screen");
}
