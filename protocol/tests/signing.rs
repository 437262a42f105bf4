//! Signatures compared with another implementation's, and attempts to forge them.

use std::time::Duration;

use proptest::prelude::*;
use protocol::dialect::{HEARTBEAT_DATA, MavMessage};
use protocol::frame::{Encoder, Frame, Framer};
use protocol::identity::{Address, GROUND, VEHICLE};
use protocol::signing::{Anchor, Key, Lockouts, Memory, MemoryError, Rejection, Signing, stamp_of};

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
fn a_signed_frame_is_accepted_once() {
    let (mut ground, mut vehicle) = (side(7), side(7));
    let signed = ground.sign(&beat(), 3, NOW);
    let received = framed(signed.as_bytes()).unwrap();
    assert_eq!(received, signed);
    assert_eq!(vehicle.check(&received, NOW), Ok(()));
    assert_eq!(vehicle.check(&received, NOW), Err(Rejection::Replayed));
    assert_eq!(
        vehicle.check(&ground.sign(&beat(), 3, NOW - SECOND), NOW),
        Ok(()),
        "the sender's clock went back"
    );
    let counters = vehicle.counters();
    assert_eq!((counters.accepted, counters.replayed, counters.rejected()), (2, 1, 1));
}

/// Frames signed by pymavlink 2.4.50 with key 0 to 31, link 3 and the first timestamp
/// 37,000,000,000,000.
#[test]
fn val_pymavlink_signatures_are_accepted_and_ours_are_the_same_bytes() {
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
fn every_flipped_bit_is_detected() {
    let signed = side(7).sign(&beat(), 1, NOW);
    for bit in 0..signed.as_bytes().len() * 8 {
        let mut bytes = signed.as_bytes().to_vec();
        bytes[bit / 8] ^= 1 << (bit % 8);
        // A change that the checksum misses is found by the signature.
        if let Some(forged) = framed(&bytes) {
            assert_eq!(side(7).check(&forged, NOW), Err(Rejection::Wrong), "bit {bit}");
        }
    }
}

#[test]
fn a_restart_remembers_received_and_sent_timestamps() {
    let mut ground = side(7);
    let received = ground.sign(&beat(), 0, NOW);
    let mut vehicle = side(7);
    vehicle.check(&received, NOW).unwrap();
    let remembered = Memory::from_text(&vehicle.memory().to_text()).unwrap();
    assert_eq!(remembered, vehicle.memory());
    let mut restarted = Signing::new(key(7), remembered);
    assert_eq!(
        restarted.check(&received, 0),
        Err(Rejection::Replayed),
        "it is rejected even without a clock"
    );
    // Its next timestamp is newer than any it has used, so the ground still accepts it.
    let before = vehicle.sign(&beat(), 0, NOW);
    ground.check(&before, NOW).unwrap();
    assert_eq!(ground.check(&restarted.sign(&beat(), 0, 0), NOW), Ok(()));
}

#[test]
fn an_unreadable_memory_names_its_line() {
    for bad in ["ours x", "heard 1 2 3", "heard 256 1 0 5", "ours 281474976710656", "theirs 5", ""] {
        let text = format!("ours 5\n{bad}\nheard 1 1 0 5\n");
        assert_eq!(Memory::from_text(&text), Err(MemoryError::Line(bad.to_owned())));
    }
    for nothing in ["", "heard 1 1 0 5\n"] {
        assert_eq!(Memory::from_text(nothing), Err(MemoryError::NoOwnStamp), "{nothing:?}");
    }
    let memory = |text| Memory::from_text(text).unwrap();
    // The last line was cut off while it was written; the line before it counts.
    assert_eq!(memory("ours 5\nheard 1 1 0 50\nheard 1 1 0 6"), memory("ours 5\nheard 1 1 0 50\n"));
}

#[test]
fn a_timestamp_far_ahead_is_refused_if_our_clock_is_set() {
    const DAY: u64 = 24 * 3600 * SECOND;
    let far = side(7).sign(&beat(), 0, NOW + 10 * 365 * DAY);
    let mut vehicle = side(7);
    assert_eq!(vehicle.check(&far, NOW), Err(Rejection::TooNew));
    assert_eq!(vehicle.check(&side(7).sign(&beat(), 0, NOW + DAY + SECOND), NOW), Err(Rejection::TooNew));
    assert_eq!((vehicle.counters().too_new, vehicle.counters().rejected()), (2, 2));
    assert_eq!(
        vehicle.check(&side(7).sign(&beat(), 0, NOW), NOW),
        Ok(()),
        "other senders are not locked out"
    );
    // A clock of another time zone is less than a day ahead; it must not lock out clocks that are
    // right.
    let mut vehicle = side(7);
    assert_eq!(vehicle.check(&side(7).sign(&beat(), 0, NOW + 14 * 3600 * SECOND), NOW), Ok(()));
    assert_eq!(vehicle.check(&side(7).sign(&beat(), 1, NOW), NOW), Ok(()));
}

/// The clock of the vehicle's computer is set three days forward while it runs, and back again. The
/// vehicle asks it once.
#[test]
fn the_stamps_of_a_run_follow_no_clock_that_is_set_while_it_runs() {
    // 2026-11-23: 20,780 days.
    let day = Duration::from_hours(20_780 * 24);
    let shown = |second: u64| {
        let step = if (100..200).contains(&second) { 3 * 86_400 } else { 0 };
        day + Duration::from_secs(second + step)
    };
    let (mut vehicle, mut following, mut station) = (side(7), side(7), side(7));
    let anchor = Anchor::at(shown(0));
    let mut refused = 0;
    for second in 0..400 {
        let true_stamp = stamp_of(day + Duration::from_secs(second));
        let stamp = anchor.stamp(Duration::from_secs(second));
        assert_eq!(stamp, true_stamp);
        station.check(&vehicle.sign(&beat(), 0, stamp), true_stamp).unwrap();
        let followed = following.sign(&beat(), 1, stamp_of(shown(second)));
        refused += u32::from(station.check(&followed, true_stamp) == Err(Rejection::TooNew));
    }
    assert_eq!(refused, 300, "a vehicle that follows its clock stays locked out when it is right again");
}

#[test]
fn a_vehicle_that_is_locked_out_by_its_stamps_is_named_with_what_to_do() {
    const DAY: u64 = 24 * 3600 * SECOND;
    let (mut vehicle, mut station, mut lockouts) = (side(7), side(7), Lockouts::default());
    let mut receive = |vehicle: &mut Signing, station: &mut Signing, now_ms: u64, clock: u64| {
        let clock = clock + now_ms * SECOND / 1_000;
        let frame = vehicle.sign(&beat(), 0, clock);
        let here = NOW + now_ms * SECOND / 1_000;
        match station.check(&frame, here) {
            Ok(()) => {
                lockouts.accepted(&frame);
                None
            }
            Err(why) => lockouts.refused(&frame, why, Duration::from_millis(now_ms), here),
        }
    };
    let ahead = NOW + 3 * DAY;
    let said: Vec<(u64, String)> = (0..600)
        .filter_map(|tenth| {
            receive(&mut vehicle, &mut station, 100 * tenth, ahead).map(|words| (tenth, words))
        })
        .collect();
    assert_eq!(said.iter().map(|(tenth, _)| *tenth).collect::<Vec<_>>(), [20, 320], "not with every frame");
    let words = &said[0].1;
    for part in ["LOCKED OUT", "255/190", "3.0 days ahead", "KEY.vehicle.stamps"] {
        assert!(words.contains(part), "{part}: {words}");
    }
    // Its clock is right now and its stamps are removed.
    let mut again = side(7);
    assert_eq!(receive(&mut again, &mut station, 61_000, NOW), None);
    assert_eq!(receive(&mut vehicle, &mut station, 61_100, ahead), None, "it was received just now");
    // A sender without a key is not reported, and deviating stamps among valid frames are no
    // lock-out.
    let mut stranger = side(8);
    for tenth in 700..800 {
        assert_eq!(receive(&mut stranger, &mut station, 100 * tenth, NOW), None);
        receive(&mut again, &mut station, 100 * tenth, NOW);
        assert_eq!(receive(&mut vehicle, &mut station, 100 * tenth + 50, ahead), None);
    }
}

#[test]
fn a_board_without_a_set_clock_adopts_the_first_timestamp_not_older_than_its_stored_ones() {
    let mut ground = side(7);
    // A clock that was never set shows 1970, or the day on which the board's image was made.
    for clock in [0, 3_400_000_000_000] {
        let mut board = side(7);
        assert_eq!(board.check(&ground.sign(&beat(), 0, NOW), clock), Ok(()));
    }
    // This clock was set in an earlier run and went back when the power was off.
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
        "the ground's clock is a month later"
    );
    // A clock that did not go back is taken to be set, and decides.
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
    // There are 45 years from 1970, eleven of them leap years.
    let epoch = Duration::from_hours(24 * (45 * 365 + 11));
    assert_eq!(stamp_of(epoch), 0);
    assert_eq!(stamp_of(epoch + Duration::from_secs(1)), 100_000);
    assert_eq!(stamp_of(Duration::ZERO), 0);
}

