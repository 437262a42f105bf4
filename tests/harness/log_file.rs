//! Reads logs, and writes changed copies of them.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use prost::Message as _;
use protocol::log::reader::{LogItem, LogReader};
use protocol::log::record::{ATTACHMENT_PROFILE, Record, TOPIC_CONTROLLER_TICK};
use protocol::log::v1;
use protocol::log::writer::{LogHeader, LogWriter};

/// The controller ticks of a log, in file order.
pub fn ticks_of(path: &Path) -> Vec<v1::ControllerTick> {
    read(path).1
}

/// The raw frames of one direction of a log (`rx` or `tx`), in file order.
pub fn raw_frames_of(path: &Path, direction: &str) -> Vec<Vec<u8>> {
    let topic = format!("/mavlink/{direction}/raw");
    let mut reader = LogReader::new(BufReader::new(File::open(path).expect("the log")));
    let mut frames = Vec::new();
    while let Some(item) = reader.next_item().expect("readable") {
        if let LogItem::Message { channel_id, data, .. } = item
            && reader.channel(channel_id).is_some_and(|channel| channel.topic == topic)
        {
            frames.push(data);
        }
    }
    frames
}

/// Changes the ticks of a log and writes them, with its profile, into a new log.
pub fn rewrite_log(from: &Path, to: &Path, change: impl FnOnce(&mut Vec<v1::ControllerTick>)) {
    let (profile_toml, mut ticks) = read(from);
    change(&mut ticks);
    let header = LogHeader { writer: "test".to_owned(), profile_toml, ..LogHeader::default() };
    let mut writer = LogWriter::new(File::create_new(to).expect("a new file"), &header).expect("a header");
    for tick in ticks {
        let time_ns = (1e9 * tick.input.time_s) as u64;
        writer.write(&Record::from(tick), time_ns).expect("a record");
    }
    writer.finish().expect("a footer");
}

fn read(path: &Path) -> (Option<String>, Vec<v1::ControllerTick>) {
    let mut reader = LogReader::new(BufReader::new(File::open(path).expect("the log")));
    let (mut profile, mut ticks) = (None, Vec::new());
    while let Some(item) = reader.next_item().expect("readable") {
        match item {
            LogItem::Attachment { name, data } if name == ATTACHMENT_PROFILE => {
                profile = Some(String::from_utf8(data).expect("text"));
            }
            LogItem::Message { channel_id, data, .. }
                if reader
                    .channel(channel_id)
                    .is_some_and(|channel| channel.topic == TOPIC_CONTROLLER_TICK) =>
            {
                ticks.push(v1::ControllerTick::decode(data.as_slice()).expect("a tick"));
            }
            _ => {}
        }
    }
    (profile, ticks)
}
