//! Several links at once, on a simulated clock.

use super::*;
use crate::dialect::{HEARTBEAT_DATA, MavMessage};
use crate::frame::Encoder;
use crate::identity::{GROUND, VEHICLE};
use crate::signing::{Key, Memory};

const CLOCK: u64 = 37_000_000_000_000;

fn beats(count: usize) -> Vec<Frame> {
    let mut encoder = Encoder::new(VEHICLE);
    (0..count).map(|_| encoder.encode(&MavMessage::HEARTBEAT(HEARTBEAT_DATA::default()))).collect()
}

fn datagram(frame: &Frame) -> Received {
    datagram_of(frame.as_bytes().to_vec())
}

/// A datagram from a fixed address.
fn datagram_of(bytes: Vec<u8>) -> Received {
    Received::Datagram { from: ([127, 0, 0, 1], 1).into(), bytes }
}

/// The event about frames, without the event about who sent them.
fn of_frames(event: Vec<LinkEvent>) -> Vec<LinkEvent> {
    event.into_iter().filter(|event| !matches!(event, LinkEvent::Accepted(_))).collect()
}

fn ms(milliseconds: u64) -> Duration {
    Duration::from_millis(milliseconds)
}

#[test]
fn over_two_lossy_links_every_frame_is_passed_on_once() {
    let mut hub = Hub::new(2, None);
    let mut heard = Vec::new();
    // Link 0 loses every third frame, link 1 loses every fifth and lags; there are 300 frames at 20
    // a second.
    let frames = beats(300);
    let mut arrivals: Vec<(u64, usize, &Frame)> = Vec::new();
    for (place, frame) in frames.iter().enumerate() {
        let sent_at = 50 * place as u64;
        if place % 3 != 0 {
            arrivals.push((sent_at, 0, frame));
        }
        if place % 5 != 0 {
            arrivals.push((sent_at + 320, 1, frame));
        }
    }
    arrivals.sort_by_key(|(at, link, _)| (*at, *link));
    for (at, link, frame) in arrivals {
        for event in hub.take(link, datagram(frame), ms(at), CLOCK) {
            if let LinkEvent::Frame(frame) = event {
                heard.push(frame.sequence());
            }
        }
    }
    assert_eq!(heard.len(), 280, "only frames that both links lost are missing");
    let loss = |link: usize| hub.links()[link].stats().figures(ms(15_300)).loss;
    assert!((loss(0) - 1.0 / 3.0).abs() < 0.02 && (loss(1) - 0.2).abs() < 0.02, "{} {}", loss(0), loss(1));
    assert_eq!(hub.links()[0].copies() + hub.links()[1].copies(), 200 + 240 - 280);
}

#[test]
fn streams_of_one_link_are_framed_separately() {
    let frames = beats(2);
    let mut hub = Hub::new(1, None);
    let (head, tail) = frames[0].as_bytes().split_at(9);
    assert!(hub.take(0, Received::Stream(1, head.to_vec()), ms(0), 0).is_empty());
    let other = hub.take(0, Received::Stream(2, frames[1].as_bytes().to_vec()), ms(1), 0);
    assert_eq!(of_frames(other), [LinkEvent::Frame(frames[1].clone())]);
    let rest = hub.take(0, Received::Stream(1, tail.to_vec()), ms(2), 0);
    assert_eq!(of_frames(rest), [LinkEvent::Frame(frames[0].clone())]);
    hub.take(0, Received::Gone(1), ms(3), 0);
    assert_eq!(hub.links()[0].framing().frames, 2, "the frames of an ended stream still count");
    for stream in 0..100 {
        hub.take(0, Received::Stream(stream, vec![0xFD]), ms(4), 0);
    }
    assert!(hub.links()[0].streams.len() <= MAX_STREAMS);
}

#[test]
fn a_forged_frame_does_not_hide_the_true_one() {
    let side = || Some(Signing::new(Key::new([7; Key::LEN]), Memory::default()));
    let (mut near, mut far) = (Hub::new(2, side()), Hub::new(2, side()));
    let frame = &beats(1)[0];
    // The forger has sequence number, message and checksum, but not the key.
    let rejected = far.take(0, datagram(frame), ms(0), CLOCK);
    assert_eq!(rejected, [LinkEvent::Rejected(frame.clone(), Rejection::Unsigned)]);
    let bytes: Vec<Vec<u8>> = (0..2).map(|link| near.bytes_for(link, frame, CLOCK)).collect();
    let first = far.take(0, datagram_of(bytes[0].clone()), ms(1), CLOCK);
    assert!(matches!(&first[..], [LinkEvent::Accepted(_), LinkEvent::Frame(_)]));
    let second = far.take(1, datagram_of(bytes[1].clone()), ms(2), CLOCK);
    assert!(
        matches!(&second[..], [LinkEvent::Accepted(_), LinkEvent::Copy(_)]),
        "it is signed for the other link and still the same frame"
    );
    assert_eq!(far.signing().map(|counters| (counters.accepted, counters.unsigned)), Some((2, 1)));
}

