//! Recovers a whole log from a damaged one.
//!
//! A recorder that was killed leaves a log without its end; a bad disk or a cable may damage the middle. Every chunk with a
//! correct checksum is kept, also after a broken one. The chunks are the truth: what the summary lists and counts helps only if
//! the summary is whole. The report lists what is lost, and so does the recovered log itself ([`METADATA_RECOVERY`]). Nothing is
//! invented: a message is kept unchanged or not at all. A log that is not in order of time is sorted.

pub(crate) mod scan;
pub(crate) mod write;

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use anyhow::Result;
use mcap::records::{Metadata, op};
use protocol::log::record::{METADATA_RECOVERY, RECOVERY_FAULT_ENTRY};
use scan::{ChunkName, Good, Records};
use serde::Serialize;
use write::Rescue;

use crate::cli::{Outcome, answer};
use crate::log::{IN_ORDER_NS, LogError, is_tlog};
use crate::output::{Destination, Overwrite, WriteError};
use crate::print::{counted, print_json, shown};

/// Why nothing could be recovered.
#[derive(Debug, thiserror::Error)]
pub enum RecoverError {
    /// The file is not an MCAP file, or cannot be read.
    #[error(transparent)]
    Log(#[from] LogError),
    /// Nothing has to be recovered.
    #[error("{}: is a .tlog, of which every command reads what can be read; `replay export` makes a log of that", path.display())]
    Tlog { path: PathBuf },
    /// No message could be kept.
    #[error("{name}: no message can be recovered{}", reason.as_ref().map(|why| format!(": {why}")).unwrap_or_default())]
    Nothing {
        /// The file.
        name: String,
        /// What is wrong with it first.
        reason: Option<String>,
    },
    #[error(transparent)]
    Write(#[from] WriteError),
}

/// A stretch of a file that could not be kept.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Lost {
    /// Its first byte; of a chunk that is not there, its first byte in the file as it was.
    pub from_byte: u64,
    /// Its length.
    pub bytes: u64,
    /// The times of its messages, s after the first message kept; `None` if the file does not tell.
    pub span_s: Option<(f64, f64)>,
    pub reason: String,
}

/// Report of a recovery.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Recovery {
    /// The damaged log.
    pub input: String,
    /// The recovered one.
    pub output: PathBuf,
    /// Messages kept.
    pub messages: u64,
    /// Chunks kept.
    pub chunks: u64,
    /// Attachments and metadata records kept.
    pub records_about: u64,
    /// From the first message kept to the last, s.
    pub kept_s: Option<f64>,
    /// What was lost.
    pub lost: Vec<Lost>,
    /// Messages that the summary counts and that were not kept; `None` without a summary.
    pub messages_lost: Option<u64>,
    /// Messages of a channel that nothing describes.
    pub undecodable: u64,
    /// Chunks that were there twice; one of each is kept.
    pub repeated: u64,
    /// Chunks that the summary does not know: of another log, and left out.
    pub foreign: u64,
    /// Chunks were not in the order of the summary; they are now.
    pub reordered: bool,
    /// Messages were not in order of time, which is no damage; they are now.
    pub sorted: bool,
    /// What was wrong with the summary; no message is lost with it.
    pub summary_fault: Option<&'static str>,
    /// Whether the log has its end mark, so nothing is missing at the end.
    pub ended: bool,
}

impl Recovery {
    /// Whether the log was whole.
    pub fn was_whole(&self) -> bool {
        let Self {
            lost, messages_lost, undecodable, repeated, foreign, reordered, ended, summary_fault, ..
        } = self;
        lost.is_empty()
            && summary_fault.is_none()
            && messages_lost.unwrap_or(0) + undecodable + repeated + foreign == 0
            && !reordered
            && *ended
    }

