//! Recovers a whole log from a damaged one.
//!
//! A recorder that was killed leaves a log without its end; a bad disk or a cable may damage the middle. Every chunk with a
//! correct checksum is kept, also after a broken one. The chunks are the truth: what the summary lists and counts helps only if
//! the summary is whole. The report lists what is lost, and so does the recovered log itself ([`METADATA_RECOVERY`]). Nothing is
//! invented: a message is kept unchanged or not at all. A log that is not in order of time is sorted.

mod scan;
mod write;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use anyhow::Result;
use mcap::records::Metadata;
use protocol::log::record::{METADATA_RECOVERY, RECOVERY_FAULT_ENTRY};
use protocol::program::Exit;
use scan::{ChunkName, Contents, LostStretch, Records};
pub use scan::{Summary, summary_of};
use serde::Serialize;
use write::Rescue;

use crate::cli::{Answer, give};
use crate::log::{IN_ORDER_NS, LogError, is_tlog};
use crate::output::WriteError;
use crate::print::counted;

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
    /// Somebody has added, repeated or moved chunks: they are not those of the summary. All that can be read is kept.
    pub changed: bool,
    /// Messages were not in order of time, which is no damage; they are now.
    pub sorted: bool,
    /// What was wrong with the summary; no message is lost with it.
    pub summary_fault: Option<&'static str>,
    /// Whether the log has its end mark, so nothing is missing at the end.
    pub ended: bool,
}

impl Recovery {
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
        if self.changed {
            faults.push("the log was changed: its chunks are not those that its summary lists".to_owned());
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
/// The input is not an MCAP file, cannot be read, or holds no message that can be kept; or the output cannot be written.
pub fn recover(input: &Path, output: &Path) -> Result<Recovery, RecoverError> {
    if is_tlog(input).unwrap_or_default() {
        return Err(RecoverError::Tlog { path: input.to_owned() });
    }
    let mut records = Records::open(input)?;
    let contents = records.contents()?;
    let mut recovery = Recovery {
        input: input.display().to_string(),
        ended: contents.ended,
        changed: was_changed(&contents),
        sorted: is_sorted_anew(&contents),
        summary_fault: contents.summary_fault,
        ..Recovery::default()
    };
    let rescue = Rescue::of(output, &mut records, &contents)?;
    let kept = rescue.kept;
    let Some((first_ns, last_ns)) = kept.span_ns else {
        let reason = contents.lost.first().map(|lost| lost.reason.clone());
        return Err(RecoverError::Nothing { name: recovery.input, reason });
    };
    recovery.messages = kept.messages;
    recovery.chunks = kept.chunks;
    recovery.records_about = kept.records_about;
    recovery.undecodable = kept.undecodable;
    recovery.kept_s = Some(last_ns.saturating_sub(first_ns) as f64 / 1e9);
    let told = contents.told.statistics.as_ref();
    // What is there twice, or of another log, makes up for nothing.
    let told = told.filter(|_| !recovery.changed);
    recovery.messages_lost = told.map(|told| told.message_count.saturating_sub(kept.messages));
    // With every message kept, no chunk is lost.
    let told = if recovery.messages_lost == Some(0) { &[] } else { &contents.told.chunks[..] };
    recovery.lost = lost_of(&contents, told, first_ns);
    recovery.output = rescue.finish(&recovery.about())?;
    Ok(recovery)
}

/// Whether there are other chunks than those of the summary, or they are in another order. Without a summary nothing says so.
fn was_changed(contents: &Contents) -> bool {
    let mut told = contents.told.chunks.iter().map(|(.., name)| name);
    let mut there = contents.good.iter().filter_map(|piece| piece.chunk);
    !contents.told.chunks.is_empty() && there.any(|there| told.all(|name| *name != there))
}

/// Whether the messages are out of order. A chunk is moved by less than what a log of ours may go back, too.
fn is_sorted_anew(contents: &Contents) -> bool {
    contents.is_mixed || contents.back_ns > if was_changed(contents) { 0 } else { IN_ORDER_NS }
}

/// What is lost, with times after the first message kept: the stretches that cannot be read, with the times of the chunks of the
/// summary that lay there, and the chunks that no stretch covers.
fn lost_of(contents: &Contents, told: &[(u64, u64, ChunkName)], first_ns: u64) -> Vec<Lost> {
    let there: BTreeSet<ChunkName> = contents.good.iter().filter_map(|piece| piece.chunk).collect();
    let mut lost = contents.lost.clone();
    for (offset, bytes, name) in told.iter().filter(|(.., name)| !there.contains(name)) {
        let span = (name.first_ns, name.last_ns);
        let covers = |stretch: &&mut LostStretch| {
            stretch.span_ns == Some(span)
                || (stretch.from_byte..stretch.from_byte + stretch.bytes).contains(offset)
        };
        if let Some(stretch) = lost.iter_mut().find(covers) {
            let (from, until) = stretch.span_ns.unwrap_or(span);
            stretch.span_ns = Some((from.min(span.0), until.max(span.1)));
        } else {
            let reason = "a chunk that the summary names is not there".to_owned();
            lost.push(LostStretch { from_byte: *offset, bytes: *bytes, span_ns: Some(span), reason });
        }
    }
    lost.sort_by_key(|stretch| stretch.from_byte);
    let since_s = |ns: u64| (ns as f64 - first_ns as f64) / 1e9;
    let in_seconds = |LostStretch { from_byte, bytes, span_ns, reason }| {
        let span_s = span_ns.map(|(from, until)| (since_s(from), since_s(until)));
        Lost { from_byte, bytes, span_s, reason }
    };
    lost.into_iter().map(in_seconds).collect()
}

impl Answer for Recovery {
    fn sentences(&self) -> Vec<String> {
        let kept_s = self.kept_s.map(|kept_s| format!(" over {kept_s:.3} s")).unwrap_or_default();
        let mut lines = vec![format!(
            "{}: kept {} in {}{kept_s}, {} about the log; written to {}",
            self.input,
            counted(self.messages, "message"),
            counted(self.chunks, "chunk"),
            counted(self.records_about, "record"),
            self.output.display()
        )];
        lines.extend(self.lost.iter().map(|Lost { from_byte, bytes, span_s, reason }| {
            let span = span_s.map_or_else(
                || "of unknown time".to_owned(),
                |(from, until)| format!("{from:.3} to {until:.3} s after the first message"),
            );
            format!("lost {} from byte {from_byte}, {span}: {reason}", counted(*bytes, "byte"))
        }));
        if self.sorted {
            lines.push("the log was not in order of time; the new one is".to_owned());
        }
        lines.push(match self.fault() {
            None => "the log was whole: nothing is lost".to_owned(),
            Some(fault) => format!("the log was DAMAGED: {fault}; the recovered log says so, too"),
        });
        lines
    }
}

#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The damaged log.
    file: PathBuf,
    /// The log to write.
    output: PathBuf,
    /// Answer in JSON.
    #[arg(long)]
    json: bool,
}

impl Args {
    pub(crate) fn run(self) -> Result<Exit> {
        give(&recover(&self.file, &self.output)?, self.json)
    }
}
