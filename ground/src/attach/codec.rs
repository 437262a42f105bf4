//! Encodes messages to bytes and back.
//!
//! ```text
//! u32 length of what follows | u32 version | payload (`postcard`)
//! ```
//!
//! Programs of any two versions can say which one is older. Numbers of the head are little-endian.

use std::time::Duration;

use serde::{Deserialize, Serialize};
use tokio::io::AsyncRead;
use tokio_util::codec::{FramedRead, LengthDelimitedCodec};

use super::{OPERATOR_MAX, ToScreen, ToStation, VERSION};
use crate::model::{NOTE_MAX, Request, words::printable};
use crate::update::Msg;

/// The longest accepted message, bytes.
const LENGTH_MAX: usize = 64 * 1024;
/// The longest word and key that ends it, in characters.
const KEY_MAX: usize = NOTE_MAX + 12;
/// Bytes of the length that stands before every message, and of the version after it.
const PREFIX_LEN: usize = 4;

/// The bytes are no valid message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum CodecError {
    #[error("the other end has version {0}, this program has {VERSION}; update the older one")]
    Version(u32),
    #[error("unexpected bytes on the socket: {0}")]
    Bytes(&'static str),
}

/// Encodes a message to a screen. `None` for messages that stay in the station (its local keys, its
/// end) and for messages that are too long.
pub fn encode_to_screen(to_screen: &ToScreen, now: Duration) -> Option<Vec<u8>> {
    // The station answers these by its actions.
    let is_answered = matches!(
        to_screen,
        ToScreen::Msg(Msg::Requested { request: Request::Report | Request::Sign { .. }, .. })
    );
    if is_answered { None } else { message(&(to_screen, now)) }
}

/// Decodes a message to a screen, and its time.
///
/// # Errors
/// The bytes are not what a station of this version sends.
pub fn decode_to_screen(bytes: &[u8]) -> Result<(ToScreen, Duration), CodecError> {
    payload(bytes)
}

/// Encodes a message to a station.
pub fn encode_to_station(request: &ToStation) -> Vec<u8> {
    message(request).unwrap_or_default()
}

/// Decodes a message to a station.
///
/// # Errors
/// The bytes are not what a screen of this version sends.
pub fn decode_to_station(bytes: &[u8]) -> Result<ToStation, CodecError> {
    let mut request = payload(bytes)?;
    match &mut request {
        ToStation::Hello { operator: text, .. } | ToStation::Stop { operator: text, .. } => {
            *text = printable(text, OPERATOR_MAX);
        }
        ToStation::Key(name) => *name = printable(name, KEY_MAX),
        ToStation::Request(Request::Note(text)) => *text = printable(text, NOTE_MAX),
        ToStation::Status | ToStation::Request(_) | ToStation::Here(_) => {}
    }
    Ok(request)
}

/// The messages of a connection, each without its length. The connection ends with one that is too
/// long.
pub fn messages<R: AsyncRead>(read: R) -> FramedRead<R, LengthDelimitedCodec> {
    LengthDelimitedCodec::builder().little_endian().max_frame_length(LENGTH_MAX).new_read(read)
}

/// The messages of a block, each without its length.
pub(crate) fn split(mut block: &[u8]) -> impl Iterator<Item = &[u8]> {
    std::iter::from_fn(move || {
        let (prefix, rest) = block.split_first_chunk()?;
        let (message, after) = rest.split_at_checked(u32::from_le_bytes(*prefix) as usize)?;
        block = after;
        Some(message)
    })
}

fn message(payload: &impl Serialize) -> Option<Vec<u8>> {
    let head = [[0; PREFIX_LEN], VERSION.to_le_bytes()].concat();
    let mut bytes = postcard::to_extend(payload, head).ok()?;
    let length = bytes.len() - PREFIX_LEN;
    bytes[..PREFIX_LEN].copy_from_slice(&u32::try_from(length).ok()?.to_le_bytes());
    (length <= LENGTH_MAX).then_some(bytes)
}

