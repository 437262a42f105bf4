//! The raw MAVLink frames as a telemetry log.
//!
//! A `.tlog` is a row of Unix times in microseconds (8 bytes, big-endian), each followed by one whole frame: what
//! Mission Planner, QGroundControl and MAVProxy write and play back.

use std::fs::File;
use std::io::{BufWriter, Read, Write as _};
use std::path::Path;

use protocol::log::record::TOPIC_RAW_RX;
use serde::Serialize;

use super::ExportError;
use crate::log::{Entry, FlightLog};
use crate::output::{Destination, NewFile};

/// What was written.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ExportedTlog {
    /// Who had written the frames down: `vehicle` or `ground`.
    pub endpoint: String,
    /// Frames that it had received.
    pub received: u64,
    /// Frames that it had sent.
    pub sent: u64,
    /// Frames that other endpoints of the log had written down; they are the same frames at the other end of a link.
    pub left_out: u64,
    /// What ended the reading of the log early.
    pub damage: Option<String>,
}

/// Writes the frames of one endpoint as a `.tlog`: of the ground's if the log has them, else the vehicle's, unless
/// `endpoint` says which.
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
            format!("frames written down by {}", endpoints.join(" and "))
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
    let failed = |source| ExportError::Write { path: destination.path.to_owned(), source };
    let file = NewFile::create(destination, Path::new(log.name())).map_err(failed)?;
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
        output.write_all(&(stamped.log_time_ns / 1000).to_be_bytes()).map_err(failed)?;
        output.write_all(&stamped.data).map_err(failed)?;
    }
    let file = output.into_inner().map_err(|error| failed(error.into_error()))?;
    file.commit().map_err(failed)?;
    written.damage = log.damage().map(ToString::to_string);
    Ok(written)
}
