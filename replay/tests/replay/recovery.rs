//! Tests the recovery of whole logs from damaged ones.

use std::path::Path;

use proptest::prelude::*;
use replay::log::Recording;
use replay::recover::recover;
use replay::verify::{Verification, verify};

use crate::flown::{WHOLE, only};
use crate::simulated::DISPERSED;

/// Recovers bytes; `None` if they were refused.
fn recovered(bytes: &[u8], directory: &Path) -> Option<(replay::recover::Recovery, Recording)> {
    let (input, output) = (directory.join("in.mcap"), directory.join("out.mcap"));
    let _ = std::fs::remove_file(&output);
    std::fs::write(&input, bytes).unwrap();
    let recovery = recover(&input, &output).ok()?;
    Some((recovery, Recording::open(&output).ok()?))
}

#[test]
fn a_whole_log_recovers_whole() {
    let directory = tempfile::tempdir().unwrap();
    let bytes = std::fs::read(&DISPERSED.log).unwrap();
    let (recovery, again) = recovered(&bytes, directory.path()).unwrap();
    assert!(recovery.ended && recovery.lost.is_empty(), "{recovery:?}");
    let then = DISPERSED.recording();
    assert_eq!((again.ticks, again.truth, again.verdict), (then.ticks, then.truth, then.verdict));
    assert_eq!(again.damage, None);
    let verified = only(verify(&directory.path().join("out.mcap")).unwrap());
    assert_eq!(verified.outcome, Verification::Identical, "profile and all");
}

/// The log of a killed recorder: everything that was synced, and the result is a whole log.
#[test]
fn a_cut_log_recovers_what_was_synced() {
    let directory = tempfile::tempdir().unwrap();
    for (at, ticks) in &WHOLE.synced[..WHOLE.synced.len() - 1] {
        let cut = &WHOLE.bytes[..usize::try_from(*at).unwrap() + 3];
        let (recovery, again) = recovered(cut, directory.path()).unwrap();
        assert_eq!((again.ticks.len(), again.damage), (*ticks, None), "cut after {at}");
        assert!(!recovery.ended);
        let verified = only(verify(&directory.path().join("out.mcap")).unwrap());
        // Data that was not yet on the disk is missing, although no checksum shows it any more.
        assert_eq!(verified.outcome, Verification::IdenticalReadablePart);
        assert_eq!((verified.ticks_identical, verified.cut.unwrap().contact_s), (*ticks as u64, None));
    }
}

/// One broken chunk loses only itself, and its position is reported.
#[test]
fn chunks_after_a_broken_chunk_are_kept() {
    let directory = tempfile::tempdir().unwrap();
    let mut bytes = WHOLE.bytes.clone();
    let (at, before) = WHOLE.synced[3];
    bytes[usize::try_from(at).unwrap() + 200] ^= 0x10;
    let (recovery, again) = recovered(&bytes, directory.path()).unwrap();
    let all = WHOLE.synced.last().unwrap().1;
    assert_eq!(again.ticks.len(), all - 5, "{recovery:?}");
    assert_eq!(again.ticks_unbroken, before);
    assert_eq!(recovery.lost.len(), 1);
    let (from_s, until_s) = recovery.lost[0].span_s.unwrap();
    assert!((from_s - before as f64 * 0.1).abs() < 1e-6 && (until_s - from_s - 0.4).abs() < 1e-6);
}

/// The length of a record is broken, so nobody knows where the next begins; the summary at the end does.
#[test]
fn after_a_broken_record_the_summary_locates_the_next_chunk() {
    let directory = tempfile::tempdir().unwrap();
    let mut bytes = WHOLE.bytes.clone();
    let (at, before) = WHOLE.synced[3];
    bytes[usize::try_from(at).unwrap() + 8] = 0x7f;
    let (recovery, again) = recovered(&bytes, directory.path()).unwrap();
    assert!(again.ticks.len() > before, "{recovery:?}");
    assert!(recovery.ended && recovery.lost.len() == 1, "{recovery:?}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 128, ..ProptestConfig::default() })]

    /// Whatever is broken: no panic, and every tick kept is an original tick.
    #[test]
    fn nothing_false_is_recovered(
        place in 8..WHOLE.bytes.len(),
        stretch in prop::collection::vec(any::<u8>(), 1..300),
        cut in 0..WHOLE.bytes.len(),
    ) {
        let directory = tempfile::tempdir().unwrap();
        let mut bytes = WHOLE.bytes.clone();
        let end = (place + stretch.len()).min(bytes.len());
        bytes[place..end].copy_from_slice(&stretch[..end - place]);
        bytes.truncate(bytes.len().max(cut + 1) - cut / 2);
        if let Some((_, again)) = recovered(&bytes, directory.path()) {
            for tick in &again.ticks {
                let number = usize::try_from(tick.input.tick).unwrap();
                let then = &crate::flown::FLIGHT.ticks[number];
                prop_assert_eq!(&tick.input, &then.input);
                prop_assert_eq!(tick.state_digest, then.state_digest);
            }
        }
    }
}
