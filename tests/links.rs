//! Every kind of link, and several at once, between the real processes.
#![expect(clippy::unwrap_used, reason = "a test that cannot set itself up has failed")]

use std::path::Path;

use e2e::{BareGround, Program, Running, SerialLine, free_port, program};
use protocol::dialect::{MavMessage, TdPhase};

fn links<'a>(option: &'a str, links: &'a [String]) -> impl Iterator<Item = &'a str> {
    links.iter().flat_map(move |link| [option, link.as_str()])
}

fn vehicle(folder: &Path, to: &[String]) -> Running {
    let mut command = program(Program::OnboardSim);
    Running::start(
        command.args(["fly", "--log", "vehicle.mcap"]).args(links("--mavlink", to)).current_dir(folder),
    )
}

fn ground(folder: &Path, to: &[String]) -> Running {
    let mut command = program(Program::Ground);
    command.args(["--headless", "--auto", "--log", "ground.mcap"]);
    Running::start(command.args(links("--connect", to)).current_dir(folder))
}

/// Flies over these links and expects a landing; returns the ground's lines.
fn land_over(vehicle_links: &[String], ground_links: &[String]) -> String {
    let folder = tempfile::tempdir().unwrap();
    let flight = vehicle(folder.path(), vehicle_links);
    let station = ground(folder.path(), ground_links);
    let (station, flight) = (station.wait(), flight.wait());
    assert_eq!((station.code, flight.code), (Some(0), Some(0)), "{}\n{}", station.output, flight.output);
    station.output
}

#[test]
fn over_tcp_they_land_whoever_connects() {
    let port = free_port();
    let ends = [format!("tcpin:127.0.0.1:{port}"), format!("tcpout:127.0.0.1:{port}")];
    land_over(&ends[..1], &ends[1..]);
    let port = free_port();
    let ends = [format!("tcpin:127.0.0.1:{port}"), format!("tcpout:127.0.0.1:{port}")];
    land_over(&ends[1..], &ends[..1]);
}

#[test]
fn over_ipv6_they_land() {
    let port = free_port();
    land_over(&[format!("udpout:[::1]:{port}")], &[format!("udpin:[::1]:{port}")]);
}

#[test]
fn at_115200_baud_they_land() {
    let line = SerialLine::new(115_200);
    let link = |device: &Path| format!("serial:{}:115200", device.display());
    land_over(&[link(&line.near)], &[link(&line.far)]);
}

#[test]
fn over_udp_tcp_and_a_radio_at_once_everything_is_heard_once() {
    let line = SerialLine::new(57_600);
    let radio = |device: &Path| format!("serial:{}:57600", device.display());
    let (udp, tcp) = (free_port(), free_port());
    let output = land_over(
        &[radio(&line.near), format!("udpout:127.0.0.1:{udp}"), format!("tcpin:127.0.0.1:{tcp}")],
        &[radio(&line.far), format!("udpin:127.0.0.1:{udp}"), format!("tcpout:127.0.0.1:{tcp}")],
    );
    for once in ["ARM acknowledged", "countdown started", "burn-out", "phase IGNITION -> POWERED"] {
        assert_eq!(output.matches(once).count(), 1, "{once} in:\n{output}");
    }
    assert!(output.contains("acknowledged: accepted, over "), "says which link:\n{output}");
}

#[test]
fn of_two_rockets_on_one_link_each_has_its_own_ground() {
    let folder = tempfile::tempdir().unwrap();
    let port = free_port();
    let rocket = |id: &str| {
        let mut command = program(Program::OnboardSim);
        let link = format!("udpout:127.0.0.1:{port}");
        Running::start(command.args(["fly", "--mavlink", &link, "--sysid", id]).current_dir(folder.path()))
    };
    let (first, second) = (rocket("1"), rocket("2"));
    let mut station = program(Program::Ground);
    station
        .args([
            "--connect",
            &format!("udpin:127.0.0.1:{port}"),
            "--headless",
            "--auto",
            "--log",
            "ground.mcap",
        ])
        .args(["--sysid", "254", "--vehicle-sysid", "2"])
        .current_dir(folder.path());
    let station = Running::to_end(&mut station);
    let second = second.wait();
    assert_eq!((station.code, second.code), (Some(0), Some(0)), "{}\n{}", station.output, second.output);
    first.signal(e2e::Signal::SIGTERM);
    let first = first.wait();
    assert!(!first.output.contains("PAD_ARMED"), "the other rocket's commands: {}", first.output);
    // The log shows the one that flew.
    let mut replayed = program(Program::Ground);
    let replayed = Running::to_end(
        replayed
            .args(["--replay", "ground.mcap", "--headless"])
            .args(["--vehicle-sysid", "2"])
            .current_dir(folder.path()),
    );
    assert!(replayed.output.contains("TOUCHDOWN"), "{}", replayed.output);
}

