//! Many senders at once: none of them takes the place of the true ground or the true vehicle, or delays an abort.

use std::io::ErrorKind;
use std::net::{SocketAddr, UdpSocket};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use e2e::{Bound, PATIENCE, Program, Running, command_frame, program};
use protocol::dialect::{HEARTBEAT_DATA, MavCmd, MavMessage, MavResult, MavState, TIMESYNC_DATA};
use protocol::frame::{Encoder, Framer};
use protocol::identity::{Address, GROUND, VEHICLE};
use protocol::signing::{Key, Memory, Signing, stamp_of};

use super::{Dice, hostile, with_key};

/// The bar: forty senders, each three hundred datagrams a second.
const SENDERS: u8 = 40;
const VOLLEYS_S: u32 = 100;
const EACH_VOLLEY: u64 = 3;

/// What strangers send.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// Five bytes that are no frame.
    Junk,
    /// Frames with a right checksum and no signature, each sender under its own system id.
    Unsigned,
    /// By turns junk, such frames, and every bad kind there is.
    Mixed,
}

/// Strangers, sending until dropped.
struct Strangers {
    stop: Arc<AtomicBool>,
    sent: Arc<AtomicU64>,
    thread: Option<JoinHandle<()>>,
}

impl Strangers {
    fn at(target: SocketAddr, kind: Kind) -> Self {
        let (stop, sent) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicU64::new(0)));
        let thread = {
            let (stop, sent) = (Arc::clone(&stop), Arc::clone(&sent));
            std::thread::Builder::new()
                .name("strangers".to_owned())
                .spawn(move || send_all(target, kind, &stop, &sent))
                .unwrap()
        };
        Self { stop, sent, thread: Some(thread) }
    }

    /// Waits until the strangers have sent for this long: every place that they can take is taken.
    fn wait_until_settled(&self) {
        while self.sent.load(Ordering::Relaxed) < u64::from(SENDERS) * EACH_VOLLEY * u64::from(VOLLEYS_S) / 2
        {
            std::thread::sleep(Duration::from_millis(10));
        }
    }
}

impl Drop for Strangers {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.join().unwrap();
        }
    }
}

fn send_all(target: SocketAddr, kind: Kind, stop: &AtomicBool, sent: &AtomicU64) {
    let sockets: Vec<UdpSocket> = (0..SENDERS).map(|_| UdpSocket::bind("127.0.0.1:0").unwrap()).collect();
    let mut encoders: Vec<Encoder> = (0..SENDERS)
        .map(|place| Encoder::new(Address { system_id: 100 + place, component_id: 190 }))
        .collect();
    let mut dice = Dice(2);
    let mut forger = Signing::new(Key::new([9; Key::LEN]), Memory::default());
    // Its commands come from a system of its own: without a key a command in the ground's name is the ground's.
    let mut others = Encoder::new(Address { system_id: 99, component_id: 190 });
    let begun = now();
    let mut number = 0;
    for volley in 1.. {
        for (socket, encoder) in sockets.iter().zip(&mut encoders) {
            for _ in 0..EACH_VOLLEY {
                number += 1;
                let bytes = match (kind, number % 4) {
                    (Kind::Junk, _) | (Kind::Mixed, 0) => dice.bytes(5),
                    (Kind::Unsigned, _) | (Kind::Mixed, 1 | 2) => {
                        let beat = MavMessage::HEARTBEAT(HEARTBEAT_DATA::default());
                        encoder.encode(&beat).as_bytes().to_vec()
                    }
                    // Of the bad kinds those that command nothing; without a key a command is obeyed.
                    (Kind::Mixed, _) => hostile(&mut dice, &mut forger, &mut others, number % 2),
                };
                // A full queue refuses it; that is the machine's business.
                if socket.send_to(&bytes, target).is_ok() {
                    sent.fetch_add(1, Ordering::Relaxed);
                }
            }
        }
        if stop.load(Ordering::Relaxed) {
            return;
        }
        std::thread::sleep((Duration::from_secs(1) * volley / VOLLEYS_S).saturating_sub(begun.elapsed()));
    }
}

