//! The description of a log, as data.

use std::collections::BTreeMap;

use protocol::log::reader::Damage;
use protocol::log::v1;
use serde::Serialize;
use sim::ending::FlightEnding;

use super::{ChannelFacts, FrameFacts, PhaseTimeline};
use crate::log::{
    AttachmentFacts, BuildComparison, Clock, ClockTime, Clocks, Cut, Flights, Found, Head, SummaryFacts,
};
use crate::settings::explained;

/// What is in a log.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Info {
    /// The log.
    pub file: String,
    /// Size of the file.
    pub size_bytes: Option<u64>,
    /// What can be done with the log.
    pub grade: Grade,
    /// The library that wrote the file.
    pub library: String,
    pub schema: SchemaFacts,
    /// Which build wrote it.
    pub build: BTreeMap<String, String>,
    /// Comparison of that build with this one.
    pub build_comparison: BuildComparison,
    pub run: BTreeMap<String, String>,
    /// The profile that was flown.
    pub profile: Option<ProfileFacts>,
    /// From the first record to the last.
    pub span: Option<Span>,
    /// Its channels, by topic.
    pub channels: Vec<ChannelFacts>,
    /// The frames of the flight computer from its release on.
    pub frames: Option<FrameFacts>,
    /// The phases from each source that records them, the vehicle first.
    pub phases: Vec<PhaseTimeline>,
    /// The landing verdict.
    pub verdict: Option<VerdictFacts>,
    /// How the flight ended, in one sentence, if the log says so.
    pub ending: Option<String>,
    /// How the clocks of the log differ.
    pub clocks: Clocks,
    /// Why the first unreadable record could not be read.
    pub unreadable: Option<String>,
    /// Whether anything is missing.
    pub completeness: Completeness,
    pub attachments: Vec<AttachmentFacts>,
}

/// The version of a log's schema, and of this build's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct SchemaFacts {
    pub version: u32,
    pub this_build: u32,
}

/// What can be done with a log.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Grade {
    /// How much.
    pub level: GradeLevel,
    pub reason: String,
}

/// How much can be done with a log.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum GradeLevel {
    /// The flight computer can be run again on its own inputs.
    BitExact,
    /// Frames in full precision, but nothing to run them with.
    Numeric,
    /// Only what went over the air or the simulator knew.
    TelemetryOnly,
}

impl GradeLevel {
    /// The grade's name.
    pub fn name(self) -> &'static str {
        match self {
            Self::BitExact => "bit-exact",
            Self::Numeric => "numeric",
            Self::TelemetryOnly => "telemetry-only",
        }
    }
}

impl Grade {
    pub(super) fn without_frames(unreadable: Option<&str>) -> Self {
        let reason = match unreadable {
            None => "it has no frames of a flight computer that this build knows".to_owned(),
            Some(why) => format!("it has no frames of a flight computer that this build can read: {why}"),
        };
        Self { level: GradeLevel::TelemetryOnly, reason }
    }
}

/// The profile in a log.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ProfileFacts {
    /// Its name, if it can be used.
    pub name: Option<String>,
    /// Its one-line description, if it can be used.
    pub summary: Option<String>,
    /// Why this build cannot use it, if so.
    pub problem: Option<String>,
}

impl ProfileFacts {
    pub(super) fn of(head: &Head) -> Option<Self> {
        let parsed = match head.profile_toml.as_ref()? {
            Ok(text) => vehicles::mission::from_toml(text, "profile.toml")
                .map(|mission| (mission.name, mission.summary))
                .map_err(|error| explained(&error.to_string())),
            Err(error) => Err(error.to_string()),
        };
        Some(match parsed {
            Ok((name, summary)) => Self { name: Some(name), summary: Some(summary), problem: None },
            Err(problem) => Self { name: None, summary: None, problem: Some(problem) },
        })
    }
}

/// From the first record to the last.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Span {
    /// Earliest log time, ns since the Unix epoch.
    pub first_ns: u64,
    /// Latest log time, ns since the Unix epoch.
    pub last_ns: u64,
    pub duration_s: f64,
}

impl Span {
    pub(super) fn new(first_ns: u64, last_ns: u64) -> Self {
        Self { first_ns, last_ns, duration_s: seconds(last_ns.saturating_sub(first_ns)) }
    }
}