#[test]
fn a_link_that_dies_in_flight_is_named_and_the_other_carries_on() {
    let folder = tempfile::tempdir().unwrap();
    let (udp, tcp) = (free_port(), free_port());
    let relay = Relay::between(free_port(), tcp);
    let to_relay = format!("tcpout:127.0.0.1:{}", relay.port);
    let flight =
        vehicle(folder.path(), &[format!("udpout:127.0.0.1:{udp}"), format!("tcpin:127.0.0.1:{tcp}")]);
    let mut station = ground(folder.path(), &[format!("udpin:127.0.0.1:{udp}"), to_relay]);
    station.wait_for_line("START observed");
    drop(relay);
    station.wait_for_line("one link down");
    let (station, flight) = (station.wait(), flight.wait());
    assert_eq!((station.code, flight.code), (Some(0), Some(0)), "{}\n{}", station.output, flight.output);
    assert!(!station.output.contains("LINK LOST"), "{}", station.output);
}

/// The ground is stopped on the pad and started again: the vehicle answers the new one.
#[test]
fn a_ground_that_restarts_is_answered_again() {
    let folder = tempfile::tempdir().unwrap();
    let port = free_port();
    let mut flight = vehicle(folder.path(), &[format!("udpin:127.0.0.1:{port}")]);
    flight.wait_for_line("PAD_IDLE");
    let watcher = || {
        let mut command = program(Program::Ground);
        command.args(["--headless", "--log", "none", "--connect", &format!("udpout:127.0.0.1:{port}")]);
        Running::start(command.current_dir(folder.path()))
    };
    for _ in 0..2 {
        let mut first = watcher();
        first.wait_for_line("PAD_IDLE");
        first.signal(e2e::Signal::SIGTERM);
        first.wait();
    }
    let station = ground(folder.path(), &[format!("udpout:127.0.0.1:{port}")]).wait();
    assert_eq!(station.code, Some(0), "{}", station.output);
    let flight = flight.wait();
    assert_eq!(flight.code, Some(0), "{}", flight.output);
}

/// The most that a vehicle on its pad may compute while its serial line is out, as a share of its own time: many times
/// what it needs, and a quarter of what a loop that never waits takes where it has a core to itself.
const PROCESSOR_SHARE_MAX: f64 = 0.25;

/// A serial line that is pulled out and put back: the vehicle waits without running hot, and is heard again.
#[test]
fn a_serial_line_is_survived_out_and_in_again() {
    let folder = tempfile::tempdir().unwrap();
    let device = folder.path().join("radio");
    let plug = |line: &SerialLine| {
        let _ = std::fs::remove_file(&device);
        std::os::unix::fs::symlink(&line.near, &device).unwrap();
    };
    let mut watch = BareGround::new();
    let first = SerialLine::new(57_600);
    plug(&first);
    let radio = format!("serial:{}:57600", device.display());
    let flight = vehicle(folder.path(), &[radio, watch.link()]);
    watch.wait_for("every check passed", |_, message| match message {
        Some(MavMessage::TD_FLIGHT_STATUS(status)) => status.checks_failed.is_empty().then_some(()),
        _ => None,
    });
    std::fs::remove_file(&device).unwrap();
    drop(first);
    let (busy_before, out_at_ms) =
        (flight.processor_time(), watch.wait_for_phase(TdPhase::TD_PHASE_PAD_IDLE).time_boot_ms);
    let mut time_ms = out_at_ms;
    while time_ms < out_at_ms + 3_000 {
        time_ms = watch.wait_for_phase(TdPhase::TD_PHASE_PAD_IDLE).time_boot_ms;
    }
    let busy = flight.processor_time().saturating_sub(busy_before);
    let share = busy.as_secs_f64() / (f64::from(time_ms - out_at_ms) * 1e-3);
    assert!(share < PROCESSOR_SHARE_MAX, "{busy:?} from {out_at_ms} to {time_ms} ms");
    let second = SerialLine::new(57_600);
    plug(&second);
    let station = ground(folder.path(), &[format!("serial:{}:57600", second.far.display())]);
    let (station, flight) = (station.wait(), flight.wait());
    assert_eq!((station.code, flight.code), (Some(0), Some(0)), "{}\n{}", station.output, flight.output);
}

/// A TCP relay that can be cut.
struct Relay {
    port: u16,
    _stop: std::sync::mpsc::SyncSender<()>,
}

impl Relay {
    fn between(port: u16, to: u16) -> Self {
        let (stop, stopped) = std::sync::mpsc::sync_channel::<()>(0);
        let listener = std::net::TcpListener::bind(("127.0.0.1", port)).unwrap();
        std::thread::Builder::new()
            .name("relay".to_owned())
            .spawn(move || {
                let (near, _) = listener.accept().unwrap();
                // Nobody is let in a second time.
                drop(listener);
                let far = connect(to);
                let copy = |mut from: std::net::TcpStream, mut to: std::net::TcpStream| {
                    std::thread::Builder::new()
                        .name("relay copy".to_owned())
                        .spawn(move || std::io::copy(&mut from, &mut to))
                        .unwrap();
                };
                copy(near.try_clone().unwrap(), far.try_clone().unwrap());
                copy(far.try_clone().unwrap(), near.try_clone().unwrap());
                // Waits until its owner goes.
                let _ = stopped.recv();
                for end in [near, far] {
                    let _ = end.shutdown(std::net::Shutdown::Both);
                }
            })
            .unwrap();
        Self { port, _stop: stop }
    }
}

/// Connects as soon as the other side listens.
fn connect(to: u16) -> std::net::TcpStream {
    for _ in 0..3_000 {
        if let Ok(stream) = std::net::TcpStream::connect(("127.0.0.1", to)) {
            return stream;
        }
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    panic!("nobody listens on port {to}");
}
