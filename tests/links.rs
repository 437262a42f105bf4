//! Flights over every kind of link and over several at once, between the real processes.
#![expect(clippy::unwrap_used, reason = "a test that cannot set itself up has failed")]

use std::net::SocketAddr;

use e2e::{
    BareGround, Bound, Program, Running, SerialLine, Signal, auto_ground, expect_landing, keygen, program,
    unshared_address, vehicle,
};
use protocol::dialect::TdPhase;

#[test]
fn over_tcp_they_land_whichever_side_connects() {
    let listen = "tcpin:127.0.0.1:0";
    let connect_to = |listener: &mut Running| format!("tcpout:127.0.0.1:{}", listener.bound_port(Bound::Tcp));
    let [first, second] = [(); 2].map(|()| tempfile::tempdir().unwrap());
    let mut listening_vehicle = Running::start(&mut vehicle(first.path(), &[listen]));
    let ground = Running::start(&mut auto_ground(first.path(), &[&connect_to(&mut listening_vehicle)]));
    let mut listening_ground = Running::start(&mut auto_ground(second.path(), &[listen]));
    let vehicle = Running::start(&mut vehicle(second.path(), &[&connect_to(&mut listening_ground)]));
    expect_landing(listening_vehicle, ground);
    expect_landing(vehicle, listening_ground);
}

#[test]
fn over_ipv6_they_land() {
    let folder = tempfile::tempdir().unwrap();
    let mut ground = Running::start(&mut auto_ground(folder.path(), &["udpin:[::1]:0"]));
    let link = format!("udpout:[::1]:{}", ground.bound_port(Bound::Udp));
    expect_landing(Running::start(&mut vehicle(folder.path(), &[&link])), ground);
}

#[test]
fn at_115200_baud_they_land() {
    let line = SerialLine::new(115_200);
    let folder = tempfile::tempdir().unwrap();
    let vehicle = Running::start(&mut vehicle(folder.path(), &[&line.near_link()]));
    expect_landing(vehicle, Running::start(&mut auto_ground(folder.path(), &[&line.far_link()])));
}

/// Ten times slower than what telemetry takes over a radio. Nothing piles up, so the commands are
/// answered and observed.
#[test]
fn at_4800_baud_they_land_signed() {
    let line = SerialLine::new(4_800);
    let folder = tempfile::tempdir().unwrap();
    keygen(folder.path(), "flight.key");
    let mut vehicle = vehicle(folder.path(), &[&line.near_link()]);
    let vehicle = Running::start(vehicle.args(["--key", "flight.key"]));
    let mut ground = auto_ground(folder.path(), &[&line.far_link()]);
    let (_, ground) = expect_landing(vehicle, Running::start(ground.args(["--key", "flight.key"])));
    for seen in ["ARM observed", "START observed"] {
        assert!(ground.output.contains(seen), "{seen} in:\n{}", ground.output);
    }
    // Until the vehicle first reports it, the uplink counts as lost.
    assert!(!ground.output.contains("!!LINK LOST"), "{}", ground.output);
}

#[test]
fn over_udp_tcp_and_a_radio_at_once_every_frame_is_received_once() {
    let line = SerialLine::new(57_600);
    let folder = tempfile::tempdir().unwrap();
    let links = [&line.near_link(), "udpin:127.0.0.1:0", "tcpin:127.0.0.1:0"];
    // It stays for a station that a busy machine keeps waiting.
    let mut vehicle = Running::start(vehicle(folder.path(), &links).arg("--stay"));
    let tcp_link = format!("tcpout:127.0.0.1:{}", vehicle.bound_port(Bound::Tcp));
    let udp_link = vehicle.udp_link();
    let ground = Running::start(&mut auto_ground(folder.path(), &[&line.far_link(), &udp_link, &tcp_link]));
    let ground = ground.wait();
    vehicle.signal(Signal::SIGTERM);
    let vehicle = vehicle.wait();
    assert_eq!((ground.code, vehicle.code), (Some(0), Some(0)), "{}\n{}", ground.output, vehicle.output);
    for once in ["ARM acknowledged", "countdown started", "burn-out", "phase IGNITION -> POWERED"] {
        assert_eq!(ground.output.matches(once).count(), 1, "{once} in:\n{}", ground.output);
    }
    let names_the_link = ground.output.contains("acknowledged: accepted, over ");
    assert!(names_the_link, "no link is named with the acknowledgement:\n{}", ground.output);
}