proptest! {
    /// A log contains the message without the signature.
    #[test]
    fn removing_the_signature_restores_the_frame(custom_mode in any::<u32>(), link in any::<u8>()) {
        let frame = Encoder::new(VEHICLE)
            .encode(&MavMessage::HEARTBEAT(HEARTBEAT_DATA { custom_mode, ..HEARTBEAT_DATA::default() }));
        prop_assert_eq!(side(1).sign(&frame, link, NOW).without_signature(), frame);
    }
}

/// Two operators, the shared key, and a vehicle that checks all three.
fn crew() -> (Signing, [Signing; 3]) {
    let [shared, ann, bob] = [1, 2, 3].map(|byte| Key::new([byte; Key::LEN]));
    let vehicle = Signing::new(shared.clone(), Memory::default())
        .with_operators([(1, ann.clone()), (2, bob.clone())].into());
    let station = |key: &Key| Signing::new(key.clone(), Memory::default());
    let stations = [
        station(&shared),
        station(&ann).as_operator(1, shared.clone()),
        station(&bob).as_operator(2, shared),
    ];
    (vehicle, stations)
}

#[test]
fn the_link_id_selects_the_key_and_nothing_else() {
    let (mut vehicle, stations) = crew();
    let beat = || Encoder::new(GROUND).encode(&MavMessage::HEARTBEAT(HEARTBEAT_DATA::default()));
    for (number, mut station) in (0..).zip(stations) {
        for link in [0, 1, 5] {
            let id = station.link_id(link);
            let signed = station.sign(&beat(), id, NOW + u64::from(number) * 100 + link as u64);
            assert_eq!(vehicle.check(&signed, NOW), Ok(()), "operator {number} over link {link}");
            assert_eq!(vehicle.operator_of(&signed), number);
        }
        // With the key of one and the number of another, or a number that is not in use.
        for other in (0..=15).filter(|other| *other != number) {
            let forged = station.sign(&beat(), other, NOW + 1_000 + u64::from(other));
            assert_eq!(vehicle.check(&forged, NOW), Err(Rejection::Wrong), "operator {number} as {other}");
        }
    }
}

