//! Pastes, held keys and hurried bytes on a real terminal: nothing but a hand arms, starts or quits.

use std::process::Command;

use e2e::{Signal, Terminal};

use crate::stage::{SIZE, START, Stage, ground};

/// What somebody meant for another window.
const NOTE: &str = "Send the crew away\nThanks\n";

/// Some ten thousand letters with every key of the station among them, but for the abort's.
fn long_text() -> String {
    "A quick brown fox: ARM\nSTART\nquit\nQUIT\nDisarm\n Start it, quickly.\n".repeat(150)
}

impl Stage {
    /// Whatever was typed before has been taken by now: a key behind it shows.
    fn wait_for_keys(&mut self) {
        self.type_until(b"5", "[5Link]");
        self.type_until(b"1", "[1Pad]");
    }
}

#[test]
fn what_is_pasted_into_an_armed_station_starts_nothing() {
    let mut stage = Stage::set("paper-calibrated");
    stage.arm();
    stage.terminal.paste(NOTE);
    stage.terminal.wait_for("a paste was dropped");
    stage.wait_for_keys();
    assert_eq!(stage.sent(START, 0.0), 0, "a countdown was started by a paste");
}

/// A console without marks around what is pasted.
#[test]
fn what_arrives_faster_than_a_hand_types_starts_nothing() {
    let mut stage = Stage::set("paper-calibrated");
    stage.arm();
    for text in [NOTE.replace('\n', "\r"), "SSTART\r".to_owned()] {
        stage.terminal.type_bytes(text.as_bytes());
        stage.wait_for_keys();
    }
    assert_eq!(stage.sent(START, 0.0), 0, "a countdown was started by a paste");
}

#[test]
fn ten_kilobytes_of_text_neither_quit_nor_reach_the_shell() {
    for marked in [true, false] {
        let mut stage = Stage::set("paper-calibrated");
        stage.terminal.wait_for("GO: every arming check passes");
        if marked {
            stage.terminal.paste(&long_text());
        } else {
            stage.terminal.type_bytes(long_text().replace('\n', "\r").as_bytes());
        }
        stage.wait_for_keys();
        assert!(!stage.terminal.look().is_closed() && stage.air.commands().is_empty());
    }
}

/// Whoever reads the terminal after the program must not find the rest of a paste.
#[test]
fn the_rest_of_a_paste_does_not_reach_the_shell() {
    let folder = tempfile::tempdir().unwrap();
    let station = ground(folder.path(), &["--connect", "udpin:127.0.0.1:0", "--log", "none"]);
    let mut shell = Command::new("sh");
    // A read that waits a second for one more byte, as often as there is one.
    let script = "\"$0\" \"$@\"; stty -icanon min 0 time 10; dd bs=4096 count=1000 of=rest 2>/dev/null";
    shell.args(["-c", script]).arg(station.get_program()).args(station.get_args());
    shell
        .current_dir(folder.path())
        .envs(station.get_envs().filter_map(|(name, value)| Some((name, value?))));
    let mut terminal = Terminal::start(&shell, SIZE, false);
    terminal.wait_for("[1Pad]");
    let text = long_text().replace('\n', "\r");
    // `setsid` has become the shell; the station is told to end by its own terminal, in the midst of a paste.
    let pid = std::fs::read_to_string(format!("/proc/{0}/task/{0}/children", terminal.pid())).unwrap();
    terminal.type_bytes(&text.as_bytes()[..4_000]);
    assert!(Command::new("kill").args(["-s", "TERM", pid.trim()]).status().unwrap().success());
    terminal.type_bytes(&text.as_bytes()[4_000..]);
    terminal.wait_for_end();
    let rest = std::fs::read_to_string(folder.path().join("rest")).unwrap();
    assert!(rest.is_empty(), "the shell was typed {} bytes: {:.60}...", rest.len(), rest);
}

#[test]
fn a_held_q_does_not_quit_while_armed() {
    let mut stage = Stage::set("paper-calibrated");
    stage.arm();
    stage.terminal.hold(b'q', 60);
    assert!(!stage.terminal.look().is_closed(), "it has quit");
    stage.terminal.type_by_hand(b"\x1b");
    stage.wait_for_keys();
    stage.terminal.signal(Signal::SIGTERM);
    stage.terminal.wait_for_end();
}
