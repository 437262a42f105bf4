//! Defines the records of a log and their topics.

use foxglove::messages::{FrameTransform, Log};

use super::{computer_v1, flight_v1, v1};

/// The direction of a raw frame, as seen from the program that wrote the log.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Direction {
    Rx,
    Tx,
}

/// A raw MAVLink frame, with its link and direction.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RawFrame {
    pub direction: Direction,
    /// The program that logged it: `vehicle` or `ground`.
    pub endpoint: &'static str,
    /// The link that carried it, for example `udpin:0.0.0.0:14550`.
    pub link: String,
    /// One complete frame.
    pub bytes: Vec<u8>,
}

/// An event, for a person to read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Event {
    pub level: EventLevel,
    /// The source: `vehicle`, `ground` or `recorder`.
    pub name: String,
    pub message: String,
}

/// The severity of an [`Event`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EventLevel {
    /// It went as planned.
    Info,
    /// It may need attention.
    Warning,
    /// Something failed.
    Error,
    /// The flight is in danger.
    Fatal,
}

#[derive(Debug, Clone, PartialEq)]
pub enum Record {
    /// `/verdict`.
    LandingVerdict(Box<v1::LandingVerdict>),
    /// `/telemetry`.
    Telemetry(Box<v1::Telemetry>),
    /// `/operator`.
    OperatorAction(v1::OperatorAction),
    /// `/book`.
    BookEntry(v1::BookEntry),
    /// `/book/head`.
    BookHead(v1::BookHead),
    /// `/mavlink/rx/raw` or `/mavlink/tx/raw`.
    RawFrame(RawFrame),
    /// `/events`.
    Event(Event),
    /// `/computer/start`.
    ComputerStart(Box<computer_v1::ComputerStart>),
    /// `/computer/frame`.
    ComputerFrame(Box<computer_v1::ComputerFrame>),
    /// `/pilot/timing`.
    PilotTiming(flight_v1::PilotTiming),
    /// `/pilot/estimate`.
    Estimate(Box<flight_v1::Estimate>),
    /// `/vehicle/truth3d`, and with it `/tf`: the same pose as a transform from `world` to
    /// `rocket`.
    TruthSample(Box<flight_v1::TruthSample>),
}

/// Topic of the landing verdict.
pub const TOPIC_VERDICT: &str = "/verdict";
/// Topic of a ground station's decoded telemetry.
pub const TOPIC_TELEMETRY: &str = "/telemetry";
/// Topic of the operator's keys and commands.
pub const TOPIC_OPERATOR: &str = "/operator";
/// Topic of a station's book.
pub const TOPIC_BOOK: &str = "/book";
/// Topic of the signed ends of the book.
pub const TOPIC_BOOK_HEAD: &str = "/book/head";
/// Topic of raw frames received.
pub const TOPIC_RAW_RX: &str = "/mavlink/rx/raw";
/// Topic of raw frames sent.
pub const TOPIC_RAW_TX: &str = "/mavlink/tx/raw";
pub const TOPIC_EVENTS: &str = "/events";
/// Topic of the data from which the flight computer is built, at power-up and at its release.
pub const TOPIC_COMPUTER_START: &str = "/computer/start";
/// Topic of the flight computer's frames.
pub const TOPIC_COMPUTER_FRAME: &str = "/computer/frame";
/// Topic of the computing times of the flight computer's frames with a plan.
pub const TOPIC_PILOT_TIMING: &str = "/pilot/timing";
pub const TOPIC_ESTIMATE: &str = "/pilot/estimate";
/// Topic of the simulated vehicle in space.
pub const TOPIC_TRUTH_SAMPLE: &str = "/vehicle/truth3d";
pub const TOPIC_TRANSFORM: &str = "/tf";
/// Message encoding of the raw frames.
pub const ENCODING_MAVLINK: &str = "mavlink2";

/// Name of the metadata record that identifies the build which wrote the log.
pub const METADATA_BUILD: &str = "build";
/// The version of a log's contents.
pub const SCHEMA_VERSION: u32 = 1;
/// Name of the metadata record with [`SCHEMA_VERSION`].
pub const METADATA_SCHEMA: &str = "schema";
/// The entry with the version.
pub const SCHEMA_VERSION_ENTRY: &str = "version";
/// Name of the metadata record that describes the run (profile, seed, start).
pub const METADATA_RUN: &str = "run";
/// Name of the metadata record of a log that was recovered from a damaged one.
pub const METADATA_RECOVERY: &str = "recovery";
/// The entry that describes the fault of the damaged log; empty if it was intact.
pub const RECOVERY_FAULT_ENTRY: &str = "fault";
/// Name of the attachment with the profile's text.
pub const ATTACHMENT_PROFILE: &str = "profile.toml";
/// Name of the attachment with the scenario: the text that the random draws are made from.
pub const ATTACHMENT_SCENARIO: &str = "scenario.toml";
/// Name of the attachment with the dialect.
pub const ATTACHMENT_DIALECT: &str = "touchdown.xml";

/// Converts the pose of the vehicle into a Foxglove transform. World: x north, y west, z up; the
/// rocket's x axis points to its nose.
pub(super) fn transform(truth: &flight_v1::TruthSample, time_ns: u64) -> FrameTransform {
    let (place, turn) = (&truth.state.position_m, &truth.state.world_from_body);
    FrameTransform {
        timestamp: Some(timestamp(time_ns)),
        parent_frame_id: "world".to_owned(),
        child_frame_id: "rocket".to_owned(),
        translation: Some(foxglove::messages::Vector3 { x: place.x, y: place.y, z: place.z }),
        rotation: Some(foxglove::messages::Quaternion { x: turn.x, y: turn.y, z: turn.z, w: turn.w }),
    }
}

impl EventLevel {
    /// Of a text with a severity of MAVLink, which is RFC 5424's: 0 emergency to 7 debug.
    pub fn of_severity(severity: u8) -> Self {
        match severity {
            0..=2 => Self::Fatal,
            3 => Self::Error,
            4 => Self::Warning,
            _ => Self::Info,
        }
    }
}

/// Converts an event into a Foxglove log message.
pub(super) fn log_message(event: &Event, time_ns: u64) -> Log {
    let level = match event.level {
        EventLevel::Info => foxglove::messages::log::Level::Info,
        EventLevel::Warning => foxglove::messages::log::Level::Warning,
        EventLevel::Error => foxglove::messages::log::Level::Error,
        EventLevel::Fatal => foxglove::messages::log::Level::Fatal,
    };
    Log {
        timestamp: Some(timestamp(time_ns)),
        level: level as i32,
        message: event.message.clone(),
        name: event.name.clone(),
        file: String::new(),
        line: 0,
    }
}

fn timestamp(time_ns: u64) -> foxglove::messages::Timestamp {
    let seconds = u32::try_from(time_ns / 1_000_000_000).unwrap_or(u32::MAX);
    foxglove::messages::Timestamp::new(seconds, (time_ns % 1_000_000_000) as u32)
}