/// A ground of one socket, which speaks first.
struct Caller {
    socket: UdpSocket,
    vehicle: SocketAddr,
    encoder: Encoder,
    framer: Framer,
    signing: Option<Signing>,
    spoke_at: Instant,
    /// The last HEARTBEAT of the vehicle, and the longest time between two.
    beat_at: Instant,
    worst_beat: Duration,
    /// The same for answers to what is asked ten times a second: only what the vehicle has taken is answered.
    answer_at: Instant,
    worst_answer: Duration,
    /// The vehicle has accepted the abort.
    accepted: bool,
    /// It shows that it is latched.
    latched: bool,
}

impl Caller {
    fn new(vehicle: SocketAddr, signing: Option<Signing>) -> Self {
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        let encoder = Encoder::new(GROUND);
        let at = now();
        Self {
            socket,
            vehicle,
            encoder,
            framer: Framer::new(),
            signing,
            spoke_at: at.checked_sub(Duration::from_secs(1)).unwrap(),
            beat_at: at,
            worst_beat: Duration::ZERO,
            answer_at: at,
            worst_answer: Duration::ZERO,
            accepted: false,
            latched: false,
        }
    }

    /// Goes on from another port, as a station behind a router that forgot it, or one that was started again.
    fn move_to_another_port(&mut self) {
        self.socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    }

    fn send(&mut self, message: &MavMessage) {
        let frame = self.encoder.encode(message);
        self.send_frame(&frame);
    }

    fn send_frame(&mut self, frame: &protocol::frame::Frame) {
        let frame = match &mut self.signing {
            Some(signing) => signing.sign(frame, 0, clock()),
            None => frame.clone(),
        };
        self.socket.send_to(frame.as_bytes(), self.vehicle).unwrap();
    }

    /// Speaks as a ground does and listens, until this moment.
    fn attend(&mut self, until: Instant, mut done: impl FnMut(&Self) -> bool) {
        let mut datagram = [0; 2048];
        let mut asked_at: Option<Instant> = None;
        while now() < until && !done(self) {
            if self.spoke_at.elapsed() >= Duration::from_secs(1) {
                self.spoke_at = now();
                self.send(&MavMessage::HEARTBEAT(HEARTBEAT_DATA::default()));
            }
            if asked_at.is_none_or(|at| at.elapsed() >= Duration::from_millis(100)) {
                asked_at = Some(now());
                let Address { system_id: target_system, component_id: target_component } = VEHICLE;
                self.send(&MavMessage::TIMESYNC(TIMESYNC_DATA {
                    tc1: 0,
                    ts1: 1,
                    target_system,
                    target_component,
                }));
            }
            self.socket.set_read_timeout(Some(Duration::from_millis(5))).unwrap();
            match self.socket.recv_from(&mut datagram) {
                Ok((count, _)) => self.framer.push_datagram(&datagram[..count]),
                Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
                Err(error) => panic!("{error}"),
            }
            while let Some(frame) = self.framer.next_frame() {
                self.hear(&frame);
            }
        }
        // What has not come by now counts, too.
        self.worst_beat = self.worst_beat.max(self.beat_at.elapsed());
        self.worst_answer = self.worst_answer.max(self.answer_at.elapsed());
    }

    fn hear(&mut self, frame: &protocol::frame::Frame) {
        match frame.decode() {
            Ok(MavMessage::HEARTBEAT(beat)) if frame.source() == VEHICLE => {
                self.worst_beat = self.worst_beat.max(self.beat_at.elapsed());
                self.beat_at = now();
                self.latched |= beat.system_status == MavState::MAV_STATE_FLIGHT_TERMINATION;
            }
            Ok(MavMessage::COMMAND_ACK(answer)) => {
                self.accepted |= answer.command == MavCmd::MAV_CMD_DO_FLIGHTTERMINATION
                    && answer.result == MavResult::MAV_RESULT_ACCEPTED;
            }
            Ok(MavMessage::TIMESYNC(sync)) if sync.tc1 != 0 => {
                self.worst_answer = self.worst_answer.max(self.answer_at.elapsed());
                self.answer_at = now();
            }
            _ => {}
        }
    }

