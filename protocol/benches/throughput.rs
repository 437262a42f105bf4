//! Compares encoding and decoding with rust-mavlink's own typed reader and writer, on the same
//! stream in the same run.
//!
//! `cargo bench -p protocol --bench throughput`. Rounds alternate between the two, so that a
//! machine that slows down slows both; the shortest rounds are compared. "and store" is our decoder
//! with a copy of every frame's bytes, which rust-mavlink does not make.

use std::hint::black_box;
use std::io::{Read, Write as _};
use std::time::{Duration, Instant};

use mavlink::{MavHeader, MavlinkReader, write_v2_msg};
use protocol::dialect::{
    ATTITUDE_QUATERNION_DATA, HEARTBEAT_DATA, LOCAL_POSITION_NED_DATA, MavMessage, TD_CONTROLLER_DATA,
    TD_FINS_DATA, TD_FLIGHT_STATUS_DATA, TD_GIMBAL_DATA, TD_PREDICTED_PATH_DATA,
};
use protocol::frame::{Encoder, Framer};
use protocol::identity::VEHICLE;

/// Messages in the stream.
const COUNT: usize = 10_000;
const ROUNDS: usize = 201;
/// A transport reads pieces of about this size.
const PIECE: usize = 1_024;

/// The mixture of messages that the vehicle sends.
fn messages() -> Vec<MavMessage> {
    let kinds = |k: usize| {
        let time_boot_ms = 20 * k as u32;
        match k % 10 {
            0 | 5 => MavMessage::ATTITUDE_QUATERNION(ATTITUDE_QUATERNION_DATA {
                time_boot_ms,
                q1: 0.7,
                q3: 0.7,
                pitchspeed: 0.01,
                ..Default::default()
            }),
            1 | 6 => MavMessage::LOCAL_POSITION_NED(LOCAL_POSITION_NED_DATA {
                time_boot_ms,
                z: -15.0,
                vz: 5.0,
                ..Default::default()
            }),
            2 | 7 => MavMessage::TD_GIMBAL(TD_GIMBAL_DATA {
                time_boot_ms,
                pitch_measured: 12,
                ..Default::default()
            }),
            3 => MavMessage::TD_CONTROLLER(TD_CONTROLLER_DATA {
                time_boot_ms,
                iterations: 3,
                ..Default::default()
            }),
            4 => MavMessage::TD_FLIGHT_STATUS(TD_FLIGHT_STATUS_DATA { time_boot_ms, ..Default::default() }),
            8 if k % 20 == 8 => {
                MavMessage::HEARTBEAT(HEARTBEAT_DATA { custom_mode: 9, ..Default::default() })
            }
            8 => {
                MavMessage::TD_FINS(TD_FINS_DATA { time_boot_ms, measured: [9_000; 4], ..Default::default() })
            }
            _ => MavMessage::TD_PREDICTED_PATH(TD_PREDICTED_PATH_DATA {
                altitude: [1_500; 12],
                count: 12,
                ..Default::default()
            }),
        }
    };
    (0..COUNT).map(kinds).collect()
}

fn stream_of(messages: &[MavMessage]) -> Vec<u8> {
    let mut encoder = Encoder::new(VEHICLE);
    messages.iter().flat_map(|message| encoder.encode(message).as_bytes().to_vec()).collect()
}

fn decode_ours(stream: &[u8]) -> usize {
    let mut framer = Framer::new();
    let mut count = 0;
    for piece in stream.chunks(PIECE) {
        framer.push(piece);
        while let Some(frame) = framer.next_view() {
            if let Ok(message) = frame.decode() {
                black_box(&message);
                count += 1;
            }
        }
    }
    count
}

/// Keeps every frame, as vehicle and ground do for their logs.
fn decode_and_store_ours(stream: &[u8]) -> usize {
    let mut framer = Framer::new();
    let mut count = 0;
    for piece in stream.chunks(PIECE) {
        framer.push(piece);
        while let Some(frame) = framer.next_frame() {
            if let Ok(message) = frame.decode() {
                black_box(&message);
                count += 1;
            }
        }
    }
    count
}

/// Gives the same pieces to a reader that asks for them.
struct Pieces<'a>(&'a [u8]);

impl Read for Pieces<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let len = self.0.len().min(buffer.len()).min(PIECE);
        let (piece, rest) = self.0.split_at(len);
        buffer[..len].copy_from_slice(piece);
        self.0 = rest;
        Ok(len)
    }
}

fn decode_theirs(stream: &[u8]) -> usize {
    let mut reader = MavlinkReader::new(Pieces(stream));
    let mut count = 0;
    while let Ok((_, message)) = reader.read_any_message::<MavMessage>() {
        black_box(&message);
        count += 1;
    }
    count
}

fn encode_ours(messages: &[MavMessage]) -> usize {
    let mut encoder = Encoder::new(VEHICLE);
    messages.iter().map(|message| black_box(encoder.encode(message)).as_bytes().len()).sum()
}

fn encode_theirs(messages: &[MavMessage]) -> usize {
    let mut header = MavHeader { system_id: 1, component_id: 1, sequence: 0 };
    let mut frame = Vec::with_capacity(280);
    let mut sum = 0;
    for message in messages {
        frame.clear();
        // Writing to memory does not fail.
        let _ = write_v2_msg(&mut frame, header, message);
        header.sequence = header.sequence.wrapping_add(1);
        sum += black_box(&frame).len();
    }
    sum
}

#[expect(clippy::disallowed_methods, reason = "a benchmark measures time")]
fn timed(work: &mut dyn FnMut() -> usize) -> Duration {
    let began = Instant::now();
    black_box(work());
    began.elapsed()
}

fn compare(
    name: &str,
    ours: &mut dyn FnMut() -> usize,
    theirs: &mut dyn FnMut() -> usize,
) -> std::io::Result<()> {
    assert_eq!(ours(), theirs(), "{name}: both do the same work");
    // The shortest round is the best measure, because other load on the machine can only add time.
    let mut shortest = [Duration::MAX; 2];
    for _ in 0..ROUNDS {
        shortest[0] = shortest[0].min(timed(ours));
        shortest[1] = shortest[1].min(timed(theirs));
    }
    let [ours_s, theirs_s] = shortest.map(|time| time.as_secs_f64());
    let rate = |time_s: f64| COUNT as f64 / time_s / 1e6;
    writeln!(
        std::io::stdout(),
        "{name:<8} ours {:6.2} million messages/s, rust-mavlink {:6.2}, ratio {:.2}",
        rate(ours_s),
        rate(theirs_s),
        theirs_s / ours_s
    )
}

fn main() -> std::io::Result<()> {
    let messages = messages();
    let stream = stream_of(&messages);
    writeln!(std::io::stdout(), "{COUNT} messages, {} bytes, shortest of {ROUNDS} rounds", stream.len())?;
    compare("decode", &mut || decode_ours(&stream), &mut || decode_theirs(&stream))?;
    compare("and store", &mut || decode_and_store_ours(&stream), &mut || decode_theirs(&stream))?;
    compare("encode", &mut || encode_ours(&messages), &mut || encode_theirs(&messages))
}
