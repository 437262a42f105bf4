//! There and back; and that no bytes panic.

use super::*;
use proptest::collection::vec;
use proptest::option;
use proptest::prelude::*;
use protocol::dialect::{HEARTBEAT_DATA, MavMessage};
use protocol::frame::Encoder;
use protocol::identity::{Address, VEHICLE};
use protocol::link::{LinkFigures, SourceFigures};
use protocol::signing::SigningCounters;

use crate::model::link::LinkReport;

fn back(told: &Told, now: Duration) -> (Told, Duration) {
    let bytes = encode_told(told, now).unwrap();
    let (prefix, rest) = bytes.split_first_chunk().unwrap();
    assert_eq!(length(*prefix).unwrap(), rest.len());
    decode_told(rest).unwrap()
}

#[test]
fn hello_and_live_come_back_the_same() {
    let hello = Told::Hello(Hello { version: VERSION, link_name: "a".to_owned(), ..Hello::default() });
    assert_eq!(back(&hello, Duration::ZERO).0, hello);
    assert_eq!(back(&Told::Live, Duration::ZERO).0, Told::Live);
    let status = Status { pid: 7, at_risk: true, phase: "PAD_ARMED".to_owned(), ..Status::default() };
    assert_eq!(back(&Told::Status(status.clone()), Duration::ZERO).0, Told::Status(status));
    let stopping = Told::Stopping { stops: false, words: "armed".to_owned() };
    assert_eq!(back(&stopping, Duration::ZERO).0, stopping);
}

/// Whatever else it says: a screen must be able to tell its crew to update.
#[test]
fn a_station_of_another_version_is_known_by_it() {
    let hello = Hello { version: VERSION + 1, link_name: "a".to_owned(), ..Hello::default() };
    let Told::Hello(known) = back(&Told::Hello(hello), Duration::ZERO).0 else { panic!("a greeting") };
    assert_eq!(known, Hello { version: VERSION + 1, ..Hello::default() });
}

#[test]
fn a_stations_own_keys_stay_with_it() {
    assert_eq!(encode_told(&Told::Msg(Msg::Key(crate::key::Key::Enter)), Duration::ZERO), None);
}

/// A screen lets go of a station that sends what it does not believe; so nothing of the kind is sent.
#[test]
fn what_is_too_long_is_not_told() {
    let long = LinkReport {
        name: "x".repeat(4_000),
        figures: LinkFigures::default(),
        sources: Vec::new(),
        capacity_bytes_s: None,
        copies: 0,
        trouble: None,
    };
    let links = |count| Told::Msg(Msg::Links { links: vec![long.clone(); count], signing: None });
    assert_eq!(back(&links(16), Duration::ZERO).0, links(16));
    assert_eq!(encode_told(&links(17), Duration::ZERO), None);
}

#[test]
fn what_is_asked_comes_back_the_same() {
    let asked = [
        Asked::Hello { watch: true, operator: "anna on pts/3".to_owned() },
        Asked::Status,
        Asked::Stop { force: true, operator: "anna".to_owned() },
        Asked::Command(CommandKind::Arm),
        Asked::Acknowledge(AlarmKind::Held),
        Asked::Acknowledge(AlarmKind::Refused(CommandKind::Abort)),
        Asked::Parameters,
        Asked::Key("Ctrl-X".to_owned()),
    ];
    for asked in asked {
        assert_eq!(decode_asked(&encode_asked(&asked)[4..]), Ok(asked));
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
    any::<[u64; 6]>().prop_map(|[accepted, unsigned, wrong, replayed, too_old, too_new]| SigningCounters {
        accepted,
        unsigned,
        wrong,
        replayed,
        too_old,
        too_new,
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
    let figures = prop::array::uniform4(-1e9..1e9).prop_map(|[rx_bytes_s, tx_bytes_s, rx_frames_s, loss]| {
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

/// Every message that the station's model takes from outside its own terminal.
fn msg() -> impl Strategy<Value = Msg> {
    let heartbeat = any::<u32>().prop_map(|custom_mode| {
        let data = HEARTBEAT_DATA { custom_mode, ..HEARTBEAT_DATA::default() };
        Msg::Frame(Encoder::new(VEHICLE).encode(&MavMessage::HEARTBEAT(data)))
    });
    let kind = prop::sample::select(vec![
        CommandKind::Arm,
        CommandKind::Disarm,
        CommandKind::Start,
        CommandKind::Abort,
    ]);
    prop_oneof![
        prop::sample::select(vec![
            Msg::Tick,
            Msg::Acknowledged(AlarmKind::LinkLost),
            Msg::ParametersWanted,
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
        (vec(link(), 0..4), option::of(signing())).prop_map(|(links, signing)| Msg::Links { links, signing }),
        (any::<u64>(), any::<bool>()).prop_map(|(dropped, failed)| Msg::Log(LogHealth { dropped, failed })),
        (kind, seat()).prop_map(|(kind, by)| Msg::Requested { kind, by }),
        vec(seat(), 0..4).prop_map(Msg::Crew),
        Just(Msg::ScreenQuit),
        option::of(any::<String>()).prop_map(Msg::SimulatorEnded),
    ]
}

proptest! {
    #[test]
    fn what_is_told_comes_back_the_same(msg in msg(), now_ns in any::<u64>()) {
        let (told, now) = (Told::Msg(msg), Duration::from_nanos(now_ns));
        prop_assert_eq!(back(&told, now), (told, now));
    }

    #[test]
    fn no_bytes_panic(bytes in vec(any::<u8>(), 0..80), kind in 0_u8..33) {
        let _ = decode_told(&bytes);
        let _ = decode_asked(&bytes);
        let mut aimed = vec![kind, 0, 0, 0, 0, 0, 0, 0, 0];
        aimed.extend(&bytes);
        let _ = decode_told(&aimed);
        let _ = decode_asked(&aimed);
    }

    /// Bytes that were right, but for one.
    #[test]
    fn no_changed_byte_panics(msg in msg(), place in any::<prop::sample::Index>(), byte in any::<u8>()) {
        let mut bytes = encode_told(&Told::Msg(msg), Duration::ZERO).unwrap();
        let place = 4 + place.index(bytes.len() - 4);
        bytes[place] = byte;
        let _ = decode_told(&bytes[4..]);
    }
}
