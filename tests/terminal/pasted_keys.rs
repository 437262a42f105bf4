//! Pasted text, held keys and bytes that arrive too fast: they arm, start or quit nothing by
//! themselves, and keys that a bad connection delivers in bunches are not lost.

use std::process::Command;

use e2e::{ARM, START, Signal, Terminal};

use super::rig::{Rig, SIZE, ground};

/// A text that was meant for another window.
const NOTE: &str = "Send the crew away\nThanks\n";

/// About ten thousand characters, with every key of the station except the abort's.
fn long_text() -> String {
    "A quick brown fox: ARM\nSTART\nquit\nQUIT\nDisarm\n Start it, quickly.\n".repeat(150)
}

impl Rig {
    /// Waits until all earlier keys were processed, by waiting for the effect of a later key.
    fn wait_for_keys(&mut self) {
        self.type_until(b"5", "[5Link]");
        self.type_until(b"1", "[1Pad]");
    }
}

#[test]
fn a_paste_into_an_armed_station_starts_nothing() {
    let mut rig = Rig::new("mk2");
    rig.arm();
    rig.terminal.paste(NOTE);
    rig.terminal.wait_for("a paste was dropped");
    rig.wait_for_keys();
    assert_eq!(rig.sent(START, 0.0), 0, "a countdown was started by a paste");
}

/// A connection that holds typed keys back for half a second at a time.
#[test]
fn keys_that_arrive_in_bunches_arm_and_start_after_the_question() {
    let mut rig = Rig::new("mk2");
    rig.terminal.wait_for("every arming check passes");
    rig.terminal.type_in_bunches(b"AARM\r", &[2, 3]);
    assert!(rig.terminal.confirm_if_prompted(" ARMED "), "keys that came together were taken for typed ones");
    rig.terminal.wait_for("✓ armed (HEARTBEAT)");
    rig.terminal.type_in_bunches(b"SSTART\r", &[1, 4, 2]);
    assert!(rig.terminal.confirm_if_prompted("START  commanded"));
    rig.wait_for_fact("START", "observed yes");
    assert_eq!(rig.sent(ARM, 1.0), 1);
    // A hold and a disarm need no second confirmation.
    rig.terminal.type_in_bunches(b"D\r", &[2]);
    rig.terminal.wait_for(" disarmed");
}

/// A console that does not put brackets around pasted text.
#[test]
fn bytes_that_arrive_faster_than_typing_start_nothing() {
    let mut rig = Rig::new("mk2");
    rig.arm();
    for text in [NOTE.replace('\n', "\r"), "SSTART\r".to_owned()] {
        rig.terminal.type_bytes(text.as_bytes());
        rig.wait_for_keys();
    }
    assert_eq!(rig.sent(START, 0.0), 0, "a countdown was started by a paste");
}

#[test]
fn ten_kilobytes_of_text_neither_quit_nor_command() {
    for marked in [true, false] {
        let mut rig = Rig::new("mk2");
        rig.terminal.wait_for("every arming check passes");
        if marked {
            rig.terminal.paste(&long_text());
        } else {
            rig.terminal.type_bytes(long_text().replace('\n', "\r").as_bytes());
        }
        rig.wait_for_keys();
        assert!(!rig.terminal.window().is_closed() && rig.proxy.commands().is_empty());
    }
}

/// The program that reads the terminal next must not receive the rest of a paste.
#[test]
fn the_rest_of_a_paste_does_not_reach_the_shell() {
    let folder = tempfile::tempdir().unwrap();
    let station = ground(folder.path(), &["--connect", "udpin:127.0.0.1:0", "--log", "none"]);
    let mut shell = Command::new("sh");
    // The script reads until no byte arrives for a second.
    let script = "\"$0\" \"$@\"; stty -icanon min 0 time 10; dd bs=4096 count=1000 of=rest 2>/dev/null";
    shell.args(["-c", script]).arg(station.get_program()).args(station.get_args());
    shell
        .current_dir(folder.path())
        .envs(station.get_envs().filter_map(|(name, value)| Some((name, value?))));
    let mut terminal = Terminal::start(&shell, SIZE, false);
    terminal.wait_for("[1Pad]");
    let text = long_text().replace('\n', "\r");
    // `setsid` has become the shell, and the station is its child, which is terminated in the
    // middle of a paste.
    let pid = std::fs::read_to_string(format!("/proc/{0}/task/{0}/children", terminal.pid())).unwrap();
    terminal.type_bytes(&text.as_bytes()[..4_000]);
    assert!(Command::new("kill").args(["-s", "TERM", pid.trim()]).status().unwrap().success());
    terminal.type_bytes(&text.as_bytes()[4_000..]);
    terminal.wait_for_end();
    let rest = std::fs::read_to_string(folder.path().join("rest")).unwrap();
    assert!(rest.is_empty(), "the shell received {} bytes: {:.60}...", rest.len(), rest);
}

#[test]
fn a_held_q_does_not_quit_while_armed() {
    let mut rig = Rig::new("mk2");
    rig.arm();
    rig.terminal.hold(b'q', 60);
    assert!(!rig.terminal.window().is_closed(), "the station has quit");
    rig.terminal.type_by_hand(b"\x1b");
    rig.wait_for_keys();
    rig.terminal.signal(Signal::SIGTERM);
    rig.terminal.wait_for_end();
}
