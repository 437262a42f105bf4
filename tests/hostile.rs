//! Hostile air: datagrams of every bad kind, thrown at a vehicle and a ground station that fly a landing.
//!
//! By default as many as an ordinary test run has time for. `TOUCHDOWN_HOSTILE_DATAGRAMS=10000000 cargo test --release
//! -p e2e --test hostile -- --nocapture` for as many as a bad day has; the numbers are printed.
#![expect(clippy::unwrap_used, reason = "a test that cannot set itself up has failed")]

#[path = "hostile/strangers.rs"]
mod strangers;

use std::net::{SocketAddr, UdpSocket};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use e2e::{BareGround, Bound, Program, Running, Signal, command_frame, program};
use protocol::dialect::{MavCmd, TdPhase};
use protocol::frame::Encoder;
use protocol::hostile::frame_of;
use protocol::identity::{GROUND, VEHICLE};
use protocol::signing::{Key, Memory, Signing};

const ORDINARY: u64 = 60_000;
/// Thrown in one go; then the thrower waits for as long as a good machine needs for them.
const VOLLEY: u64 = 200;
const VOLLEY_TIME: Duration = Duration::from_millis(10);

fn wanted() -> u64 {
    std::env::var("TOUCHDOWN_HOSTILE_DATAGRAMS").ok().and_then(|count| count.parse().ok()).unwrap_or(ORDINARY)
}

/// Numbers that are the same in every run (Knuth's MMIX generator).
struct Dice(u64);

impl Dice {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        self.0 >> 33
    }

    fn bytes(&mut self, most: u64) -> Vec<u8> {
        (0..self.next() % (most + 1)).map(|_| self.next() as u8).collect()
    }
}

/// A datagram that nobody honest would send, of the `number`th kind.
fn hostile(dice: &mut Dice, forger: &mut Signing, ours: &mut Encoder, number: u64) -> Vec<u8> {
    let commands = [
        (MavCmd::MAV_CMD_DO_FLIGHTTERMINATION, 1.0),
        (MavCmd::MAV_CMD_COMPONENT_ARM_DISARM, 1.0),
        (MavCmd::MAV_CMD_COMPONENT_ARM_DISARM, 0.0),
        (MavCmd::MAV_CMD_MISSION_START, 0.0),
        (MavCmd::MAV_CMD_SET_MESSAGE_INTERVAL, 31.0),
    ];
    let (asked, param1) = commands[(dice.next() % 5) as usize];
    match number % 8 {
        0 => dice.bytes(600),
        // Markers and little else.
        1 => dice.bytes(300).iter().map(|byte| if byte & 1 == 0 { 0xFD } else { byte & 3 }).collect(),
        // The right checksum over anything, from anybody.
        2 | 3 => {
            let id = [
                0, 1, 2, 4, 11, 20, 21, 22, 23, 30, 31, 66, 69, 75, 76, 77, 109, 110, 111, 147, 244, 253,
                256, 300,
            ][(dice.next() % 24) as usize];
            let mut piece = vec![id as u8, (id >> 8) as u8, dice.next() as u8, dice.next() as u8];
            piece.extend(dice.bytes(250));
            frame_of(&piece).map_or_else(Vec::new, |frame| frame.as_bytes().to_vec())
        }
        // In the vehicle's own name.
        4 => {
            let mut piece = vec![0, 0, VEHICLE.system_id, VEHICLE.component_id];
            piece.extend(dice.bytes(20));
            frame_of(&piece).map_or_else(Vec::new, |frame| frame.as_bytes().to_vec())
        }
        // In the ground's name: unsigned, and signed with another key.
        5 => command_frame(ours, asked, param1).as_bytes().to_vec(),
        6 => forger.sign(&command_frame(ours, asked, param1), 0, 1 << 45).as_bytes().to_vec(),
        // A good beginning.
        _ => {
            let frame = command_frame(ours, asked, param1);
            let cut = (dice.next() as usize) % frame.as_bytes().len();
            frame.as_bytes()[..cut].to_vec()
        }
    }
}

/// Throws until it has thrown as many as wanted, and on until it is told to stop.
struct Thrower {
    thrown: Arc<AtomicU64>,
    stop: Arc<AtomicBool>,
    thread: std::thread::JoinHandle<()>,
}

impl Thrower {
    fn at(targets: Vec<SocketAddr>) -> Self {
        let (thrown, stop) = (Arc::new(AtomicU64::new(0)), Arc::new(AtomicBool::new(false)));
        let thread = {
            let (thrown, stop) = (Arc::clone(&thrown), Arc::clone(&stop));
            std::thread::Builder::new()
                .name("thrower".to_owned())
                .spawn(move || throw(&targets, &thrown, &stop))
        };
        Self { thrown, stop, thread: thread.unwrap() }
    }

    fn thrown(&self) -> u64 {
        self.thrown.load(Ordering::Relaxed)
    }

    fn stop(self) -> u64 {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.join().unwrap();
        self.thrown.load(Ordering::Relaxed)
    }
}

fn throw(targets: &[SocketAddr], thrown: &AtomicU64, stop: &AtomicBool) {
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    let mut dice = Dice(1);
    let mut forger = Signing::new(Key::new([9; Key::LEN]), Memory::default());
    let mut ours = Encoder::new(GROUND);
    let mut number = 0;
    while !stop.load(Ordering::Relaxed) {
        for _ in 0..VOLLEY {
            let datagram = hostile(&mut dice, &mut forger, &mut ours, number);
            let target = targets[(number / 8) as usize % targets.len()];
            // A full queue refuses it; that is the machine's business.
            if socket.send_to(&datagram, target).is_ok() {
                thrown.fetch_add(1, Ordering::Relaxed);
            }
            number += 1;
        }
        std::thread::sleep(VOLLEY_TIME);
    }
}

