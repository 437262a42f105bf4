//! Flights over signed links between the real processes.
#![expect(clippy::unwrap_used, reason = "a test that cannot set itself up has failed")]

use std::net::{SocketAddr, UdpSocket};
use std::path::Path;
use std::time::Duration;

use e2e::{
    Program, Running, Signal, auto_ground, expect_landing, keygen, program, signing_clock,
    signing_with_key_in, unshared_address,
};
use protocol::dialect::{MavMessage, TIMESYNC_DATA};
use protocol::frame::{Encoder, Framer};
use protocol::identity::VEHICLE;
use protocol::signing::Signing;

fn fly(folder: &Path, key: &str, link: &str) -> Running {
    let mut command = program(Program::OnboardSim);
    Running::start(command.args(["fly", "--mavlink", link, "--key", key]).current_dir(folder))
}

#[test]
fn with_one_key_they_land_and_remember_their_timestamps() {
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(keygen(folder.path(), "flight.key").code, Some(0));
    assert_eq!(keygen(folder.path(), "flight.key").code, Some(1), "the key was overwritten");
    let mut station = auto_ground(folder.path(), &["udpin:127.0.0.1:0"]);
    let mut station = Running::start(station.args(["--key", "flight.key"]));
    let flight = fly(folder.path(), "flight.key", &station.udp_link());
    expect_landing(flight, station);
    for user in ["vehicle", "ground"] {
        let stamps = folder.path().join(format!("flight.key.{user}.stamps"));
        let text = std::fs::read_to_string(stamps).unwrap();
        assert!(text.starts_with("ours ") && text.contains("heard "), "{text}");
    }
    let bytes = std::fs::read(folder.path().join("ground.mcap")).unwrap();
    let key = std::fs::read_to_string(folder.path().join("flight.key")).unwrap();
    let raw: Vec<u8> =
        (0..64).step_by(2).map(|at| u8::from_str_radix(&key[at..at + 2], 16).unwrap()).collect();
    for secret in [key.trim().as_bytes(), &raw] {
        assert!(!bytes.windows(secret.len()).any(|window| window == secret), "the log contains the key");
    }
}

#[test]
fn with_another_key_neither_side_accepts_anything() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["vehicle.key", "other.key"] {
        assert_eq!(keygen(folder.path(), name).code, Some(0));
    }
    let mut flight = fly(folder.path(), "vehicle.key", "udpin:127.0.0.1:0");
    let link = flight.udp_link();
    for key in [Some("other.key"), None] {
        let mut station = program(Program::Ground);
        station
            .args(["--connect", &link, "--headless", "--auto", "--log", "none"])
            .args(["--timeout-s", "15"])
            .args(key.iter().flat_map(|key| ["--key", key]))
            .current_dir(folder.path());
        let station = Running::to_end(&mut station);
        assert_ne!(station.code, Some(0), "{}", station.output);
        if key.is_some() {
            // The ground reports its counters in words.
            assert!(station.output.contains("wrongly signed"), "{}", station.output);
            assert!(!station.output.contains("PAD_IDLE"), "{}", station.output);
        } else {
            // A ground without a key sees the vehicle. The vehicle does not obey it, and the ground
            // reports the reason.
            assert!(station.output.contains("UPLINK LOST"), "{}", station.output);
            assert!(station.output.contains("not signed, is the key missing here?"), "{}", station.output);
        }
    }
    flight.signal(Signal::SIGTERM);
    let flight = flight.wait();
    assert_eq!(flight.code, Some(5), "nothing was armed or aborted: {}", flight.output);
    assert!(!flight.output.contains("PAD_ARMED"), "{}", flight.output);
}

#[test]
fn a_key_that_others_can_read_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(keygen(folder.path(), "open.key").code, Some(0));
    let open = std::os::unix::fs::PermissionsExt::from_mode(0o644);
    std::fs::set_permissions(folder.path().join("open.key"), open).unwrap();
    let flight = fly(folder.path(), "open.key", "udpout:127.0.0.1:1").wait();
    assert_eq!(flight.code, Some(1), "{}", flight.output);
    assert!(flight.output.contains("chmod 600 open.key"), "{}", flight.output);
    let mut station = program(Program::Ground);
    station.args(["--connect", "udpin:127.0.0.1:0", "--key", "open.key", "--log", "none"]);
    let station = Running::to_end(station.current_dir(folder.path()));
    assert_eq!(station.code, Some(1), "{}", station.output);
    assert!(station.output.contains("chmod 600 open.key"), "{}", station.output);
}

/// A vehicle made of one socket. It asks the ground for its time with TIMESYNC, and the ground
/// answers only frames that it accepts.
struct TimesyncVehicle {
    socket: UdpSocket,
    encoder: Encoder,
    signing: Signing,
    requests: i64,
}

impl TimesyncVehicle {
    fn new(folder: &Path, ground: SocketAddr) -> Self {
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        socket.connect(ground).unwrap();
        socket.set_read_timeout(Some(Duration::from_millis(100))).unwrap();
        Self { socket, encoder: Encoder::new(VEHICLE), signing: signing_with_key_in(folder), requests: 0 }
    }