    /// Waits until the vehicle hears and is heard; what was missing before does not count.
    fn meet(&mut self, within: Duration) -> Duration {
        let began = now();
        self.answer_at = began;
        self.beat_at = began;
        self.attend(began + within, |caller| caller.answer_at > began && caller.beat_at > began);
        assert!(self.answer_at > began && self.beat_at > began, "not picked up within {within:?}");
        (self.worst_beat, self.worst_answer) = (Duration::ZERO, Duration::ZERO);
        began.elapsed()
    }

    /// Sends ABORT twenty times a second until the vehicle has accepted it, which it does by latching it; returns how
    /// long that took.
    fn abort(&mut self) -> Duration {
        let began = now();
        while !self.accepted && began.elapsed() < Duration::from_secs(30) {
            let frame = command_frame(&mut self.encoder, MavCmd::MAV_CMD_DO_FLIGHTTERMINATION, 1.0);
            self.send_frame(&frame);
            self.attend(now() + Duration::from_millis(50), |caller| caller.accepted);
        }
        let took = began.elapsed();
        self.attend(now() + Duration::from_secs(3), |caller| caller.latched);
        assert!(self.latched, "accepted after {took:?}, and yet not latched");
        took
    }
}

fn now() -> Instant {
    #[expect(clippy::disallowed_methods, reason = "real processes are timed by a real clock")]
    Instant::now()
}

fn clock() -> u64 {
    #[expect(clippy::disallowed_methods, reason = "signatures need the time of day")]
    let now = std::time::SystemTime::now();
    stamp_of(now.duration_since(std::time::UNIX_EPOCH).unwrap())
}

/// The key in the folder, as another program would read it; each start of a ground goes on from the clock.
fn signing(folder: &Path, keyed: bool) -> Option<Signing> {
    let hex = std::fs::read_to_string(folder.join("flight.key")).unwrap();
    keyed.then(|| Signing::new(Key::from_hex(hex.trim_end()).unwrap(), Memory::default()))
}

fn vehicle(folder: &Path, keyed: bool) -> (Running, SocketAddr) {
    let mut command = program(Program::OnboardSim);
    command.args(["fly", "--stay", "--mavlink", "udpin:127.0.0.1:0"]).current_dir(folder);
    if keyed {
        command.args(["--key", "flight.key"]);
    }
    let mut vehicle = Running::start(&mut command);
    let port = vehicle.bound_port(Bound::Udp);
    (vehicle, ([127, 0, 0, 1], port).into())
}

/// What one try came to.
#[derive(Debug)]
struct Try {
    latched: Duration,
    worst_beat: Duration,
    worst_answer: Duration,
}

/// The strangers are there first; then the ground comes, speaks for a while, and aborts.
fn abort_among(kind: Kind, keyed: bool, speaks_for: Duration) -> Try {
    let folder = with_key();
    let (_vehicle, address) = vehicle(folder.path(), keyed);
    let strangers = Strangers::at(address, kind);
    strangers.wait_until_settled();
    let mut caller = Caller::new(address, signing(folder.path(), keyed));
    caller.meet(PATIENCE);
    caller.attend(now() + speaks_for, |_| false);
    let latched = caller.abort();
    Try { latched, worst_beat: caller.worst_beat, worst_answer: caller.worst_answer }
}

/// HEARTBEAT comes once a second and may be late by half of one; an answer to one of two questions may be lost where
/// the kernel's queue of a busy machine overflows, five in a row may not.
fn check(tried: &Try, case: &str) {
    assert!(tried.latched <= Duration::from_millis(500), "{case}: latched late: {tried:?}");
    assert!(tried.worst_beat <= Duration::from_millis(1_500), "{case}: heartbeats broken: {tried:?}");
    assert!(tried.worst_answer <= Duration::from_millis(600), "{case}: not heard: {tried:?}");
}

