//! Stations are found, listed and stopped, and other programs do not affect them.

use std::path::Path;

use e2e::{ARM, Bound, Ended, Running, Signal, Terminal};

use super::rig::{Pad, ground};

/// A pad whose station runs as a daemon.
struct Station {
    pad: Pad,
    daemon: Running,
}

impl Station {
    fn new() -> Self {
        let pad = Pad::new();
        let daemon = pad.daemon("held.mcap");
        Self { pad, daemon }
    }

    fn run(&self, arguments: &[&str]) -> Ended {
        Running::to_end(&mut ground(self.pad.folder.path(), arguments))
    }

    fn attach(&self, operator: &str) -> Terminal {
        let screen = self.pad.attach(&["--operator", operator], &[]);
        screen.wait_for("every arming check passes");
        screen
    }

    fn arms(&self) -> usize {
        let arm = |request: &&protocol::command::CommandRequest| request.is(ARM) && request.params[0] > 0.5;
        self.pad.proxy.commands().iter().filter(arm).count()
    }
}

/// A newcomer types the keys of the first flight while a real vehicle waits on its pad.
#[test]
fn ground_without_arguments_beside_a_station_is_the_demonstration() {
    let station = Station::new();
    let bare = ground(station.pad.folder.path(), &["--log", "none"]);
    let mut demonstration = Terminal::start(&bare, (140, 45), false);
    demonstration.wait_for("press A, type ARM");
    demonstration.type_until(b"AARM\r", " ARMED ");
    demonstration.type_until(b"SSTART\r", "START  commanded");
    demonstration.wait_for("AERO_DESCENT");
    assert!(station.pad.proxy.commands().is_empty(), "the real vehicle was commanded");
    demonstration.signal(Signal::SIGTERM);
    demonstration.wait_for_end();
}

#[test]
fn stations_are_listed_and_stopped_and_an_armed_one_only_by_force() {
    let station = Station::new();
    let mut screen = station.attach("anna");
    let listed = station.run(&["status"]);
    for words in [
        station.pad.proxy.ground_link().as_str(),
        "vehicle 1/1",
        "PAD_IDLE disarmed",
        "/held.mcap",
        "screen 1, anna",
        ".sock",
    ] {
        assert!(listed.output.contains(words), "no {words} in:\n{}", listed.output);
    }
    let report: serde_json::Value = serde_json::from_str(&station.run(&["status", "--json"]).output).unwrap();
    assert_eq!((&report[0]["phase"], &report[0]["armed"]), (&"PAD_IDLE".into(), &false.into()), "{report}");
    assert_eq!(report[0]["screens"].as_array().map(Vec::len), Some(1), "{report}");
    assert!(Path::new(report[0]["log"].as_str().unwrap()).is_absolute(), "{report}");
    screen.type_until(b"AARM\r", " ARMED ");
    assert!(station.run(&["status"]).output.contains("PAD_ARMED ARMED"));
    let refused = station.run(&["stop"]);
    assert_eq!(refused.code, Some(4));
    assert!(refused.output.contains("armed or in flight; --force"), "{}", refused.output);
    let stopped = station.run(&["stop", "--force"]);
    assert_eq!(stopped.code, Some(0), "{}", stopped.output);
    assert!(stopped.output.contains("held.mcap"), "{}", stopped.output);
    assert!(station.run(&["status"]).output.contains("no ground station of yours runs"));
    screen.wait_for("STATION GONE: this screen shows the past");
    let ended = station.daemon.wait();
    assert!(ended.output.contains("ARM commanded, attempt 1 (screen 1, anna)"), "{}", ended.output);
}

#[test]
fn an_address_in_use_names_the_station_that_holds_it() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["daemon", "--connect", "udpin:127.0.0.1:0", "--log", "held.mcap"];
    let mut daemon = Running::start(&mut ground(folder.path(), &arguments));
    let taken = format!("udpin:0.0.0.0:{}", daemon.bound_port(Bound::Udp));
    // The station is listed once it serves screens; its link is open by then.
    let listed = || Running::to_end(&mut ground(folder.path(), &["status"])).output.contains("udpin:");
    assert!((0..100).any(|_| listed()), "the station is not listed");
    let second = Running::to_end(&mut ground(folder.path(), &["--connect", &taken, "--headless"]));
    assert_eq!(second.code, Some(1));
    for words in ["your ground station pid ", "uses udpin:", "`ground attach`", "`ground stop`"] {
        assert!(second.output.contains(words), "no {words} in:\n{}", second.output);
    }
    let files = std::fs::read_dir(folder.path()).unwrap().count();
    assert_eq!(
        files, 3,
        "there is more than the station's log, its telemetry log and the folder of its socket"
    );
}

#[test]
fn two_operators_who_arm_at_once_arm_once() {
    let station = Station::new();
    let (mut first, mut second) = (station.attach("anna"), station.attach("ben"));
    first.type_by_hand(b"AARM");
    second.type_by_hand(b"AARM");
    for screen in [&mut first, &mut second] {
        screen.type_bytes(b"\r");
    }
    for screen in [&mut first, &mut second] {
        // On a busy machine keys arrive together.
        screen.confirm_if_prompted(" ARMED ");
        screen.wait_for(" ARMED ");
    }
    assert_eq!(station.arms(), 1);
}
