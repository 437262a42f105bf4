//! Splits a text into the 50-byte chunks of STATUSTEXT, reassembles texts, and removes control
//! characters.
//!
//! <https://mavlink.io/en/messages/common.html#STATUSTEXT>

use alloc::collections::BTreeMap;
use alloc::string::String;
use alloc::vec::Vec;
use alloc::{format, vec};
use core::time::Duration;

use mavlink::types::CharArray;

use crate::dialect::{MavSeverity, STATUSTEXT_DATA};
use crate::identity::Address;

const CHUNK_LEN: usize = 50;
const MAX_CHUNKS: usize = 8;
/// A text whose chunks are not complete after this time is shown with a gap.
const REASSEMBLY_TIMEOUT: Duration = Duration::from_secs(2);

/// Splits a text into STATUSTEXT messages. `id` marks the chunks of one text and must differ from
/// the ids of the texts before it. A text that fits into one chunk is sent with id 0.
pub fn chunks(severity: MavSeverity, text: &str, id: u16) -> Vec<STATUSTEXT_DATA> {
    let bytes = &text.as_bytes()[..text.len().min(CHUNK_LEN * MAX_CHUNKS)];
    let single = bytes.len() <= CHUNK_LEN;
    let mut pieces: Vec<&[u8]> = bytes.chunks(CHUNK_LEN).collect();
    // If the last chunk is full, it has no terminator, so an empty chunk ends the text.
    if bytes.is_empty() || (!single && bytes.len().is_multiple_of(CHUNK_LEN)) {
        pieces.push(&[]);
    }
    pieces
        .into_iter()
        .enumerate()
        .map(|(sequence, piece)| {
            let mut text = [0; CHUNK_LEN];
            text[..piece.len()].copy_from_slice(piece);
            STATUSTEXT_DATA {
                severity,
                text: CharArray::new(text),
                id: if single { 0 } else { id.max(1) },
                chunk_seq: sequence as u8,
            }
        })
        .collect()
}

/// A reassembled text without control characters.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Text {
    /// The sender.
    pub source: Address,
    /// RFC 5424 severity, 0 emergency to 7 debug.
    pub severity: u8,
    /// The text; `[...]` marks a missing chunk.
    pub text: String,
}

#[derive(Debug)]
struct Partial {
    severity: u8,
    chunks: [Option<Vec<u8>>; MAX_CHUNKS],
    ended_at: Option<usize>,
    first_seen: Duration,
}

/// Reassembles chunked texts. At most [`Reassembler::MAX_PARTIAL`] incomplete texts are stored.
#[derive(Debug, Default)]
pub struct Reassembler {
    partial: BTreeMap<(Address, u16), Partial>,
}

impl Reassembler {
    /// This many texts may wait for their chunks at the same time; the oldest one is given up
    /// first.
    pub const MAX_PARTIAL: usize = 16;

    /// Takes a chunk and returns the texts that are ready.
    pub fn push(&mut self, source: Address, chunk: &STATUSTEXT_DATA, now: Duration) -> Vec<Text> {
        let bytes: &[u8; CHUNK_LEN] = &chunk.text;
        let end = bytes.iter().position(|byte| *byte == 0);
        let piece = bytes[..end.unwrap_or(CHUNK_LEN)].to_vec();
        let severity = chunk.severity as u8;
        if chunk.id == 0 {
            return vec![Text { source, severity, text: printable(&piece) }];
        }
        let sequence = usize::from(chunk.chunk_seq);
        if sequence >= MAX_CHUNKS {
            return Vec::new();
        }
        let mut ready = self.expire(now);
        if self.partial.len() >= Self::MAX_PARTIAL
            && !self.partial.contains_key(&(source, chunk.id))
            && let Some(oldest) = self.partial.iter().min_by_key(|(_, p)| p.first_seen).map(|(key, _)| *key)
            && let Some(partial) = self.partial.remove(&oldest)
        {
            ready.push(partial.into_text(oldest.0));
        }
        let partial = self.partial.entry((source, chunk.id)).or_insert_with(|| Partial {
            severity,
            chunks: Default::default(),
            ended_at: None,
            first_seen: now,
        });
        partial.chunks[sequence] = Some(piece);
        if end.is_some() || sequence == MAX_CHUNKS - 1 {
            partial.ended_at = Some(sequence);
        }
        if partial.is_complete()
            && let Some(partial) = self.partial.remove(&(source, chunk.id))
        {
            ready.push(partial.into_text(source));
        }
        ready
    }

    /// Returns the texts that have waited too long for a chunk.
    pub fn expire(&mut self, now: Duration) -> Vec<Text> {
        let is_late =
            |_: &_, partial: &mut Partial| now.saturating_sub(partial.first_seen) > REASSEMBLY_TIMEOUT;
        let late = self.partial.extract_if(.., is_late);
        late.map(|((source, _), partial)| partial.into_text(source)).collect()
    }
}

impl Partial {
    fn is_complete(&self) -> bool {
        self.ended_at.is_some_and(|end| self.chunks[..=end].iter().all(Option::is_some))
    }

    fn into_text(self, source: Address) -> Text {
        let end = self
            .ended_at
            .unwrap_or_else(|| self.chunks.iter().rposition(Option::is_some).map_or(0, |last| last + 1))
            .min(MAX_CHUNKS - 1);
        // The bytes are joined first, because a character may be split between two chunks.
        let mut bytes = Vec::new();
        for chunk in &self.chunks[..=end] {
            bytes.extend_from_slice(chunk.as_deref().unwrap_or(b"[...]"));
        }
        Text { source, severity: self.severity, text: printable(&bytes) }
    }
}

/// Makes received bytes safe for a terminal: bytes that are not UTF-8 and control characters become
/// U+FFFD, so that no escape sequence that was sent by radio reaches the terminal.
pub fn printable(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes)
        .chars()
        .map(|c| if c.is_control() || is_bidi_control(c) { char::REPLACEMENT_CHARACTER } else { c })
        .collect()
}

/// The beginning of a hash in groups of four digits, to be compared by eye and read aloud.
pub fn shown(hash: &[u8]) -> String {
    let (pairs, _) = hash.as_chunks::<2>();
    let groups: Vec<String> = pairs.iter().take(8).map(|[a, b]| format!("{a:02x}{b:02x}")).collect();
    groups.join("-")
}

/// Characters that change the order of the text around them (Unicode UAX #9).
fn is_bidi_control(c: char) -> bool {
    matches!(c, '\u{061c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}
