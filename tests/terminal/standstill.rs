//! A station that stood still while its vehicle flew: Ctrl-Z and `fg`, a busy computer, a laptop
//! whose lid was closed.

use e2e::Signal;

use super::rig::Pad;

#[test]
fn what_waited_while_the_station_stood_still_is_in_the_log_and_not_on_the_screen() {
    let mut pad = Pad::with_vehicle(&["--start", "pad"]);
    let mut daemon = pad.daemon("flight.mcap");
    let mut screen = pad.attach(&[], &[]);
    screen.wait_for("every arming check passes");
    screen.type_until(b"AARM\r", " ARMED ");
    screen.wait_for("✓ armed (HEARTBEAT)");
    screen.type_until(b"SSTART\r", "START  commanded");
    daemon.wait_for_line("-> BOOST");
    daemon.signal(Signal::SIGSTOP);
    pad.vehicle.wait_for_line("its legs");
    daemon.signal(Signal::SIGCONT);
    daemon.wait_for_line("what waited is in the log only");
    screen.wait_until("a vehicle that is down", |window| {
        let row = window.rows().swap_remove(1);
        (row.contains("TOUCHDOWN") || row.contains("SAFED")).then_some(())
    });
    daemon.signal(Signal::SIGTERM);
    let output = daemon.wait().output;
    for old in ["TWO VEHICLES", "another vehicle", "rebooted", "-> AERO_DESCENT", "-> POWERED"] {
        assert!(!output.contains(old), "{old} in {output}");
    }
}
