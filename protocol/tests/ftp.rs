//! A file over a line that loses, doubles and reorders, on a simulated clock.
#![expect(clippy::unwrap_used, reason = "a test that cannot set itself up has failed")]

use std::collections::BTreeMap;
use std::time::Duration;

use proptest::prelude::*;
use protocol::dialect::MavMessage;
use protocol::frame::{Encoder, Frame, Framer};
use protocol::ftp::download::{Download, DownloadEvent, Failure};
use protocol::ftp::server::{InMemory, Server};
use protocol::ftp::{DATA_LEN, FileRequest, Packet, crc};
use protocol::identity::{GROUND, VEHICLE};

/// A generator for tests: xorshift.
struct Chance(u64);

impl Chance {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    fn happens(&mut self, probability: f64) -> bool {
        (self.next() >> 11) as f64 / ((1_u64 << 53) as f64) < probability
    }
}

#[derive(Clone, Copy)]
struct LineSettings {
    bytes_s: f64,
    latency_s: f64,
    loss: f64,
    double: f64,
    /// Probability of being late by up to this many seconds.
    late: (f64, f64),
}

/// One direction of a line: a frame takes its time, then its latency.
struct Line {
    settings: LineSettings,
    free_at_s: f64,
    bytes: usize,
    /// By time of arrival and number.
    under_way: BTreeMap<(u64, u64), Vec<u8>>,
    number: u64,
    framer: Framer,
}

impl Line {
    fn new(settings: LineSettings) -> Self {
        Self {
            settings,
            free_at_s: 0.0,
            bytes: 0,
            under_way: BTreeMap::new(),
            number: 0,
            framer: Framer::new(),
        }
    }

    fn send(&mut self, frame: &Frame, now_s: f64, chance: &mut Chance) {
        let LineSettings { bytes_s, latency_s, loss, double, late } = self.settings;
        let bytes = frame.as_bytes();
        self.bytes += bytes.len();
        self.free_at_s = self.free_at_s.max(now_s) + bytes.len() as f64 / bytes_s;
        for _ in 0..=usize::from(chance.happens(double)) {
            if chance.happens(loss) {
                continue;
            }
            let late_s =
                if chance.happens(late.0) { late.1 * (chance.next() % 100) as f64 / 100.0 } else { 0.0 };
            let at_us = (1e6 * (self.free_at_s + latency_s + late_s)) as u64;
            self.number += 1;
            self.under_way.insert((at_us, self.number), bytes.to_vec());
        }
    }

    fn arrived(&mut self, now_s: f64) -> Vec<Frame> {
        let mut frames = Vec::new();
        while let Some(first) = self.under_way.first_entry()
            && first.key().0 as f64 <= 1e6 * now_s
        {
            self.framer.push(&first.remove());
            while let Some(frame) = self.framer.next_frame() {
                frames.push(frame);
            }
        }
        frames
    }
}

/// The vehicle with its file, the line, and what is on the ground's disk.
struct World {
    now_s: f64,
    chance: Chance,
    server: Server,
    files: InMemory,
    /// What is in the only file.
    file: Vec<u8>,
    down: Line,
    up: Line,
    encoders: (Encoder, Encoder),
    /// With the checksum of the file that it is to become.
    written: (u32, Vec<u8>),
    begun_fresh: u32,
    open: bool,
}

const STEP_S: f64 = 0.005;

impl World {
    fn new(len: usize, settings: LineSettings, seed: u64) -> Self {
        let mut chance = Chance(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1);
        let file: Vec<u8> = (0..len).map(|_| chance.next() as u8).collect();
        Self {
            now_s: 0.0,
            chance,
            server: Server::default(),
            files: InMemory::new([("flight.mcap", file.clone())]),
            file,
            down: Line::new(settings),
            up: Line::new(settings),
            encoders: (Encoder::new(VEHICLE), Encoder::new(GROUND)),
            written: (0, Vec::new()),
            begun_fresh: 0,
            open: true,
        }
    }

    fn now(&self) -> Duration {
        Duration::from_secs_f64(self.now_s)
    }