    fn question(&mut self) -> Vec<u8> {
        self.requests += 1;
        let sync = TIMESYNC_DATA { tc1: 0, ts1: self.requests, target_system: 0, target_component: 0 };
        let frame = self.encoder.encode(&MavMessage::TIMESYNC(sync));
        self.signing.sign(&frame, 0, signing_clock()).as_bytes().to_vec()
    }

    /// Sends a question and returns whether it is answered at once.
    fn is_answered(&self, question: &[u8]) -> bool {
        // Without a listener, either the next send or the next receive reports it.
        let _ = self.socket.send(question);
        let mut datagram = [0; 2048];
        let mut framer = Framer::new();
        loop {
            let count = match self.socket.recv(&mut datagram) {
                Ok(count) => count,
                Err(error) => {
                    if error.kind() == std::io::ErrorKind::ConnectionRefused {
                        std::thread::sleep(Duration::from_millis(100));
                    }
                    return false;
                }
            };
            framer.push_datagram(&datagram[..count]);
            while let Some(frame) = framer.next_frame() {
                if let Ok(MavMessage::TIMESYNC(sync)) = frame.decode()
                    && sync.tc1 != 0
                    && sync.ts1 == self.requests
                {
                    return true;
                }
            }
        }
    }

    /// Sends new questions until one is answered, and returns that one.
    fn request_until_answered(&mut self) -> Vec<u8> {
        for _ in 0..600 {
            let question = self.question();
            if self.is_answered(&question) {
                return question;
            }
        }
        panic!("no question was answered");
    }

    /// Waits until a program listens; until then the system reports an error.
    fn wait_for_listener(&self) {
        for _ in 0..600 {
            let refused = (0..3).any(|_| {
                std::thread::sleep(Duration::from_millis(30));
                self.socket.send(&[0]).is_err()
            });
            if !refused {
                return;
            }
        }
        panic!("no listener");
    }
}

/// Timestamp of a signed frame: six bytes before the last six.
fn stamp_of(frame: &[u8]) -> u64 {
    frame[frame.len() - 12..][..6].iter().rev().fold(0, |stamp, byte| stamp << 8 | u64::from(*byte))
}

#[test]
fn a_frame_that_a_ground_accepted_is_rejected_after_the_ground_was_killed() {
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(keygen(folder.path(), "flight.key").code, Some(0));
    let stamps = folder.path().join("flight.key.ground.stamps");
    // The same address for every run, as a crew would use.
    let address = unshared_address();
    let start = || {
        let mut station = program(Program::Ground);
        station
            .args(["--connect", &format!("udpin:{address}"), "--key", "flight.key"])
            .args(["--headless", "--log", "none"])
            .current_dir(folder.path());
        Running::start(&mut station)
    };
    let mut vehicle = TimesyncVehicle::new(folder.path(), address);
    for _ in 0..3 {
        let station = start();
        // A station waits 50 ms for the disk, and a busy one may take longer.
        let stored_in_time = |_| {
            let question = vehicle.request_until_answered();
            let stored = std::fs::read_to_string(&stamps).unwrap_or_default();
            stored.contains(&format!(" {}\n", stamp_of(&question))).then_some(question)
        };
        let question = (0..600).find_map(stored_in_time).expect("timestamps are stored before the answer");
        // The station has just acted on it.
        station.signal(Signal::SIGKILL);
        station.wait();
        let station = start();
        vehicle.wait_for_listener();
        for _ in 0..10 {
            assert!(!vehicle.is_answered(&question), "a replayed frame was accepted");
        }
        vehicle.request_until_answered();
        station.signal(Signal::SIGKILL);
        station.wait();
    }
}

#[test]
fn a_passphrase_gives_the_same_key_as_in_mavproxy() {
    use std::io::Write as _;
    let folder = tempfile::tempdir().unwrap();
    for (given, code) in [("\n", Some(1)), ("abc\n", Some(0))] {
        let mut command = program(Program::OnboardSim);
        command.args(["keygen", "--passphrase", "flight.key"]).current_dir(folder.path());
        let (mut keyboard, running) = Running::start_with_input(&mut command);
        keyboard.write_all(given.as_bytes()).unwrap();
        drop(keyboard);
        let ended = running.wait();
        assert_eq!(ended.code, code, "{}", ended.output);
    }
    // SHA-256 of `abc`: FIPS 180-2, appendix B.1.
    let key = std::fs::read_to_string(folder.path().join("flight.key")).unwrap();
    assert_eq!(key.trim_end(), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

#[test]
fn an_empty_timestamp_file_is_refused_on_both_sides() {
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(keygen(folder.path(), "flight.key").code, Some(0));
    for user in ["vehicle", "ground"] {
        std::fs::write(folder.path().join(format!("flight.key.{user}.stamps")), "").unwrap();
    }
    let flight = fly(folder.path(), "flight.key", "udpout:127.0.0.1:1").wait();
    let mut station = program(Program::Ground);
    station.args(["--connect", "udpin:127.0.0.1:0", "--key", "flight.key", "--log", "none", "--headless"]);
    let station = Running::to_end(station.current_dir(folder.path()));
    for (ended, user) in [(flight, "vehicle"), (station, "ground")] {
        assert_eq!(ended.code, Some(1), "{}", ended.output);
        assert!(ended.output.contains(&format!("flight.key.{user}.stamps")), "{}", ended.output);
    }
}
