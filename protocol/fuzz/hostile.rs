//! Feeds hostile input to every decoder of `protocol`; the fuzz targets and its tests call it.
//!
//! Each function accepts any bytes and panics only if a decoder breaks a promise. It corrects
//! checksums, so that the code behind the checksum is reached as well.

use std::io::Cursor;
use std::sync::LazyLock;
use std::time::Duration;

use protocol::command::{CommandAnswer, CommandRequest, CommandSender};
use protocol::dialect::MavMessage;
use protocol::frame::{Encoder, Frame, Framer};
use protocol::ftp::download::Download;
use protocol::ftp::server::{NoFiles, Server};
use protocol::ftp::{FileRequest, Packet};
use protocol::hub::{Hub, LinkEvent, Received};
use protocol::identity::{Address, GROUND};
use protocol::link_stats::LinkStats;
use protocol::log::reader::LogReader;
use protocol::log::record::{Event, EventLevel, Record};
use protocol::log::v1::OperatorAction;
use protocol::log::writer::{LogHeader, LogWriteError, LogWriter};
use protocol::parameter::ParamRequest;
use protocol::signing::{Key, Memory, Signing};
use protocol::text::{Reassembler, printable};

/// Builds a frame from these bytes: message id (low byte, then high), source, payload. Returns
/// `None` for an id outside the dialect.
pub fn frame_of(bytes: &[u8]) -> Option<Frame> {
    let [low, high, system_id, component_id, payload @ ..] = bytes else { return None };
    let source = Address { system_id: *system_id, component_id: *component_id };
    let payload = &payload[..payload.len().min(255)];
    let payload = if payload.is_empty() { &[0][..] } else { payload };
    Encoder::new(source).encode_payload(u32::from(u16::from_le_bytes([*low, *high])), payload)
}

/// Frames a stream in pieces whose sizes come from the bytes themselves, and checks that every byte
/// is counted.
///
/// # Panics
/// A byte was not counted as framed or as garbage.
pub fn stream(data: &[u8]) {
    let mut framer = Framer::new();
    let mut framed = 0;
    let mut rest = data;
    while let Some(first) = rest.first() {
        let piece = rest.len().min(1 + usize::from(*first));
        framer.push(&rest[..piece]);
        rest = &rest[piece..];
        while let Some(frame) = framer.next_frame() {
            framed += frame.as_bytes().len();
            every_decoder(&frame);
        }
    }
    framer.on_silence();
    while let Some(frame) = framer.next_frame() {
        framed += frame.as_bytes().len();
    }
    let garbage = usize::try_from(framer.counters().garbage_bytes).unwrap_or(usize::MAX);
    assert_eq!(garbage + framed, data.len(), "some bytes are counted neither as framed nor as garbage");
}

/// Passes frames with correct checksums through every decoder. A length byte precedes each frame.
///
/// # Panics
/// A frame changes when it is framed again, or a text contains a control character.
pub fn frames(data: &[u8]) {
    let mut texts = Reassembler::default();
    let mut stats = LinkStats::default();
    let mut sender = CommandSender::new(0);
    let (mut files, mut download) = (Server::default(), Download::new(None, 0));
    let mut rest = data;
    let mut now = Duration::ZERO;
    while let [len, tail @ ..] = rest {
        let (piece, after) = tail.split_at(tail.len().min(usize::from(*len)));
        rest = after;
        now += Duration::from_millis(u64::from(*len));
        let Some(frame) = frame_of(piece) else { continue };
        if let Some(request) = FileRequest::from_frame(&frame) {
            files.take(&request, 0, len % 2 == 0, &NoFiles, now);
            files.work(&mut NoFiles);
            files.next(0, &mut NoFiles, now);
        }
        if let Some((_, answer)) = Packet::answer_in(&frame) {
            download.take(&answer, now);
            download.poll(now);
        }
        let mut framer = Framer::new();
        framer.push_datagram(frame.as_bytes());
        assert_eq!(framer.next_frame().as_ref(), Some(&frame), "a frame changed when it was framed again");
        every_decoder(&frame);
        stats.on_frame(&frame, now);
        if let Some(answer) = CommandAnswer::from_frame(&frame) {
            sender.on_answer(&answer, now);
        }
        if let Ok(MavMessage::STATUSTEXT(chunk)) = frame.decode() {
            for text in texts.push(frame.source(), &chunk, now) {
                assert!(!text.text.chars().any(char::is_control), "{:?}", text.text);
            }
        }
    }
    stats.figures(now);
    stats.sources(now);
    sender.poll(now);
}