    fn step(&mut self, download: Option<&mut Download>) {
        self.now_s += STEP_S;
        let now = self.now();
        for frame in self.up.arrived(self.now_s) {
            let request = FileRequest::from_frame(&frame).unwrap();
            self.server.take(&request, 0, self.open, &self.files, now);
        }
        self.server.work(&mut self.files);
        while self.down.free_at_s < self.now_s + STEP_S
            && let Some(message) = self.server.next(0, &mut self.files, now)
        {
            let frame = self.encoders.0.encode(&message);
            self.down.send(&frame, self.now_s, &mut self.chance);
        }
        let heard = self.down.arrived(self.now_s);
        let Some(download) = download else { return };
        for frame in heard {
            let (target, packet) = Packet::answer_in(&frame).unwrap();
            assert_eq!(target, GROUND);
            match download.take(&packet, now) {
                Some(DownloadEvent::Opened { crc }) => {
                    if self.written.0 != crc {
                        self.begun_fresh += 1;
                        self.written = (crc, Vec::new());
                    }
                    download.resume(self.written.1.len() as u32);
                }
                Some(DownloadEvent::Data(data)) => self.written.1.extend(data),
                None => {}
            }
        }
        for packet in download.poll(now) {
            let frame = self.encoders.1.encode(&packet.message(VEHICLE));
            self.up.send(&frame, self.now_s, &mut self.chance);
        }
    }

    fn is_complete(&self) -> bool {
        self.written == (crc::continued(0, &self.file), self.file.clone())
    }

    fn run(&mut self, download: &mut Download, most_s: f64) -> Option<Result<(), Failure>> {
        let end_s = self.now_s + most_s;
        while self.now_s < end_s && download.ended().is_none() {
            self.step(Some(download));
        }
        download.ended()
    }
}

const RADIO: LineSettings =
    LineSettings { bytes_s: 5760.0, latency_s: 0.05, loss: 0.3, double: 0.0, late: (0.0, 0.0) };

/// Ten megabytes over 57,600 baud with 30 % loss both ways; the ground's process is killed five
/// times, and begins again with what is on disk.
#[test]
fn ten_megabytes_arrive_intact_over_a_bad_line_with_the_ground_killed_five_times() {
    const LEN: usize = 10_000_000;
    let mut world = World::new(LEN, RADIO, 1);
    for life in 0_u16..=5 {
        let mut download = Download::new(Some("flight.mcap"), 1000 * life);
        if life == 5 {
            assert_eq!(world.run(&mut download, 10_000.0), Some(Ok(())));
            break;
        }
        assert_eq!(world.run(&mut download, 400.0 + 10.0 * f64::from(life)), None);
        for _ in 0..400 {
            world.step(None);
        }
    }
    assert!(world.is_complete(), "the file is another");
    assert_eq!(world.begun_fresh, 1, "it began at zero more than once");
    // What the line can carry of files: whole frames, of which 30 % are lost.
    let carried_bytes =
        world.now_s * RADIO.bytes_s * (1.0 - RADIO.loss) * DATA_LEN as f64 / (DATA_LEN + 27) as f64;
    let share = LEN as f64 / carried_bytes;
    println!("{LEN} bytes in {:.0} s: {:.1} % of what the line can carry", world.now_s, 100.0 * share);
    println!("of all bytes that arrive, {:.1} %", 100.0 * LEN as f64 / (world.now_s * RADIO.bytes_s * 0.7));
    assert!(share >= 0.8, "{share}");
}

#[test]
fn a_slow_line_and_a_quick_one_are_filled_as_well() {
    for (bytes_s, latency_s, len) in [
        (2000.0, 0.25, 300_000),
        (5760.0, 0.05, 1_000_000),
        (5760.0, 0.3, 600_000),
        (100_000.0, 0.01, 4_000_000),
    ] {
        for loss in [0.0, 0.1, 0.3] {
            let settings = LineSettings { bytes_s, latency_s, loss, ..RADIO };
            let mut world = World::new(len, settings, 7);
            let mut download = Download::new(None, 0);
            assert_eq!(world.run(&mut download, 10_000.0), Some(Ok(())));
            assert!(world.is_complete());
            let share = len as f64 / (world.now_s * bytes_s * (1.0 - loss)) * 266.0 / 239.0;
            println!("{bytes_s} B/s, latency {latency_s} s, loss {loss}: {:.1} %", 100.0 * share);
            assert!(share >= 0.8, "{bytes_s} B/s, latency {latency_s} s, loss {loss}: {share}");
        }
    }
}

