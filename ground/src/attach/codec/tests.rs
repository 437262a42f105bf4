//! There and back; and that no bytes panic.

use super::*;
use proptest::prelude::*;
use protocol::dialect::{HEARTBEAT_DATA, MavMessage};
use protocol::frame::Encoder;
use protocol::identity::VEHICLE;

fn back(told: &Told, now: Duration) -> (Told, Duration) {
    let bytes = encode_told(told, now).unwrap();
    let (prefix, rest) = bytes.split_first_chunk().unwrap();
    assert_eq!(length(*prefix).unwrap(), rest.len());
    decode_told(rest).unwrap()
}

#[test]
fn what_is_told_comes_back_the_same() {
    let heartbeat = MavMessage::HEARTBEAT(HEARTBEAT_DATA::default());
    let framing = FramerCounters { frames: 1, crc_errors: 2, garbage_bytes: 1 << 40, ..Default::default() };
    let msgs = [
        Msg::Tick,
        Msg::Frame(Encoder::new(VEHICLE).encode(&heartbeat)),
        Msg::Received { bytes: 77, framing },
        Msg::Sent { bytes: 12, drops: 3 },
        Msg::LinkUp("peer é".to_owned()),
        Msg::LinkDown(String::new()),
        Msg::Log(LogHealth { dropped: 9, failed: true }),
        Msg::Requested(CommandKind::Abort),
        Msg::SimulatorEnded(None),
        Msg::SimulatorEnded(Some("why".to_owned())),
        Msg::Acknowledged,
        Msg::ParametersWanted,
        Msg::ScreenGone,
    ];
    for msg in msgs {
        let told = Told::Msg(msg);
        assert_eq!(back(&told, Duration::from_nanos(5)), (told, Duration::from_nanos(5)));
    }
    let hello = Told::Hello(Hello { version: VERSION, link_name: "a".to_owned(), ..Hello::default() });
    assert_eq!(back(&hello, Duration::ZERO).0, hello);
    assert_eq!(back(&Told::Live, Duration::ZERO).0, Told::Live);
}

#[test]
fn a_stations_own_keys_stay_with_it() {
    assert_eq!(encode_told(&Told::Msg(Msg::Key(crate::key::Key::Enter)), Duration::ZERO), None);
}

#[test]
fn what_is_asked_comes_back_the_same() {
    let asked = [
        Asked::Hello { watch: true },
        Asked::Command(CommandKind::Arm),
        Asked::Acknowledge,
        Asked::Parameters,
        Asked::Key("Ctrl-X".to_owned()),
    ];
    for asked in asked {
        assert_eq!(decode_asked(&encode_asked(&asked)[4..]), Ok(asked));
    }
}

proptest! {
    #[test]
    fn no_bytes_panic(bytes in prop::collection::vec(any::<u8>(), 0..80), kind in 0_u8..14) {
        let _ = decode_told(&bytes);
        let _ = decode_asked(&bytes);
        let mut aimed = vec![kind, 0, 0, 0, 0, 0, 0, 0, 0];
        aimed.extend(&bytes);
        let _ = decode_told(&aimed);
        let _ = decode_asked(&aimed);
    }
}