/// Passes any input to several links; with a key, unsigned and forged frames must be rejected.
///
/// # Panics
/// A frame was accepted although it was not signed with the key.
pub fn hub(data: &[u8]) {
    let key = Signing::new(Key::new([7; Key::LEN]), Memory::default());
    let mut hubs = [Hub::new(2, None), Hub::new(2, Some(key))];
    let mut rest = data;
    let mut now = Duration::ZERO;
    while let [kind, len, tail @ ..] = rest {
        let (piece, after) = tail.split_at(tail.len().min(usize::from(*len)));
        rest = after;
        now += Duration::from_millis(u64::from(*kind));
        let link = usize::from(kind % 3);
        let stream = u64::from(kind >> 6);
        let received = match (kind >> 2) % 6 {
            0 => datagram(piece.to_vec()),
            1 => Received::Stream(stream, piece.to_vec()),
            2 => Received::Silence(stream),
            3 => Received::Gone(stream),
            // Whole frames, so that the code behind the framing is reached.
            _ => match frame_of(piece) {
                Some(frame) if kind & 1 == 0 => datagram(frame.as_bytes().to_vec()),
                Some(frame) => datagram(forged(&frame)),
                None => Received::Down(printable(piece)),
            },
        };
        for (keyed, hub) in hubs.iter_mut().enumerate() {
            for news in hub.take(link, received.clone(), now, 1_000) {
                if let (1, LinkEvent::Frame(frame) | LinkEvent::Copy(frame)) = (keyed, news) {
                    // A radio's report about itself is the only message that may be unsigned.
                    assert_eq!(frame.message_id(), 109, "a frame was accepted without a signature");
                }
            }
        }
    }
}

fn datagram(bytes: Vec<u8>) -> Received {
    Received::Datagram { from: ([127, 0, 0, 1], 1).into(), bytes }
}

/// Reads the bytes as a flight log, and then a good log in which these bytes change others: two
/// bytes of position and one of value for each change.
///
/// # Panics
/// A good log cannot be written to memory, or a log in memory cannot be read to its end.
pub fn log(data: &[u8]) {
    read_log(data);
    let mut changed = GOOD_LOG.clone();
    for change in data.as_chunks::<3>().0 {
        let [low, high, value] = *change;
        let place = usize::from(u16::from_le_bytes([low, high])) % changed.len();
        changed[place] = value;
    }
    read_log(&changed);
}

/// A log with a few records of each encoding in two chunks.
static GOOD_LOG: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let written = || -> Result<Vec<u8>, LogWriteError> {
        let mut writer = LogWriter::new(Cursor::new(Vec::new()), &LogHeader::default())?;
        for time_ns in 0..20 {
            let event =
                Event { level: EventLevel::Info, name: "hostile".to_owned(), message: "text".to_owned() };
            writer.write(&Record::Event(event), time_ns)?;
            let action = OperatorAction { time_s: 1.0, kind: "key".to_owned(), detail: "A".to_owned() };
            writer.write(&Record::OperatorAction(action), time_ns)?;
            if time_ns == 10 {
                writer.flush()?;
            }
        }
        Ok(writer.finish()?.into_inner())
    };
    written().expect("a log can be written to memory")
});

fn read_log(bytes: &[u8]) {
    let mut reader = LogReader::new(bytes);
    while reader.next_item().expect("a log can be read from memory").is_some() {}
}

/// Signs a frame with another key than the hub's.
fn forged(frame: &Frame) -> Vec<u8> {
    let mut forger = Signing::new(Key::new([8; Key::LEN]), Memory::default());
    forger.sign(frame, 0, 2_000).as_bytes().to_vec()
}

fn every_decoder(frame: &Frame) {
    // The results do not matter; the calls must return.
    let _ = frame.decode();
    let _ = frame.for_log();
    let _ = frame.without_signature();
    let _ = CommandRequest::from_frame(frame);
    let _ = CommandAnswer::from_frame(frame);
    let _ = ParamRequest::from_frame(frame);
    if let Some(request) = FileRequest::from_frame(frame) {
        Encoder::new(GROUND).encode(&request.packet.message(request.source));
    }
}
