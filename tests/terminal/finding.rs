//! Stations are found, named and ended; and what is not a station's never touches one.

use e2e::{Air, Bound, Ended, Program, Running, Signal, Terminal, program};

use crate::stage::{ARM, SIZE, ground};

/// A vehicle, and a station that holds its link without a screen.
struct Held {
    folder: tempfile::TempDir,
    air: Air,
    link: String,
    daemon: Running,
    _vehicle: Running,
}

impl Held {
    fn new() -> Self {
        let air = Air::new();
        let mut vehicle = program(Program::OnboardSim);
        vehicle.args(["fly", "--stay", "--mavlink", &air.vehicle_link()]);
        let vehicle = Running::start(&mut vehicle);
        let (folder, link) = (tempfile::tempdir().unwrap(), air.ground_link());
        let arguments = ["daemon", "--connect", &link, "--log", "held.mcap"];
        let mut daemon = Running::start(&mut ground(folder.path(), &arguments));
        daemon.wait_for_line("PAD_IDLE");
        Self { folder, air, link, daemon, _vehicle: vehicle }
    }

    fn run(&self, arguments: &[&str]) -> Ended {
        Running::to_end(&mut ground(self.folder.path(), arguments))
    }

    fn attach(&self, operator: &str) -> Terminal {
        let attach = ground(self.folder.path(), &["attach", "--operator", operator]);
        let screen = Terminal::start(&attach, SIZE, false);
        screen.wait_for("GO: every arming check passes");
        screen
    }

    fn arms(&self) -> usize {
        let arm = |request: &&protocol::command::CommandRequest| request.is(ARM) && request.params[0] > 0.5;
        self.air.commands().iter().filter(arm).count()
    }
}

/// The keys of the newcomer's first flight, while a real vehicle waits on its pad.
#[test]
fn a_bare_ground_beside_a_station_is_the_demonstration_and_says_that_the_station_runs() {
    let held = Held::new();
    let bare = ground(held.folder.path(), &["--log", "none"]);
    let mut demonstration = Terminal::start(&bare, (140, 45), false);
    demonstration.wait_for("a station runs: pid ");
    demonstration.wait_for("`ground attach` shows it");
    demonstration.wait_for("GO: every arming check passes");
    demonstration.type_until(b"AARM\r", " ARMED ");
    demonstration.type_until(b"SSTART\r", "START  commanded");
    demonstration.wait_for("AERO_DESCENT");
    assert!(held.air.commands().is_empty(), "the real vehicle was commanded");
    demonstration.signal(Signal::SIGTERM);
    demonstration.wait_for_end();
}

#[test]
fn stations_are_listed_and_ended_and_an_armed_one_only_by_force() {
    let held = Held::new();
    let mut screen = held.attach("anna");
    let listed = held.run(&["status"]);
    for words in
        [held.link.as_str(), "vehicle 1/1", "PAD_IDLE disarmed", "log held.mcap", "screen 1, anna", ".sock"]
    {
        assert!(listed.output.contains(words), "no {words} in:\n{}", listed.output);
    }
    screen.type_until(b"AARM\r", " ARMED ");
    assert!(held.run(&["status"]).output.contains("PAD_ARMED ARMED"));
    let refused = held.run(&["stop"]);
    assert_eq!(refused.code, Some(1));
    assert!(refused.output.contains("armed or in flight; --force"), "{}", refused.output);
    let stopped = held.run(&["stop", "--force", "--operator", "ben"]);
    assert_eq!(stopped.code, Some(0), "{}", stopped.output);
    assert!(stopped.output.contains("held.mcap"), "{}", stopped.output);
    assert!(held.run(&["status"]).output.contains("no ground station of yours runs"));
    screen.wait_for("LINK DOWN: the ground station of this screen is gone");
    let ended = held.daemon.wait();
    assert!(ended.output.contains("ARM commanded, attempt 1 (screen 1, anna)"), "{}", ended.output);
}

#[test]
fn an_address_in_use_names_the_station_that_holds_it() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["daemon", "--connect", "udpin:127.0.0.1:0", "--log", "held.mcap"];
    let mut daemon = Running::start(&mut ground(folder.path(), &arguments));
    let taken = format!("udpin:0.0.0.0:{}", daemon.bound_port(Bound::Udp));
    // Found once it serves screens; its link is open then.
    let listed = || Running::to_end(&mut ground(folder.path(), &["status"])).output.contains("udpin:");
    assert!((0..100).any(|_| listed()), "the station is never found");
    let second = Running::to_end(&mut ground(folder.path(), &["--connect", &taken, "--headless"]));
    assert_eq!(second.code, Some(1));
    for words in ["your ground station pid ", "holds udpin:", "`ground attach`", "`ground stop`", "in use"] {
        assert!(second.output.contains(words), "no {words} in:\n{}", second.output);
    }
    let files = std::fs::read_dir(folder.path()).unwrap().count();
    assert_eq!(files, 3, "the station's log, its telemetry log and the folder of its socket");
}

#[test]
fn two_hands_that_arm_at_once_arm_once() {
    let held = Held::new();
    let (mut first, mut second) = (held.attach("anna"), held.attach("ben"));
    first.type_by_hand(b"AARM");
    second.type_by_hand(b"AARM");
    for screen in [&mut first, &mut second] {
        screen.type_bytes(b"\r");
    }
    for screen in [&first, &second] {
        screen.wait_for(" ARMED ");
    }
    assert_eq!(held.arms(), 1);
}