#[test]
fn strangers_do_not_delay_an_abort() {
    for kind in [Kind::Junk, Kind::Unsigned, Kind::Mixed] {
        for keyed in [true, false] {
            let tried = abort_among(kind, keyed, Duration::from_secs(3));
            println!("{kind:?}, key {keyed}: {tried:?}");
            check(&tried, &format!("{kind:?}, key {keyed}"));
        }
    }
}

/// The bar itself, six hundred aborts in about half an hour:
/// `cargo test --release -p e2e --test hostile -- --ignored --nocapture a_hundred`.
#[test]
#[ignore = "half an hour"]
fn a_hundred_aborts_of_each_kind_are_latched_within_half_a_second() {
    for kind in [Kind::Junk, Kind::Unsigned, Kind::Mixed] {
        for keyed in [true, false] {
            let mut tries: Vec<Try> =
                (0..100).map(|_| abort_among(kind, keyed, Duration::from_secs(2))).collect();
            tries.sort_by_key(|tried| tried.latched);
            let longest = |of: fn(&Try) -> Duration| tries.iter().map(of).max().unwrap();
            println!(
                "{kind:?}, key {keyed}: latched median {:?}, worst {:?}; worst gap of heartbeats {:?}, of answers {:?}",
                tries[50].latched,
                tries[99].latched,
                longest(|tried| tried.worst_beat),
                longest(|tried| tried.worst_answer)
            );
            for tried in &tries {
                check(tried, &format!("{kind:?}, key {keyed}"));
            }
        }
    }
}

#[test]
fn a_ground_on_another_port_is_picked_up_among_strangers() {
    for keyed in [true, false] {
        let folder = with_key();
        let (_vehicle, address) = vehicle(folder.path(), keyed);
        let strangers = Strangers::at(address, Kind::Mixed);
        strangers.wait_until_settled();
        let mut caller = Caller::new(address, signing(folder.path(), keyed));
        caller.meet(PATIENCE);
        caller.move_to_another_port();
        let moved = caller.meet(Duration::from_secs(3));
        // Started again: nothing is left of it but its key and its clock.
        let mut caller = Caller::new(address, signing(folder.path(), keyed));
        let restarted = caller.meet(Duration::from_secs(3));
        println!(
            "key {keyed}: picked up after {moved:?} on another port, after {restarted:?} when restarted"
        );
    }
}

/// The other way round: a ground that listens, with its vehicle and the strangers on one port.
#[test]
fn a_listening_ground_flies_its_vehicle_among_strangers() {
    for keyed in [true, false] {
        let folder = with_key();
        let mut station = program(Program::Ground);
        station
            .args(["--connect", "udpin:127.0.0.1:0", "--headless", "--auto", "--log", "ground.mcap"])
            .args(["--key", "flight.key"].iter().filter(|_| keyed))
            .current_dir(folder.path());
        let mut station = Running::start(&mut station);
        let port = station.bound_port(Bound::Udp);
        let strangers = Strangers::at(([127, 0, 0, 1], port).into(), Kind::Mixed);
        strangers.wait_until_settled();
        let mut flight = program(Program::OnboardSim);
        flight
            .args(["fly", "--mavlink", &format!("udpout:127.0.0.1:{port}")])
            .args(["--key", "flight.key"].iter().filter(|_| keyed))
            .current_dir(folder.path());
        let flight = Running::start(&mut flight);
        let (station, flight) = (station.wait(), flight.wait());
        let output = &station.output;
        assert_eq!((station.code, flight.code), (Some(0), Some(0)), "{output}\n{}", flight.output);
        assert!(!output.contains("link lost"), "{output}");
        // A flight of half a minute: one line in ten seconds, and a few peers by name.
        // Without a key many of them are peers.
        let about = |line: &&str| line.contains("unknown senders") || line.contains("further peers");
        let about_strangers = output.lines().filter(about).count();
        assert!((1..=6).contains(&about_strangers), "{about_strangers} lines:\n{output}");
        let named = output.matches("link up").count();
        assert!(named <= 6, "{named} peers are named:\n{output}");
    }
}
