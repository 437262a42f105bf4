//! Recovers a readable log from a damaged one.
//!
//! A recorder that was killed leaves a log without its end; a bad disk or a cable may damage the
//! middle. Every chunk with a correct checksum is recovered, also after a broken one. The report
//! lists what is lost, and so does the recovered log ([`METADATA_RECOVERY`]). Nothing is invented:
//! a message is recovered unchanged or not at all.

pub(crate) mod scan;
mod write;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use mcap::records::Metadata;
use protocol::log::record::{METADATA_RECOVERY, RECOVERY_FAULT_ENTRY};
use scan::{LostStretch, Records};
use serde::Serialize;
pub use write::Recovered;
use write::Rescue;

use crate::cli::Answer;
use crate::log::LogError;
use crate::output::WriteError;
use crate::print::{counted, messages_lost};

/// Why nothing could be recovered.
#[derive(Debug, thiserror::Error)]
pub enum RecoverError {
    /// The file is not an MCAP file, or cannot be read.
    #[error(transparent)]
    Log(#[from] LogError),
    /// No message could be recovered.
    #[error("{name}: no message can be recovered{}", reason.as_ref().map(|why| format!(": {why}")).unwrap_or_default())]
    Nothing { name: String, reason: Option<String> },
    #[error(transparent)]
    Write(#[from] WriteError),
}

/// A stretch of a file that could not be recovered.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Lost {
    /// Its first byte.
    pub from_byte: u64,
    /// Its length.
    pub bytes: u64,
    /// The times of its messages, s after the first recovered message; `None` if unknown.
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
    #[serde(flatten)]
    pub recovered: Recovered,
    /// From the first recovered message to the last, s.
    pub kept_s: Option<f64>,
    /// What was lost.
    pub lost: Vec<Lost>,
    /// Number of messages by the summary; `None` without an intact one.
    pub messages_counted: Option<u64>,
    /// The summary is there and its checksum is right; no message is lost without it.
    pub summary_is_intact: bool,
    /// Whether the log has its end mark, so nothing is missing at the end.
    pub ended: bool,
}

impl Recovery {
    /// The metadata of the recovered log.
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

    /// The damage of the log, also stored in the recovered one; `None` if it was intact.
    pub fn fault(&self) -> Option<String> {
        let Recovered { messages, undecodable, beside_chunks, missing, .. } = self.recovered;
        let mut faults = Vec::new();
        faults.extend(self.lost.first().map(|lost| {
            let bytes: u64 = self.lost.iter().map(|lost| lost.bytes).sum();
            format!(
                "{} lost at {}, the first from byte {}",
                counted(bytes, "byte"),
                counted(self.lost.len() as u64, "position"),
                lost.from_byte
            )
        }));
        let counted = self.messages_counted.filter(|counted| *counted != messages);
        faults.extend(
            counted.map(|counted| format!("its summary counts {counted} messages, and {messages} are there")),
        );
        faults.extend((missing > 0).then(|| messages_lost(missing)));
        if undecodable > 0 {
            faults.push(format!("{undecodable} messages of an unknown channel were dropped"));
        }
        if beside_chunks > 0 {
            faults.push(format!(
                "{beside_chunks} messages stood beside the chunks, which no checksum protects; they are kept"
            ));
        }
        if self.recovered.out_of_order {
            let order = self
                .recovered
                .put_in_order
                .unwrap_or("neither its times nor the numbers of its frames give one");
            faults.push(format!("it was not in order of time: {order}"));
        }
        if self.ended && !self.summary_is_intact {
            faults.push("its summary is damaged, and no message with it".to_owned());
        }
        if !self.ended {
            faults.push("it had no end mark, so its end may be lost".to_owned());
        }
        (!faults.is_empty()).then(|| faults.join("; "))
    }
}

/// Recovers a log into a new file.
///
/// # Errors
/// The input is not an MCAP file, cannot be read, or holds no message that can be kept; or the
/// output cannot be written.
pub fn recover(input: &Path, output: &Path) -> Result<Recovery, RecoverError> {
    let mut records = Records::open(input)?;
    let contents = records.contents()?;
    let input = input.display().to_string();
    let rescue = Rescue::of(output, &mut records, &contents)?;
    let recovered = rescue.recovered;
    let Some((first_ns, last_ns)) = recovered.span_ns else {
        let reason = contents.lost.first().map(|lost| lost.reason.clone());
        return Err(RecoverError::Nothing { name: input, reason });
    };
    let since_s = |ns: u64| (ns as f64 - first_ns as f64) / 1e9;
    let lost = |LostStretch { from_byte, bytes, span_ns, reason }: &LostStretch| Lost {
        from_byte: *from_byte,
        bytes: *bytes,
        span_s: span_ns.map(|(from, until)| (since_s(from), since_s(until))),
        reason: reason.clone(),
    };
    let mut recovery = Recovery {
        input,
        output: PathBuf::new(),
        recovered,
        kept_s: Some(since_s(last_ns)),
        lost: contents.lost.iter().map(lost).collect(),
        messages_counted: contents.summary.statistics.as_ref().map(|statistics| statistics.message_count),
        summary_is_intact: contents.summary.is_intact,
        ended: contents.ended,
    };
    recovery.output = rescue.finish(&recovery.about())?;
    Ok(recovery)
}

impl Answer for Recovery {
    fn sentences(&self) -> Vec<String> {
        let kept_s = self.kept_s.map(|kept_s| format!(" over {kept_s:.3} s")).unwrap_or_default();
        let mut lines = vec![format!(
            "{}: kept {} in {}{kept_s}, {} about the log; written to {}",
            self.input,
            counted(self.recovered.messages, "message"),
            counted(self.recovered.chunks, "chunk"),
            counted(self.recovered.records_about, "record"),
            self.output.display()
        )];
        lines.extend(self.lost.iter().map(|Lost { from_byte, bytes, span_s, reason }| {
            let span = span_s.map_or_else(
                || "of unknown time".to_owned(),
                |(from, until)| format!("{from:.3} to {until:.3} s after the first message"),
            );
            format!("lost {} from byte {from_byte}, {span}: {reason}", counted(*bytes, "byte"))
        }));
        lines.push(match self.fault() {
            None => "the log was whole: nothing is lost".to_owned(),
            Some(fault) => format!("the log was DAMAGED: {fault}; the recovered log says so, too"),
        });
        lines
    }
}
