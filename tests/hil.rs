//! Hardware in the loop between two processes, over every kind of link and over links that fail. Each flight is compared
//! frame by frame with the same one in the world's process.

use std::time::Duration;

use e2e::{
    Bound, Ended, Impairment, Program, Running, SerialLine, Signal, UdpProxy, program, wait_for_content,
};

fn computer(link: &str) -> Running {
    Running::start(program(Program::OnboardSim).args(["computer", "--link", link]))
}

fn world(link: &str, arguments: &[&str]) -> Running {
    let mut command = program(Program::OnboardSim);
    Running::start(command.args(["world", "--seed", "2002", "--link", link]).args(arguments))
}

fn expect_identical(ended: &Ended, flights: u64) {
    assert_eq!(ended.code, Some(0), "{}", ended.output);
    let words = format!("and {flights} of {flights} flights identical");
    assert!(ended.output.contains(&words), "{}", ended.output);
}

#[test]
fn over_udp_tcp_and_a_serial_line_a_flight_is_the_one_in_one_process() {
    let line = SerialLine::new(4_000_000);
    let mut udp = computer("udpin:127.0.0.1:0");
    let mut tcp = computer("tcpin:127.0.0.1:0");
    let serial = computer(&line.near_link());
    let links = [
        format!("udpout:127.0.0.1:{}", udp.bound_port(Bound::Udp)),
        format!("tcpout:127.0.0.1:{}", tcp.bound_port(Bound::Tcp)),
        line.far_link(),
    ];
    for (link, flights) in links.iter().zip([2, 2, 1]) {
        let flown = world(link, &["--compare", "--flights", &flights.to_string()]).wait();
        expect_identical(&flown, flights);
    }
    drop(serial);
}

#[test]
fn a_world_that_listens_finds_its_computer_by_its_heartbeat() {
    let mut world = world("udpin:127.0.0.1:0", &["--compare"]);
    let _computer = computer(&format!("udpout:127.0.0.1:{}", world.bound_port(Bound::Udp)));
    expect_identical(&world.wait(), 1);
}

#[test]
fn lost_doubled_and_overtaken_datagrams_change_nothing_in_lockstep() {
    let proxy = UdpProxy::new();
    proxy.impair(Impairment {
        lost_per_1000: 3,
        duplicated_per_1000: 100,
        delay_max: Duration::from_millis(1),
        ..Impairment::default()
    });
    let _computer = computer(&proxy.vehicle_link());
    let flown = world(&proxy.ground_link(), &["--compare"]).wait();
    expect_identical(&flown, 1);
    assert!(!flown.output.contains("sent again 0,"), "{}", flown.output);
}

#[test]
fn a_link_that_is_unplugged_for_a_while_changes_nothing_in_lockstep() {
    let proxy = UdpProxy::new();
    proxy.impair(Impairment { delay_max: Duration::from_millis(1), ..Impairment::default() });
    let mut computer = computer(&proxy.vehicle_link());
    let world = world(&proxy.ground_link(), &["--compare"]);
    computer.wait_for_line("begins in lockstep");
    proxy.impair(Impairment { drops_all: true, ..Impairment::default() });
    // The frame that was lost is sent again, and lost again.
    for _ in 0..3 {
        proxy.wait_for_ground();
    }
    proxy.impair(Impairment::default());
    let flown = world.wait();
    expect_identical(&flown, 1);
    assert!(!flown.output.contains("sent again 0,"), "{}", flown.output);
}

#[test]
fn a_serial_line_that_was_unplugged_is_opened_again_and_changes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let [near, far] = ["near", "far"].map(|name| folder.path().join(name));
    let plug = |line: &SerialLine| {
        for (device, end) in [(&near, &line.near), (&far, &line.far)] {
            let _ = std::fs::remove_file(device);
            std::os::unix::fs::symlink(end, device).unwrap();
        }
    };
    let link = |device: &std::path::Path| format!("serial:{}:4000000", device.display());
    let first = SerialLine::new(4_000_000);
    plug(&first);
    let mut computer = computer(&link(&far));
    let world = world(&link(&near), &["--compare", "--give-up", "60"]);
    computer.wait_for_line("begins in lockstep");
    // Both ends hang up.
    drop(first);
    computer.wait_for_line("link down");
    let second = SerialLine::new(4_000_000);
    plug(&second);
    expect_identical(&world.wait(), 1);
}

#[test]
fn a_computer_that_is_killed_in_flight_ends_the_flight_with_its_exit_code() {
    let mut computer = computer("udpin:127.0.0.1:0");
    let link = format!("udpout:127.0.0.1:{}", computer.bound_port(Bound::Udp));
    let world = world(&link, &["--flights", "1000", "--give-up", "2"]);
    computer.wait_for_line("frames flown");
    computer.signal(Signal::SIGKILL);
    let ended = world.wait();
    assert_eq!(ended.code, Some(5), "{}", ended.output);
    assert!(ended.output.contains("LINK LOST: "), "{}", ended.output);
}

/// A watchdog's reset: the process is killed in flight and started again with what it had saved.
#[test]
fn a_computer_that_is_killed_in_flight_and_started_again_flies_on_from_what_it_saved() {
    let folder = tempfile::tempdir().unwrap();
    let start = |link: &str| {
        let mut command = program(Program::OnboardSim);
        command.args(["computer", "--link", link, "--saved", "saved"]).current_dir(folder.path());
        Running::start(&mut command)
    };
    let mut computer = start("udpin:127.0.0.1:0");
    let port = computer.bound_port(Bound::Udp);
    let world = world(&format!("udpout:127.0.0.1:{port}"), &["--flights", "1", "--give-up", "60"]);
    computer.wait_for_line("begins in lockstep");
    // Both slots were written: frame 2 is flown.
    for slot in ["saved-0", "saved-1"] {
        wait_for_content(&folder.path().join(slot));
    }
    computer.signal(Signal::SIGKILL);
    computer.wait();
    let mut again = start(&format!("udpin:127.0.0.1:{port}"));
    again.wait_for_line("goes on behind frame");
    let ended = world.wait();
    assert_eq!(ended.code, Some(0), "{}", ended.output);
}

#[test]
fn a_computer_with_another_mission_is_told_and_not_flown() {
    let mut computer = Running::start(program(Program::OnboardSim).args([
        "computer",
        "--profile",
        "vlr",
        "--link",
        "udpin:127.0.0.1:0",
    ]));
    let link = format!("udpout:127.0.0.1:{}", computer.bound_port(Bound::Udp));
    let ended = world(&link, &["--give-up", "1"]).wait();
    assert_eq!(ended.code, Some(5), "{}", ended.output);
    assert!(ended.output.contains("it must fly the mission"), "{}", ended.output);
    computer.wait_for_line("not answered: the world flies the mission");
}

#[test]
fn in_real_time_a_flight_lands_and_its_jitter_is_reported() {
    let mut computer = computer("udpin:127.0.0.1:0");
    let link = format!("udpout:127.0.0.1:{}", computer.bound_port(Bound::Udp));
    let ended = world(&link, &["--real-time"]).wait();
    assert_eq!(ended.code, Some(0), "{}", ended.output);
    for words in ["frames began late by: median", "answers came after: median", "LANDED"] {
        assert!(ended.output.contains(words), "{words} in:\n{}", ended.output);
    }
}
