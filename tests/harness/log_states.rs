//! Every state in which a log is found: whole, being written, of a killed recorder, cut, damaged.
//! All are made from one intact log, and each states what can still be read.

use std::ops::Range;

use protocol::log::reader::{LogItem, LogReader};

/// Size of the type and the length before every record (MCAP specification, Records).
const HEAD_BYTES: usize = 9;
const MAGIC_BYTES: usize = 8;
const CHUNK: u8 = 6;
const DATA_END: u8 = 15;
/// What a recorder has written of a chunk that it has not closed: the type, and everything that it
/// does not know yet as ones.
const OPEN_CHUNK: [&[u8]; 5] =
    [&[CHUNK], &[0xff; 8], &[0; 16], &[0xff; 12], b"\x03\0\0\0lz4\xff\xff\xff\xff\xff\xff\xff\xff"];

/// A log in one of its states.
#[derive(Debug)]
pub struct LogState {
    pub name: String,
    pub bytes: Vec<u8>,
    /// Nothing is wrong with it.
    pub is_intact: bool,
    /// Messages in front of the damage.
    pub before: u64,
    /// Messages outside of the damage.
    pub outside: u64,
}

/// Every state of a log, which has at least a dozen chunks.
pub fn log_states(intact: &[u8]) -> Vec<LogState> {
    let log = Intact::of(intact);
    let all = log.messages(log.bytes.len());
    let mut states = vec![LogState {
        name: "whole".to_owned(),
        bytes: intact.to_vec(),
        is_intact: true,
        before: all,
        outside: all,
    }];
    let mut add = |name: String, bytes: Vec<u8>, [before, outside]: [u64; 2]| {
        states.push(LogState { name, bytes, is_intact: false, before, outside });
    };
    let hit = log.chunks.len() / 2;
    let (chunk, next) = (log.chunks[hit].clone(), log.chunks[hit + 1].clone());
    let before = log.messages(chunk.start);
    let but_one = all - (log.messages(chunk.end) - before);

    add(
        "being written".to_owned(),
        [&intact[..chunk.start], &OPEN_CHUNK.concat(), &intact[chunk.start..][..300]].concat(),
        [before; 2],
    );
    for part in 1..=8 {
        // The first chunk may have the beginning of the flight alone.
        let at = log.chunks[2 + part * (log.chunks.len() - 3) / 8].start;
        let open = OPEN_CHUNK.concat();
        let open = &open[..open.len() * (part % 3) / 2];
        add(format!("recorder killed {part}/8"), [&intact[..at], open].concat(), [log.messages(at); 2]);
    }
    let cuts = [
        ("magic", MAGIC_BYTES / 2),
        ("head of the first record", MAGIC_BYTES + 4),
        ("head of a chunk's record", chunk.start + 4),
        ("fields of a chunk", chunk.start + HEAD_BYTES + 20),
        ("compressed data", usize::midpoint(chunk.start, chunk.end)),
        ("index of a chunk", chunk.end + 5),
        ("end mark of the data", log.data_end + 4),
        ("summary", usize::midpoint(log.data_end, intact.len())),
        ("footer", intact.len() - MAGIC_BYTES - 4),
        ("magic at the end", intact.len() - 3),
    ];
    for (place, at) in cuts {
        add(format!("cut in the {place}"), intact[..at].to_vec(), [log.messages(at); 2]);
    }
    // A hole begins in the middle of a chunk and ends in the same or in a later one.
    let middle = usize::midpoint(chunk.start, chunk.end);
    for (name, bytes) in [("byte", 1), ("sector", 512), ("64 kB", 1 << 16)] {
        let until = (middle + bytes).min(log.chunks[log.chunks.len() - 3].end - 1);
        let broken = log.chunks.iter().filter(|chunk| chunk.start < until && chunk.end > middle);
        let lost: u64 = broken.map(|chunk| log.messages(chunk.end) - log.messages(chunk.start)).sum();
        let outside = [before, all - lost];
        add(format!("{name} missing"), [&intact[..middle], &intact[until..]].concat(), outside);
        let zeroed = [&intact[..middle], &vec![0; until - middle], &intact[until..]].concat();
        add(format!("{name} of zeros"), zeroed, outside);
    }
    add("byte added".to_owned(), [&intact[..middle], b"\r", &intact[middle..]].concat(), [before, but_one]);
    for (name, byte) in [("zero", 0), ("ff", 0xff)] {
        let tail = [byte; 4096];
        add(format!("{name} tail"), [intact, &tail].concat(), [all; 2]);
        add(format!("cut, and a {name} tail"), [&intact[..chunk.start], &tail].concat(), [before; 2]);
    }
    for bit in 0..8 * HEAD_BYTES {
        let mut bytes = intact.to_vec();
        bytes[chunk.start + bit / 8] ^= 1 << (bit % 8);
        // Its fields state its length, too, and its checksum proves its content.
        let outside = if bit < 8 { but_one } else { all };
        add(format!("bit {bit} of a chunk's head flipped"), bytes, [before, outside]);
    }
    for (name, length) in [("2^60", 1 << 60), ("2^64-9", u64::MAX - 8), ("2^64-1", u64::MAX)] {
        let mut bytes = intact.to_vec();
        bytes[chunk.start + 1..][..8].copy_from_slice(&u64::to_le_bytes(length));
        add(format!("a chunk of {name} bytes"), bytes, [before, all]);
        // The record behind a chunk is its index, which no checksum protects.
        let mut bytes = intact.to_vec();
        bytes[chunk.end + 1..][..8].copy_from_slice(&u64::to_le_bytes(length));
        add(format!("an index of {name} bytes"), bytes, [log.messages(next.start), all]);
    }
    // Its sizes, and the length of the name of its compression.
    for at in [16, 28, 28 + 4 + 3] {
        let mut bytes = intact.to_vec();
        bytes[chunk.start + HEAD_BYTES + at + 3] ^= 0x80;
        add(format!("a size of 2^31 at byte {at} of a chunk"), bytes, [before, but_one]);
    }
    add("empty".to_owned(), Vec::new(), [0; 2]);
    add("header alone".to_owned(), intact[..log.header_end].to_vec(), [0; 2]);
    add("two logs in one file".to_owned(), [intact, intact].concat(), [all; 2]);
    states
}

