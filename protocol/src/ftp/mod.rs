//! MAVLink FTP, for reading only: a vehicle offers the files of its log, and a ground station fetches them.
//!
//! * [`packet`]: the packets, and the frames that carry them;
//! * [`server`]: the vehicle's side; everything that writes is refused;
//! * [`download`]: the ground's side: bursts first, then the pieces that were lost; it continues where an earlier
//!   process was stopped;
//! * [`ranges`]: which bytes are there;
//! * [`part`]: what is remembered of an unfinished download;
//! * [`crc`]: the checksum of a whole file.
//!
//! Nothing here reads a file, a clock or a link. Protocol: <https://mavlink.io/en/services/ftp.html>.

pub mod crc;
pub mod download;
pub mod packet;
pub mod part;
pub mod ranges;
pub mod server;

pub use packet::{DATA_LEN, FileRequest, Opcode, Packet};

/// The directory of the log's files.
pub const LOG_DIRECTORY: &str = "/log";
