//! One record of a log; decoded if replay needs its content.

use std::sync::LazyLock;

use flight::computer::flight_time_s;
use prost::{Message, Name};
use prost_reflect::{
    Cardinality, DescriptorPool, DynamicMessage, MessageDescriptor, ReflectMessage as _, Value,
};
use protocol::log::reader::LogChannel;
use protocol::log::record::{
    ENCODING_MAVLINK, TOPIC_COMPUTER_FRAME, TOPIC_COMPUTER_START, TOPIC_ESTIMATE, TOPIC_EVENTS,
    TOPIC_OPERATOR, TOPIC_PILOT_TIMING, TOPIC_RAW_RX, TOPIC_RAW_TX, TOPIC_TELEMETRY, TOPIC_TRUTH_SAMPLE,
    TOPIC_VERDICT,
};
use protocol::log::{
    DESCRIPTORS_COMPUTER_V1, DESCRIPTORS_FLIGHT_V1, DESCRIPTORS_V1, computer_v1, flight_v1, v1,
};

/// A record and its position in the log.
#[derive(Debug, Clone, PartialEq)]
pub struct StampedEntry {
    /// Its channel; see [`FlightLog::channels`](super::FlightLog::channels).
    pub channel_id: u16,
    /// Nanoseconds since the Unix epoch.
    pub log_time_ns: u64,
    /// Sequence number in its channel, or in the log if its channels share a counter.
    pub sequence: u32,
    /// Records lost before it, by the sequence numbers.
    pub lost_before: u32,
    /// Its bytes.
    pub data: Vec<u8>,
    /// Its content.
    pub entry: Entry,
}

/// A frame of the flight computer, and its place in the flight.
#[derive(Debug, Clone, PartialEq)]
pub struct LoggedFrame {
    /// As recorded: numbers and times count from power-up.
    pub record: computer_v1::ComputerFrame,
    /// Its number since the release, until the flight is over.
    pub since_release: Option<u64>,
}

impl LoggedFrame {
    /// Time since the release, s, in flight.
    pub fn flight_time_s(&self) -> Option<f64> {
        self.since_release.map(flight_time_s)
    }

    /// The frame on the clock of its flight: number and time count from the release. `None` outside
    /// the flight.
    pub fn in_flight(self) -> Option<computer_v1::ComputerFrame> {
        let frame = self.since_release?;
        let mut record = self.record;
        (record.input.frame, record.input.time_s) = (frame, flight_time_s(frame));
        Some(record)
    }
}

/// One record of a log.
#[derive(Debug, Clone, PartialEq)]
pub enum Entry {
    /// The data from which the flight computer was built, at power-up or at its release.
    ComputerStart(Box<computer_v1::ComputerStart>),
    /// A frame of the flight computer.
    ComputerFrame(Box<LoggedFrame>),
    /// Solve time of a planning frame.
    PilotTiming(Box<flight_v1::PilotTiming>),
    /// The estimate of the flight computer after a frame.
    Estimate(Box<flight_v1::Estimate>),
    /// The simulated world.
    World(Box<flight_v1::TruthSample>),
    /// The landing verdict.
    Verdict(Box<v1::LandingVerdict>),
    /// The values that a ground station knew.
    Telemetry(Box<v1::Telemetry>),
    /// A raw frame: see the record's own bytes.
    RawFrame,
    /// An operator's action: see the record's own bytes.
    Operator,
    /// An event, as text for people; many programs write such records.
    Event(Box<foxglove::messages::Log>),
    /// A record on one of our topics that this build cannot read.
    Unreadable { reason: String },
    /// Anything else: transforms and records of other programs.
    Other,
}

impl Entry {
    /// Whether such a record occurs only in flight logs.
    pub(super) fn is_ours(&self) -> bool {
        !matches!(self, Self::Event(_) | Self::Other)
    }

    /// The content of a message on `channel`, if it can be understood exactly. Of a frame of the
    /// flight computer that is not looked at if `trusted`: see [`misread_frame`].
    pub(super) fn decode(channel: Option<&LogChannel>, data: &[u8], trusted: bool) -> Self {
        let Some(channel) = channel else {
            return Self::Other;
        };
        match channel.topic.as_str() {
            TOPIC_COMPUTER_START => decoded(channel, data, Self::ComputerStart),
            TOPIC_COMPUTER_FRAME => {
                decoded_if(!trusted, channel, &computer_v1::ComputerFrame::full_name(), data, |record| {
                    Self::ComputerFrame(Box::new(LoggedFrame { record: *record, since_release: None }))
                })
            }
            TOPIC_PILOT_TIMING => decoded(channel, data, Self::PilotTiming),
            TOPIC_ESTIMATE => decoded(channel, data, Self::Estimate),
            TOPIC_TRUTH_SAMPLE => decoded(channel, data, Self::World),
            TOPIC_VERDICT => decoded(channel, data, Self::Verdict),
            TOPIC_TELEMETRY => decoded(channel, data, Self::Telemetry),
            TOPIC_OPERATOR => decoded(channel, data, |_: Box<v1::OperatorAction>| Self::Operator),
            TOPIC_EVENTS => decoded_if(false, channel, "foxglove.Log", data, Self::Event),
            TOPIC_RAW_RX | TOPIC_RAW_TX if channel.message_encoding == ENCODING_MAVLINK => Self::RawFrame,
            _ => Self::Other,
        }
    }
}

