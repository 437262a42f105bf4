//! Counts the messages of each channel.

use std::collections::BTreeMap;

use protocol::log::reader::LogChannel;
use serde::Serialize;

use crate::log::{Entry, StampedEntry};

/// A channel of a log.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ChannelFacts {
    pub topic: String,
    /// How its messages are encoded.
    pub message_encoding: String,
    /// The name of its schema.
    pub schema: String,
    /// Metadata of the channel: link, endpoint, dialect.
    pub metadata: BTreeMap<String, String>,
    pub messages: u64,
    /// Messages that this build cannot read.
    pub unreadable: u64,
    /// Missing messages before the last one, by the gaps in the sequence numbers.
    pub lost: u64,
}

/// Counts messages by channel.
#[derive(Default)]
pub(super) struct ChannelCounter {
    counts: BTreeMap<u16, Counts>,
}

#[derive(Default)]
struct Counts {
    messages: u64,
    unreadable: u64,
    last_sequence: u32,
}

impl ChannelCounter {
    pub(super) fn count(&mut self, stamped: &StampedEntry) {
        let counts = self.counts.entry(stamped.channel_id).or_default();
        counts.messages += 1;
        counts.unreadable += u64::from(matches!(stamped.entry, Entry::Unreadable { .. }));
        counts.last_sequence = counts.last_sequence.max(stamped.sequence);
    }

    pub(super) fn into_facts<'a>(
        mut self,
        channels: impl Iterator<Item = (u16, &'a LogChannel)>,
    ) -> Vec<ChannelFacts> {
        let mut facts: Vec<ChannelFacts> = channels
            .map(|(id, channel)| {
                let counts = self.counts.remove(&id).unwrap_or_default();
                // Sequence numbers start at 0; a writer without numbering leaves 0 everywhere.
                let numbered =
                    if counts.last_sequence == 0 { 0 } else { u64::from(counts.last_sequence) + 1 };
                ChannelFacts {
                    topic: channel.topic.clone(),
                    message_encoding: channel.message_encoding.clone(),
                    schema: channel.schema_name.clone(),
                    metadata: channel.metadata.clone(),
                    messages: counts.messages,
                    unreadable: counts.unreadable,
                    lost: numbered.saturating_sub(counts.messages),
                }
            })
            .collect();
        facts.sort_by(|a, b| (&a.topic, &a.metadata).cmp(&(&b.topic, &b.metadata)));
        facts
    }
}
