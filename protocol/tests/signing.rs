//! Signatures against another implementation's, and against every way to forge them.

use proptest::prelude::*;
use protocol::dialect::{HEARTBEAT_DATA, MavMessage, RADIO_STATUS_DATA};
use protocol::frame::{Encoder, Frame, Framer};
use protocol::identity::{GROUND, VEHICLE};
use protocol::signing::{Key, Memory, MemoryError, Rejection, Signing, stamp_of};

const NOW: u64 = 37_000_000_000_000;
const SECOND: u64 = 100_000;

fn key(fill: u8) -> Key {
    Key::new([fill; Key::LEN])
}

fn side(fill: u8) -> Signing {
    Signing::new(key(fill), Memory::default())
}

fn beat() -> Frame {
    Encoder::new(GROUND).encode(&MavMessage::HEARTBEAT(HEARTBEAT_DATA::default()))
}

fn framed(bytes: &[u8]) -> Option<Frame> {
    let mut framer = Framer::new();
    framer.push_datagram(bytes);
    framer.next_frame()
}

#[test]
fn what_one_side_signs_the_other_believes_once() {
    let (mut ground, mut vehicle) = (side(7), side(7));
    let signed = ground.sign(&beat(), 3, NOW);
    let heard = framed(signed.as_bytes()).unwrap();
    assert_eq!(heard, signed);
    assert_eq!(vehicle.check(&heard, NOW), Ok(()));
    assert_eq!(vehicle.check(&heard, NOW), Err(Rejection::Replayed));
    assert_eq!(vehicle.check(&ground.sign(&beat(), 3, NOW - SECOND), NOW), Ok(()), "a clock that went back");
    let counters = vehicle.counters();
    assert_eq!((counters.accepted, counters.replayed, counters.rejected()), (2, 1, 1));
}

/// Frames signed by pymavlink 2.4.50: key 0 to 31, link 3, first timestamp 37,000,000,000,000.
#[test]
fn val_pymavlink_signatures_are_believed_and_ours_are_the_same_bytes() {
    let by_pymavlink = [
        "fd09010000ffbe000000000000000608000403dab0030050dbbba621bb191406ecc3",
        "fd20010001ffbe4c00000000803f00000000000000000000000000000000000000000000000090010101a79a030150dbbba621bb4acba64323",
    ];
    let key = Key::new(std::array::from_fn(|place| place as u8));
    let mut judge = Signing::new(key.clone(), Memory::default());
    let mut signer = Signing::new(key, Memory::default());
    for hex in by_pymavlink {
        let bytes: Vec<u8> =
            (0..hex.len()).step_by(2).map(|at| u8::from_str_radix(&hex[at..at + 2], 16).unwrap()).collect();
        let frame = framed(&bytes).unwrap();
        assert_eq!(judge.check(&frame, NOW), Ok(()));
        assert_eq!(signer.sign(&frame.without_signature(), 3, 37_000_000_000_000).as_bytes(), bytes);
    }
}

#[test]
fn unsigned_wrong_and_old_frames_are_rejected_and_counted() {
    let mut vehicle = side(7);
    assert_eq!(vehicle.check(&beat(), NOW), Err(Rejection::Unsigned));
    assert_eq!(vehicle.check(&side(8).sign(&beat(), 0, NOW), NOW), Err(Rejection::Wrong));
    assert_eq!(vehicle.check(&side(7).sign(&beat(), 0, NOW - 61 * SECOND), NOW), Err(Rejection::TooOld));
    assert_eq!(vehicle.check(&side(7).sign(&beat(), 0, NOW - 59 * SECOND), NOW), Ok(()));
    let counters = vehicle.counters();
    assert_eq!((counters.unsigned, counters.wrong, counters.too_old), (1, 1, 1));
}

#[test]
fn a_radio_s_own_report_needs_no_signature() {
    let radio = MavMessage::RADIO_STATUS(RADIO_STATUS_DATA::default());
    let mut vehicle = side(7);
    assert_eq!(vehicle.check(&Encoder::new(GROUND).encode(&radio), NOW), Ok(()));
    assert_eq!(vehicle.counters().accepted, 0);
}

#[test]
fn every_flipped_bit_is_noticed() {
    let signed = side(7).sign(&beat(), 1, NOW);
    for bit in 0..signed.as_bytes().len() * 8 {
        let mut bytes = signed.as_bytes().to_vec();
        bytes[bit / 8] ^= 1 << (bit % 8);
        // What the checksum lets through, the signature does not.
        if let Some(forged) = framed(&bytes) {
            assert_eq!(side(7).check(&forged, NOW), Err(Rejection::Wrong), "bit {bit}");
        }
    }
}

#[test]
fn a_restart_forgets_neither_what_was_heard_nor_what_was_sent() {
    let mut ground = side(7);
    let heard = ground.sign(&beat(), 0, NOW);
    let mut vehicle = side(7);
    vehicle.check(&heard, NOW).unwrap();
    let remembered = Memory::from_text(&vehicle.memory().to_text()).unwrap();
    assert_eq!(remembered, vehicle.memory());
    let mut restarted = Signing::new(key(7), remembered);
    assert_eq!(restarted.check(&heard, 0), Err(Rejection::Replayed), "even without a clock");
    // Its own next timestamp is newer than any it has used, so the ground still believes it.
    let before = vehicle.sign(&beat(), 0, NOW);
    ground.check(&before, NOW).unwrap();
    assert_eq!(ground.check(&restarted.sign(&beat(), 0, 0), NOW), Ok(()));
}

