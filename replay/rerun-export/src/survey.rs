//! Collects what the export must know before its first record: which records the log has, and its events, which the
//! stream of flight records does not contain.

use std::collections::BTreeMap;
use std::io::Read;

use flight::vehicle::mission::Mission;
use foxglove::messages::Log;
use foxglove::messages::log::Level;
use prost::Message as _;
use protocol::log::reader::{LogItem, LogReader};
use protocol::log::record::{
    ATTACHMENT_PROFILE, EventLevel, METADATA_BUILD, METADATA_RUN, TOPIC_COMPUTER_FRAME, TOPIC_EVENTS,
    TOPIC_TELEMETRY, TOPIC_TRUTH_SAMPLE,
};
use protocol::text::printable;

/// Most events kept; a flight has dozens.
const EVENTS_KEPT: usize = 100_000;

/// The source of the rocket's pose, the best last.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum PoseSource {
    /// No source: the log has no poses.
    #[default]
    None,
    /// The ground station's telemetry.
    Telemetry,
    /// The simulated world.
    Truth,
}

/// An event as text for a screen.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StampedEvent {
    /// Nanoseconds since the Unix epoch.
    pub log_time_ns: u64,
    pub level: EventLevel,
    /// Source and text.
    pub text: String,
}

impl StampedEvent {
    pub(crate) fn of(log: &Log, log_time_ns: u64) -> Self {
        let level = match log.level() {
            Level::Unknown | Level::Debug | Level::Info => EventLevel::Info,
            Level::Warning => EventLevel::Warning,
            Level::Error => EventLevel::Error,
            Level::Fatal => EventLevel::Fatal,
        };
        let said = printable(log.message.as_bytes());
        let text =
            if log.name.is_empty() { said } else { format!("{}: {said}", printable(log.name.as_bytes())) };
        Self { log_time_ns, level, text }
    }
}

/// Facts about a log.
#[derive(Debug, Clone, Default)]
pub struct Survey {
    /// Which run it is: profile, seed and so on.
    pub run: BTreeMap<String, String>,
    /// Which build wrote it.
    pub build: BTreeMap<String, String>,
    /// The text of the mission.
    pub profile_toml: Option<String>,
    /// The mission, if the log has one that this build can use.
    pub mission: Option<Mission>,
    /// Whether it is a vehicle's own log, with frames of its flight computer or the simulated truth.
    pub of_vehicle: bool,
    /// Why this build cannot use the mission, if so.
    pub profile_problem: Option<String>,
    /// The source of the rocket's pose.
    pub pose_source: PoseSource,
    /// The events, by time.
    pub events: Vec<StampedEvent>,
    /// Number of events that cannot be read or exceed the limit.
    pub events_left_out: u64,
    /// Time of the first record, ns since the Unix epoch.
    pub first_log_time_ns: Option<u64>,
}

impl Survey {
    /// Reads a log to its end, or to its damage.
    ///
    /// # Errors
    /// The input cannot be read.
    pub fn of(input: impl Read) -> std::io::Result<Self> {
        let mut reader = LogReader::new(input);
        let mut survey = Self::default();
        let mut profile = None;
        while let Some(item) = reader.next_item()? {
            match item {
                LogItem::Metadata { name, entries } if name == METADATA_RUN => survey.run = entries,
                LogItem::Metadata { name, entries } if name == METADATA_BUILD => survey.build = entries,
                LogItem::Attachment { name, data } if name == ATTACHMENT_PROFILE => profile = Some(data),
                LogItem::Message { channel_id, log_time_ns, data, .. } => {
                    survey.first_log_time_ns.get_or_insert(log_time_ns);
                    if let Some(channel) = reader.channel(channel_id) {
                        survey.take_message(&channel.topic, &channel.schema_name, log_time_ns, &data);
                    }
                }
                _ => {}
            }
        }
        survey.events.sort_by_key(|event| event.log_time_ns);
        if let Some(data) = profile {
            survey.take_profile(data);
        }
        Ok(survey)
    }

    /// As [`of`](Self::of), for a log that is being written, whose flight may not have begun: what is flown is told by its
    /// mission.
    ///
    /// # Errors
    /// The input cannot be read.
    pub fn of_beginning(input: impl Read) -> std::io::Result<Self> {
        let mut survey = Self::of(input)?;
        survey.of_vehicle |= survey.mission.is_some();
        Ok(survey)
    }

    /// Start of the run, ns since the Unix epoch: as the log says, or its first record.
    pub fn start_unix_ns(&self) -> Option<u64> {
        self.run.get("start_unix_ns").and_then(|text| text.parse().ok()).or(self.first_log_time_ns)
    }

    fn take_profile(&mut self, data: Vec<u8>) {
        let text = match String::from_utf8(data) {
            Ok(text) => text,
            Err(error) => {
                self.profile_problem = Some(error.to_string());
                return;
            }
        };
        match flight::vehicles::mission::from_toml(&text, ATTACHMENT_PROFILE) {
            Ok(mission) => self.mission = Some(mission),
            Err(error) => self.profile_problem = Some(error.to_string()),
        }
        self.profile_toml = Some(text);
    }

    fn take_message(&mut self, topic: &str, schema_name: &str, log_time_ns: u64, data: &[u8]) {
        let ours = schema_name.starts_with("touchdown.");
        self.of_vehicle |= ours && matches!(topic, TOPIC_COMPUTER_FRAME | TOPIC_TRUTH_SAMPLE);
        let source = match topic {
            TOPIC_TRUTH_SAMPLE if ours => PoseSource::Truth,
            TOPIC_TELEMETRY if ours => PoseSource::Telemetry,
            TOPIC_EVENTS if schema_name == "foxglove.Log" => return self.take_event(log_time_ns, data),
            _ => PoseSource::None,
        };
        self.pose_source = self.pose_source.max(source);
    }

    fn take_event(&mut self, log_time_ns: u64, data: &[u8]) {
        match Log::decode(data) {
            Ok(log) if self.events.len() < EVENTS_KEPT => {
                self.events.push(StampedEvent::of(&log, log_time_ns));
            }
            _ => self.events_left_out += 1,
        }
    }
}
