//! Tests cut and broken logs: no panic, everything before the damage is used, and no damage goes unnoticed.

use proptest::prelude::*;
use protocol::log::computer_v1::ComputerFrame;
use replay::info::{GradeLevel, info_of};
use replay::log::{Entry, FlightLog, LogError};
use replay::verify::Verification;

use crate::flown::{FLIGHT, FRAME_S, Recipe, WHOLE, idle_frame, verify_bytes, write_log};

/// Every frame that can be read, and whether the log is damaged.
fn read_frames(bytes: &[u8]) -> Result<(Vec<ComputerFrame>, bool), LogError> {
    let mut log = FlightLog::read("test.mcap".to_owned(), bytes)?;
    let mut frames = Vec::new();
    while let Some(stamped) = log.next_entry()? {
        if let Entry::ComputerFrame(frame) = stamped.entry {
            frames.push(frame.record);
        }
    }
    Ok((frames, log.damage().is_some()))
}

/// Where the data end and the summary begins.
fn data_end() -> usize {
    usize::try_from(WHOLE.synced.last().unwrap().0).unwrap()
}

#[test]
fn a_log_cut_anywhere_yields_what_was_synced_before_the_cut() {
    let bytes = &WHOLE.bytes;
    // Cuts at multiples of a prime reach every position inside a record; others are exactly at and around each sync.
    let around_syncs =
        WHOLE.synced.iter().flat_map(|(at, _)| (at - 1)..=(at + 1)).map(|at| usize::try_from(at).unwrap());
    for cut in (1..data_end()).step_by(37).chain(around_syncs) {
        let later = WHOLE.synced.partition_point(|(at, _)| *at <= cut as u64);
        let safe = later.checked_sub(1).map_or(0, |last| WHOLE.synced[last].1);
        // The messages of a sync are complete some bytes before it, and a full chunk ends before it, too.
        let most = WHOLE.synced.get(later).map_or(safe, |(_, frames)| *frames);
        match read_frames(&bytes[..cut]) {
            Ok((frames, damaged)) => {
                assert!((safe..=most).contains(&frames.len()), "cut after {cut} bytes: {}", frames.len());
                assert!(FLIGHT.frames.starts_with(&frames), "cut after {cut} bytes");
                assert!(damaged, "cut after {cut} bytes");
            }
            Err(error) => assert_eq!(safe, 0, "cut after {cut} bytes: {error}"),
        }
    }
}

#[test]
fn the_readable_part_of_a_cut_log_is_verified() {
    for place in [0, 3, 7] {
        let (at, frames) = WHOLE.synced[place];
        let report = verify_bytes(&WHOLE.bytes[..usize::try_from(at).unwrap() + 11]).unwrap();
        assert_eq!(report.outcome, Verification::IdenticalReadablePart);
        assert_eq!(report.frames_identical, frames as u64);
        assert!(report.damage.unwrap().contains("without an end mark"));
    }
}

#[test]
fn a_cut_log_is_described_up_to_the_cut() {
    let (at, frames) = WHOLE.synced[5];
    let cut = &WHOLE.bytes[..usize::try_from(at).unwrap() + 3];
    let mut log = FlightLog::read("test.mcap".to_owned(), cut).unwrap();
    let info = info_of(&mut log, || None).unwrap();
    assert_eq!(info.grade.level, GradeLevel::BitExact);
    assert_eq!(info.frames.unwrap().last, frames as u64);
    assert!(!info.completeness.complete);
    let until_s = info.completeness.readable_until_s.unwrap();
    assert!((until_s - frames as f64 * FRAME_S).abs() < 1e-6, "{until_s}");
}

/// Records shorter than their fields, of every known and unknown type, after a good beginning.
#[test]
fn a_record_too_short_for_its_type_ends_the_reading() {
    let beginning = &WHOLE.bytes[..usize::try_from(WHOLE.synced[0].0).unwrap()];
    for opcode in 0..=u8::MAX {
        for length in 0..48_u8 {
            let mut bytes = beginning.to_vec();
            bytes.push(opcode);
            bytes.extend(u64::from(length).to_le_bytes());
            bytes.extend(std::iter::repeat_n(0, usize::from(length)));
            let (frames, damaged) = read_frames(&bytes).unwrap();
            assert_eq!(frames.len(), WHOLE.synced[0].1, "type {opcode}, {length} bytes");
            // An end-of-data record of four bytes, without a checksum, is valid.
            assert!(damaged || opcode == mcap::records::op::DATA_END, "type {opcode}, {length} bytes");
        }
    }
}

/// A NaN's payload and the sign of zero go into a log and come out again.
#[test]
fn every_bit_pattern_survives_the_log() {
    let patterns = [0x7ff8_0000_0000_0001, 0xfff0_dead_beef_cafe, 0x8000_0000_0000_0000, 1, u64::MAX];
    let frames: Vec<ComputerFrame> = (1..)
        .zip(patterns)
        .map(|(number, bits)| {
            let mut frame = idle_frame(number);
            frame.input.time_s = f64::from_bits(bits);
            frame.output.gimbal_rad[0] = f64::from_bits(bits);
            frame
        })
        .collect();
    let (read, damaged) = read_frames(&write_log(&frames, &Recipe::default()).bytes).unwrap();
    assert!(!damaged);
    for (frame, bits) in read.iter().zip(patterns) {
        assert_eq!(frame.input.time_s.to_bits(), bits);
        assert_eq!(frame.output.gimbal_rad[0].to_bits(), bits);
    }
    assert_eq!(read.len(), patterns.len());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 512, ..ProptestConfig::default() })]

    /// Whichever bit of the data is flipped: either the file is refused, or the log is known to be damaged and every
    /// frame that is read is an original frame.
    #[test]
    fn no_flipped_bit_goes_unnoticed(place in 0..data_end(), bit in 0_u32..8) {
        let mut bytes = WHOLE.bytes.clone();
        bytes[place] ^= 1_u8 << bit;
        if let Ok((frames, damaged)) = read_frames(&bytes) {
            prop_assert!(damaged);
            prop_assert!(frames.iter().all(|frame| FLIGHT.frames.contains(frame)));
        }
    }

    /// After the data there is only what this reader does not need, under a checksum of its own.
    #[test]
    fn a_broken_summary_is_told_and_loses_no_frame(place in data_end() + 13..WHOLE.bytes.len(), bit in 0_u32..8) {
        let mut bytes = WHOLE.bytes.clone();
        bytes[place] ^= 1_u8 << bit;
        let (frames, damaged) = read_frames(&bytes).unwrap();
        prop_assert_eq!(frames.len(), FLIGHT.frames.len());
        prop_assert!(damaged);
    }

    /// Overwrites stretches of the log with bytes of another file.
    #[test]
    fn an_overwritten_stretch_is_survived(
        place in 8..data_end(), stretch in prop::collection::vec(any::<u8>(), 1..400),
    ) {
        let mut bytes = WHOLE.bytes.clone();
        let end = (place + stretch.len()).min(bytes.len());
        bytes[place..end].copy_from_slice(&stretch[..end - place]);
        if let Ok((frames, _)) = read_frames(&bytes) {
            prop_assert!(frames.iter().all(|frame| FLIGHT.frames.contains(frame)));
        }
    }

    #[test]
    fn random_bytes_are_refused(bytes in prop::collection::vec(any::<u8>(), 0..600), with_magic: bool) {
        let magic: &[u8] = if with_magic { b"\x89MCAP0\r\n" } else { b"" };
        let file = [magic, &bytes].concat();
        prop_assert!(read_frames(&file).is_err());
        prop_assert!(verify_bytes(&file).is_err());
    }
}
