//! A recorded flight as bytes for a board, and the board's answers.
//!
//! Either way a stream is a sequence of records: the length of the record in four bytes, the lowest first, then the
//! record, a protocol buffer. To the board: one [`Begin`], then one [`Frame`] for each frame. From the board: one
//! [`Answer`] for each frame. A length of zero, or the end of the bytes, ends the flight.
//!
//! A board with a radio (`on_the_air`) hears its crew itself: it does not look at uplink, commander and requests in a frame, and
//! its answer has them for the next one, so that a world that flies the same computer beside it can compare.
//!
//! Inputs and answers are the records of the flight log, byte for byte. There are two kinds of flights in logs: from
//! power-up on, and, as in a campaign, released at once in the air.

use alloc::string::String;
use alloc::vec::Vec;

use log_records::computer_v1::{Commander, ComputerInput, ComputerOutput, ComputerStart, Request, Uplink};
use log_records::flight_v1::{PilotInput, PilotOutput, PilotStart};
use prost::{DecodeError, Message};

/// Longest accepted record, bytes: several times a mission with its motors' files (20 KB), the longest there is.
pub const LONGEST_BYTES: usize = 128 * 1024;

/// What a computer is built from at power-up.
#[derive(Clone, PartialEq, Message)]
pub struct Begin {
    /// The mission's or profile's text, from the log.
    #[prost(string, required, tag = "1")]
    pub toml: String,
    /// The law of the landing burn, by its name.
    #[prost(string, required, tag = "2")]
    pub controller: String,
    /// The start of a flight from power-up on.
    #[prost(message, optional, tag = "3")]
    pub at_power_up: Option<ComputerStart>,
    /// The start of a flight that was released at once.
    #[prost(message, optional, tag = "4")]
    pub in_the_air: Option<PilotStart>,
    /// Who the board is on its own radio. Without it nobody is heard, and the crew's requests are in the frames.
    #[prost(message, optional, tag = "5")]
    pub on_the_air: Option<OnTheAir>,
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
}

/// What a board has heard over its radio for its next frame.
#[derive(Clone, PartialEq, Message)]
pub struct Heard {
    /// `None`: nobody has to be heard.
    #[prost(message, optional, tag = "1")]
    pub uplink: Option<Uplink>,
    /// The station that armed the vehicle, if one did.
    #[prost(message, optional, tag = "2")]
    pub commander: Option<Commander>,
    /// In order.
    #[prost(message, repeated, tag = "3")]
    pub requests: Vec<Request>,
}

/// The input of a frame, of the one kind or the other.
#[derive(Clone, PartialEq, Message)]
pub struct Frame {
    #[prost(message, optional, tag = "1")]
    pub from_power_up: Option<ComputerInput>,
    #[prost(message, optional, tag = "2")]
    pub in_the_air: Option<PilotInput>,
}

impl Frame {
    /// The frame's number, counted from power-up or from the release.
    pub fn number(&self) -> Option<u64> {
        let number = self.from_power_up.as_ref().map(|input| input.frame);
        number.or_else(|| self.in_the_air.as_ref().map(|input| input.frame))
    }
}

/// What a frame decided, as its record in the log has it.
#[derive(Clone, PartialEq, Message)]
pub struct Answer {
    #[prost(message, optional, tag = "1")]
    pub from_power_up: Option<ComputerOutput>,
    #[prost(message, optional, tag = "2")]
    pub in_the_air: Option<PilotOutput>,
    /// The digest of the memory after the frame: the computer's, or that of its pilot in the air.
    #[prost(fixed64, required, tag = "3")]
    pub state_digest: u64,
    /// What the next frame is told and asked, of a board with a radio.
    #[prost(message, optional, tag = "4")]
    pub heard: Option<Heard>,
}

impl Answer {
    /// Whether both have decided the same in every bit. Compared as bytes: a NaN never equals itself, and 0.0 equals -0.0.
    pub fn is_same_as(&self, other: &Self) -> bool {
        let decided = |answer: &Self| Self { heard: None, ..answer.clone() }.encode_to_vec();
        decided(self) == decided(other)
    }
}

/// Bytes in and out: a file, a serial line, a debugger's channel.
pub trait Link {
    type Error;

    /// Reads at least one byte; 0 at the end.
    ///
    /// # Errors
    /// The bytes cannot be read.
    fn read(&mut self, into: &mut [u8]) -> Result<usize, Self::Error>;

    /// Writes all bytes.
    ///
    /// # Errors
    /// The bytes cannot be written.
    fn write_all(&mut self, bytes: &[u8]) -> Result<(), Self::Error>;
}

/// Why a stream cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum StreamError<E> {
    #[error("link: {0}")]
    Link(E),
    #[error("a record of {bytes} bytes; at most {LONGEST_BYTES} are accepted")]
    TooLong { bytes: usize },
    #[error("the stream ends inside a record: {missing} of {bytes} bytes are missing")]
    CutOff { missing: usize, bytes: usize },
    #[error("a record is not what its place in the stream asks for: {0}")]
    Record(DecodeError),
}

/// Reads the next record into `buffer`, whose memory is used again; `None` at the end of the flight.
///
/// # Errors
/// See [`StreamError`].
pub fn receive<R: Message + Default, L: Link>(
    link: &mut L,
    buffer: &mut Vec<u8>,
) -> Result<Option<R>, StreamError<L::Error>> {
    let mut length = [0; 4];
    if fill(link, &mut length, true)? == 0 {
        return Ok(None);
    }
    let bytes = u32::from_le_bytes(length) as usize;
    if bytes == 0 {
        return Ok(None);
    }
    if bytes > LONGEST_BYTES {
        return Err(StreamError::TooLong { bytes });
    }
    buffer.clear();
    buffer.resize(bytes, 0);
    fill(link, buffer, false)?;
    R::decode(buffer.as_slice()).map(Some).map_err(StreamError::Record)
}

/// Writes a record.
///
/// # Errors
/// See [`StreamError`].
pub fn send<R: Message, L: Link>(
    link: &mut L,
    record: &R,
    buffer: &mut Vec<u8>,
) -> Result<(), StreamError<L::Error>> {
    buffer.clear();
    buffer.extend([0; 4]);
    // A vector grows as needed.
    let _ = record.encode(buffer);
    let bytes = buffer.len() - 4;
    if bytes > LONGEST_BYTES {
        return Err(StreamError::TooLong { bytes });
    }
    buffer[..4].copy_from_slice(&(bytes as u32).to_le_bytes());
    link.write_all(buffer).map_err(StreamError::Link)
}

/// Fills `into`, and returns how much of it was filled: less than all of it only at the end of the stream, 0 if `or_end`.
fn fill<L: Link>(link: &mut L, into: &mut [u8], or_end: bool) -> Result<usize, StreamError<L::Error>> {
    let mut filled = 0;
    while filled < into.len() {
        let read = link.read(&mut into[filled..]).map_err(StreamError::Link)?;
        if read == 0 {
            if filled == 0 && or_end {
                return Ok(0);
            }
            return Err(StreamError::CutOff { missing: into.len() - filled, bytes: into.len() });
        }
        filled += read;
    }
    Ok(filled)
}
