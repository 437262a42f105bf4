//! Tests cut and broken logs: no panic, everything before the damage is used, and no damage goes
//! unnoticed.

use proptest::prelude::*;
use protocol::log::computer_v1::ComputerFrame;
use replay::log::{Entry, FlightLog, LogError};

use crate::flown::{COMPLETE, FLIGHT, verify_bytes};

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
    usize::try_from(COMPLETE.synced.last().unwrap().0).unwrap()
}

/// Records shorter than their fields, of every known and unknown type, after a good beginning.
#[test]
fn a_record_too_short_for_its_type_ends_the_reading() {
    let beginning = &COMPLETE.bytes[..usize::try_from(COMPLETE.synced[0].0).unwrap()];
    for opcode in 0..=u8::MAX {
        for length in 0..48_u8 {
            let mut bytes = beginning.to_vec();
            bytes.push(opcode);
            bytes.extend(u64::from(length).to_le_bytes());
            bytes.extend(std::iter::repeat_n(0, usize::from(length)));
            let (frames, damaged) = read_frames(&bytes).unwrap();
            assert_eq!(frames.len(), COMPLETE.synced[0].1, "type {opcode}, {length} bytes");
            // An end-of-data record of four bytes, without a checksum, is valid.
            assert!(damaged || opcode == mcap::records::op::DATA_END, "type {opcode}, {length} bytes");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 512, ..ProptestConfig::default() })]

    /// Whichever bit of the data is flipped: either the file is refused, or the log is known to be
    /// damaged and every frame that is read is an original frame.
    #[test]
    fn no_flipped_bit_goes_unnoticed(place in 0..data_end(), bit in 0_u32..8) {
        let mut bytes = COMPLETE.bytes.clone();
        bytes[place] ^= 1_u8 << bit;
        if let Ok((frames, damaged)) = read_frames(&bytes) {
            prop_assert!(damaged);
            prop_assert!(frames.iter().all(|frame| FLIGHT.frames.contains(frame)));
        }
    }

    /// After the data there is only what this reader does not need, under a checksum of its own.
    #[test]
    fn a_broken_summary_is_reported_and_loses_no_frame(place in data_end() + 13..COMPLETE.bytes.len(), bit in 0_u32..8) {
        let mut bytes = COMPLETE.bytes.clone();
        bytes[place] ^= 1_u8 << bit;
        let (frames, damaged) = read_frames(&bytes).unwrap();
        prop_assert_eq!(frames.len(), FLIGHT.frames.len());
        prop_assert!(damaged);
    }

    #[test]
    fn random_bytes_are_refused(bytes in prop::collection::vec(any::<u8>(), 0..600), with_magic: bool) {
        let magic: &[u8] = if with_magic { b"\x89MCAP0\r\n" } else { b"" };
        let file = [magic, &bytes].concat();
        prop_assert!(read_frames(&file).is_err());
        prop_assert!(verify_bytes(&file).is_err());
    }
}
