//! Tests the recovery of whole logs from damaged ones.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use mcap::records::{MessageHeader, Metadata};
use proptest::prelude::*;
use proptest::test_runner::TestRunner;
use protocol::log::reader::Damage;
use replay::info::info;
use replay::log::{FlightLog, Recording};
use replay::recover::recover;

use crate::command_line::{replay, run};
use crate::flown::COMPLETE;
use crate::from_apogee::LANDED;
use crate::simulated::DISPERSED;
use crate::tampered::Held;

/// Recovers bytes; `None` if they were refused.
fn recovered(bytes: &[u8], directory: &Path) -> Option<(replay::recover::Recovery, Recording)> {
    let (input, output) = (directory.join("in.mcap"), directory.join("out.mcap"));
    let _ = std::fs::remove_file(&output);
    std::fs::write(&input, bytes).unwrap();
    let recovery = recover(&input, &output).ok()?;
    Some((recovery, Recording::open(&output).ok()?))
}

/// A number in the summary is accepted only under the summary's checksum.
#[test]
fn a_changed_summary_does_not_count_what_is_lost() {
    let directory = tempfile::tempdir().unwrap();
    let mut bytes = COMPLETE.bytes.clone();
    let mut at = usize::try_from(COMPLETE.synced.last().unwrap().0).unwrap();
    while bytes[at] != mcap::records::op::STATISTICS {
        let length = u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap());
        at += 9 + usize::try_from(length).unwrap();
    }
    // Another sixteen million messages.
    bytes[at + 9 + 3] ^= 1;
    let (recovery, _) = recovered(&bytes, directory.path()).unwrap();
    assert_eq!((recovery.messages_counted, recovery.fault().is_some()), (None, true));
    assert!(!recovery.summary_is_intact, "{recovery:?}");
}

/// Messages, and the place behind the last chunk of a whole log.
fn complete_log_and_ends_of_its_chunks() -> (Messages, usize) {
    let original = &ORIGINALS[0];
    (original.messages.clone(), original.chunks.last().unwrap().end)
}

