//! Hostile datagrams of every kind, sent to a vehicle and a ground station that fly a landing.
//!
//! By default the tests send as many as an ordinary test run has time for.
//! `TOUCHDOWN_HOSTILE_DATAGRAMS=10000000 cargo test --release -p e2e hostile -- --nocapture` sends
//! more and prints the numbers.
#![expect(clippy::unwrap_used, reason = "a test that cannot set itself up has failed")]

mod strangers;

use std::net::{SocketAddr, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use e2e::{
    BareGround, Bound, Program, Random, Running, Signal, auto_ground, command_frame, expect_identical_replay,
    expect_landing, keygen, program, vehicle,
};
use protocol::dialect::{MavCmd, TdPhase};
use protocol::frame::{Encoder, Frame};
use protocol::identity::{Address, GROUND, VEHICLE};
use protocol::signing::{Key, Memory, Signing};

const DEFAULT_COUNT: u64 = 60_000;
/// This many are sent at once; then the sender pauses.
const BURST: u64 = 200;
const BURST_PAUSE: Duration = Duration::from_millis(10);

fn datagrams_wanted() -> u64 {
    std::env::var("TOUCHDOWN_HOSTILE_DATAGRAMS")
        .ok()
        .and_then(|count| count.parse().ok())
        .unwrap_or(DEFAULT_COUNT)
}

/// A frame of these bytes: message id (low byte, then high), source, payload; `None` for an id
/// outside the dialect.
fn frame_of(bytes: &[u8]) -> Option<Frame> {
    let [low, high, system_id, component_id, payload @ ..] = bytes else { return None };
    let source = Address { system_id: *system_id, component_id: *component_id };
    Encoder::new(source)
        .encode_payload(u32::from(u16::from_le_bytes([*low, *high])), &payload[..payload.len().min(255)])
}

/// A hostile datagram; `number` selects its kind.
fn hostile(random: &mut Random, forger: &mut Signing, ours: &mut Encoder, number: u64) -> Vec<u8> {
    let commands = [
        (MavCmd::MAV_CMD_DO_FLIGHTTERMINATION, 1.0),
        (MavCmd::MAV_CMD_COMPONENT_ARM_DISARM, 1.0),
        (MavCmd::MAV_CMD_COMPONENT_ARM_DISARM, 0.0),
        (MavCmd::MAV_CMD_MISSION_START, 0.0),
        (MavCmd::MAV_CMD_SET_MESSAGE_INTERVAL, 31.0),
    ];
    let (asked, param1) = commands[(random.next() % 5) as usize];
    match number % 8 {
        0 => random.bytes(600),
        // Mostly start markers.
        1 => random.bytes(300).iter().map(|byte| if byte & 1 == 0 { 0xFD } else { byte & 3 }).collect(),
        // A correct checksum over random content from a random source.
        2 | 3 => {
            let id = [
                0, 1, 2, 4, 11, 20, 21, 22, 23, 30, 31, 66, 69, 75, 76, 77, 109, 110, 111, 147, 244, 253,
                256, 300,
            ][(random.next() % 24) as usize];
            let mut piece = vec![id as u8, (id >> 8) as u8, random.next() as u8, random.next() as u8];
            piece.extend(random.bytes(250));
            frame_of(&piece).map_or_else(Vec::new, |frame| frame.as_bytes().to_vec())
        }
        // A frame in the vehicle's own name.
        4 => {
            let mut piece = vec![0, 0, VEHICLE.system_id, VEHICLE.component_id];
            piece.extend(random.bytes(20));
            frame_of(&piece).map_or_else(Vec::new, |frame| frame.as_bytes().to_vec())
        }
        // A command in the ground's name, unsigned, and one signed with another key.
        5 => command_frame(ours, asked, param1).as_bytes().to_vec(),
        6 => forger.sign(&command_frame(ours, asked, param1), 0, 1 << 45).as_bytes().to_vec(),
        // The beginning of a valid frame.
        _ => {
            let frame = command_frame(ours, asked, param1);
            let cut = (random.next() as usize) % frame.as_bytes().len();
            frame.as_bytes()[..cut].to_vec()
        }
    }
}

/// Sends hostile datagrams until it is stopped.
struct HostileSender {
    sent: Arc<AtomicU64>,
    stop: Arc<AtomicBool>,
    thread: std::thread::JoinHandle<()>,
}

impl HostileSender {
    fn at(targets: Vec<SocketAddr>) -> Self {
        let (sent, stop) = (Arc::new(AtomicU64::new(0)), Arc::new(AtomicBool::new(false)));
        let thread = {
            let (sent, stop) = (Arc::clone(&sent), Arc::clone(&stop));
            std::thread::Builder::new()
                .name("hostile sender".to_owned())
                .spawn(move || send_hostile(&targets, &sent, &stop))
        };
        Self { sent, stop, thread: thread.unwrap() }
    }

    fn sent(&self) -> u64 {
        self.sent.load(Ordering::Relaxed)
    }

    fn stop(self) -> u64 {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.join().unwrap();
        self.sent.load(Ordering::Relaxed)
    }
}

fn send_hostile(targets: &[SocketAddr], sent: &AtomicU64, stop: &AtomicBool) {
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    let mut random = Random(1);
    let mut forger = Signing::new(Key::new([9; Key::LEN]), Memory::default());
    let mut ours = Encoder::new(GROUND);
    let mut number = 0;
    while !stop.load(Ordering::Relaxed) {
        for _ in 0..BURST {
            let datagram = hostile(&mut random, &mut forger, &mut ours, number);
            let target = targets[(number / 8) as usize % targets.len()];
            // The system refuses it if its queue is full; then it does not count.
            if socket.send_to(&datagram, target).is_ok() {
                sent.fetch_add(1, Ordering::Relaxed);
            }
            number += 1;
        }
        std::thread::sleep(BURST_PAUSE);
    }
}

fn with_key() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let made = keygen(folder.path(), "flight.key");
    assert_eq!(made.code, Some(0), "{}", made.output);
    folder
}

