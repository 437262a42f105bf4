//! Signed links between the real processes.
#![expect(clippy::unwrap_used, reason = "a test that cannot set itself up has failed")]

use std::net::UdpSocket;
use std::path::Path;
use std::time::Duration;

use e2e::{Bound, Ended, Program, Running, Signal, program};
use protocol::dialect::{MavMessage, TIMESYNC_DATA};
use protocol::frame::{Encoder, Framer};
use protocol::identity::VEHICLE;
use protocol::signing::{Key, Memory, Signing, stamp_of};

fn keygen(folder: &Path, name: &str) -> Ended {
    Running::to_end(program(Program::OnboardSim).args(["keygen", name]).current_dir(folder))
}

fn fly(folder: &Path, key: &str, link: &str) -> Running {
    let mut command = program(Program::OnboardSim);
    Running::start(command.args(["fly", "--mavlink", link, "--key", key]).current_dir(folder))
}

#[test]
fn with_one_key_they_land_and_remember_their_timestamps() {
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(keygen(folder.path(), "flight.key").code, Some(0));
    assert_eq!(keygen(folder.path(), "flight.key").code, Some(1), "a key is not overwritten");
    let mut station = program(Program::Ground);
    station
        .args(["--connect", "udpin:127.0.0.1:0", "--key", "flight.key"])
        .args(["--headless", "--auto", "--log", "ground.mcap"])
        .current_dir(folder.path());
    let mut station = Running::start(&mut station);
    let link = format!("udpout:127.0.0.1:{}", station.bound_port(Bound::Udp));
    let flight = fly(folder.path(), "flight.key", &link);
    let (station, flight) = (station.wait(), flight.wait());
    assert_eq!((station.code, flight.code), (Some(0), Some(0)), "{}\n{}", station.output, flight.output);
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
        assert!(!bytes.windows(secret.len()).any(|window| window == secret), "a key in the log");
    }
}

#[test]
fn with_another_key_nothing_is_believed_on_either_side() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["vehicle.key", "other.key"] {
        assert_eq!(keygen(folder.path(), name).code, Some(0));
    }
    let mut flight = fly(folder.path(), "vehicle.key", "udpin:127.0.0.1:0");
    let link = format!("udpout:127.0.0.1:{}", flight.bound_port(Bound::Udp));
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
            // The ground's counters, in words.
            assert!(station.output.contains("wrongly signed"), "{}", station.output);
            assert!(!station.output.contains("PAD_IDLE"), "{}", station.output);
        } else {
            // A ground without a key sees the vehicle, is not obeyed, and is told why.
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

/// A vehicle of one socket that asks for the ground's time: only what the ground believes is answered.
struct Asker {
    socket: UdpSocket,
    encoder: Encoder,
    signing: Signing,
    asked: i64,
}

impl Asker {
    fn new(folder: &Path, port: u16) -> Self {
        let hex = std::fs::read_to_string(folder.join("flight.key")).unwrap();
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        socket.connect(("127.0.0.1", port)).unwrap();
        socket.set_read_timeout(Some(Duration::from_millis(100))).unwrap();
        let signing = Signing::new(Key::from_hex(hex.trim_end()).unwrap(), Memory::default());
        Self { socket, encoder: Encoder::new(VEHICLE), signing, asked: 0 }
    }

    fn question(&mut self) -> Vec<u8> {
        #[expect(clippy::disallowed_methods, reason = "signatures need the time of day")]
        let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap();
        self.asked += 1;
        let sync = TIMESYNC_DATA { tc1: 0, ts1: self.asked, target_system: 0, target_component: 0 };
        let frame = self.encoder.encode(&MavMessage::TIMESYNC(sync));
        self.signing.sign(&frame, 0, stamp_of(now)).as_bytes().to_vec()
    }

    /// Whether this is answered at once.
    fn is_answered(&self, question: &[u8]) -> bool {
        // Nobody may be listening yet, which either the next call to send or the next to receive says.
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
                    && sync.ts1 == self.asked
                {
                    return true;
                }
            }
        }
    }

    /// Asks anew until it is answered, and returns the question that was.
    fn ask_until_answered(&mut self) -> Vec<u8> {
        for _ in 0..600 {
            let question = self.question();
            if self.is_answered(&question) {
                return question;
            }
        }
        panic!("never answered");
    }

    /// Waits until somebody listens: until then the system refuses what is sent.
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
        panic!("nobody listens");
    }
}

#[test]
fn what_a_ground_heard_is_not_believed_again_after_it_was_killed() {
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(keygen(folder.path(), "flight.key").code, Some(0));
    let start = |port: u16| {
        let mut station = program(Program::Ground);
        station
            .args(["--connect", &format!("udpin:127.0.0.1:{port}"), "--key", "flight.key"])
            .args(["--headless", "--log", "none"])
            .current_dir(folder.path());
        Running::start(&mut station)
    };
    // Any port; the ones after it listen at the same, as a crew's would.
    let mut first = Some(start(0));
    let port = first.as_mut().map_or(0, |station| station.bound_port(Bound::Udp));
    let mut vehicle = Asker::new(folder.path(), port);
    for _ in 0..3 {
        let station = first.take().unwrap_or_else(|| start(port));
        let question = vehicle.ask_until_answered();
        // It has acted on it just now.
        station.signal(Signal::SIGKILL);
        station.wait();
        let station = start(port);
        vehicle.wait_for_listener();
        for _ in 0..10 {
            assert!(!vehicle.is_answered(&question), "believed twice");
        }
        vehicle.ask_until_answered();
        station.signal(Signal::SIGKILL);
        station.wait();
    }
}

#[test]
fn a_passphrase_makes_the_key_that_mavproxy_makes_of_it() {
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
fn an_empty_file_of_timestamps_is_refused_on_both_sides() {
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
