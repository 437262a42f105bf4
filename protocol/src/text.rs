//! STATUSTEXT: long texts in 50-byte chunks, put together again, and made fit for a terminal.
//!
//! <https://mavlink.io/en/messages/common.html#STATUSTEXT>

use std::collections::BTreeMap;
use std::time::Duration;

use mavlink::types::CharArray;

use crate::dialect::{MavSeverity, STATUSTEXT_DATA};
use crate::identity::Address;

const CHUNK_LEN: usize = 50;
const MAX_CHUNKS: usize = 8;
/// A text whose last chunk is missing for this long is shown with a gap.
pub const REASSEMBLY_TIMEOUT: Duration = Duration::from_secs(2);

/// Splits a text into STATUSTEXT messages. `id` ties the chunks together and must differ from that of
/// the texts before it; 0 is allowed only when one chunk is enough and is then used anyway.
pub fn chunks(severity: MavSeverity, text: &str, id: u16) -> Vec<STATUSTEXT_DATA> {
    let bytes = &text.as_bytes()[..text.len().min(CHUNK_LEN * MAX_CHUNKS)];
    let single = bytes.len() <= CHUNK_LEN;
    let mut pieces: Vec<&[u8]> = bytes.chunks(CHUNK_LEN).collect();
    // A full last chunk has no terminator: an empty one ends the text.
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

/// A text put together again and made printable.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Text {
    /// Who said it.
    pub source: Address,
    /// RFC 5424 severity, 0 emergency to 7 debug.
    pub severity: u8,
    /// The text; `[...]` marks a chunk that never came.
    pub text: String,
}

#[derive(Debug)]
struct Partial {
    severity: u8,
    chunks: [Option<Vec<u8>>; MAX_CHUNKS],
    ended_at: Option<usize>,
    first_seen: Duration,
}

/// Puts chunked texts together again. Bounded: at most [`Reassembler::MAX_PARTIAL`] texts wait.
#[derive(Debug, Default)]
pub struct Reassembler {
    partial: BTreeMap<(Address, u16), Partial>,
}

impl Reassembler {
    /// Texts that may wait for their chunks at the same time; the oldest is given up first.
    pub const MAX_PARTIAL: usize = 16;

    /// Nothing waiting.
    pub fn new() -> Self {
        Self::default()
    }

    /// Takes a chunk; returns the texts that are ready.
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
        if partial.is_whole()
            && let Some(partial) = self.partial.remove(&(source, chunk.id))
        {
            ready.push(partial.into_text(source));
        }
        ready
    }

    /// Texts that waited too long for a chunk.
    pub fn expire(&mut self, now: Duration) -> Vec<Text> {
        let mut late = Vec::new();
        let keys: Vec<_> = self
            .partial
            .iter()
            .filter(|(_, partial)| now.saturating_sub(partial.first_seen) > REASSEMBLY_TIMEOUT)
            .map(|(key, _)| *key)
            .collect();
        for key in keys {
            if let Some(partial) = self.partial.remove(&key) {
                late.push(partial.into_text(key.0));
            }
        }
        late
    }
}

impl Partial {
    fn is_whole(&self) -> bool {
        self.ended_at.is_some_and(|end| self.chunks[..=end].iter().all(Option::is_some))
    }

    fn into_text(self, source: Address) -> Text {
        let end = self
            .ended_at
            .unwrap_or_else(|| self.chunks.iter().rposition(Option::is_some).map_or(0, |last| last + 1))
            .min(MAX_CHUNKS - 1);
        // Put together as bytes first: a character may be cut by a chunk's edge.
        let mut bytes = Vec::new();
        for chunk in &self.chunks[..=end] {
            bytes.extend_from_slice(chunk.as_deref().unwrap_or(b"[...]"));
        }
        Text { source, severity: self.severity, text: printable(&bytes) }
    }
}

/// Makes received bytes fit for a terminal: what is not UTF-8 becomes U+FFFD, and control characters
/// (with them every escape sequence's start) become U+FFFD too, so that a radio cannot move the cursor.
pub fn printable(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes)
        .chars()
        .map(|c| if c.is_control() || is_bidi_control(c) { char::REPLACEMENT_CHARACTER } else { c })
        .collect()
}

/// Characters that reorder what stands around them on the screen (Unicode UAX #9).
fn is_bidi_control(c: char) -> bool {
    matches!(c, '\u{061c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}
