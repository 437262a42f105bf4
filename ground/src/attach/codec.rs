//! Encodes messages to bytes and back.
//!
//! ```text
//! u32 length of what follows | u8 kind | u64 nanoseconds since the station's start | payload
//! ```
//!
//! The payload is `postcard`. That of a greeting has its version before it, so that programs of any two versions can say
//! which one is older. Numbers of the head are little-endian.

use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::{Hello, OPERATOR_MAX, ToScreen, ToStation, VERSION};
use crate::model::Request;
use crate::update::Msg;

/// The longest accepted message, bytes.
const LENGTH_MAX: usize = 64 * 1024;
/// The longest name of a key, in characters.
const KEY_MAX: usize = 8;
/// Bytes of the length that stands before every message.
const PREFIX_LEN: usize = 4;
/// Bytes of kind and time.
const HEAD_LEN: usize = 9;
/// The kinds of messages.
const GREETING: u8 = 0;
const OTHER: u8 = 1;

/// The bytes are no valid message.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("unexpected bytes on the socket: {0}")]
pub struct CodecError(&'static str);

/// Encodes a message to a screen. `None` for messages that stay in the station (its own keys, its own end) and for
/// messages that are too long.
pub fn encode_to_screen(told: &ToScreen, now: Duration) -> Option<Vec<u8>> {
    match told {
        ToScreen::Hello(hello) => message(Some(hello.version), &**hello, now),
        // The station answers these by what it does.
        ToScreen::Msg(Msg::Asked { request: Request::Report | Request::Sign { .. }, .. }) => None,
        told => message(None, told, now),
    }
}

/// Decodes a message to a screen, and its time. If the station has another version, only that is decoded.
///
/// # Errors
/// The bytes are not what a station sends.
pub fn decode_to_screen(bytes: &[u8]) -> Result<(ToScreen, Duration), CodecError> {
    let (version, now, rest) = open(bytes)?;
    let told = match version {
        None => payload(rest)?,
        Some(VERSION) => ToScreen::Hello(Box::new(Hello { version: VERSION, ..payload(rest)? })),
        Some(version) => ToScreen::Hello(Box::new(Hello { version, ..Hello::default() })),
    };
    Ok((told, now))
}

/// Encodes a message to a station.
pub fn encode_to_station(asked: &ToStation) -> Vec<u8> {
    let version = matches!(asked, ToStation::Hello { .. }).then_some(VERSION);
    message(version, asked, Duration::ZERO).unwrap_or_default()
}

/// Decodes a message to a station.
///
/// # Errors
/// The bytes are not what a screen sends.
pub fn decode_to_station(bytes: &[u8]) -> Result<ToStation, CodecError> {
    let (version, _, rest) = open(bytes)?;
    if version.is_some_and(|version| version != VERSION) {
        return Err(CodecError("the screen is of another version"));
    }
    Ok(match payload(rest)? {
        ToStation::Hello { watch, operator } if version.is_some() => {
            ToStation::Hello { watch, operator: words(&operator, OPERATOR_MAX) }
        }
        ToStation::Hello { .. } => return Err(CodecError("a greeting without a version")),
        ToStation::Stop { force, operator } => {
            ToStation::Stop { force, operator: words(&operator, OPERATOR_MAX) }
        }
        ToStation::Key(name) => ToStation::Key(words(&name, KEY_MAX)),
        asked => asked,
    })
}

/// The length of a message, from its four bytes.
///
/// # Errors
/// No valid message has this length.
pub fn length(prefix: [u8; PREFIX_LEN]) -> Result<usize, CodecError> {
    let length = usize::try_from(u32::from_le_bytes(prefix)).unwrap_or(usize::MAX);
    if (HEAD_LEN..=LENGTH_MAX).contains(&length) { Ok(length) } else { Err(CodecError("a wrong length")) }
}

/// A whole message; with a version it is a greeting.
fn message(version: Option<u32>, payload: &impl Serialize, now: Duration) -> Option<Vec<u8>> {
    let mut bytes = vec![0; PREFIX_LEN];
    bytes.push(if version.is_some() { GREETING } else { OTHER });
    bytes.extend(u64::try_from(now.as_nanos()).unwrap_or(u64::MAX).to_le_bytes());
    bytes.extend(version.map(u32::to_le_bytes).into_iter().flatten());
    let mut bytes = postcard::to_extend(payload, bytes).ok()?;
    let length = bytes.len() - PREFIX_LEN;
    bytes[..PREFIX_LEN].copy_from_slice(&u32::try_from(length).ok()?.to_le_bytes());
    (length <= LENGTH_MAX).then_some(bytes)
}

/// The version of a greeting, the time, and the payload.
fn open(bytes: &[u8]) -> Result<(Option<u32>, Duration, &[u8]), CodecError> {
    const SHORT: CodecError = CodecError("too short");
    let (kind, rest) = bytes.split_first().ok_or(SHORT)?;
    let (now, rest) = rest.split_first_chunk().ok_or(SHORT)?;
    let now = Duration::from_nanos(u64::from_le_bytes(*now));
    match *kind {
        GREETING => {
            let (version, rest) = rest.split_first_chunk().ok_or(SHORT)?;
            Ok((Some(u32::from_le_bytes(*version)), now, rest))
        }
        OTHER => Ok((None, now, rest)),
        _ => Err(CodecError("an unknown kind of message")),
    }
}

fn payload<'a, T: Deserialize<'a>>(bytes: &'a [u8]) -> Result<T, CodecError> {
    match postcard::take_from_bytes(bytes) {
        Ok((value, [])) => Ok(value),
        Ok(_) => Err(CodecError("too long")),
        Err(_) => Err(CodecError("no message of this version")),
    }
}

/// A text from another process, made printable and shortened to this many characters.
fn words(text: &str, characters: usize) -> String {
    protocol::text::printable(text.as_bytes()).chars().take(characters).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::collection::vec;
    use proptest::option;
    use proptest::prelude::*;
    use protocol::book::{Head, SignedHead};
    use protocol::dialect::{HEARTBEAT_DATA, MavMessage};
    use protocol::frame::Encoder;
    use protocol::frame::FramerCounters;
    use protocol::identity::{Address, VEHICLE};
    use protocol::link_stats::{LinkFigures, SourceFigures};
    use protocol::mission::MissionHash;
    use protocol::signing::SigningCounters;

    use crate::attach::StationStatus;
    use crate::model::{
        AlarmKind, CommandKind, KeyOwner, LinkReport, LogHealth, LogSpace, Request, Seat, Settings,
    };

    // Every message decodes to what was encoded, and no bytes cause a panic.

    fn back(told: &ToScreen, now: Duration) -> (ToScreen, Duration) {
        let bytes = encode_to_screen(told, now).unwrap();
        let (prefix, rest) = bytes.split_first_chunk().unwrap();
        assert_eq!(length(*prefix).unwrap(), rest.len());
        decode_to_screen(rest).unwrap()
    }

    #[test]
    fn greeting_end_of_history_status_and_stopping_survive_the_round_trip() {
        let hello = ToScreen::Hello(Box::new(Hello {
            version: VERSION,
            screen: 3,
            station: Settings {
                key_owner: Some(KeyOwner { number: 2, name: "Bob".to_owned() }),
                mission: Some(MissionHash([1, 2, 3, 4, 5, 6, 7, 8])),
                interactive: false,
                ..Settings::on_screen("a")
            },
        }));
        assert_eq!(back(&hello, Duration::ZERO).0, hello);
        assert_eq!(back(&ToScreen::Live, Duration::ZERO).0, ToScreen::Live);
        let status = StationStatus {
            pid: 7,
            at_risk: true,
            phase: "PAD_ARMED".to_owned(),
            ..StationStatus::default()
        };
        assert_eq!(back(&ToScreen::Status(status.clone()), Duration::ZERO).0, ToScreen::Status(status));
        let stopping = ToScreen::Stopping { stops: false, words: "armed".to_owned() };
        assert_eq!(back(&stopping, Duration::ZERO).0, stopping);
    }

    #[test]
    fn a_report_survives_the_round_trip() {
        for written in [Ok("flight.html".to_owned()), Err("disk full".to_owned())] {
            let told = ToScreen::Msg(Msg::Report(written));
            assert_eq!(back(&told, Duration::ZERO).0, told);
        }
    }

    #[test]
    fn the_end_of_the_book_survives_the_round_trip_without_its_signature() {
        let head = SignedHead { head: Head { book: 7, entries: 8, hash: [9; 32] }, signature: [0; 64] };
        let told = ToScreen::Msg(Msg::Book { head, is_signed: true });
        assert_eq!(back(&told, Duration::ZERO).0, told);
    }

    #[test]
    fn a_checklist_survives_the_round_trip() {
        use crate::model::{ChecklistEntry, Mark, Signature};
        let mut list = crate::model::parse_checklist(include_str!("../../checklist-example.toml")).unwrap();
        let signature = Signature { by: "Ann".to_owned(), unix_s: 7, found: Some(1.5), role: None };
        list.apply(&ChecklistEntry::Marked { step: 0, mark: Mark::Signed(signature.clone()) });
        list.apply(&ChecklistEntry::Marked { step: 1, mark: Mark::Voided(signature) });
        let told = ToScreen::Msg(Msg::Checklist(Box::new(list)));
        assert_eq!(back(&told, Duration::ZERO).0, told);
    }

    /// A screen must be able to tell its crew which program to update.
    #[test]
    fn a_greeting_of_another_version_decodes_to_its_version() {
        let hello = Hello { version: VERSION + 1, station: Settings::on_screen("a"), ..Hello::default() };
        let ToScreen::Hello(known) = back(&ToScreen::Hello(Box::new(hello)), Duration::ZERO).0 else {
            panic!("a greeting")
        };
        assert_eq!(*known, Hello { version: VERSION + 1, ..Hello::default() });
    }

    #[test]
    fn a_stations_own_keys_are_not_sent() {
        assert_eq!(encode_to_screen(&ToScreen::Msg(Msg::Key(crate::key::Key::Enter)), Duration::ZERO), None);
    }

    #[test]
    fn what_the_station_answers_by_what_it_does_is_not_sent() {
        for request in [Request::Report, Request::Sign { step: 1, void: false }] {
            let told = ToScreen::Msg(Msg::Asked { request, by: Seat::default() });
            assert_eq!(encode_to_screen(&told, Duration::ZERO), None);
        }
    }

    /// No memory is taken for what is not there.
    #[test]
    fn a_wrong_count_ends_with_the_bytes() {
        let mut bytes = encode_to_screen(
            &ToScreen::Msg(Msg::Crew { seats: Vec::new(), silent: Vec::new() }),
            Duration::ZERO,
        )
        .unwrap();
        bytes.pop();
        bytes.extend([0xFF; 9]);
        bytes.push(1);
        assert!(decode_to_screen(&bytes[PREFIX_LEN..]).is_err());
    }

    /// A screen disconnects on a message that is too long, so none is sent.
    #[test]
    fn a_message_that_is_too_long_is_not_sent() {
        let long = LinkReport {
            name: "x".repeat(4_000),
            figures: LinkFigures::default(),
            sources: Vec::new(),
            capacity_bytes_s: None,
            copies: 0,
            trouble: None,
        };
        let links = |count| ToScreen::Msg(Msg::Links { links: vec![long.clone(); count], signing: None });
        assert_eq!(back(&links(16), Duration::ZERO).0, links(16));
        assert_eq!(encode_to_screen(&links(17), Duration::ZERO), None);
    }

    #[test]
    fn messages_to_a_station_survive_the_round_trip() {
        let asked = [
            ToStation::Hello { watch: true, operator: "anna on pts/3".to_owned() },
            ToStation::Status,
            ToStation::Stop { force: true, operator: "anna".to_owned() },
            ToStation::Request(Request::Command(CommandKind::Arm)),
            ToStation::Request(Request::Acknowledge(AlarmKind::Held)),
            ToStation::Request(Request::Acknowledge(AlarmKind::Refused(CommandKind::Abort))),
            ToStation::Request(Request::Report),
            ToStation::Request(Request::RangeTest),
            ToStation::Request(Request::Choose(4_242)),
            ToStation::Request(Request::WithoutLog),
            ToStation::Request(Request::Untested),
            ToStation::Request(Request::Sign { step: 7, void: true }),
            ToStation::Key("Ctrl-X".to_owned()),
            ToStation::Here,
        ];
        for asked in asked {
            assert_eq!(decode_to_station(&encode_to_station(&asked)[4..]), Ok(asked));
        }
    }

    fn counters() -> impl Strategy<Value = FramerCounters> {
        any::<[u64; 6]>().prop_map(
            |[frames, crc_errors, unknown_ids, cut_short, unknown_flags, garbage_bytes]| FramerCounters {
                frames,
                crc_errors,
                unknown_ids,
                cut_short,
                unknown_flags,
                garbage_bytes,
            },
        )
    }

    fn signing() -> impl Strategy<Value = SigningCounters> {
        any::<[u64; 6]>().prop_map(|[accepted, unsigned, wrong, replayed, too_old, too_new]| {
            SigningCounters { accepted, unsigned, wrong, replayed, too_old, too_new }
        })
    }

    fn source() -> impl Strategy<Value = SourceFigures> {
        let figures = (any::<[u8; 2]>(), any::<u64>(), -1e9..1e9, -1e9..1e9);
        figures.prop_map(|([system_id, component_id], age_ns, rx_frames_s, loss)| SourceFigures {
            source: Address { system_id, component_id },
            age: Duration::from_nanos(age_ns),
            rx_frames_s,
            loss,
        })
    }

    fn link() -> impl Strategy<Value = LinkReport> {
        let figures =
            prop::array::uniform4(-1e9..1e9).prop_map(|[rx_bytes_s, tx_bytes_s, rx_frames_s, loss]| {
                LinkFigures { rx_bytes_s, tx_bytes_s, rx_frames_s, loss }
            });
        let rest = (vec(source(), 0..4), option::of(any::<u32>()), any::<u64>(), option::of(any::<String>()));
        (any::<String>(), figures, rest).prop_map(|(name, figures, rest)| {
            let (sources, capacity_bytes_s, copies, trouble) = rest;
            LinkReport { name, figures, sources, capacity_bytes_s, copies, trouble }
        })
    }

    fn seat() -> impl Strategy<Value = Seat> {
        (any::<u32>(), any::<String>()).prop_map(|(screen, operator)| Seat { screen, operator })
    }

    /// Every message that a station forwards to its screens.
    fn msg() -> impl Strategy<Value = Msg> {
        let heartbeat = any::<u32>().prop_map(|custom_mode| {
            let data = HEARTBEAT_DATA { custom_mode, ..HEARTBEAT_DATA::default() };
            Msg::Frame(Encoder::new(VEHICLE).encode(&MavMessage::HEARTBEAT(data)))
        });
        let kind = prop::sample::select(CommandKind::ALL.to_vec());
        prop_oneof![
            prop::sample::select(vec![
                Msg::Tick,
                Msg::Asked { request: Request::Acknowledge(AlarmKind::LinkLost), by: Seat::default() },
                Msg::Asked { request: Request::RangeTest, by: Seat::default() },
                Msg::SignRefused("step 2 is not signed: FLIGHT signs it".to_owned()),
                Msg::ScreenGone
            ]),
            heartbeat,
            (any::<usize>(), counters()).prop_map(|(bytes, framing)| Msg::Received { bytes, framing }),
            (any::<usize>(), any::<u64>()).prop_map(|(bytes, drops)| Msg::Sent { bytes, drops }),
            any::<String>().prop_map(Msg::LinkUp),
            any::<String>().prop_map(Msg::LinkDown),
            any::<String>().prop_map(Msg::OneLinkDown),
            any::<String>().prop_map(Msg::LinkSays),
            any::<usize>().prop_map(Msg::HeardOver),
            any::<u16>().prop_map(Msg::HeardFrom),
            (vec(link(), 0..4), option::of(signing()))
                .prop_map(|(links, signing)| Msg::Links { links, signing }),
            (any::<u64>(), any::<[bool; 2]>(), any::<Option<(u64, u32)>>()).prop_map(
                |(dropped, [failed, removed], space)| {
                    let space =
                        space.map(|(free_bytes, grows_bytes_s)| LogSpace { free_bytes, grows_bytes_s });
                    Msg::Log(LogHealth { dropped, failed, removed, space })
                }
            ),
            (kind, seat()).prop_map(|(kind, by)| Msg::command(kind, by)),
            (vec(seat(), 0..4), vec(seat(), 0..2)).prop_map(|(seats, silent)| Msg::Crew { seats, silent }),
            seat().prop_map(|by| Msg::Asked { request: Request::RangeTest, by }),
            (seat(), any::<u32>()).prop_map(|(by, boot)| Msg::Asked { request: Request::Choose(boot), by }),
            seat().prop_map(|by| Msg::Asked { request: Request::WithoutLog, by }),
            seat().prop_map(|by| Msg::Asked { request: Request::Untested, by }),
            Just(Msg::ScreenQuit),
            option::of(any::<String>()).prop_map(Msg::SimulatorEnded),
        ]
    }

    proptest! {
        #[test]
        fn messages_to_a_screen_survive_the_round_trip(msg in msg(), now_ns in any::<u64>()) {
            let (told, now) = (ToScreen::Msg(msg), Duration::from_nanos(now_ns));
            prop_assert_eq!(back(&told, now), (told, now));
        }

        #[test]
        fn arbitrary_bytes_do_not_panic(bytes in vec(any::<u8>(), 0..80), kind in 0_u8..33) {
            let _ = decode_to_screen(&bytes);
            let _ = decode_to_station(&bytes);
            let mut aimed = vec![kind, 0, 0, 0, 0, 0, 0, 0, 0];
            aimed.extend(&bytes);
            let _ = decode_to_screen(&aimed);
            let _ = decode_to_station(&aimed);
        }

        /// A valid message with one changed byte.
        #[test]
        fn a_changed_byte_does_not_panic(msg in msg(), place in any::<prop::sample::Index>(), byte in any::<u8>()) {
            let mut bytes = encode_to_screen(&ToScreen::Msg(msg), Duration::ZERO).unwrap();
            let place = 4 + place.index(bytes.len() - 4);
            bytes[place] = byte;
            let _ = decode_to_screen(&bytes[4..]);
        }
    }
}