#[test]
fn an_unknown_link_number_is_ignored() {
    let mut hub = Hub::new(1, None);
    assert!(hub.take(1, datagram(&beats(1)[0]), ms(0), 0).is_empty());
    hub.on_sent(1, 5, ms(0));
}

#[test]
fn trouble_is_reported_until_the_link_works_again() {
    let mut hub = Hub::new(1, None);
    hub.take(0, Received::Down("unplugged".to_owned()), ms(0), 0);
    assert_eq!(hub.links()[0].trouble(), Some("unplugged"));
    hub.take(0, Received::Up("/dev/x".to_owned()), ms(1), 0);
    assert_eq!(hub.links()[0].trouble(), None);
}

/// Returns the senders that are accepted after one datagram with these bytes.
fn accepted(hub: &mut Hub, bytes: Vec<u8>) -> Vec<Origin> {
    let origin = |event| match event {
        LinkEvent::Accepted(origin) => Some(origin),
        _ => None,
    };
    hub.take(0, datagram_of(bytes), ms(0), CLOCK).into_iter().filter_map(origin).collect()
}

#[test]
fn a_sender_is_accepted_only_for_a_valid_frame() {
    let sender = [Origin::Datagram(([127, 0, 0, 1], 1).into())];
    let plain = beats(1).remove(0);
    let mut hub = Hub::new(1, None);
    assert_eq!(accepted(&mut hub, vec![1, 2, 3]), []);
    assert_eq!(accepted(&mut hub, plain.as_bytes()[..20].to_vec()), []);
    assert_eq!(accepted(&mut hub, plain.as_bytes().to_vec()), sender);
    let key = |fill| Some(Signing::new(Key::new([fill; Key::LEN]), Memory::default()));
    let mut hub = Hub::new(1, key(7));
    let signed_by = |fill| Hub::new(1, key(fill)).bytes_for(0, &plain, CLOCK);
    let radio = MavMessage::RADIO_STATUS(crate::dialect::RADIO_STATUS_DATA::default());
    assert_eq!(accepted(&mut hub, plain.as_bytes().to_vec()), []);
    assert_eq!(accepted(&mut hub, signed_by(8)), []);
    let report = Encoder::new(RADIO).encode(&radio).as_bytes().to_vec();
    let mut serial = Hub::new(1, key(7)).over(&[Some(5_760)]);
    assert_eq!(
        accepted(&mut serial, report),
        [],
        "the message that may be unsigned does not prove its sender"
    );
    assert_eq!(accepted(&mut hub, signed_by(7)), sender);
    assert_eq!(accepted(&mut hub, signed_by(7)), [], "replayed");
}

/// Over a network anybody could thin a signed line with it.
#[test]
fn a_radio_reports_without_a_signature_on_its_serial_line_alone() {
    let radio = MavMessage::RADIO_STATUS(crate::dialect::RADIO_STATUS_DATA::default());
    let report = Encoder::new(RADIO).encode(&radio);
    for (key, carried, is_taken) in
        [(true, Some(5_760), true), (true, None, false), (false, Some(5_760), true), (false, None, true)]
    {
        let signing = key.then(|| Signing::new(Key::new([7; Key::LEN]), Memory::default()));
        let mut hub = Hub::new(1, signing).over(&[carried]);
        let report = Received::Stream(0, report.as_bytes().to_vec());
        let event = of_frames(hub.take(0, report, ms(0), CLOCK));
        assert_eq!(matches!(event[..], [LinkEvent::Frame(_)]), is_taken, "{key} {carried:?}: {event:?}");
    }
}

/// An observer who repeats an operator's frame over another link, with the key that all share,
/// hides nothing.
#[test]
fn nobody_turns_another_one_s_frame_into_a_copy() {
    let [shared, ann] = [7, 8].map(|byte| Key::new([byte; Key::LEN]));
    let vehicle = Signing::new(shared.clone(), Memory::default()).with_operators([(1, ann.clone())].into());
    let mut hub = Hub::new(2, Some(vehicle));
    let mut observer = Signing::new(shared.clone(), Memory::default());
    let mut ann = Signing::new(ann, Memory::default()).as_operator(1, shared);
    let abort = Encoder::new(GROUND).encode(&MavMessage::HEARTBEAT(HEARTBEAT_DATA::default()));
    let take = |hub: &mut Hub, link: usize, frame: Frame| {
        hub.take(link, Received::Stream(0, frame.as_bytes().to_vec()), Duration::ZERO, 6_000_000)
    };
    let seen =
        |event: &[LinkEvent]| event.iter().filter(|event| matches!(event, LinkEvent::Frame(_))).count();
    let id = observer.link_id(0);
    let forged = take(&mut hub, 0, observer.sign(&abort, id, 6_000_000));
    let (first, second) = (ann.link_id(1), ann.link_id(0));
    let true_one = take(&mut hub, 1, ann.sign(&abort, first, 6_000_001));
    let copy = take(&mut hub, 0, ann.sign(&abort, second, 6_000_002));
    assert_eq!([seen(&forged), seen(&true_one), seen(&copy)], [1, 1, 0]);
}
