//! Every message decodes to what was encoded, and no bytes cause a panic.

use super::*;
use proptest::collection::vec;
use proptest::option;
use proptest::prelude::*;
use protocol::dialect::{HEARTBEAT_DATA, MavMessage};
use protocol::frame::Encoder;
use protocol::identity::{Address, VEHICLE};
use protocol::link_stats::{LinkFigures, SourceFigures};
use protocol::signing::SigningCounters;

use crate::model::link::LinkReport;
use crate::model::station_log::LogSpace;

fn back(told: &ToScreen, now: Duration) -> (ToScreen, Duration) {
    let bytes = encode_to_screen(told, now).unwrap();
    let (prefix, rest) = bytes.split_first_chunk().unwrap();
    assert_eq!(length(*prefix).unwrap(), rest.len());
    decode_to_screen(rest).unwrap()
}

#[test]
fn greeting_end_of_history_status_and_stopping_survive_the_round_trip() {
    let hello = ToScreen::Hello(Hello {
        version: VERSION,
        link_name: "a".to_owned(),
        key_number: 2,
        key_owner: "Bob".to_owned(),
        mission: Some([1, 2, 3, 4, 5, 6, 7, 8]),
        ..Hello::default()
    });
    assert_eq!(back(&hello, Duration::ZERO).0, hello);
    assert_eq!(back(&ToScreen::Live, Duration::ZERO).0, ToScreen::Live);
    let status =
        StationStatus { pid: 7, at_risk: true, phase: "PAD_ARMED".to_owned(), ..StationStatus::default() };
    assert_eq!(back(&ToScreen::Status(status.clone()), Duration::ZERO).0, ToScreen::Status(status));
    let stopping = ToScreen::Stopping { stops: false, words: "armed".to_owned() };
    assert_eq!(back(&stopping, Duration::ZERO).0, stopping);
}

#[test]
fn a_report_and_a_download_survive_the_round_trip() {
    for written in [Ok("flight.html".to_owned()), Err("disk full".to_owned())] {
        for told in [Msg::Report(written.clone()), Msg::Download(written)].map(ToScreen::Msg) {
            assert_eq!(back(&told, Duration::ZERO).0, told);
        }
    }
}

#[test]
fn the_end_of_the_book_survives_the_round_trip() {
    let head = SignedHead { head: Head { book: 7, entries: 8, hash: [9; 32] }, signature: [10; 64] };
    let told = ToScreen::Msg(Msg::Book { head, is_signed: true });
    assert_eq!(back(&told, Duration::ZERO).0, told);
}

#[test]
fn a_checklist_survives_the_round_trip() {
    use crate::model::checklist::{ChecklistEntry, Signature};
    let mut list = crate::checklist_file::parse(include_str!("../../../checklist-example.toml")).unwrap();
    let signature = Signature { by: "Ann".to_owned(), unix_s: 7, found: Some(1.5), role: None };
    list.apply(&ChecklistEntry::Signed { step: 0, signature: signature.clone() });
    list.apply(&ChecklistEntry::Voided { step: 1, signature });
    let told = ToScreen::Msg(Msg::Checklist(Box::new(list)));
    assert_eq!(back(&told, Duration::ZERO).0, told);
}

/// A screen must be able to tell its crew which program to update.
#[test]
fn a_greeting_of_another_version_decodes_to_its_version() {
    let hello = Hello { version: VERSION + 1, link_name: "a".to_owned(), ..Hello::default() };
    let ToScreen::Hello(known) = back(&ToScreen::Hello(hello), Duration::ZERO).0 else {
        panic!("a greeting")
    };
    assert_eq!(known, Hello { version: VERSION + 1, ..Hello::default() });
}

#[test]
fn a_stations_own_keys_are_not_sent() {
    assert_eq!(encode_to_screen(&ToScreen::Msg(Msg::Key(crate::key::Key::Enter)), Duration::ZERO), None);
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
        ToStation::Request(Request::Parameters),
        ToStation::Request(Request::Report),
        ToStation::Request(Request::Download),
        ToStation::Request(Request::RangeTest),
        ToStation::Request(Request::WithoutLog),
        ToStation::Request(Request::Sign { step: 7, void: true }),
        ToStation::Key("Ctrl-X".to_owned()),
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
            Msg::AlarmAcknowledged(AlarmKind::LinkLost),
            Msg::ParametersWanted,
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
        (vec(link(), 0..4), option::of(signing())).prop_map(|(links, signing)| Msg::Links { links, signing }),
        (any::<u64>(), any::<bool>(), any::<Option<(u64, u32)>>()).prop_map(|(dropped, failed, space)| {
            let space = space.map(|(free_bytes, grows_bytes_s)| LogSpace { free_bytes, grows_bytes_s });
            Msg::Log(LogHealth { dropped, failed, space })
        }),
        (kind, seat()).prop_map(|(kind, by)| Msg::Requested { kind, by }),
        vec(seat(), 0..4).prop_map(Msg::Crew),
        seat().prop_map(Msg::RangeTest),
        seat().prop_map(Msg::WithoutLog),
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