    /// What the recovered log says of itself.
    fn about(&self) -> Metadata {
        let lost = self.lost.iter().map(|lost| {
            format!("bytes {} to {}: {}", lost.from_byte, lost.from_byte + lost.bytes, lost.reason)
        });
        let facts = BTreeMap::from([
            ("from".to_owned(), self.input.clone()),
            ("ended".to_owned(), self.ended.to_string()),
            ("lost".to_owned(), lost.collect::<Vec<_>>().join("; ")),
            (RECOVERY_FAULT_ENTRY.to_owned(), self.fault().unwrap_or_default()),
        ]);
        Metadata { name: METADATA_RECOVERY.to_owned(), metadata: facts }
    }

    /// What was wrong with the log, for the recovered one; `None` if it was whole.
    pub fn fault(&self) -> Option<String> {
        let mut faults = Vec::new();
        faults.extend(self.lost.first().map(|lost| {
            let bytes: u64 = self.lost.iter().map(|lost| lost.bytes).sum();
            format!(
                "{} stretches of {bytes} bytes are lost, the first from byte {}",
                self.lost.len(),
                lost.from_byte
            )
        }));
        faults.extend(
            self.messages_lost.filter(|lost| *lost > 0).map(|lost| format!("{lost} messages are lost")),
        );
        if self.undecodable > 0 {
            faults.push(format!("{} messages of an unknown channel were dropped", self.undecodable));
        }
        if self.repeated > 0 {
            faults.push(format!("{} chunks were there twice", self.repeated));
        }
        if self.foreign > 0 {
            faults.push(format!("{} chunks of another log were left out", self.foreign));
        }
        if self.reordered {
            faults.push("its chunks were out of order".to_owned());
        }
        faults.extend(self.summary_fault.map(|fault| format!("{fault}, and no message with it")));
        if !self.ended {
            faults.push("it had no end mark, so its end may be lost".to_owned());
        }
        (!faults.is_empty()).then(|| faults.join("; "))
    }
}

/// Recovers a log into a new file.
///
/// # Errors
/// The input is not an MCAP file, cannot be read, or holds no message that can be kept; the output exists and may not be
/// replaced, or cannot be written.
pub fn recover<'a>(input: &Path, output: impl Into<Destination<'a>>) -> Result<Recovery, RecoverError> {
    let destination = output.into();
    if is_tlog(input).unwrap_or_default() {
        return Err(RecoverError::Tlog { path: input.to_owned() });
    }
    let mut records = Records::open(input)?;
    let contents = records.contents()?;
    let told = contents.told;
    let ended = contents.ended;
    let first_reason = contents.lost.first().map(|lost| lost.reason.clone());
    let mut recovery = Recovery {
        input: input.display().to_string(),
        output: destination.path.to_owned(),
        ended,
        sorted: contents.back_ns > IN_ORDER_NS,
        summary_fault: contents.summary_fault,
        ..Recovery::default()
    };
    let (good, repeated) = without_repeats(contents.good);
    recovery.repeated = repeated;
    let missing = missing_chunks(&told.chunks, &good);
    let (good, foreign) = without_foreign(good, &told.chunks, &missing);
    recovery.foreign = foreign;
    let (good, reordered) = in_order(good, &told.chunks);
    recovery.reordered = reordered;
    let mut keeps_all = |_: &str, _: u64| true;
    let mut rescue = Rescue::create(destination, input, &told, &mut keeps_all)?;
    rescue.sorts = recovery.sorted;
    for piece in good {
        let body = records.body(piece.at)?;
        rescue.keep(piece.opcode, &body)?;
    }
    let kept = rescue.kept();
    let Some((first_ns, last_ns)) = kept.span_ns else {
        return Err(RecoverError::Nothing { name: recovery.input, reason: first_reason });
    };
    recovery.messages = kept.messages;
    recovery.chunks = kept.chunks;
    recovery.records_about = kept.records_about;
    recovery.undecodable = kept.undecodable;
    recovery.kept_s = Some(last_ns.saturating_sub(first_ns) as f64 / 1e9);
    recovery.messages_lost = told.messages.map(|told| told.saturating_sub(kept.messages));
    // With every message kept, a chunk that the summary does not know is one whose head was changed.
    let missing = if recovery.messages_lost == Some(0) { Vec::new() } else { missing };
    recovery.lost = lost_of(&contents.lost, &missing, Some(first_ns));
    rescue.finish(&recovery.about())?;
    Ok(recovery)
}