/// Whether anything is missing.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Completeness {
    /// The log was closed properly, is undamaged, and lacks nothing up to the end of its flight.
    pub complete: bool,
    /// Why the log could not be read to its end, if so.
    pub damage: Option<String>,
    /// The last time that could be read, s after the first record.
    pub readable_until_s: Option<f64>,
    /// How much is missing after that, s; known only if the end of the file can be read.
    pub missing_s: Option<f64>,
    /// Messages missing before the last of their channel.
    pub messages_lost: u64,
    /// Number of flights with ticks: more than one in a joined log.
    pub flights: usize,
    /// Where the record of a flight ends, if that is before the end of the flight.
    pub cut: Option<Cut>,
}

impl Completeness {
    pub(super) fn new(
        damage: Option<&Damage>,
        span: Option<&Span>,
        channels: &[ChannelFacts],
        summary: impl FnOnce() -> Option<SummaryFacts>,
    ) -> Self {
        let missing_s = damage.and_then(|_| {
            let end_ns = summary()?.last_log_time_ns;
            Some(seconds(end_ns.checked_sub(span?.last_ns)?))
        });
        let messages_lost = channels.iter().map(|channel| channel.lost).sum();
        Self {
            complete: damage.is_none() && messages_lost == 0,
            damage: damage.map(ToString::to_string),
            readable_until_s: span.map(|span| span.duration_s),
            missing_s,
            messages_lost,
            flights: 0,
            cut: None,
        }
    }

    /// Adds what the flights of the log show.
    pub(super) fn with_flights(self, flights: &Flights) -> Self {
        let cut = flights.cut();
        Self { complete: self.complete && cut.is_none(), flights: flights.flown(), cut, ..self }
    }
}

/// The landing verdict, as recorded or heard.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VerdictFacts {
    /// Whether the vehicle landed within the limits that decide.
    pub landed: bool,
    /// How the flight ended, in one sentence.
    pub ending: String,
    /// Time of contact, s.
    pub time_s: f64,
    /// What the time counts from: T+0, or power-up if a ground station heard the verdict.
    pub clock: Clock,
    /// The limits that decide: those of the legs.
    pub limits: Vec<VerdictLimit>,
    /// The landing paper's Table 2, if `limits` are those of the legs and the log has it.
    pub table_2: Vec<VerdictLimit>,
}

/// A limit of the landing verdict.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VerdictLimit {
    /// Name of the judged quantity.
    pub name: String,
    pub value: f64,
    /// The lowest allowed.
    pub minimum: f64,
    /// The highest allowed.
    pub maximum: f64,
    /// Unit of value and limits.
    pub unit: String,
    /// Whether the value is inside the limits.
    pub passed: bool,
}

impl VerdictFacts {
    /// A recorded verdict.
    pub fn of(verdict: &v1::LandingVerdict) -> Self {
        let facts = |limits: &[v1::LimitResult]| -> Vec<VerdictLimit> {
            let limits = limits.iter().map(|limit| VerdictLimit {
                name: limit.name.clone(),
                value: limit.value,
                minimum: limit.minimum,
                maximum: limit.maximum,
                unit: limit.unit.clone(),
                passed: limit.passed,
            });
            limits.collect()
        };
        Self {
            landed: verdict.landed,
            ending: verdict.ending.clone().unwrap_or_else(|| ending_of_earlier(verdict)),
            time_s: verdict.time_s,
            clock: Clock::Flight,
            limits: facts(&verdict.limits),
            table_2: facts(&verdict.table_2),
        }
    }

    /// The verdict that was found in a log.
    pub(crate) fn found(found: &Found) -> Self {
        let clock = if found.heard { Clock::Boot } else { Clock::Flight };
        Self { clock, ..Self::of(&found.verdict) }
    }

    /// Its time of contact with its clock.
    pub fn contact(&self) -> ClockTime {
        ClockTime { clock: self.clock, time_s: self.time_s }
    }
}

/// How a flight ended whose log, of an earlier release, does not say it.
fn ending_of_earlier(verdict: &v1::LandingVerdict) -> String {
    // The limits of a planar landing are Table 2; those of legs have other names.
    let in_plane = verdict.limits.iter().any(|limit| limit.name == "u");
    let broken = verdict.limits.iter().rev().find(|limit| !limit.passed);
    FlightEnding {
        aborted: false,
        landed: verdict.landed,
        table_2: in_plane.then_some(verdict.landed),
        failure: broken.map(|limit| limit.name.as_str()),
    }
    .to_string()
}

fn seconds(ns: u64) -> f64 {
    ns as f64 / 1e9
}
