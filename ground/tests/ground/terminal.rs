//! The program on a terminal that disappears: link and log continue, and a screen can attach again.
//!
//! `script` (util-linux) provides the terminal; without it the test reports that and checks
//! nothing.

use std::io::Write as _;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

/// Runs a command line on its own terminal.
fn on_a_terminal(directory: &Path, command_line: &str) -> Option<Child> {
    Command::new("script")
        .args(["--quiet", "--flush", "--command", command_line, "terminal.txt"])
        .current_dir(directory)
        .env("TERM", "xterm")
        .env("LANG", "C.UTF-8")
        .env("XDG_RUNTIME_DIR", directory)
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .ok()
}

/// Waits until a file contains these words, long enough for a slow machine.
fn wait_for(path: &Path, what: &str) -> bool {
    (0..600).any(|_| {
        std::thread::park_timeout(Duration::from_millis(50));
        std::fs::read(path).is_ok_and(|bytes| String::from_utf8_lossy(&bytes).contains(what))
    })
}

fn signal(name: &str, process: &str) -> bool {
    // The built-in of the shell, because not every machine has a `kill` program.
    let sent = Command::new("sh").args(["-c", &format!("kill -s {name} {process}")]).status();
    sent.is_ok_and(|status| status.success())
}

#[test]
fn a_station_survives_the_loss_of_its_terminal() {
    let directory = tempfile::tempdir().unwrap();
    let program = env!("CARGO_BIN_EXE_ground");
    let arguments = "--connect udpin:127.0.0.1:0 --log kept.mcap";
    let line = format!("sh -c 'stty rows 24 cols 80; echo $$ > pid; exec {program} {arguments}'");
    let Some(mut terminal) = on_a_terminal(directory.path(), &line) else {
        return writeln!(
            std::io::stderr(),
            "NOT RUN: there is no `script` here (Debian: apt-get install bsdutils)"
        )
        .unwrap();
    };
    assert!(wait_for(&directory.path().join("terminal.txt"), "steps"));
    let process = std::fs::read_to_string(directory.path().join("pid")).unwrap().trim().to_owned();
    // The session is dropped, and its terminal disappears.
    terminal.kill().unwrap();
    terminal.wait().unwrap();
    let socket = directory.path().join(format!("touchdown/{process}.sock"));
    assert!(socket.exists(), "it serves screens");
    let mut attached =
        on_a_terminal(directory.path(), &format!("sh -c 'stty rows 24 cols 80; exec {program} attach'"))
            .unwrap();
    assert!(wait_for(&directory.path().join("terminal.txt"), "steps"));
    attached.stdin.take().unwrap().write_all(b"q").unwrap();
    assert!(attached.wait().unwrap().success());
    assert!(signal("TERM", &process), "it still runs");
    let tlog = directory.path().join("kept.tlog");
    assert!(tlog.exists());
    let ended = (0..200).any(|_| {
        std::thread::park_timeout(Duration::from_millis(50));
        !signal("0", &process)
    });
    assert!(ended && !socket.exists());
}
