//! Writes the raw MAVLink frames as a telemetry log.
//!
//! A `.tlog` is a sequence of Unix times in microseconds (8 bytes, big-endian), each followed by one whole frame.
//! Mission Planner, QGroundControl and MAVProxy write and play back such files.

use std::fs::File;
use std::io::{BufWriter, Read, Write as _};
use std::path::Path;

use protocol::log::record::TOPIC_RAW_RX;
use serde::Serialize;

use super::ExportError;
use crate::log::{Entry, FlightLog};
use crate::output::{Destination, NewFile, WriteError};

/// Summary of a written `.tlog`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ExportedTlog {
    /// The endpoint that recorded the frames: `vehicle` or `ground`.
    pub endpoint: String,
    /// Frames that the endpoint had received.
    pub received: u64,
    /// Frames that the endpoint had sent.
    pub sent: u64,
    /// Frames recorded by other endpoints, left out: they are the same frames at the other end of the link.
    pub left_out: u64,
    /// Why the log could not be read to its end.
    pub damage: Option<String>,
}

/// Writes the frames of one endpoint as a `.tlog`. Without `endpoint`, it takes the ground's frames if the log has
/// them, else the vehicle's.
///
/// # Errors
/// The log cannot be read or has no frames of that endpoint, or the file cannot be written.
pub fn export_tlog<'a>(
    open: &dyn Fn() -> Result<FlightLog<std::io::BufReader<File>>, crate::log::LogError>,
    endpoint: Option<&str>,
    output: impl Into<Destination<'a>>,
) -> Result<ExportedTlog, ExportError> {
    let mut log = open()?;
    while log.next_entry()?.is_some() {}
    let mut endpoints: Vec<String> = log
        .channels()
        .filter(|(_, channel)| channel.message_encoding == protocol::log::record::ENCODING_MAVLINK)
        .filter_map(|(_, channel)| channel.metadata.get("endpoint").cloned())
        .collect();
    endpoints.sort();
    endpoints.dedup();
    let wanted = endpoint.unwrap_or(if endpoints.iter().any(|known| known == "ground") {
        "ground"
    } else {
        "vehicle"
    });
    if !endpoints.iter().any(|known| known == wanted) {
        let found = if endpoints.is_empty() {
            "no raw MAVLink frames".to_owned()
        } else {
            format!("frames recorded by {}", endpoints.join(" and "))
        };
        let wanted = format!("a .tlog needs frames of {wanted}");
        return Err(ExportError::Nothing { name: log.name().to_owned(), found, wanted });
    }
    write_frames(&mut open()?, wanted, output.into())
}

fn write_frames<R: Read>(
    log: &mut FlightLog<R>,
    endpoint: &str,
    destination: Destination,
) -> Result<ExportedTlog, ExportError> {
    let failed = WriteError::at(destination.path);
    let file = NewFile::create(destination, Path::new(log.name()))?;
    let mut output = BufWriter::new(file);
    let mut written =
        ExportedTlog { endpoint: endpoint.to_owned(), received: 0, sent: 0, left_out: 0, damage: None };
    while let Some(stamped) = log.next_entry()? {
        if stamped.entry != Entry::RawFrame {
            continue;
        }
        let Some(channel) = log.channel(stamped.channel_id) else {
            continue;
        };
        if channel.metadata.get("endpoint").map(String::as_str) != Some(endpoint) {
            written.left_out += 1;
            continue;
        }
        if channel.topic == TOPIC_RAW_RX {
            written.received += 1;
        } else {
            written.sent += 1;
        }
        output.write_all(&(stamped.log_time_ns / 1000).to_be_bytes()).map_err(&failed)?;
        output.write_all(&stamped.data).map_err(&failed)?;
    }
    output.into_inner().map_err(|error| failed(error.into_error()))?.commit()?;
    written.damage = log.damage().map(ToString::to_string);
    Ok(written)
}
