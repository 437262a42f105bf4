//! Channels and how many of their messages are there.

use std::collections::BTreeMap;

use protocol::log::reader::LogChannel;
use serde::Serialize;

use crate::log::{Entry, StampedEntry};

/// A channel of a log.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ChannelFacts {
    /// Its topic.
    pub topic: String,
    /// How its messages are encoded.
    pub message_encoding: String,
    /// The name of its schema.
    pub schema: String,
    /// What else the log says about it: link, endpoint, dialect.
    pub metadata: BTreeMap<String, String>,
    /// Its messages.
    pub messages: u64,
    /// Of these, how many this build cannot read.
    pub unreadable: u64,
    /// Messages that the numbering says existed before the last one and that are not there.
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
                // Numbers count from 0; a writer that does not number leaves 0 everywhere.
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
