//! The program: exit codes, printed lines and log.

use std::path::Path;
use std::process::{Command, Output};

use protocol::log::reader::{LogItem, LogReader};

fn ground(directory: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_ground"))
        .args(arguments)
        .current_dir(directory)
        .env("XDG_RUNTIME_DIR", directory)
        .env("XDG_CONFIG_HOME", directory)
        .output()
        .expect("the program can be started")
}

fn out(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn err(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn what_cannot_be_run_has_its_code_and_is_named() {
    let directory = tempfile::tempdir().unwrap();
    let output = ground(directory.path(), &["--help"]);
    assert!(output.status.code() == Some(0) && out(&output).contains(protocol::program::EXIT_CODES));
    for (arguments, code, named) in [
        (&["--connect", "tcp:host:1"][..], 2, "udpin:ADDRESS:PORT"),
        (&["--mission", "no-such"], 1, "no-such"),
        (&["attach", "--connect", "udpin:127.0.0.1:0"], 2, "--connect"),
        (&["attach", "--auto"], 2, "--auto"),
        (&["status", "--log", "none"], 2, "--log"),
    ] {
        let output = ground(directory.path(), arguments);
        assert_eq!(output.status.code(), Some(code), "{}", err(&output));
        assert!(err(&output).contains(named), "{}", err(&output));
    }
}

/// A start that fails must not leave a log behind.
#[test]
fn a_start_that_fails_leaves_no_files() {
    let directory = tempfile::tempdir().unwrap();
    let other = std::net::UdpSocket::bind("127.0.0.1:0").unwrap();
    let link = format!("udpin:{}", other.local_addr().unwrap());
    for arguments in [
        &["--connect", &link][..],
        &["daemon", "--connect", &link],
        &["--connect", &link, "--log", "a.mcap"],
        &["--connect", "udpin:127.0.0.1:0", "--key", "no-such-key"],
    ] {
        let output = ground(directory.path(), arguments);
        assert_eq!(output.status.code(), Some(1), "{}", err(&output));
        let left: Vec<_> =
            std::fs::read_dir(directory.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
        assert!(left.is_empty(), "{arguments:?} left {left:?}");
    }
    let output = ground(directory.path(), &["--connect", &link]);
    assert!(err(&output).contains("none of your ground stations does"), "{}", err(&output));
}

#[test]
fn a_silent_link_is_code_5() {
    let directory = tempfile::tempdir().unwrap();
    let arguments = ["--connect", "udpin:127.0.0.1:0", "--timeout-s", "0.3", "--log", "none"];
    let output = ground(directory.path(), &arguments);
    assert_eq!(output.status.code(), Some(5), "{}", out(&output));
    let entries = std::fs::read_dir(directory.path()).unwrap();
    let names: Vec<_> = entries.map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(names, ["touchdown"], "no log was wanted; there its socket was");
}

/// The demonstration, through real sockets, faster than real time.
#[test]
fn a_landing_ends_with_code_0_and_names_its_log() {
    let directory = tempfile::tempdir().unwrap();
    let output = ground(directory.path(), &["--speed", "4", "--start", "apogee"]);
    let text = out(&output);
    assert_eq!(output.status.code(), Some(0), "{text}{}", err(&output));
    for words in ["phase PAD_ARMED -> ", "countdown started", "ground contact", "STANDS UNDAMAGED"] {
        assert!(text.contains(words), "{words} is missing in\n{text}");
    }
    assert!(text.lines().count() <= 40, "it is read by somebody who wants to see what flies:\n{text}");
    let log = text.lines().find_map(|line| line.strip_prefix("log: ")).unwrap();
    let mut reader = LogReader::new(std::fs::File::open(directory.path().join(log)).unwrap());
    let (mut vehicle_ns, mut apart_ns, mut from_ground) = (0_u64, 0, 0);
    while let Some(item) = reader.next_item().unwrap() {
        let LogItem::Message { channel_id, log_time_ns, .. } = item else { continue };
        let channel = reader.channel(channel_id).unwrap();
        match channel.metadata.get("endpoint").map(String::as_str) {
            Some("vehicle") => vehicle_ns = log_time_ns,
            Some("ground") if vehicle_ns > 0 => {
                from_ground += 1;
                apart_ns = apart_ns.max(log_time_ns.abs_diff(vehicle_ns));
            }
            _ => {}
        }
    }
    // At four times the speed, two separate clocks would differ by seconds before the landing.
    assert!(from_ground > 10 && apart_ns < 1_500_000_000, "{from_ground} records, {apart_ns} ns apart");
    assert_eq!(reader.damage(), None);
    let both_sides = |topic: &str| {
        let mut ends: Vec<_> = reader
            .channels()
            .filter(|(_, channel)| channel.topic == topic)
            .filter_map(|(_, channel)| channel.metadata.get("endpoint").cloned())
            .collect();
        ends.sort();
        ends == ["ground", "vehicle"]
    };
    assert!(both_sides("/mavlink/rx/raw") && both_sides("/mavlink/tx/raw"));
    for topic in ["/telemetry", "/operator", "/events", "/computer/frame", "/verdict"] {
        assert!(reader.channels().any(|(_, channel)| channel.topic == topic), "{topic} is missing");
    }
    let output = ground(directory.path(), &["--replay", log]);
    assert_eq!(output.status.code(), Some(0), "{}", err(&output));
    let replayed = out(&output);
    for words in [
        "ARM commanded",
        "ARM acknowledged: accepted",
        "ARM observed",
        "START observed",
        "phase PAD_ARMED -> ",
        "STANDS UNDAMAGED",
    ] {
        assert!(replayed.contains(words), "{words} is missing in\n{replayed}");
    }
    let output = ground(directory.path(), &["--replay", log, "--from", "CHUTE"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(
        err(&output).contains("has no phase CHUTE; it has SAFE, PAD_IDLE, PAD_ARMED"),
        "{}",
        err(&output)
    );
}

#[test]
fn settings_are_checked_and_a_wrong_key_is_named() {
    let directory = tempfile::tempdir().unwrap();
    let example = ground(directory.path(), &["config", "example"]);
    assert!(out(&example).contains("#alarm_command"));
    let check = |text: &str| {
        std::fs::write(directory.path().join("ground.toml"), text).unwrap();
        ground(directory.path(), &["config", "check", "ground.toml"])
    };
    let right = check("connect = [\"udpin:0.0.0.0:14550\"]\nbell = false\n");
    assert_eq!(right.status.code(), Some(0));
    assert!(out(&right).contains("valid"));
    let wrong = check("bel = false\n");
    assert_eq!(wrong.status.code(), Some(1));
    assert!(err(&wrong).contains("ground.toml") && err(&wrong).contains("bel"), "{}", err(&wrong));
}

#[test]
fn completions_and_the_manual_name_the_commands() {
    let directory = tempfile::tempdir().unwrap();
    for shell in ["bash", "zsh", "fish"] {
        let script = ground(directory.path(), &["completions", shell]);
        assert_eq!(script.status.code(), Some(0));
        assert!(out(&script).contains("replay") && out(&script).contains("daemon"), "{shell}");
    }
    let manual = ground(directory.path(), &["man"]);
    assert!(out(&manual).starts_with(".ie") || out(&manual).contains(".TH ground"));
    assert!(out(&manual).contains("Exit codes"));
    let of_a_command = ground(directory.path(), &["man", "config", "check"]);
    assert!(
        out(&of_a_command).contains("ground\\-config\\-check")
            || out(&of_a_command).contains(".TH ground-config-check")
    );
    assert_eq!(ground(directory.path(), &["man", "land"]).status.code(), Some(2));
}

/// The log and the telemetry log of a demonstration contain the same flight.
/// A program reads one object: how the flight ended, and where its log is.
#[test]
fn the_end_of_a_run_is_one_object() {
    let directory = tempfile::tempdir().unwrap();
    let output =
        ground(directory.path(), &["--json", "--start", "apogee", "--speed", "4", "--log", "f.mcap"]);
    let report: serde_json::Value = serde_json::from_str(&out(&output)).unwrap();
    assert_eq!((&report["exit_code"], &report["stands"]), (&0.into(), &true.into()), "{report}");
    assert_eq!(report["log"], "f.mcap", "{report}");
}
