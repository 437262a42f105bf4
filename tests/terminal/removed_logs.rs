//! Somebody removes the station's logs while it writes them.

use e2e::{Program, Running, Signal, program, raw_frames_of};

use super::rig::Pad;

#[test]
fn logs_that_are_removed_in_the_countdown_are_an_alarm_and_lose_nothing() {
    let mut pad = Pad::new();
    let daemon = pad.daemon("flight.mcap");
    let mut screen = pad.attach(&[], &[]);
    screen.wait_for("every arming check passes");
    screen.type_until(b"AARM\r", " ARMED ");
    screen.wait_for("✓ armed (HEARTBEAT)");
    screen.type_until(b"SSTART\r", "START  commanded");
    for file in ["flight.mcap", "flight.tlog"] {
        std::fs::remove_file(pad.folder.path().join(file)).unwrap();
    }
    screen.wait_for("STATION LOG was REMOVED");
    pad.vehicle.wait_for_line("its legs");
    daemon.signal(Signal::SIGTERM);
    let output = daemon.wait().output;
    assert!(output.contains("the log was removed"), "{output}");
    assert!(!output.contains("HOLD") && output.contains("flight-2.mcap"), "{output}");
    let logs = ["flight.mcap", "flight-2.mcap"].map(|name| pad.folder.path().join(name));
    for log in &logs {
        let info = Running::to_end(program(Program::Replay).arg("info").arg(log));
        assert_eq!(info.code, Some(0), "{}", info.output);
        assert!(log.with_extension("tlog").metadata().unwrap().len() > 1_000);
    }
    assert!(!pad.folder.path().join("flight-3.mcap").exists(), "{output}");
    // The fifth byte of a frame is its number (MAVLink 2).
    let sent = logs.iter().flat_map(|log| raw_frames_of(log, "tx"));
    let numbers: Vec<u8> = sent.map(|frame| frame[4]).collect();
    assert!(numbers.len() > 100 && numbers.windows(2).all(|pair| pair[1] == pair[0].wrapping_add(1)));
}
