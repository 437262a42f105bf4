//! Reads logs.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use prost::Message as _;
use protocol::log::computer_v1::ComputerFrame;
use protocol::log::reader::{LogItem, LogReader};
use protocol::log::record::TOPIC_COMPUTER_FRAME;

/// The flight computer's frames in a log, in file order.
pub fn frames_of(path: &Path) -> Vec<ComputerFrame> {
    let frames = messages_of(path, TOPIC_COMPUTER_FRAME);
    frames.iter().map(|data| ComputerFrame::decode(data.as_slice()).expect("a frame")).collect()
}

/// The raw frames of one direction of a log (`rx` or `tx`), in file order.
pub fn raw_frames_of(path: &Path, direction: &str) -> Vec<Vec<u8>> {
    messages_of(path, &format!("/mavlink/{direction}/raw"))
}

fn messages_of(path: &Path, topic: &str) -> Vec<Vec<u8>> {
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
