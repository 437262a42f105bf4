//! Every kind of link, and several at once, between the real processes.
#![expect(clippy::unwrap_used, reason = "a test that cannot set itself up has failed")]

use std::path::Path;

use e2e::{BareGround, Bound, Program, Running, SerialLine, program};
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

/// Waits for the end and expects a landing; returns the ground's lines.
fn landed(flight: Running, station: Running) -> String {
    let (station, flight) = (station.wait(), flight.wait());
    assert_eq!((station.code, flight.code), (Some(0), Some(0)), "{}\n{}", station.output, flight.output);
    station.output
}

#[test]
fn over_tcp_they_land_whoever_connects() {
    let listen = ["tcpin:127.0.0.1:0".to_owned()];
    let connect = |to: &mut Running| [format!("tcpout:127.0.0.1:{}", to.bound_port(Bound::Tcp))];
    let [first, second] = [(); 2].map(|()| tempfile::tempdir().unwrap());
    let mut listening_flight = vehicle(first.path(), &listen);
    let station = ground(first.path(), &connect(&mut listening_flight));
    let mut listening_station = ground(second.path(), &listen);
    let flight = vehicle(second.path(), &connect(&mut listening_station));
    landed(listening_flight, station);
    landed(flight, listening_station);
}

#[test]
fn over_ipv6_they_land() {
    let folder = tempfile::tempdir().unwrap();
    let mut station = ground(folder.path(), &["udpin:[::1]:0".to_owned()]);
    let link = format!("udpout:[::1]:{}", station.bound_port(Bound::Udp));
    landed(vehicle(folder.path(), &[link]), station);
}

#[test]
fn at_115200_baud_they_land() {
    let line = SerialLine::new(115_200);
    let link = |device: &Path| format!("serial:{}:115200", device.display());
    let folder = tempfile::tempdir().unwrap();
    let flight = vehicle(folder.path(), &[link(&line.near)]);
    landed(flight, ground(folder.path(), &[link(&line.far)]));
}

#[test]
fn over_udp_tcp_and_a_radio_at_once_everything_is_heard_once() {
    let line = SerialLine::new(57_600);
    let radio = |device: &Path| format!("serial:{}:57600", device.display());
    let folder = tempfile::tempdir().unwrap();
    let listens = ["udpin:127.0.0.1:0", "tcpin:127.0.0.1:0"].map(str::to_owned);
    let mut flight = vehicle(folder.path(), &[&[radio(&line.near)], &listens[..]].concat());
    let (udp, tcp) = (flight.bound_port(Bound::Udp), flight.bound_port(Bound::Tcp));
    let calls = [format!("udpout:127.0.0.1:{udp}"), format!("tcpout:127.0.0.1:{tcp}")];
    let station = ground(folder.path(), &[&[radio(&line.far)], &calls[..]].concat());
    let output = landed(flight, station);
    for once in ["ARM acknowledged", "countdown started", "burn-out", "phase IGNITION -> POWERED"] {
        assert_eq!(output.matches(once).count(), 1, "{once} in:\n{output}");
    }
    assert!(output.contains("acknowledged: accepted, over "), "says which link:\n{output}");
}

#[test]
fn of_two_rockets_on_one_link_each_has_its_own_ground() {
    let folder = tempfile::tempdir().unwrap();
    let mut station = program(Program::Ground);
    station
        .args(["--connect", "udpin:127.0.0.1:0", "--headless", "--auto", "--log", "ground.mcap"])
        .args(["--sysid", "254", "--vehicle-sysid", "2"])
        .current_dir(folder.path());
    let mut station = Running::start(&mut station);
    let link = format!("udpout:127.0.0.1:{}", station.bound_port(Bound::Udp));
    let rocket = |id: &str| {
        let mut command = program(Program::OnboardSim);
        Running::start(command.args(["fly", "--mavlink", &link, "--sysid", id]).current_dir(folder.path()))
    };
    let (first, second) = (rocket("1"), rocket("2"));
    let (station, second) = (station.wait(), second.wait());
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
    let mut flight = vehicle(folder.path(), &["udpin:127.0.0.1:0", "tcpin:127.0.0.1:0"].map(str::to_owned));
    let relay = Relay::to(flight.bound_port(Bound::Tcp));
    let calls = [
        format!("udpout:127.0.0.1:{}", flight.bound_port(Bound::Udp)),
        format!("tcpout:127.0.0.1:{}", relay.port),
    ];
    let mut station = ground(folder.path(), &calls);
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
    let mut flight = vehicle(folder.path(), &["udpin:127.0.0.1:0".to_owned()]);
    let port = flight.bound_port(Bound::Udp);
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
    fn to(to: u16) -> Self {
        let (stop, stopped) = std::sync::mpsc::sync_channel::<()>(0);
        let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        let port = listener.local_addr().unwrap().port();
        std::thread::Builder::new()
            .name("relay".to_owned())
            .spawn(move || {
                let (near, _) = listener.accept().unwrap();
                // Nobody is let in a second time.
                drop(listener);
                let far = std::net::TcpStream::connect(("127.0.0.1", to)).unwrap();
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