/// The first of equal chunks each, and how many were left out.
fn without_repeats(good: Vec<Good>) -> (Vec<Good>, u64) {
    let mut seen = std::collections::BTreeSet::new();
    let before = good.len();
    let kept: Vec<Good> =
        good.into_iter().filter(|piece| piece.chunk.is_none_or(|chunk| seen.insert(chunk))).collect();
    let repeated = before - kept.len();
    (kept, repeated as u64)
}

/// The chunks of the summary that are not there.
fn missing_chunks(told: &[(u64, u64, ChunkName)], good: &[Good]) -> Vec<(u64, u64, ChunkName)> {
    let mut there: BTreeMap<ChunkName, u32> = BTreeMap::new();
    for (name, _) in good.iter().filter_map(|piece| piece.chunk) {
        *there.entry(name).or_default() += 1;
    }
    let is_missing = |(_, _, name): &&(u64, u64, ChunkName)| match there.get_mut(name) {
        Some(count) if *count > 0 => {
            *count -= 1;
            false
        }
        _ => true,
    };
    told.iter().filter(is_missing).copied().collect()
}

/// The pieces without chunks that the summary does not know, and how many those were. If one of its chunks is missing, an unknown
/// one of the same sizes is that chunk with changed times. Without a summary nothing tells them apart.
fn without_foreign(
    good: Vec<Good>,
    told: &[(u64, u64, ChunkName)],
    missing: &[(u64, u64, ChunkName)],
) -> (Vec<Good>, u64) {
    if told.is_empty() {
        return (good, 0);
    }
    let known: std::collections::BTreeSet<ChunkName> = told.iter().map(|(.., name)| *name).collect();
    let sizes = |name: &ChunkName| (name.uncompressed_bytes, name.compressed_bytes);
    let mut missing: Vec<_> = missing.iter().map(|(.., name)| sizes(name)).collect();
    let before = good.len();
    let mut belongs = |name: &ChunkName| {
        let changed = missing.iter().position(|missing| *missing == sizes(name));
        known.contains(name) || changed.map(|place| missing.swap_remove(place)).is_some()
    };
    let kept: Vec<Good> =
        good.into_iter().filter(|piece| piece.chunk.is_none_or(|(name, _)| belongs(&name))).collect();
    let foreign = before - kept.len();
    (kept, foreign as u64)
}

/// The pieces with the chunks in the order of the summary, and whether they were in another one. Without a summary, and
/// in a file with messages outside of chunks, the order stays.
fn in_order(good: Vec<Good>, told: &[(u64, u64, ChunkName)]) -> (Vec<Good>, bool) {
    let place: BTreeMap<ChunkName, u64> = told.iter().map(|(offset, _, name)| (*name, *offset)).collect();
    let places: Option<Vec<u64>> =
        good.iter().filter_map(|piece| piece.chunk).map(|(name, _)| place.get(&name).copied()).collect();
    let loose = good.iter().any(|piece| piece.opcode == op::MESSAGE);
    if loose || places.is_none_or(|places| places.is_sorted()) {
        return (good, false);
    }
    let (mut chunks, mut all): (Vec<Good>, Vec<Good>) =
        good.into_iter().partition(|piece| piece.chunk.is_some());
    chunks.sort_by_key(|piece| piece.chunk.and_then(|(name, _)| place.get(&name)));
    all.extend(chunks);
    (all, true)
}