fn payload<'a, T: Deserialize<'a>>(bytes: &'a [u8]) -> Result<T, CodecError> {
    let (version, rest) = bytes.split_first_chunk().ok_or(CodecError::Bytes("too short"))?;
    match u32::from_le_bytes(*version) {
        VERSION => {}
        other => return Err(CodecError::Version(other)),
    }
    match postcard::take_from_bytes(rest) {
        Ok((value, [])) => Ok(value),
        Ok(_) => Err(CodecError::Bytes("too long")),
        Err(_) => Err(CodecError::Bytes("no message of this version")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::collection::vec;
    use proptest::prelude::*;
    use protocol::book::{Head, SignedHead};
    use protocol::dialect::{HEARTBEAT_DATA, MavMessage};
    use protocol::frame::{Encoder, FramerCounters};
    use protocol::identity::{Address, VEHICLE};
    use protocol::link_stats::{LinkFigures, SourceFigures};
    use protocol::mission::MissionHash;
    use protocol::signing::SigningCounters;

    use crate::attach::{Hello, StationStatus};
    use crate::key::Key;
    use crate::model::{
        AlarmKind, ChecklistEntry, CommandKind, Degrees, KeyOwner, LinkReport, LogHealth, LogSpace, Mark,
        Request, Seat, Settings, Signature, Silence, parse_checklist,
    };

    fn back(message: &ToScreen, now: Duration) -> (ToScreen, Duration) {
        let bytes = encode_to_screen(message, now).unwrap();
        let (prefix, rest) = bytes.split_first_chunk().unwrap();
        assert_eq!(u32::from_le_bytes(*prefix) as usize, rest.len());
        decode_to_screen(rest).unwrap()
    }

    fn link() -> LinkReport {
        let figures = LinkFigures { rx_bytes_s: 1.5, ..LinkFigures::default() };
        let source = Address { system_id: 1, component_id: 2 };
        LinkReport {
            name: "x".repeat(4_000),
            figures,
            sources: vec![SourceFigures {
                source,
                age: Duration::from_nanos(3),
                rx_frames_s: -0.0,
                loss: 0.5,
            }],
            capacity_bytes_s: Some(4),
            copies: u64::MAX,
            trouble: Some("ü".to_owned()),
        }
    }

    /// One of every kind whose fields are encoded in a way of their own, and some others.
    fn messages() -> Vec<ToScreen> {
        let mut list = parse_checklist(include_str!("../../checklist-example.toml")).unwrap();
        let signature = Signature { by: "Ann".to_owned(), unix_s: 7, found: Some(1.5), role: None };
        list.apply(&ChecklistEntry::Marked { step: 0, mark: Mark::Signed(signature.clone()) });
        list.apply(&ChecklistEntry::Marked { step: 1, mark: Mark::Voided(signature) });
        let seat = Seat::new(3, "anna on pts/3");
        let head = SignedHead { head: Head { book: 7, entries: 8, hash: [9; 32] }, signature: [0; 64] };
        let beat = MavMessage::HEARTBEAT(HEARTBEAT_DATA { custom_mode: 5, ..HEARTBEAT_DATA::default() });
        let space = Some(LogSpace { free_bytes: u64::MAX, grows_bytes_s: 2 });
        let station = Settings {
            key_owner: Some(KeyOwner { number: 2, name: "Bob".to_owned() }),
            mission: Some(MissionHash([1, 2, 3, 4, 5, 6, 7, 8])),
            here: Some(Degrees { latitude: 1.5, longitude: -2.5 }),
            interactive: false,
            ..Settings::on_screen("a")
        };
        let msgs = [
            Msg::Frame(Encoder::new(VEHICLE).encode(&beat)),
            Msg::Checklist(Box::new(list)),
            Msg::Book { head, is_signed: true },
            Msg::Report(Err("disk full".to_owned())),
            Msg::Here(Ok(Degrees { latitude: 35.347, longitude: -117.809 })),
            Msg::Here(Err("no fix".to_owned())),
            Msg::Links {
                links: vec![link()],
                signing: Some(SigningCounters { wrong: 3, ..Default::default() }),
            },
            Msg::Received { bytes: 7, framing: FramerCounters { crc_errors: 8, ..Default::default() } },
            Msg::Log(LogHealth { dropped: 1, failed: true, removed: false, space }),
            Msg::Crew { seats: vec![seat.clone()], silent: vec![(Seat::default(), Silence::TooSmall)] },
            Msg::Requested {
                request: Request::Acknowledge(AlarmKind::Refused(CommandKind::Abort)),
                by: seat,
            },
            Msg::Tick,
        ];
        let status = StationStatus { pid: 7, phase: "PAD_ARMED".to_owned(), ..StationStatus::default() };
        let others = [
            ToScreen::Hello(Box::new(Hello { screen: 3, station })),
            ToScreen::Live,
            ToScreen::Status(status),
            ToScreen::Stopping { stops: false, words: "armed".to_owned() },
        ];
        msgs.map(ToScreen::Msg).into_iter().chain(others).collect()
    }

    #[test]
    fn messages_to_a_screen_survive_the_round_trip() {
        for message in messages() {
            assert_eq!(back(&message, Duration::new(5, 6)), (message, Duration::new(5, 6)));
        }
    }

    /// A screen must be able to name the program to update.
    #[test]
    fn a_message_of_another_version_names_it() {
        let mut bytes = encode_to_station(&ToStation::Status);
        bytes[PREFIX_LEN] += 1;
        assert_eq!(decode_to_station(&bytes[PREFIX_LEN..]), Err(CodecError::Version(VERSION + 1)));
    }

    #[test]
    fn local_keys_and_requests_answered_by_an_action_are_not_sent() {
        let requested = |request| Msg::Requested { request, by: Seat::default() };
        for msg in [
            Msg::Keys(vec![Key::Enter]),
            requested(Request::Report),
            requested(Request::Sign { step: 1, void: false }),
        ] {
            assert_eq!(encode_to_screen(&ToScreen::Msg(msg), Duration::ZERO), None);
        }
    }

    /// A screen disconnects on a message that is too long, so none is sent. No memory is taken for
    /// what is not there.
    #[test]
    fn a_message_that_is_too_long_is_not_sent_and_a_wrong_count_ends_with_the_bytes() {
        let links = |count| ToScreen::Msg(Msg::Links { links: vec![link(); count], signing: None });
        assert!(encode_to_screen(&links(15), Duration::ZERO).is_some());
        assert_eq!(encode_to_screen(&links(17), Duration::ZERO), None);
        let empty = Msg::Crew { seats: Vec::new(), silent: Vec::new() };
        let mut bytes = encode_to_screen(&ToScreen::Msg(empty), Duration::ZERO).unwrap();
        bytes.truncate(bytes.len() - 3);
        bytes.extend([0xFF; 9]);
        bytes.push(1);
        assert!(decode_to_screen(&bytes[PREFIX_LEN..]).is_err());
    }

    #[test]
    fn messages_to_a_station_survive_the_round_trip() {
        let requests = [
            ToStation::Hello { watch: true, operator: "anna on pts/3".to_owned() },
            ToStation::Status,
            ToStation::Stop { force: true, operator: "anna".to_owned() },
            ToStation::Request(Request::Command(CommandKind::Arm)),
            ToStation::Request(Request::Choose(4_242)),
            ToStation::Request(Request::Sign { step: 7, void: true }),
            ToStation::Key("Ctrl-X".to_owned()),
            ToStation::Here(Ok(())),
            ToStation::Here(Err(Silence::TmuxCopyMode)),
        ];
        for request in requests {
            assert_eq!(decode_to_station(&encode_to_station(&request)[PREFIX_LEN..]), Ok(request));
        }
    }

    proptest! {
        #[test]
        fn no_bytes_cause_a_panic(
            bytes in vec(any::<u8>(), 0..80),
            place in any::<prop::sample::Index>(),
            byte in any::<u8>(),
        ) {
            let _ = decode_to_screen(&bytes);
            let aimed = [&VERSION.to_le_bytes()[..], &bytes].concat();
            let _ = decode_to_screen(&aimed);
            let _ = decode_to_station(&aimed);
            for message in messages() {
                let mut changed = encode_to_screen(&message, Duration::ZERO).unwrap().split_off(PREFIX_LEN);
                let place = place.index(changed.len());
                changed[place] = byte;
                let _ = decode_to_screen(&changed);
            }
        }
    }
}
