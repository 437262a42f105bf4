//! The log of `fly`: its name, and a flight without a log.
#![expect(clippy::unwrap_used, reason = "a test that cannot be set up fails")]

use std::fs;
use std::io::{BufRead as _, BufReader, Write as _};
use std::net::UdpSocket;
use std::path::Path;
use std::process::{Command, Stdio};

/// The output of `fly` with this log, apart from its error. A key that does not exist ends it
/// before the flight.
fn fly(directory: &Path, log: &str) -> String {
    let program = env!("CARGO_BIN_EXE_onboard-sim");
    let arguments = ["fly", "--log", log, "--key", "missing.key"];
    let output = Command::new(program).current_dir(directory).args(arguments).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(output.stdout.is_empty());
    let stderr = String::from_utf8(output.stderr).unwrap();
    stderr.split_inclusive('\n').filter(|line| !line.starts_with("error: ")).collect()
}

#[test]
fn fly_with_the_log_none_writes_no_file() {
    let directory = tempfile::tempdir().unwrap();
    // A file with the name `none` would collide with a log, and was not written by `fly`.
    fs::write(directory.path().join("none"), "notes").unwrap();
    assert_eq!(fly(directory.path(), "none"), "");
    assert_eq!(fs::read_to_string(directory.path().join("none")).unwrap(), "notes");
    assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 1);
}

/// The same command again after a crash.
#[test]
fn fly_preserves_an_existing_log_and_reports_the_free_name() {
    let directory = tempfile::tempdir().unwrap();
    fs::write(directory.path().join("flight.mcap"), "a flight").unwrap();
    let notes = fly(directory.path(), "flight.mcap");
    assert_eq!(notes, "flight.mcap exists and is kept; flight-2.mcap is written\n");
    assert_eq!(fs::read_to_string(directory.path().join("flight.mcap")).unwrap(), "a flight");
    // Control characters in a name do not reach the terminal.
    fs::write(directory.path().join("\u{1b}[2J.mcap"), "a flight").unwrap();
    let notes = fly(directory.path(), "\u{1b}[2J.mcap");
    assert_eq!(notes, "\u{fffd}[2J.mcap exists and is kept; \u{fffd}[2J-2.mcap is written\n");
}

/// Help for the person who types is not part of the object, nor is the reason why the pad is not
/// simulated faster.
#[test]
fn a_line_that_is_not_understood_is_answered_beside_the_object() {
    let mut fly = Command::new(env!("CARGO_BIN_EXE_onboard-sim"));
    let station = UdpSocket::bind("127.0.0.1:0").unwrap();
    let link = format!("udpout:{}", station.local_addr().unwrap());
    fly.args(["fly", "--json", "--speed", "max", "--mavlink", &link]);
    fly.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut flying = fly.spawn().unwrap();
    writeln!(flying.stdin.as_mut().unwrap(), "pull the pin").unwrap();
    let mut lines = BufReader::new(flying.stderr.take().unwrap()).lines();
    for start in ["onboard-sim: on the pad a vehicle with a crew runs at real time, because", "type `pin in`"]
    {
        assert!(lines.any(|line| line.unwrap().starts_with(start)), "{start}");
    }
    // It is running, and receives a signal.
    (0..20).for_each(|_| _ = station.recv(&mut [0; 300]).unwrap());
    let pid = rustix::process::Pid::from_child(&flying);
    rustix::process::kill_process(pid, rustix::process::Signal::TERM).unwrap();
    let ended = flying.wait_with_output().unwrap();
    let result: serde_json::Value = serde_json::from_slice(&ended.stdout).unwrap();
    assert_eq!(result["exit_code"], 5, "{result}");
}

/// A program reads one object: how the flight ended, and the path of its log.
#[test]
fn the_end_of_a_flight_is_one_object() {
    let directory = tempfile::tempdir().unwrap();
    let mut fly = Command::new(env!("CARGO_BIN_EXE_onboard-sim"));
    fly.current_dir(directory.path())
        .args(["fly", "--json", "--start", "apogee", "--speed", "max", "--log", "f.mcap"]);
    let result: serde_json::Value = serde_json::from_slice(&fly.output().unwrap().stdout).unwrap();
    assert_eq!((&result["exit_code"], &result["log"]), (&0.into(), &"f.mcap".into()), "{result}");
    let verdict = &result["verdict"];
    assert!(verdict["landing"]["stands"] == true && verdict["envelope"][0]["passed"] == true, "{result}");
}