/// What is lost, with times after the first message kept: the stretches, and the chunks of the summary that no stretch
/// covers.
fn lost_of(
    stretches: &[scan::LostStretch],
    missing: &[(u64, u64, ChunkName)],
    first_ns: Option<u64>,
) -> Vec<Lost> {
    let since_s = |ns: u64| (ns as f64 - first_ns.unwrap_or(ns) as f64) / 1e9;
    let mut lost: Vec<Lost> = Vec::new();
    let mut spans: Vec<Option<(u64, u64)>> = stretches.iter().map(|stretch| stretch.span_ns).collect();
    let mut uncovered = Vec::new();
    for (offset, bytes, name) in missing {
        let span = (name.first_ns, name.last_ns);
        let covers = |(place, stretch): (usize, &scan::LostStretch)| {
            let holds = (stretch.from_byte..stretch.from_byte + stretch.bytes).contains(offset);
            (stretch.span_ns == Some(span) || holds).then_some(place)
        };
        match stretches.iter().enumerate().find_map(covers) {
            Some(place) => {
                let (from, until) = spans[place].unwrap_or(span);
                spans[place] = Some((from.min(span.0), until.max(span.1)));
            }
            None => uncovered.push((*offset, *bytes, span)),
        }
    }
    let in_seconds = |(from, until): (u64, u64)| (since_s(from), since_s(until));
    lost.extend(stretches.iter().zip(spans).map(|(stretch, span_ns)| Lost {
        from_byte: stretch.from_byte,
        bytes: stretch.bytes,
        span_s: span_ns.map(in_seconds),
        reason: stretch.reason.clone(),
    }));
    lost.extend(uncovered.into_iter().map(|(from_byte, bytes, span_ns)| Lost {
        from_byte,
        bytes,
        span_s: Some(in_seconds(span_ns)),
        reason: "a chunk that the summary names is not there".to_owned(),
    }));
    lost.sort_by_key(|lost| lost.from_byte);
    lost
}

/// Writes what was recovered and what is lost as text.
///
/// # Errors
/// The output failed.
pub fn print_recovery(recovery: &Recovery, output: &mut impl Write) -> io::Result<()> {
    let kept_s = recovery.kept_s.map(|kept_s| format!(" over {kept_s:.3} s")).unwrap_or_default();
    writeln!(
        output,
        "{}: kept {} in {}{kept_s}, {} about the log; written to {}",
        shown(&recovery.input),
        counted(recovery.messages, "message"),
        counted(recovery.chunks, "chunk"),
        counted(recovery.records_about, "record"),
        recovery.output.display()
    )?;
    for lost in &recovery.lost {
        let span = lost.span_s.map_or_else(
            || "of unknown time".to_owned(),
            |(from, until)| format!("{from:.3} to {until:.3} s after the first message"),
        );
        writeln!(
            output,
            "lost {} from byte {}, {span}: {}",
            counted(lost.bytes, "byte"),
            lost.from_byte,
            shown(&lost.reason)
        )?;
    }
    if recovery.sorted {
        writeln!(output, "the log was not in order of time; the new one is")?;
    }
    if recovery.was_whole() {
        return writeln!(output, "the log was whole: nothing is lost");
    }
    if let Some(fault) = recovery.fault() {
        writeln!(output, "the log was DAMAGED: {fault}; the recovered log says so, too")?;
    }
    Ok(())
}

#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The damaged log.
    file: PathBuf,
    /// The log to write.
    output: PathBuf,
    /// Replace an existing file, but never the damaged log itself.
    #[arg(long)]
    force: bool,
    /// Answer in JSON.
    #[arg(long)]
    json: bool,
}

impl Args {
    pub(crate) fn run(self) -> Result<Outcome> {
        let destination = Destination { path: &self.output, overwrite: Overwrite::if_forced(self.force) };
        let recovery = recover(&self.file, destination)?;
        answer(
            |output| {
                if self.json { print_json(&recovery, output) } else { print_recovery(&recovery, output) }
            },
        )?;
        Ok(Outcome::Given)
    }
}