/// An intact log, and where its parts are.
struct Intact<'a> {
    bytes: &'a [u8],
    header_end: usize,
    chunks: Vec<Range<usize>>,
    data_end: usize,
    /// Messages in front of the end of each chunk.
    counts: Vec<(usize, u64)>,
}

impl<'a> Intact<'a> {
    fn of(bytes: &'a [u8]) -> Self {
        let (mut at, mut chunks, mut header_end) = (MAGIC_BYTES, Vec::new(), 0);
        while bytes[at] != DATA_END {
            let length: [u8; 8] = bytes[at + 1..at + HEAD_BYTES].try_into().expect("eight bytes");
            let end = at + HEAD_BYTES + usize::try_from(u64::from_le_bytes(length)).expect("a small log");
            if bytes[at] == CHUNK {
                chunks.push(at..end);
            }
            header_end = if header_end == 0 { end } else { header_end };
            at = end;
        }
        assert!(chunks.len() >= 12, "{} chunks", chunks.len());
        let counts = chunks.iter().map(|chunk| (chunk.end, count(&bytes[..chunk.end]))).collect();
        Self { bytes, header_end, chunks, data_end: at, counts }
    }

    /// Messages in the chunks that end at this byte or before it.
    fn messages(&self, until: usize) -> u64 {
        self.counts.iter().rfind(|(end, _)| *end <= until).map_or(0, |(_, messages)| *messages)
    }
}

/// Messages at the front of these bytes, which are intact as far as they go.
fn count(bytes: &[u8]) -> u64 {
    let (mut reader, mut messages) = (LogReader::new(bytes), 0);
    while let Some(item) = reader.next_item().expect("bytes in memory") {
        messages += u64::from(matches!(item, LogItem::Message { .. }));
    }
    messages
}
