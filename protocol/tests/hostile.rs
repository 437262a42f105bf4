//! Runs the fuzz targets for a bounded time with proptest. `PROPTEST_CASES` sets how many cases.

use proptest::prelude::*;

#[path = "../fuzz/hostile.rs"]
pub mod hostile;

/// Bytes in the format that the fuzz targets parse: lengths, and message ids that exist.
fn pieces() -> impl Strategy<Value = Vec<u8>> {
    let id = prop_oneof![0u16..=512, 54_000u16..=54_010, any::<u16>()];
    let piece = (id, any::<[u8; 2]>(), prop::collection::vec(any::<u8>(), 0..251));
    prop::collection::vec(piece, 0..12).prop_map(|pieces| {
        let mut bytes = Vec::new();
        for (id, source, payload) in pieces {
            bytes.push((4 + payload.len()) as u8);
            bytes.extend_from_slice(&id.to_le_bytes());
            bytes.extend_from_slice(&source);
            bytes.extend_from_slice(&payload);
        }
        bytes
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2_000))]

    #[test]
    fn any_stream_is_framed(data in prop::collection::vec(any::<u8>(), 0..2_000)) {
        hostile::stream(&data);
    }

    #[test]
    fn a_stream_of_markers_is_framed(data in prop::collection::vec(prop::sample::select(vec![0xFDu8, 0xFE, 0, 1, 9, 0xFF]), 0..2_000)) {
        hostile::stream(&data);
    }

    #[test]
    fn any_frame_is_decoded(data in pieces()) {
        hostile::frames(&data);
    }

    #[test]
    fn any_log_is_read(data in prop::collection::vec(any::<u8>(), 0..300), magic: bool) {
        hostile::log(&data);
        if magic {
            hostile::log(&[mcap::MAGIC, &data].concat());
        }
    }

    #[test]
    fn any_links_are_carried(kinds in prop::collection::vec(any::<u8>(), 0..12), data in pieces()) {
        // A byte before each piece says what the link receives.
        let mut bytes = Vec::new();
        let mut rest = &data[..];
        for kind in kinds {
            let [len, tail @ ..] = rest else { break };
            let (piece, after) = tail.split_at(tail.len().min(usize::from(*len)));
            bytes.extend_from_slice(&[kind, *len]);
            bytes.extend_from_slice(piece);
            rest = after;
        }
        hostile::hub(&bytes);
    }
}
