//! Reads the summary at the end of a damaged file: a file broken in its middle may still have it.

use std::fs::File;
use std::io::{Read as _, Seek as _};
use std::path::Path;

use mcap::sans_io::summary_reader::{SummaryReadEvent, SummaryReader, SummaryReaderOptions};
use protocol::log::reader::RECORD_LIMIT_BYTES;
use protocol::log::record::TOPIC_PILOT_TICK;

/// Facts from a file's summary.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SummaryFacts {
    /// Messages in the file.
    pub message_count: u64,
    /// Of these, frames of the flight computer.
    pub ticks: u64,
    /// Time of the last message, ns since the Unix epoch.
    pub last_log_time_ns: u64,
}

/// Reads the summary at the end of a file, if possible.
pub fn summary_of(path: &Path) -> Option<SummaryFacts> {
    let summary = read_summary(path)?;
    let stats = summary.stats?;
    let is_tick =
        |id: &u16| summary.channels.get(id).is_some_and(|channel| channel.topic == TOPIC_PILOT_TICK);
    let counts = stats.channel_message_counts.iter().filter(|(id, _)| is_tick(id));
    Some(SummaryFacts {
        message_count: stats.message_count,
        ticks: counts.map(|(_, count)| *count).fold(0, u64::saturating_add),
        last_log_time_ns: stats.message_end_time,
    })
}

/// The summary at the end of a file; `None` if the file has none that can be read.
fn read_summary(path: &Path) -> Option<mcap::Summary> {
    let mut file = File::open(path).ok()?;
    let size = file.metadata().ok()?.len();
    let options =
        SummaryReaderOptions::default().with_file_size(size).with_record_length_limit(RECORD_LIMIT_BYTES);
    let mut reader = SummaryReader::new_with_options(options);
    while let Some(event) = reader.next_event() {
        match event.ok()? {
            SummaryReadEvent::ReadRequest(need) => {
                let count = file.read(reader.insert(need)).ok()?;
                reader.notify_read(count);
            }
            SummaryReadEvent::SeekRequest(to) => reader.notify_seeked(file.seek(to).ok()?),
        }
    }
    reader.finish()
}