/// Records are far smaller. Decoded, one may take many times its bytes.
pub(crate) const RECORD_MAX_BYTES: usize = 1 << 20;

fn decoded<M: Message + Name + Default>(
    channel: &LogChannel,
    data: &[u8],
    kind: impl FnOnce(Box<M>) -> Entry,
) -> Entry {
    decoded_if(true, channel, &M::full_name(), data, kind)
}

/// Why a frame's bytes cannot be understood exactly; `None` if they can. Where a frame is encoded
/// again to be compared with its bytes, this is called only if they differ.
pub(crate) fn misread_frame(data: &[u8]) -> Option<String> {
    complaint(&computer_v1::ComputerFrame::full_name(), data)
        .map(|complaint| format!("{TOPIC_COMPUTER_FRAME}: {complaint}"))
}

fn decoded_if<M: Message + Default>(
    exactly: bool,
    channel: &LogChannel,
    accepted: &str,
    data: &[u8],
    kind: impl FnOnce(Box<M>) -> Entry,
) -> Entry {
    if channel.schema_name != accepted {
        // Another program may use the same topic name.
        return if channel.schema_name.starts_with("touchdown.") {
            let found = &channel.schema_name;
            let reason = format!("{} holds {found}; this build reads {accepted}", channel.topic);
            Entry::Unreadable { reason }
        } else {
            Entry::Other
        };
    }
    let unreadable = |why: String| Entry::Unreadable { reason: format!("{}: {why}", channel.topic) };
    if data.len() > RECORD_MAX_BYTES {
        return unreadable(format!("{} bytes; no record has more than {RECORD_MAX_BYTES}", data.len()));
    }
    let message = match M::decode(data) {
        Ok(message) => message,
        Err(error) => return unreadable(error.to_string()),
    };
    // The decoder fills missing fields with zeros and skips unknown ones, so encoding again would
    // give different bytes.
    if exactly
        && message.encode_to_vec() != data
        && let Some(complaint) = complaint(accepted, data)
    {
        return unreadable(complaint);
    }
    kind(Box::new(message))
}

static POOL: LazyLock<DescriptorPool> = LazyLock::new(|| {
    let mut pool = DescriptorPool::decode(DESCRIPTORS_V1).unwrap_or_default();
    // A schema that cannot be added would be missing, and the crate's tests would notice.
    let _ = pool.decode_file_descriptor_set(DESCRIPTORS_FLIGHT_V1);
    let _ = pool.decode_file_descriptor_set(DESCRIPTORS_COMPUTER_V1);
    pool
});

/// Describes a frame of the flight computer.
pub(crate) fn frame_descriptor() -> Option<MessageDescriptor> {
    POOL.get_message_by_name(&computer_v1::ComputerFrame::full_name())
}

/// Why a record cannot be understood exactly: a missing or an unknown field. `None` if it can.
pub(super) fn complaint(full_name: &str, data: &[u8]) -> Option<String> {
    let descriptor = POOL.get_message_by_name(full_name)?;
    match DynamicMessage::decode(descriptor, data) {
        Ok(message) => message_complaint(&message, ""),
        Err(error) => Some(error.to_string()),
    }
}

fn message_complaint(message: &DynamicMessage, path: &str) -> Option<String> {
    if let Some(unknown) = message.unknown_fields().next() {
        let place = if path.is_empty() { "the record" } else { path.trim_end_matches('.') };
        return Some(format!(
            "{place} has a field number {} that this build does not know: a newer version wrote it",
            unknown.number()
        ));
    }
    message.descriptor().fields().find_map(|field| {
        let name = format!("{path}{}", field.name());
        if field.cardinality() == Cardinality::Required && !message.has_field(&field) {
            return Some(format!("{name} is missing; this build needs it"));
        }
        match message.get_field(&field).as_ref() {
            Value::Message(inner) if message.has_field(&field) => {
                message_complaint(inner, &format!("{name}."))
            }
            Value::List(items) => items.iter().enumerate().find_map(|(index, item)| {
                message_complaint(item.as_message()?, &format!("{name}[{index}]."))
            }),
            _ => None,
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::log::{computer_v1, v1};

    #[test]
    fn every_record_is_described() {
        for name in ["LandingVerdict", "Telemetry", "OperatorAction"] {
            assert!(POOL.get_message_by_name(&format!("touchdown.log.v1.{name}")).is_some(), "{name}");
        }
        assert!(frame_descriptor().is_some());
    }

    #[test]
    fn a_missing_field_is_named() {
        let frame = "touchdown.computer.v1.ComputerFrame";
        assert_eq!(complaint(frame, &computer_v1::ComputerFrame::default().encode_to_vec()), None);
        assert_eq!(complaint(frame, &[]).unwrap(), "input is missing; this build needs it");
        // Field 1, a message of no bytes.
        assert_eq!(complaint(frame, &[0x0a, 0x00]).unwrap(), "input.frame is missing; this build needs it");
    }

    #[test]
    fn an_unknown_field_is_named_with_its_place() {
        let mut action = v1::OperatorAction::default().encode_to_vec();
        // Field 15, a varint.
        action.extend([0x78, 0x01]);
        let complaint = complaint("touchdown.log.v1.OperatorAction", &action).unwrap();
        assert!(complaint.contains("field number 15"), "{complaint}");
    }
}
