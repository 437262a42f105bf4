//! Framing under every chunk size, garbage, cut frames and random bytes.
#![expect(clippy::unwrap_used, reason = "a test that cannot set itself up has failed")]

use protocol::dialect::{
    ATTITUDE_QUATERNION_DATA, COMMAND_LONG_DATA, HEARTBEAT_DATA, MavCmd, MavMessage, TD_PREDICTED_PATH_DATA,
};
use protocol::frame::{Encoder, Frame, Framer};
use protocol::identity::{GROUND, VEHICLE};

fn messages() -> Vec<MavMessage> {
    vec![
        MavMessage::HEARTBEAT(HEARTBEAT_DATA {
            custom_mode: 9,
            mavlink_version: 3,
            ..HEARTBEAT_DATA::default()
        }),
        MavMessage::ATTITUDE_QUATERNION(ATTITUDE_QUATERNION_DATA {
            // The two start markers, 0xFD and 0xFE, occur inside the payload.
            time_boot_ms: 0xFEFD_FDFE,
            q1: 1.0,
            ..ATTITUDE_QUATERNION_DATA::default()
        }),
        MavMessage::TD_PREDICTED_PATH(TD_PREDICTED_PATH_DATA {
            x: [-1; 12],
            altitude: [0x7DFD; 12],
            count: 12,
            ..TD_PREDICTED_PATH_DATA::default()
        }),
        MavMessage::COMMAND_LONG(COMMAND_LONG_DATA {
            command: MavCmd::MAV_CMD_COMPONENT_ARM_DISARM,
            param1: 1.0,
            param2: f32::NAN,
            ..COMMAND_LONG_DATA::default()
        }),
    ]
}

fn frames() -> Vec<Frame> {
    let mut encoder = Encoder::new(VEHICLE);
    messages().iter().map(|message| encoder.encode(message)).collect()
}

fn drain(framer: &mut Framer) -> Vec<Frame> {
    std::iter::from_fn(|| framer.next_frame()).collect()
}

#[test]
fn every_chunk_size_finds_every_frame_between_garbage() {
    let garbage = [0x00, 0xFD, 0x03, 0xFE, 0x55, 0xFD, 0xFF, 0x00];
    let expected = frames();
    let mut stream = Vec::new();
    for frame in &expected {
        stream.extend_from_slice(&garbage);
        stream.extend_from_slice(frame.as_bytes());
    }
    // A candidate that begins in the garbage may need up to one frame's length of bytes before it
    // is rejected.
    stream.extend_from_slice(&[0; 300]);
    for chunk in 1..=stream.len() {
        let mut framer = Framer::new();
        let mut found = Vec::new();
        for piece in stream.chunks(chunk) {
            framer.push(piece);
            found.extend(drain(&mut framer));
        }
        assert_eq!(found, expected, "chunks of {chunk}");
        assert_eq!(framer.counters().frames, expected.len() as u64);
    }
}

#[test]
fn what_was_encoded_is_decoded() {
    for (sequence, (frame, message)) in frames().iter().zip(messages()).enumerate() {
        assert_eq!(frame.source(), VEHICLE);
        assert_eq!(usize::from(frame.sequence()), sequence);
        // NaN does not equal itself, but its text does.
        assert_eq!(format!("{:?}", frame.decode().unwrap()), format!("{message:?}"));
    }
}

fn bytes(hex: &str) -> Vec<u8> {
    (0..hex.len()).step_by(2).map(|at| u8::from_str_radix(&hex[at..at + 2], 16).unwrap()).collect()
}

/// Frames packed by pymavlink 2.4.50 (MAVLink 2, system 1, component 1). We decode them and encode
/// the same bytes.
#[test]
fn val_pymavlink_frames_byte_for_byte() {
    let by_pymavlink = [
        // HEARTBEAT: type 9, autopilot 0, base mode 0x81, custom mode 9, status 4; sequence 0.
        "fd0900000001010000000900000009008104037893",
        // COMMAND_LONG to 1/1: 400, param1 1, param2 NaN; sequence 5.
        "fd2000000501014c00000000803f0000c07f000000000000000000000000000000000000000090010101a3f6",
        // STATUSTEXT: severity 4, "hello"; sequence 6.
        "fd060000060101fd00000468656c6c6f12bf",
    ];
    for hex in by_pymavlink {
        let mut framer = Framer::new();
        framer.push(&bytes(hex));
        let frame = framer.next_frame().unwrap();
        let message = frame.decode().unwrap();
        let mut encoder = Encoder::new(VEHICLE);
        for _ in 0..frame.sequence() {
            encoder.encode(&message);
        }
        assert_eq!(encoder.encode(&message).as_bytes(), bytes(hex), "{message:?}");
    }
}

#[test]
fn a_flipped_bit_anywhere_is_detected() {
    let frame = &frames()[1];
    let bytes = frame.as_bytes();
    for bit in 0..bytes.len() * 8 {
        let mut bad = bytes.to_vec();
        bad[bit / 8] ^= 1 << (bit % 8);
        let mut framer = Framer::new();
        framer.push(&bad);
        framer.push(&[0; 300]);
        assert!(drain(&mut framer).is_empty(), "bit {bit}");
    }
}

#[test]
fn a_frame_does_not_continue_in_the_next_datagram() {
    let frame = &frames()[0];
    let (head, tail) = frame.as_bytes().split_at(7);
    let mut framer = Framer::new();
    framer.push_datagram(head);
    assert!(framer.next_frame().is_none());
    framer.push_datagram(tail);
    assert!(framer.next_frame().is_none(), "a frame was joined from two datagrams");
    framer.push_datagram(frame.as_bytes());
    assert_eq!(framer.next_frame().as_ref(), Some(frame));
}

/// Stray bytes, among them markers of both protocol versions, and the beginnings of frames whose
/// rest is lost.
fn noises() -> Vec<Vec<u8>> {
    let cut = frames()[1].as_bytes()[..20].to_vec();
    vec![vec![0xFE], vec![0xFD], vec![0xFE, 0xFD], vec![0xFD, 0xFF, 0x00], vec![0xFD, 0xFF, 0x01, 0x00], cut]
}

#[test]
fn noise_before_a_frame_in_a_datagram_does_not_hide_it() {
    let frame = &frames()[3];
    for noise in noises() {
        let mut framer = Framer::new();
        framer.push_datagram(&[&noise, frame.as_bytes()].concat());
        assert_eq!(drain(&mut framer).last(), Some(frame), "{noise:x?}");
    }
}

#[test]
fn noise_before_a_frame_hides_it_only_until_the_line_is_silent() {
    let frame = &frames()[3];
    for noise in noises() {
        let mut framer = Framer::new();
        framer.push(&noise);
        let mut found = drain(&mut framer);
        framer.push(frame.as_bytes());
        found.extend(drain(&mut framer));
        framer.on_silence();
        found.extend(drain(&mut framer));
        assert_eq!(found.last(), Some(frame), "{noise:x?}");
    }
}

#[test]
fn an_unknown_message_id_is_counted_and_skipped() {
    let mut framer = Framer::new();
    let mut foreign = frames()[0].as_bytes().to_vec();
    foreign[7..10].copy_from_slice(&[0xEE, 0xEE, 0x0E]);
    framer.push(&foreign);
    framer.push(frames()[0].as_bytes());
    assert_eq!(drain(&mut framer).len(), 1);
    assert_eq!(framer.counters().unknown_ids, 1);
    assert_eq!(Encoder::new(GROUND).encode_payload(0x000E_EEEE, &[1]), None);
}