#[test]
fn a_dead_line_times_out_and_a_refusal_is_reported() {
    let mut world = World::new(1000, LineSettings { loss: 1.0, ..RADIO }, 3);
    let mut download = Download::new(None, 0);
    assert_eq!(world.run(&mut download, 100.0), Some(Err(Failure::NoAnswer)));
    let mut world = World { open: false, ..World::new(1000, RADIO, 3) };
    let mut download = Download::new(None, 0);
    assert_eq!(world.run(&mut download, 100.0), Some(Err(Failure::NotNow)));
    let mut world = World::new(1000, RADIO, 3);
    let mut download = Download::new(Some("other.mcap"), 0);
    assert_eq!(world.run(&mut download, 100.0), Some(Err(Failure::NoSuchFile)));
}

#[test]
fn a_vehicle_that_arms_during_the_download_ends_it() {
    let mut world = World::new(1_000_000, RADIO, 4);
    let mut download = Download::new(None, 0);
    assert_eq!(world.run(&mut download, 20.0), None);
    world.open = false;
    world.server.close_all();
    let ended = world.run(&mut download, 60.0);
    assert_eq!(ended, Some(Err(Failure::NotNow)));
}

#[test]
fn the_stored_part_of_another_file_is_discarded() {
    let settings = LineSettings { loss: 0.0, ..RADIO };
    let mut world = World::new(50_000, settings, 5);
    world.written = (1, vec![0; 10_000]);
    let mut download = Download::new(None, 0);
    assert_eq!(world.run(&mut download, 100.0), Some(Ok(())));
    assert!(world.is_complete());
    assert_eq!(world.begun_fresh, 1);
}

#[test]
fn a_session_that_the_vehicle_has_closed_is_opened_again() {
    let mut world = World::new(200_000, RADIO, 6);
    let mut download = Download::new(None, 0);
    world.run(&mut download, 20.0);
    world.server.close_all();
    assert_eq!(world.run(&mut download, 1000.0), Some(Ok(())));
    assert!(world.is_complete());
    assert_eq!(world.begun_fresh, 1);
}

#[test]
fn a_log_stores_every_frame_without_file_content() {
    let request = Packet { size: 239, ..Packet::request(1, 2, protocol::ftp::Opcode::READ_FILE, 239, "") };
    let frame = Encoder::new(VEHICLE).encode(&request.ack(&[0xAB; 239]).message(GROUND));
    let mut framer = Framer::new();
    framer.push(&frame.for_log().unwrap());
    let logged = framer.next_frame().unwrap();
    assert_eq!((logged.sequence(), logged.message_id(), logged.source()), (frame.sequence(), 110, VEHICLE));
    assert!(matches!(logged.decode(), Ok(MavMessage::FILE_TRANSFER_PROTOCOL(_))));
    assert!(logged.as_bytes().len() < 30 && !logged.as_bytes().contains(&0xAB));
    // A request and a list are logged as they are.
    let frame = Encoder::new(GROUND).encode(&request.message(VEHICLE));
    assert_eq!(frame.for_log().unwrap(), frame.as_bytes());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Whatever the line does, the file arrives whole.
    #[test]
    fn any_line_that_carries_something_carries_the_file(
        (seed, len) in (any::<u64>(), 1_usize..40_000),
        (loss, double, late) in (0.0..0.5_f64, 0.0..0.3_f64, 0.0..0.3_f64),
        (late_s, latency_s) in (0.0..1.0_f64, 0.0..0.5_f64),
        bytes_s in 1000.0..50_000.0_f64,
        kills in proptest::collection::vec(0.1..8.0_f64, 0..4),
    ) {
        let settings = LineSettings { bytes_s, latency_s, loss, double, late: (late, late_s) };
        let mut world = World::new(len, settings, seed);
        for (life, kill_s) in kills.iter().enumerate() {
            let mut download = Download::new(None, (seed >> life) as u16);
            world.run(&mut download, *kill_s);
        }
        let mut download = Download::new(None, seed as u16);
        prop_assert_eq!(world.run(&mut download, 2000.0), Some(Ok(())));
        prop_assert!(world.is_complete());
    }
}