/// Whoever only looks on has the shared key: they can neither use up the streams of an operator nor
/// put one's stream into the future, and thereby delay an abort.
#[test]
fn an_observer_locks_no_operator_out() {
    let (mut vehicle, [mut observer, mut ann, _]) = crew();
    for system_id in 1..=255 {
        let mut encoder = Encoder::new(Address { system_id, component_id: 190 });
        let frame = encoder.encode(&MavMessage::HEARTBEAT(HEARTBEAT_DATA::default()));
        for link in 0..16_u8 {
            let signed = observer.sign(&frame, link << 4, NOW + 1_000_000);
            let _ = vehicle.check(&signed, NOW);
        }
    }
    let beat = Encoder::new(GROUND).encode(&MavMessage::HEARTBEAT(HEARTBEAT_DATA::default()));
    let id = ann.link_id(0);
    assert_eq!(vehicle.check(&ann.sign(&beat, id, NOW), NOW), Ok(()));
}

/// The vehicle signs with the shared key, and every station checks with it.
#[test]
fn every_station_accepts_the_vehicle() {
    let (mut vehicle, stations) = crew();
    let beat = Encoder::new(VEHICLE).encode(&MavMessage::HEARTBEAT(HEARTBEAT_DATA::default()));
    for (link, mut station) in stations.into_iter().enumerate() {
        let signed = vehicle.sign(&beat, vehicle.link_id(link), NOW);
        assert_eq!(station.check(&signed, NOW), Ok(()));
    }
}