/// A log with everything that a summary can hold, and little of it: four chunks, two topics,
/// metadata and an attachment.
fn small_log() -> Vec<u8> {
    let options = mcap::WriteOptions::new().chunk_size(None);
    let mut writer = options.create(std::io::Cursor::new(Vec::new())).unwrap();
    let schema = writer.add_schema("s", "text", b"x").unwrap();
    let channels =
        ["/a", "/b"].map(|topic| writer.add_channel(schema, topic, "text", &BTreeMap::new()).unwrap());
    let about = Metadata { name: "about".to_owned(), metadata: BTreeMap::new() };
    writer.write_metadata(&about).unwrap();
    let (name, media_type) = ("n".to_owned(), "text".to_owned());
    let data = std::borrow::Cow::Borrowed(&b"data"[..]);
    writer.attach(&mcap::Attachment { log_time: 0, create_time: 0, name, media_type, data }).unwrap();
    for number in 0..8 {
        let (log_time, channel_id) = (1_000 * u64::from(number), channels[number as usize % 2]);
        let header = MessageHeader { channel_id, sequence: number, log_time, publish_time: log_time };
        writer.write_to_known_channel(&header, &[number as u8; 9]).unwrap();
        if number % 2 == 1 {
            writer.flush().unwrap();
        }
    }
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

/// A disk that is full, a limit of the file's size, a recorder that is killed while it closes: what
/// is left of the list of chunks is not taken for the whole list.
#[test]
fn a_log_cut_at_any_byte_behind_its_chunks_loses_no_message() {
    let directory = tempfile::tempdir().unwrap();
    let (input, output) = (directory.path().join("in.mcap"), directory.path().join("out.mcap"));
    let small = small_log();
    let small_end = mcap::Summary::read(&small).unwrap().unwrap().chunk_indexes;
    let small_end =
        small_end.iter().map(|index| index.chunk_start_offset + index.chunk_length).max().unwrap();
    let (_, whole_end) = complete_log_and_ends_of_its_chunks();
    // Every byte of the small one; of the other, whose schemas are long, some of every kind of
    // record.
    for (bytes, chunks_end, step) in
        [(&small, usize::try_from(small_end).unwrap(), 1), (&COMPLETE.bytes, whole_end, 97)]
    {
        std::fs::write(&input, bytes).unwrap();
        let messages = Held::read(&input).facts();
        for cut in (chunks_end..bytes.len()).step_by(step) {
            std::fs::write(&input, &bytes[..cut]).unwrap();
            let recovery = recover(&input, &output).unwrap();
            assert_eq!(Held::read(&output).facts(), messages, "cut at {cut}: {recovery:?}");
            assert_eq!(recovery.messages_counted, None, "{cut}");
            assert!(recovery.fault().is_some(), "{cut}");
            assert!(recovery.lost.iter().all(|lost| lost.from_byte >= chunks_end as u64), "{recovery:?}");
            std::fs::remove_file(&output).unwrap();
        }
        std::fs::write(&input, &bytes[..bytes.len() - 60]).unwrap();
        let (code, stdout, _) = run(replay("recover", &input).arg(&output));
        assert!(code == 0 && stdout.contains("DAMAGED: "), "{stdout}");
        std::fs::remove_file(&output).unwrap();
    }
}

/// What a log holds: topic, time, number and bytes of each message.
type Messages = BTreeSet<(String, u64, u32, Vec<u8>)>;

fn messages_of(path: &Path) -> (Messages, Option<Damage>) {
    let mut log = FlightLog::open(path).unwrap();
    let mut messages = Messages::new();
    while let Some(stamped) = log.next_entry().unwrap() {
        let topic = log.channel(stamped.channel_id).map_or_else(String::new, |channel| channel.topic.clone());
        messages.insert((topic, stamped.log_time_ns, stamped.sequence, stamped.data));
    }
    (messages, log.damage().cloned())
}

/// A whole log: its bytes, its messages, and where each of its chunks lies.
struct Original {
    bytes: Vec<u8>,
    messages: Messages,
    chunks: Vec<std::ops::Range<usize>>,
}

impl Original {
    fn of(bytes: Vec<u8>) -> Self {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("original.mcap");
        std::fs::write(&path, &bytes).unwrap();
        let (messages, damage) = messages_of(&path);
        assert_eq!(damage, None);
        let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
        let place = |bytes: u64| usize::try_from(bytes).unwrap();
        let mut chunks: Vec<_> = summary
            .chunk_indexes
            .iter()
            .map(|index| {
                let begins = place(index.chunk_start_offset);
                begins..begins + place(index.chunk_length)
            })
            .collect();
        chunks.sort_by_key(|chunk| chunk.start);
        assert!(chunks.len() > 3);
        Self { bytes, messages, chunks }
    }
}

static ORIGINALS: LazyLock<[Original; 3]> = LazyLock::new(|| {
    let read = |path: &PathBuf| Original::of(std::fs::read(path).unwrap());
    [Original::of(COMPLETE.bytes.clone()), read(&DISPERSED.log), read(&LANDED.log)]
});

/// One thing that can happen to a chunk.
#[derive(Debug, Clone, Copy)]
enum Harm {
    /// It and its index are gone.
    Gone,
    /// It is there twice.
    Twice,
    /// It has changed places with the next.
    Swapped,
    /// One bit of it is turned.
    Flipped,
    /// Some of its bytes are missing.
    Shortened,
    /// Some bytes were written into it.
    Inserted,
    /// It says that it unpacks to 4 GB.
    Inflated,
    /// The file ends within it.
    Cut,
    /// A chunk of another log follows it.
    Spliced,
    /// In the summary a topic has another name.
    Renamed,
}

const HARMS: [Harm; 10] = [
    Harm::Gone,
    Harm::Twice,
    Harm::Swapped,
    Harm::Flipped,
    Harm::Shortened,
    Harm::Inserted,
    Harm::Inflated,
    Harm::Cut,
    Harm::Spliced,
    Harm::Renamed,
];

fn harmed(original: &Original, harm: Harm, chunk: usize, place: usize) -> Vec<u8> {
    let bytes = &original.bytes;
    let chunk = chunk % (original.chunks.len() - 1);
    let (this, next) = (original.chunks[chunk].clone(), original.chunks[chunk + 1].clone());
    let within = this.start + place % this.len();
    let mut harmed = bytes.clone();
    match harm {
        Harm::Gone => drop(harmed.drain(this.start..next.start)),
        Harm::Twice => drop(harmed.splice(next.start..next.start, bytes[this.start..next.start].to_vec())),
        Harm::Swapped => {
            let swapped = [&bytes[next.clone()], &bytes[this.end..next.start], &bytes[this.clone()]].concat();
            harmed[this.start..next.end].copy_from_slice(&swapped);
        }
        Harm::Flipped => harmed[within] ^= 1 << (place % 8),
        Harm::Shortened => drop(harmed.drain(within..(within + 1 + place % 300).min(this.end))),
        Harm::Inserted => drop(harmed.splice(within..within, vec![0x55; 1 + place % 300])),
        Harm::Inflated => harmed[this.start + 9 + 16..][..8].copy_from_slice(&(4_u64 << 30).to_le_bytes()),
        Harm::Cut => harmed.truncate(within),
        Harm::Spliced => {
            let other = ORIGINALS.iter().find(|other| !std::ptr::eq(*other, original)).unwrap();
            let foreign = other.bytes[other.chunks[place % other.chunks.len()].clone()].to_vec();
            drop(harmed.splice(next.start..next.start, foreign));
        }
        Harm::Renamed => {
            let summary = original.chunks.last().unwrap().end;
            let topic = b"/computer/frame";
            let names = bytes[summary..].windows(topic.len()).position(|window| window == topic).unwrap();
            harmed[summary + names + 1 + place % (topic.len() - 1)] ^= 1 << (place % 3);
        }
    }
    harmed
}

/// Recovers a harmed log, and asserts what has to hold of every recovery.
fn assert_nothing_is_laundered(original: &Original, bytes: &[u8], is_spliced: bool, what: &str) {
    let directory = tempfile::tempdir().unwrap();
    let (input, output) = (directory.path().join("in.mcap"), directory.path().join("out.mcap"));
    std::fs::write(&input, bytes).unwrap();
    let strictly = |path: &PathBuf| run(replay("verify", path).arg("--strict")).0;
    assert_ne!(strictly(&input), 0, "{what}: the harmed log itself");
    let Ok(recovery) = recover(&input, &output) else { return };
    if recovery.recovered.out_of_order {
        assert!(recovery.fault().unwrap().contains("not in order of time"), "{what}: {recovery:?}");
        assert_ne!(strictly(&output), 0, "{what}: the recovered log");
        return;
    }
    let (kept, damage) = messages_of(&output);
    assert!(is_spliced || kept.is_subset(&original.messages), "{what}: something was invented");
    assert!(recovery.fault().is_some(), "{what}: {recovery:?}");
    assert!(matches!(damage, Some(Damage::Recovered(_))), "{what}: {damage:?}");
    assert!(!info(&output).unwrap().completeness.complete, "{what}");
    assert_ne!(strictly(&output), 0, "{what}: the recovered log");
    if is_spliced {
        return;
    }
    if let Some(counted) = recovery.messages_counted {
        assert_eq!(counted, original.messages.len() as u64, "{what}: {recovery:?}");
    }
    // What is lost lies where the report says; without a summary some losses have no time.
    let first_ns = kept.iter().map(|(_, at_ns, ..)| *at_ns).min().unwrap();
    let in_a_span = |at_ns: u64| {
        let at_s = (at_ns as f64 - first_ns as f64) / 1e9;
        let spans = recovery.lost.iter().map(|lost| lost.span_s);
        spans
            .into_iter()
            .any(|span| span.is_none_or(|(from, until)| (from - 1e-6..=until + 1e-6).contains(&at_s)))
    };
    let unreported = original.messages.difference(&kept).find(|(_, at_ns, ..)| !in_a_span(*at_ns));
    let unreported = unreported.map(|(topic, at_ns, ..)| (topic, (*at_ns as f64 - first_ns as f64) / 1e9));
    // Without an end mark the rest is unknown; without its channel's record a message has no topic;
    // and a chunk that is not there leaves only the count of messages.
    let is_counted = recovery.messages_counted.is_some_and(|counted| counted != recovery.recovered.messages);
    let open_end = !recovery.ended || recovery.recovered.undecodable > 0 || is_counted;
    assert!(
        unreported.is_none() || open_end,
        "{what}: {unreported:?} is lost and not reported: {recovery:?}"
    );
}

#[test]
fn a_missing_chunk_is_reported_wherever_it_was() {
    for original in &*ORIGINALS {
        for chunk in [0, original.chunks.len() / 2, original.chunks.len() - 2] {
            for harm in [Harm::Gone, Harm::Twice, Harm::Swapped] {
                let bytes = harmed(original, harm, chunk, 0);
                assert_nothing_is_laundered(original, &bytes, false, &format!("chunk {chunk} {harm:?}"));
            }
        }
    }
}

/// The bytes that are missing cost their own chunk, and no more.
#[test]
fn bytes_missing_in_a_chunk_lose_that_chunk_alone() {
    let original = &ORIGINALS[2];
    let bytes = harmed(original, Harm::Shortened, 1, 299);
    let directory = tempfile::tempdir().unwrap();
    let (recovery, _) = recovered(&bytes, directory.path()).unwrap();
    assert_eq!(recovery.recovered.chunks as usize, original.chunks.len() - 1, "{recovery:?}");
    assert!(recovery.ended);
}

/// Harms three logs in so many ways.
fn harm_in_ways(cases: u32) {
    let mut runner = TestRunner::new(ProptestConfig { cases, ..ProptestConfig::default() });
    let ways = (0_usize..3, prop::sample::select(HARMS.to_vec()), 0_usize..1_000, 0_usize..100_000);
    let ended = runner.run(&ways, |(log, harm, chunk, place)| {
        let original = &ORIGINALS[log];
        let what = format!("{log} {harm:?} {chunk} {place}");
        let is_spliced = matches!(harm, Harm::Spliced);
        assert_nothing_is_laundered(original, &harmed(original, harm, chunk, place), is_spliced, &what);
        Ok(())
    });
    ended.unwrap();
}

/// Chunks of three logs are cut, dropped, swapped, repeated, spliced, flipped, renamed and
/// inflated.
#[test]
fn no_recovery_of_a_damaged_log_calls_it_intact() {
    harm_in_ways(100);
}

#[test]
#[ignore = "takes minutes: a thousand ways instead of a hundred"]
fn no_recovery_of_a_log_damaged_in_a_thousand_ways_calls_it_intact() {
    harm_in_ways(1_000);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 128, ..ProptestConfig::default() })]

    /// Whatever is broken: no panic, and every frame kept is an original frame.
    #[test]
    fn nothing_false_is_recovered(
        place in 8..COMPLETE.bytes.len(),
        stretch in prop::collection::vec(any::<u8>(), 1..300),
        cut in 0..COMPLETE.bytes.len(),
    ) {
        let directory = tempfile::tempdir().unwrap();
        let mut bytes = COMPLETE.bytes.clone();
        let end = (place + stretch.len()).min(bytes.len());
        bytes[place..end].copy_from_slice(&stretch[..end - place]);
        bytes.truncate(bytes.len().max(cut + 1) - cut / 2);
        if let Some((_, again)) = recovered(&bytes, directory.path()) {
            for frame in &again.frames {
                let number = usize::try_from(frame.input.frame).unwrap() - 1;
                let then = &crate::flown::FLIGHT.frames[number];
                prop_assert_eq!(&frame.input, &then.input);
                prop_assert_eq!(frame.state_digest, then.state_digest);
            }
        }
    }
}
