//! A flight as bytes for a board, and the board's answers.
//!
//! Each direction is a sequence of records: a protocol buffer and its CRC-32 (the lowest byte
//! first), in Consistent Overhead Byte Stuffing, ended by a zero byte. So a receiver that joins
//! late, or has lost a byte, is synchronised again behind the next zero, and a corrupted record is
//! detected. To the board: one [`Frame`] for each frame; the first one contains the flight. From
//! the board: one [`Answer`] for each frame. A repeated request gets the same answer again.
//!
//! A board with a radio (`on_the_air`) receives its crew's commands itself: it ignores uplink,
//! commander and requests in a frame, and its answer contains them for the next one, so that a
//! world that flies the same computer beside it can compare.
//!
//! Inputs and answers are the records of the flight log, byte for byte.

use alloc::string::String;
use alloc::vec::Vec;

use prost::Message;
use protocol::records::computer_v1::{
    Commander, ComputerInput, ComputerOutput, ComputerStart, Request, Uplink,
};

/// Longest accepted record, bytes: several times a mission with its motors' files (20 KB), the
/// longest there is.
pub const LONGEST_BYTES: usize = 128 * 1024;

/// The data that a computer is built from.
#[derive(Clone, PartialEq, Message)]
pub struct Begin {
    /// The mission's text, from the log.
    #[prost(string, required, tag = "1")]
    pub toml: String,
    /// The start in the log: at power-up, or at the release.
    #[prost(message, required, tag = "2")]
    pub start: ComputerStart,
    /// Identity of the board on its radio. Without it no station is received, and the crew's
    /// requests are in the frames.
    #[prost(message, optional, tag = "3")]
    pub on_the_air: Option<OnTheAir>,
    /// Another one for each flight: a board that flies this one already does not begin it again.
    #[prost(uint32, required, tag = "4")]
    pub flight: u32,
}

/// A board with a radio.
#[derive(Clone, PartialEq, Message)]
pub struct OnTheAir {
    /// Name of the mission.
    #[prost(string, required, tag = "1")]
    pub mission: String,
    /// MAVLink system id.
    #[prost(uint32, required, tag = "2")]
    pub system_id: u32,
    /// Another one at each power-up.
    #[prost(uint32, required, tag = "3")]
    pub boot_number: u32,
    /// Bytes per second that the radio carries.
    #[prost(uint32, required, tag = "4")]
    pub budget_bytes_s: u32,
    /// The vehicle's unique id, the same at each power-up.
    #[prost(uint32, required, tag = "5")]
    pub uid: u32,
}

/// Uplink data received by a board's radio for its next frame.
#[derive(Clone, PartialEq, Message)]
pub struct RadioInput {
    /// `None`: no uplink is required.
    #[prost(message, optional, tag = "1")]
    pub uplink: Option<Uplink>,
    /// The station that armed the vehicle, if one did.
    #[prost(message, optional, tag = "2")]
    pub commander: Option<Commander>,
    /// In order.
    #[prost(message, repeated, tag = "3")]
    pub requests: Vec<Request>,
}

/// The input of a frame.
#[derive(Clone, PartialEq, Message)]
pub struct Frame {
    #[prost(message, required, tag = "1")]
    pub input: ComputerInput,
    /// In a flight's first frame, in the first one behind a reset, and in a repeated request.
    #[prost(message, optional, tag = "2")]
    pub begin: Option<Begin>,
}

/// Decisions of a frame, as in its record in the log.
#[derive(Clone, PartialEq, Message)]
pub struct Answer {
    /// The number of the frame.
    #[prost(uint64, required, tag = "1")]
    pub frame: u64,
    #[prost(message, required, tag = "2")]
    pub output: ComputerOutput,
    /// The digest of the memory after the frame.
    #[prost(fixed64, required, tag = "3")]
    pub state_digest: u64,
    /// Radio input of the next frame, for a board with a radio.
    #[prost(message, optional, tag = "4")]
    pub radio: Option<RadioInput>,
}

impl Answer {
    /// Whether both have decided the same in every bit. Compared as bytes: a NaN never equals
    /// itself, and 0.0 equals -0.0.
    pub fn is_same_as(&self, other: &Self) -> bool {
        let decided = |answer: &Self| Self { radio: None, ..answer.clone() }.encode_to_vec();
        decided(self) == decided(other)
    }
}

/// Appends a record to the bytes to send.
pub fn put(record: &impl Message, into: &mut Vec<u8>) {
    let mut bytes = record.encode_to_vec();
    bytes.extend(crc32fast::hash(&bytes).to_le_bytes());
    into.extend(cobs::encode_vec(&bytes));
    into.push(0);
}

/// Takes records out of the bytes that arrive.
#[derive(Debug, Clone, Default)]
pub struct Reader {
    pending: Vec<u8>,
    /// Bytes already searched without finding the end of a record.
    looked_at: usize,
    broken: u64,
}

impl Reader {
    /// Adds bytes that have arrived.
    pub fn push(&mut self, bytes: &[u8]) {
        if self.looked_at > LONGEST_BYTES {
            // Noise without an end.
            self.pending.clear();
            (self.looked_at, self.broken) = (0, self.broken + 1);
        }
        self.pending.extend(bytes);
    }

    /// Returns the next complete record; broken ones before it are counted.
    pub fn next_record<R: Message + Default>(&mut self) -> Option<R> {
        loop {
            let end = self.pending[self.looked_at..].iter().position(|byte| *byte == 0);
            let Some(end) = end.map(|end| self.looked_at + end) else {
                self.looked_at = self.pending.len();
                return None;
            };
            let found = record_in(&mut self.pending[..end]);
            self.pending.drain(..=end);
            self.looked_at = 0;
            match found {
                Some(record) => return Some(record),
                None => self.broken += 1,
            }
        }
    }

    /// Number of corrupted records.
    pub fn broken(&self) -> u64 {
        self.broken
    }

    /// Bytes of a record whose end has not arrived.
    pub fn missing_its_end(&self) -> usize {
        self.pending.len()
    }
}

fn record_in<R: Message + Default>(stuffed: &mut [u8]) -> Option<R> {
    let bytes = cobs::decode_in_place(stuffed).ok()?;
    let (record, sum) = stuffed[..bytes].split_last_chunk()?;
    (crc32fast::hash(record) == u32::from_le_bytes(*sum)).then(|| R::decode(record).ok())?
}