fn fly(folder: &Path, links: [&str; 2], further: &[&str]) -> Running {
    let mut command = program(Program::OnboardSim);
    command.args(["fly", "--key", "flight.key", "--log", "vehicle.mcap"]).args(further).current_dir(folder);
    Running::start(command.args(links.iter().flat_map(|link| ["--mavlink", link])))
}

fn with_key() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let made = Running::to_end(
        program(Program::OnboardSim).args(["keygen", "flight.key"]).current_dir(folder.path()),
    );
    assert_eq!(made.code, Some(0), "{}", made.output);
    folder
}

/// The vehicle waits on the pad: alive at every step, its memory flat, nothing armed, started or terminated.
#[test]
fn a_vehicle_stands_through_it() {
    let folder = with_key();
    let mut watch = BareGround::new();
    let mut vehicle = fly(folder.path(), ["udpin:127.0.0.1:0", &watch.link()], &["--stay"]);
    let port = vehicle.bound_port(Bound::Udp);
    watch.wait_for_heartbeat();
    let thrower = Thrower::at(vec![([127, 0, 0, 1], port).into()]);
    // The first part fills every table there is.
    let step = wanted() / 10;
    let mut memory = Vec::new();
    for part in 1..=10 {
        while thrower.thrown() < part * step {
            let beat = watch.wait_for_heartbeat();
            assert!(beat.custom_mode <= TdPhase::TD_PHASE_PAD_IDLE as u32, "still idle on the pad");
            assert!(!beat.base_mode.contains(protocol::dialect::MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED));
        }
        memory.push(vehicle.memory_bytes());
    }
    let thrown = thrower.stop();
    watch.wait_for_heartbeat();
    vehicle.signal(Signal::SIGTERM);
    let ended = vehicle.wait();
    assert_eq!(ended.code, Some(5), "stopped, not aborted: {}", ended.output);
    let grown = memory[9].saturating_sub(memory[1]);
    println!("{thrown} hostile datagrams at the vehicle; memory {memory:?}\n{}", ended.output);
    assert!(grown < 4 << 20, "memory grows by {grown} bytes over the last eight tenths: {memory:?}");
    assert!(!ended.output.contains("PAD_ARMED"), "{}", ended.output);
}

/// A landing flown over the flooded port of the ground and a clean link beside the vehicle's flooded one.
#[test]
fn a_landing_is_flown_through_it() {
    let folder = with_key();
    let mut station = program(Program::Ground);
    station
        .args(["--connect", "udpin:127.0.0.1:0", "--key", "flight.key"])
        .args(["--headless", "--auto", "--log", "ground.mcap"])
        .current_dir(folder.path());
    let mut station = Running::start(&mut station);
    let clean = station.bound_port(Bound::Udp);
    let mut vehicle = fly(folder.path(), ["udpin:127.0.0.1:0", &format!("udpout:127.0.0.1:{clean}")], &[]);
    let flooded = vehicle.bound_port(Bound::Udp);
    let thrower = Thrower::at(vec![([127, 0, 0, 1], flooded).into(), ([127, 0, 0, 1], clean).into()]);
    let before = station.memory_bytes();
    let (station, vehicle) = (station.wait(), vehicle.wait());
    let thrown = thrower.stop();
    println!(
        "{thrown} hostile datagrams at both; ground's memory before {before}\n{}\n{}",
        station.output, vehicle.output
    );
    assert_eq!((station.code, vehicle.code), (Some(0), Some(0)), "{}\n{}", station.output, vehicle.output);
    assert!(station.output.contains("frames refused"), "counted and said: {}", station.output);
    let verified =
        Running::to_end(program(Program::Replay).args(["verify", "vehicle.mcap"]).current_dir(folder.path()));
    assert_eq!(verified.code, Some(0), "{}", verified.output);
}

/// A ground station without a vehicle, watched by a flood: alive, its memory flat, nothing believed.
#[test]
fn a_ground_stands_through_it() {
    let folder = with_key();
    let mut command = program(Program::Ground);
    command
        .args(["--connect", "udpin:127.0.0.1:0", "--key", "flight.key"])
        .args(["--headless", "--log", "ground.mcap"])
        .current_dir(folder.path());
    let mut station = Running::start(&mut command);
    let port = station.bound_port(Bound::Udp);
    let thrower = Thrower::at(vec![([127, 0, 0, 1], port).into()]);
    station.wait_for_line("frames refused");
    let step = wanted() / 10;
    let mut memory = Vec::new();
    for part in 1..=10 {
        while thrower.thrown() < part * step {
            std::thread::sleep(VOLLEY_TIME);
        }
        memory.push(station.memory_bytes());
    }
    let thrown = thrower.stop();
    station.signal(Signal::SIGTERM);
    let ended = station.wait();
    println!("{thrown} hostile datagrams at the ground; memory {memory:?}\n{}", ended.output);
    assert!(!ended.output.contains("phase"), "nothing was believed: {}", ended.output);
    let grown = memory[9].saturating_sub(memory[1]);
    assert!(grown < 4 << 20, "memory grows by {grown} bytes over the last eight tenths: {memory:?}");
}