#[test]
fn a_ground_commands_only_its_vehicle_of_two_rockets_on_one_link() {
    let folder = tempfile::tempdir().unwrap();
    let mut ground = auto_ground(folder.path(), &["udpin:127.0.0.1:0"]);
    let mut ground = Running::start(ground.args(["--sysid", "254", "--vehicle-sysid", "2"]));
    let link = ground.udp_link();
    let rocket = |id: &str| {
        let mut command = program(Program::OnboardSim);
        Running::start(command.args(["fly", "--mavlink", &link, "--sysid", id]).current_dir(folder.path()))
    };
    let (first, second) = (rocket("1"), rocket("2"));
    expect_landing(second, ground);
    first.signal(Signal::SIGTERM);
    let first = first.wait();
    assert!(
        !first.output.contains("PAD_ARMED"),
        "it obeyed the commands to the other rocket: {}",
        first.output
    );
    // The log shows the flight of the second rocket.
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
fn a_link_that_fails_in_flight_is_reported_and_the_other_one_continues() {
    let folder = tempfile::tempdir().unwrap();
    let links = ["udpin:127.0.0.1:0", "tcpin:127.0.0.1:0"];
    let mut vehicle = Running::start(&mut vehicle(folder.path(), &links));
    let relay = Relay::to(vehicle.bound_port(Bound::Tcp));
    let (udp_link, tcp_link) = (vehicle.udp_link(), format!("tcpout:{}", relay.address));
    let mut ground = Running::start(&mut auto_ground(folder.path(), &[&udp_link, &tcp_link]));
    ground.wait_for_line("START observed");
    drop(relay);
    ground.wait_for_line("one link down");
    let (_, ground) = expect_landing(vehicle, ground);
    assert!(!ground.output.contains("LINK LOST"), "{}", ground.output);
}

/// The ground is stopped while the vehicle is on the pad, and the vehicle answers the next one.
#[test]
fn a_ground_that_restarts_is_answered_again() {
    let folder = tempfile::tempdir().unwrap();
    let mut vehicle = Running::start(&mut vehicle(folder.path(), &["udpin:127.0.0.1:0"]));
    let link = vehicle.udp_link();
    vehicle.wait_for_line("PAD_IDLE");
    for _ in 0..2 {
        let mut command = program(Program::Ground);
        command.args(["--headless", "--log", "none", "--connect", &link]);
        let mut watching = Running::start(command.current_dir(folder.path()));
        watching.wait_for_line("PAD_IDLE");
        watching.signal(Signal::SIGTERM);
        watching.wait();
    }
    expect_landing(vehicle, Running::start(&mut auto_ground(folder.path(), &[&link])));
}

/// The most processor time that a vehicle on its pad may use while its serial line is gone, as a
/// share of the elapsed time. It needs a small part of this; a loop that never waits takes four
/// times as much.
const PROCESSOR_SHARE_MAX: f64 = 0.25;

/// A serial line is unplugged and plugged in again. The vehicle waits without using the processor,
/// and is received again.
#[test]
fn a_serial_line_may_be_unplugged_and_plugged_in_again() {
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
    let vehicle = Running::start(&mut vehicle(folder.path(), &[&radio, &watch.link()]));
    watch.wait_until_ready();
    std::fs::remove_file(&device).unwrap();
    drop(first);
    let (busy_before, out_at_ms) =
        (vehicle.processor_time(), watch.wait_for_phase(TdPhase::TD_PHASE_PAD_IDLE).time_boot_ms);
    let mut time_ms = out_at_ms;
    while time_ms < out_at_ms + 3_000 {
        time_ms = watch.wait_for_phase(TdPhase::TD_PHASE_PAD_IDLE).time_boot_ms;
    }
    let busy = vehicle.processor_time().saturating_sub(busy_before);
    let share = busy.as_secs_f64() / (f64::from(time_ms - out_at_ms) * 1e-3);
    assert!(share < PROCESSOR_SHARE_MAX, "{busy:?} from {out_at_ms} to {time_ms} ms");
    let second = SerialLine::new(57_600);
    plug(&second);
    expect_landing(vehicle, Running::start(&mut auto_ground(folder.path(), &[&second.far_link()])));
}

/// A TCP relay. Dropping it cuts the connection.
struct Relay {
    address: SocketAddr,
    _stop: std::sync::mpsc::SyncSender<()>,
}

impl Relay {
    fn to(to: u16) -> Self {
        let (stop, stopped) = std::sync::mpsc::sync_channel::<()>(0);
        // The ground keeps calling this address after the relay is gone, and no other program may
        // answer there.
        let address = unshared_address();
        let listener = std::net::TcpListener::bind(address).unwrap();
        std::thread::Builder::new()
            .name("relay".to_owned())
            .spawn(move || {
                let (near, _) = listener.accept().unwrap();
                // A cut connection is not accepted again.
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
                // Wait until the relay is dropped.
                let _ = stopped.recv();
                for end in [near, far] {
                    let _ = end.shutdown(std::net::Shutdown::Both);
                }
            })
            .unwrap();
        Self { address, _stop: stop }
    }
}