/// The vehicle waits on the pad under a flood: it keeps sending, its memory does not grow, and
/// nothing is armed, started or terminated.
#[test]
fn a_vehicle_survives_a_flood() {
    let folder = with_key();
    let mut watch = BareGround::new();
    let mut vehicle = vehicle(folder.path(), &["udpin:127.0.0.1:0", &watch.link()]);
    let mut vehicle = Running::start(vehicle.args(["--stay", "--key", "flight.key"]));
    let port = vehicle.bound_port(Bound::Udp);
    watch.wait_for_heartbeat();
    let sender = HostileSender::at(vec![([127, 0, 0, 1], port).into()]);
    // During the first part all tables fill up.
    let step = datagrams_wanted() / 10;
    let mut memory = Vec::new();
    for part in 1..=10 {
        while sender.sent() < part * step {
            let beat = watch.wait_for_heartbeat();
            assert!(
                beat.custom_mode & 0xFF <= TdPhase::TD_PHASE_PAD_IDLE as u32,
                "the vehicle has left the idle phase"
            );
            assert!(!beat.base_mode.contains(protocol::dialect::MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED));
        }
        memory.push(vehicle.memory_bytes());
    }
    let sent = sender.stop();
    watch.wait_for_heartbeat();
    vehicle.signal(Signal::SIGTERM);
    let ended = vehicle.wait();
    assert_eq!(ended.code, Some(5), "stopped, not aborted: {}", ended.output);
    let grown = memory[9].saturating_sub(memory[1]);
    println!("{sent} hostile datagrams at the vehicle; memory {memory:?}\n{}", ended.output);
    assert!(grown < 4 << 20, "memory grows by {grown} bytes over the last eight tenths: {memory:?}");
    assert!(!ended.output.contains("PAD_ARMED"), "{}", ended.output);
}

/// A landing is flown while a port of the ground and one of the vehicle are flooded; the vehicle
/// also has a link of its own to the ground.
#[test]
fn a_landing_succeeds_under_a_flood() {
    let folder = with_key();
    let mut station = auto_ground(folder.path(), &["udpin:127.0.0.1:0"]);
    let mut station = Running::start(station.args(["--key", "flight.key"]));
    let clean = station.bound_port(Bound::Udp);
    let mut vehicle = vehicle(folder.path(), &["udpin:127.0.0.1:0", &station.udp_link()]);
    let mut vehicle = Running::start(vehicle.args(["--key", "flight.key"]));
    let flooded = vehicle.bound_port(Bound::Udp);
    let sender = HostileSender::at(vec![([127, 0, 0, 1], flooded).into(), ([127, 0, 0, 1], clean).into()]);
    let before = station.memory_bytes();
    let (vehicle, station) = expect_landing(vehicle, station);
    let sent = sender.stop();
    println!(
        "{sent} hostile datagrams at both; ground's memory before {before}\n{}\n{}",
        station.output, vehicle.output
    );
    assert!(
        station.output.contains("frames refused"),
        "the refused frames are not reported: {}",
        station.output
    );
    expect_identical_replay(folder.path(), "vehicle.mcap");
}

/// A ground station without a vehicle under a flood: it keeps running, its memory does not grow,
/// and it accepts nothing.
#[test]
fn a_ground_survives_a_flood() {
    let folder = with_key();
    let mut command = program(Program::Ground);
    command
        .args(["--connect", "udpin:127.0.0.1:0", "--key", "flight.key"])
        .args(["--headless", "--log", "ground.mcap"])
        .current_dir(folder.path());
    let mut station = Running::start(&mut command);
    let port = station.bound_port(Bound::Udp);
    let sender = HostileSender::at(vec![([127, 0, 0, 1], port).into()]);
    station.wait_for_line("frames refused");
    let step = datagrams_wanted() / 10;
    let mut memory = Vec::new();
    for part in 1..=10 {
        while sender.sent() < part * step {
            std::thread::sleep(BURST_PAUSE);
        }
        memory.push(station.memory_bytes());
    }
    let sent = sender.stop();
    station.signal(Signal::SIGTERM);
    let ended = station.wait();
    println!("{sent} hostile datagrams at the ground; memory {memory:?}\n{}", ended.output);
    assert!(!ended.output.contains("phase"), "a frame was accepted: {}", ended.output);
    let grown = memory[9].saturating_sub(memory[1]);
    assert!(grown < 4 << 20, "memory grows by {grown} bytes over the last eight tenths: {memory:?}");
}