#[test]
fn a_later_time_is_adopted_from_whoever_holds_the_key() {
    let mut vehicle = side(7);
    vehicle.check(&side(7).sign(&beat(), 0, NOW), 0).unwrap();
    let old = side(7).sign(&beat(), 9, NOW - 61 * SECOND);
    assert_eq!(vehicle.check(&old, 0), Err(Rejection::TooOld));
}

#[test]
fn a_memory_that_makes_no_sense_names_its_line() {
    for bad in ["ours x", "heard 1 2 3", "heard 256 1 0 5", "ours 281474976710656", "theirs 5", ""] {
        let text = format!("ours 5\n{bad}\nheard 1 1 0 5\n");
        assert_eq!(Memory::from_text(&text), Err(MemoryError::Line(bad.to_owned())));
    }
    for nothing in ["", "heard 1 1 0 5\n"] {
        assert_eq!(Memory::from_text(nothing), Err(MemoryError::Nothing), "{nothing:?}");
    }
    let memory = |text| Memory::from_text(text).unwrap();
    // Cut off while it was written; the line before holds.
    assert_eq!(memory("ours 5\nheard 1 1 0 50\nheard 1 1 0 6"), memory("ours 5\nheard 1 1 0 50\n"));
}

#[test]
fn a_stamp_far_ahead_is_refused_where_our_own_clock_is_known_to_be_set() {
    const DAY: u64 = 24 * 3600 * SECOND;
    let far = side(7).sign(&beat(), 0, NOW + 10 * 365 * DAY);
    let mut vehicle = side(7);
    assert_eq!(vehicle.check(&far, NOW), Err(Rejection::TooNew));
    assert_eq!(vehicle.check(&side(7).sign(&beat(), 0, NOW + DAY + SECOND), NOW), Err(Rejection::TooNew));
    assert_eq!((vehicle.counters().too_new, vehicle.counters().rejected()), (2, 2));
    assert_eq!(vehicle.check(&side(7).sign(&beat(), 0, NOW), NOW), Ok(()), "and shuts nobody out");
    // Less than a day ahead is a clock of another time zone; it does not shut out those that are right, either.
    let mut vehicle = side(7);
    assert_eq!(vehicle.check(&side(7).sign(&beat(), 0, NOW + 14 * 3600 * SECOND), NOW), Ok(()));
    assert_eq!(vehicle.check(&side(7).sign(&beat(), 1, NOW), NOW), Ok(()));
}

#[test]
fn a_board_without_a_set_clock_adopts_the_first_stamp_not_older_than_those_it_stored() {
    let mut ground = side(7);
    // Never set: it shows 1970, or the day its image was made.
    for clock in [0, 3_400_000_000_000] {
        let mut board = side(7);
        assert_eq!(board.check(&ground.sign(&beat(), 0, NOW), clock), Ok(()));
    }
    // Set in an earlier run; without power it went back to where it was then, or further.
    let mut board = side(7);
    board.check(&ground.sign(&beat(), 0, NOW), NOW).unwrap();
    let stored = Memory::from_text(&board.memory().to_text()).unwrap();
    let back = NOW - 3600 * SECOND;
    let later = NOW + 30 * 24 * 3600 * SECOND;
    let mut restarted = Signing::new(key(7), stored.clone());
    assert_eq!(restarted.check(&side(7).sign(&beat(), 9, NOW - 61 * SECOND), back), Err(Rejection::TooOld));
    assert_eq!(
        restarted.check(&side(7).sign(&beat(), 9, later), back),
        Ok(()),
        "a month later by the ground"
    );
    // A clock that did not go back is set, and knows better.
    let mut restarted = Signing::new(key(7), stored);
    assert_eq!(restarted.check(&side(7).sign(&beat(), 9, later), NOW + SECOND), Err(Rejection::TooNew));
}

#[test]
fn keys_are_64_hexadecimal_digits_and_never_printed() {
    let hex = "00ff".repeat(16);
    let key = Key::from_hex(&hex).unwrap();
    assert_eq!(key.to_hex(), hex);
    assert_eq!(format!("{key:?}"), "Key(secret)");
    for bad in ["", "00", &"0".repeat(63), &"g".repeat(64), &"ä".repeat(32), &"+0".repeat(32)] {
        assert_eq!(Key::from_hex(bad), None, "{bad}");
    }
}

#[test]
fn val_mavlink_guide_timestamps_count_10_us_since_2015() {
    use std::time::Duration;
    // 45 years from 1970, eleven of them leap years.
    let epoch = Duration::from_hours(24 * (45 * 365 + 11));
    assert_eq!(stamp_of(epoch), 0);
    assert_eq!(stamp_of(epoch + Duration::from_secs(1)), 100_000);
    assert_eq!(stamp_of(Duration::ZERO), 0);
}

proptest! {
    /// A log keeps the message and not the signature.
    #[test]
    fn without_its_signature_a_frame_is_the_one_that_was_signed(custom_mode in any::<u32>(), link in any::<u8>()) {
        let frame = Encoder::new(VEHICLE)
            .encode(&MavMessage::HEARTBEAT(HEARTBEAT_DATA { custom_mode, ..HEARTBEAT_DATA::default() }));
        prop_assert_eq!(side(1).sign(&frame, link, NOW).without_signature(), frame);
    }
}
