//! The beginning of a log, made on a desk, that the board copies to its card.

use std::io::Cursor;

use prost::Name as _;
use protocol::log::DESCRIPTORS_COMPUTER_V1;
use protocol::log::computer_v1::{ComputerFrame, ComputerStart};
use protocol::log::record::{Record, TOPIC_COMPUTER_FRAME};
use protocol::log::writer::{LogHeader, LogWriteError, LogWriter};

use crate::card::{CHANNEL, put_header, put_text};

const SCHEMA: u8 = 0x03;
const CHANNEL_RECORD: u8 = 0x04;

/// The head of the log of a mission: build, mission, start of the computer, and the channel of its
/// frames.
///
/// # Errors
/// The writer of logs failed.
pub fn head(name: &str, mission_toml: &str, start: &ComputerStart) -> Result<Vec<u8>, LogWriteError> {
    let header = LogHeader {
        writer: "teensy".to_owned(),
        run: [("profile".to_owned(), name.to_owned())].into(),
        profile_toml: Some(mission_toml.to_owned()),
        ..LogHeader::default()
    };
    let mut bytes = Cursor::new(Vec::new());
    let mut writer = LogWriter::new(&mut bytes, &header)?;
    writer.write(&Record::ComputerStart(Box::new(*start)), 0)?;
    writer.flush()?;
    // The writer ends the log when it goes out of scope: everything behind this is left out.
    let length = writer.finish()?.position();
    let mut bytes = std::mem::take(bytes.get_mut());
    bytes.truncate(end_of_data(&bytes).unwrap_or(length as usize));
    let name = ComputerFrame::full_name();
    let schema_bytes = 2 + 4 + name.len() + 4 + "protobuf".len() + 4 + DESCRIPTORS_COMPUTER_V1.len();
    put_header(&mut bytes, SCHEMA, schema_bytes);
    bytes.extend(CHANNEL.to_le_bytes());
    put_text(&mut bytes, &name);
    put_text(&mut bytes, "protobuf");
    bytes.extend((DESCRIPTORS_COMPUTER_V1.len() as u32).to_le_bytes());
    bytes.extend(DESCRIPTORS_COMPUTER_V1);
    put_header(&mut bytes, CHANNEL_RECORD, 2 + 2 + 4 + TOPIC_COMPUTER_FRAME.len() + 4 + "protobuf".len() + 4);
    bytes.extend(CHANNEL.to_le_bytes());
    bytes.extend(CHANNEL.to_le_bytes());
    put_text(&mut bytes, TOPIC_COMPUTER_FRAME);
    put_text(&mut bytes, "protobuf");
    bytes.extend(0_u32.to_le_bytes());
    Ok(bytes)
}

/// Where the record begins that ends a log's data: opcode 0x0F.
fn end_of_data(bytes: &[u8]) -> Option<usize> {
    let mut at = 8;
    loop {
        let (opcode, length) = (*bytes.get(at)?, bytes.get(at + 1..at + 9)?);
        if opcode == 0x0F {
            return Some(at);
        }
        at += 9 + u64::from_le_bytes(length.try_into().ok()?) as usize;
    }
}
