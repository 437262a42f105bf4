//! Describes a log: its content, how complete it is, and what can be done with it.

mod counts;
pub mod season;

use std::collections::BTreeMap;
use std::io::{IsTerminal as _, Read};
use std::path::{Path, PathBuf};

pub(crate) use self::counts::RESET;
pub use self::counts::{Channel, Frames, PhaseSource, PhaseSpan, PhaseTimeline, PlanningLatency, SolverWork};
use self::counts::{ChannelCounter, EndingTracker, FrameCounter, PhaseTracker};
use anyhow::{Result, ensure};
use avionics::link::telemetry;
use flight::computer::findings::Findings;
use flight::vehicle::mission::Mission;
use flight::vehicles::mission::from_toml;
use mavlink::MessageData as _;
use protocol::dialect::{MavMessage, TD_EVENTS_DATA, TD_FINDING_DATA, TdPhase};
use protocol::log::record::SCHEMA_VERSION;
use protocol::log::v1::LimitResult;
use protocol::program::Exit;
use protocol::reported::{FlightEvent, ReceivedEvents};
use serde::Serialize;
use time::OffsetDateTime;
use time::format_description::well_known::Rfc3339;

use crate::cli::{Answer, answer, give, give_each, warn_of_loss};
use crate::controller::new_plan;
use crate::findings::{self, Finding};
use crate::log::{
    Attachment, BuildComparison, Clock, ClockTime, Clocks, Cut, Entry, FlightLog, Head, Jump, LogError,
    Recording, RecordingError, RecordingReader, StampedEntry, Verdict, frame_of,
};
use crate::print::{beyond, counted, messages_lost};

/// Describes a log file. The flight computer is run again only if the vehicle's own findings do not
/// suffice.
///
/// # Errors
/// The file is not a flight log or cannot be read. Damage is part of the description, not an error.
pub fn info(path: &Path) -> Result<Info, LogError> {
    let info = described(path)?;
    Ok(if info.findings.is_some() { info } else { run_again(path, info) })
}

/// Adds the findings of the flight computer, run again, and the work of its solver.
fn run_again(path: &Path, mut info: Info) -> Info {
    if info.grade.level != GradeLevel::BitExact {
        info.set_findings(Err(info.grade.reason.clone()));
        return info;
    }
    let mut work = Vec::new();
    let recording = match recorded(path) {
        Ok((_, recording)) => recording,
        Err(error) => {
            info.set_findings(Err(error.to_string()));
            return info;
        }
    };
    let again = findings::run_again(&recording, |computer, _, frame| {
        let plan = new_plan(computer.pilot(), &frame.output);
        work.extend(plan.map(|_| computer.pilot().report().iterations as f64));
    });
    let again = again.and_then(|(_, findings)| findings);
    if let Some(frames) = info.frames.as_mut().filter(|_| again.is_ok()) {
        frames.solver_work = SolverWork::of(work);
    }
    info.note_again(&recording, again);
    info
}

/// The same with the vehicle's own findings alone.
pub(crate) fn described(path: &Path) -> Result<Info, LogError> {
    let mut log = FlightLog::open(path)?;
    let mut info = info_of(&mut log)?;
    info.note_size(path);
    Ok(info)
}

/// The same with the recording of the flight, whose computer was run up to its release.
///
/// # Errors
/// As [`Recording::open`].
pub(crate) fn recorded(path: &Path) -> Result<(Info, Recording), RecordingError> {
    let mut log = FlightLog::open(path)?;
    let (mut seen, mut reader) = (Seen::default(), RecordingReader::of(&log, true));
    while let Some(stamped) = log.next_entry()? {
        seen.take(&stamped, &log);
        reader.take(stamped, &log)?;
    }
    let mut info = seen.into_info(&log);
    info.note_size(path);
    Ok((info, reader.finish(&log)?))
}

/// Describes a log that is being read.
///
/// # Errors
/// As [`info`].
pub fn info_of<R: Read>(log: &mut FlightLog<R>) -> Result<Info, LogError> {
    let mut seen = Seen::default();
    while let Some(stamped) = log.next_entry()? {
        seen.take(&stamped, log);
    }
    Ok(seen.into_info(log))
}

/// Whether a raw frame holds TD_FINDING or TD_EVENTS, by its header.
fn is_of_interest(frame: &[u8]) -> bool {
    let ids = [TD_FINDING_DATA::ID, TD_EVENTS_DATA::ID].map(u32::to_le_bytes);
    let is_one = |found: &[u8]| ids.iter().any(|id| *found == id[..3]);
    frame.first() == Some(&mavlink::MAV_STX_V2) && frame.get(7..10).is_some_and(is_one)
}

/// What was seen while the log was read.
#[derive(Default)]
struct Seen {
    channels: ChannelCounter,
    flights: usize,
    span: Option<(u64, u64)>,
    vehicle_phases: PhaseTracker,
    telemetry_phases: PhaseTracker,
    ending: EndingTracker,
    frames: FrameCounter,
    highest_m: Option<f64>,
    unreadable: Option<String>,
    /// The vehicle has warned of something before its release.
    warned: bool,
    /// The finding that the vehicle has sent last.
    finding: Option<TD_FINDING_DATA>,
    events: ReceivedEvents,
}

impl Seen {
    fn take<R: Read>(&mut self, stamped: &StampedEntry, log: &FlightLog<R>) {
        let flights = log.flights.found.len();
        if flights > self.flights {
            // The last verdict is shown: phases and outcome are of the same flight.
            (self.vehicle_phases, self.finding) = (PhaseTracker::default(), None);
            (self.ending, self.flights) = (EndingTracker::default(), flights);
            self.events = ReceivedEvents::default();
        }
        self.channels.count(stamped);
        let at_ns = stamped.log_time_ns;
        let (first_ns, last_ns) = self.span.unwrap_or((at_ns, at_ns));
        self.span = Some((first_ns.min(at_ns), last_ns.max(at_ns)));
        self.ending.note(&stamped.entry);
        match &stamped.entry {
            Entry::Telemetry(telemetry) => {
                if let Some(phase) = telemetry.phase {
                    let jumped_s = log.clocks.station_jump.map_or(0.0, |jump| jump.by_s);
                    self.telemetry_phases.note(telemetry.time_s - jumped_s, phase);
                }
                self.rises_to(telemetry.altitude_m);
            }
            Entry::Estimate(estimate) => self.rises_to(Some(estimate.state.position_m.z)),
            Entry::Unreadable { reason } => {
                self.unreadable.get_or_insert_with(|| reason.clone());
            }
            Entry::Event(event) if log.clocks.flight_zero_s.is_none() => {
                self.warned |= findings::is_warning(event);
            }
            Entry::RawFrame if is_of_interest(&stamped.data) => {
                match frame_of(&stamped.data).and_then(|frame| frame.decode().ok()) {
                    Some(MavMessage::TD_FINDING(finding)) => self.finding = Some(finding),
                    Some(MavMessage::TD_EVENTS(events)) => self.events.take(&events),
                    _ => {}
                }
            }
            Entry::ComputerStart(_) => self.frames.start = true,
            Entry::PilotTiming(timing) => self.frames.time(timing),
            Entry::ComputerFrame(frame) => {
                let reset = self.frames.count(frame.record.input.frame, stamped.lost_before);
                if let Some(time_s) = frame.flight_time_s() {
                    if reset {
                        self.vehicle_phases.reset(time_s);
                    }
                    self.vehicle_phases.note(time_s, frame.record.output.phase);
                }
            }
            _ => {}
        }
    }

    fn rises_to(&mut self, height_m: Option<f64>) {
        // What is no number is no height.
        self.highest_m = height_m.into_iter().chain(self.highest_m).reduce(f64::max);
    }

    fn into_info<R: Read>(self, log: &FlightLog<R>) -> Info {
        let head = log.head();
        let profile = Profile::of(head);
        let frames = self.frames.into_facts();
        let span = self.span.map(|(first_ns, last_ns)| Span {
            first_ns,
            last_ns,
            duration_s: last_ns.saturating_sub(first_ns) as f64 / 1e9,
        });
        let channels = self.channels.into_facts(log);
        let verdict = log.verdict();
        let sent = self.finding.filter(|_| !self.warned).zip(verdict.as_ref());
        let findings = sent.and_then(|(last, verdict)| findings::recorded(&last, verdict, &log.clocks));
        let ending = self.ending.words(verdict.as_ref());
        let resets = self.vehicle_phases.resets;
        let after_reset = |ending| match resets {
            0 => ending,
            _ => format!("{ending}; after {} of the flight computer in flight", counted(resets, "RESET")),
        };
        let timelines =
            [(PhaseSource::Vehicle, self.vehicle_phases), (PhaseSource::Telemetry, self.telemetry_phases)];
        Info {
            file: log.name().to_owned(),
            size_bytes: None,
            grade: match &frames {
                Some(frames) => Grade::of_frames(frames, profile.as_ref()),
                None => Grade::without_frames(self.unreadable.as_deref()),
            },
            frames,
            schema: Schema {
                version: head.schema_version().map(str::to_owned),
                this_build: SCHEMA_VERSION.to_string(),
            },
            library: head.library.clone(),
            build: head.build.clone(),
            build_comparison: head.compare_build(),
            run: head.run.clone(),
            profile,
            completeness: Completeness::of(log, span.as_ref()),
            span,
            channels,
            phases: timelines
                .into_iter()
                .filter_map(|(source, tracker)| tracker.into_timeline(source))
                .collect(),
            ending: ending.map(after_reset),
            verdict,
            highest_m: self.highest_m.filter(|height_m| height_m.is_finite()),
            events: self.events.events,
            findings,
            not_looked_for: None,
            clocks: log.clocks,
            unreadable: self.unreadable,
            attachments: head.attachments.clone(),
        }
    }
}

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
    pub schema: Schema,
    /// Which build wrote it.
    pub build: BTreeMap<String, String>,
    /// Comparison of that build with this one.
    pub build_comparison: BuildComparison,
    pub run: BTreeMap<String, String>,
    /// The profile that was flown.
    pub profile: Option<Profile>,
    /// From the first record to the last.
    pub span: Option<Span>,
    /// Its channels, by topic.
    pub channels: Vec<Channel>,
    /// The frames of the flight computer from its release on.
    pub frames: Option<Frames>,
    /// The phases from each source that records them, the vehicle first.
    pub phases: Vec<PhaseTimeline>,
    /// The events of the flight, as its computer reports them; none if it did not.
    pub events: Vec<FlightEvent>,
    /// The landing verdict.
    pub verdict: Option<Verdict>,
    /// Greatest height that was estimated or received, m.
    pub highest_m: Option<f64>,
    /// How the flight ended, in one sentence, if the log has a verdict.
    pub ending: Option<String>,
    /// What went wrong, causes first; `None` of a log whose flight this build does not run again
    /// as it was.
    pub findings: Option<Vec<Finding>>,
    /// Why no findings were looked for.
    pub not_looked_for: Option<String>,
    /// How the clocks of the log differ.
    pub clocks: Clocks,
    /// Why the first unreadable record could not be read.
    pub unreadable: Option<String>,
    /// Whether anything is missing.
    pub completeness: Completeness,
    pub attachments: Vec<Attachment>,
}

impl Info {
    /// Statement that there are no findings, and how far the log allows it.
    pub(crate) fn no_findings(&self) -> String {
        match &self.not_looked_for {
            Some(reason) => format!("not looked for: {reason}"),
            None if self.completeness.cut.is_some() => "none up to where the record ends".to_owned(),
            None => "none".to_owned(),
        }
    }

    fn note_size(&mut self, path: &Path) {
        self.size_bytes = std::fs::metadata(path).ok().map(|metadata| metadata.len());
    }

    /// The contact: as the vehicle reports it, else of its verdict.
    pub(crate) fn contact(&self) -> Option<ClockTime> {
        let event = self.events.iter().find(|event| event.phase == TdPhase::TD_PHASE_TOUCHDOWN);
        let reported = event.map(|event| ClockTime { clock: Clock::Flight, time_s: event.at_s });
        reported.or_else(|| self.verdict.as_ref().map(Verdict::contact))
    }

    /// Notes what a flight computer reports that was run again.
    pub(crate) fn note_again(&mut self, recording: &Recording, again: Result<Findings, String>) {
        if let Some(MavMessage::TD_EVENTS(data)) =
            again.as_ref().ok().and_then(|again| telemetry::events(&again.events, 0))
        {
            let mut received = ReceivedEvents::default();
            received.take(&data);
            self.events = received.events;
        }
        self.set_findings(findings::facts(recording, again));
    }

    fn set_findings(&mut self, found: Result<Vec<Finding>, String>) {
        match found {
            Ok(findings) => self.findings = Some(findings),
            // Those that the vehicle sent remain.
            Err(reason) => self.not_looked_for = self.findings.is_none().then_some(reason),
        }
    }
}

/// The version of a log's schema, if recorded, and of this build's.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Schema {
    pub version: Option<String>,
    pub this_build: String,
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
pub struct Profile {
    /// Its name, if it can be used.
    pub name: Option<String>,
    /// Its one-line description, if it can be used.
    pub summary: Option<String>,
    /// The keys with which it is not flown by the standard controller.
    pub changed: Vec<String>,
    /// Why this build cannot use it, if so.
    pub problem: Option<String>,
}

impl Profile {
    pub(super) fn of(head: &Head) -> Option<Self> {
        let text = head.profile_toml.as_ref()?.as_ref().map_err(ToString::to_string);
        let mission =
            text.and_then(|text| from_toml(text, "profile.toml").map_err(|error| error.to_string()));
        Some(match mission {
            Ok(Mission { name, summary, changed, .. }) => {
                Self { name: Some(name), summary: Some(summary), changed, problem: None }
            }
            Err(problem) => Self { name: None, summary: None, changed: Vec::new(), problem: Some(problem) },
        })
    }

    /// What flew it, if that is not the standard controller.
    pub(crate) fn controller(&self) -> Option<String> {
        (!self.changed.is_empty()).then(|| format!("not the standard one: {}", self.changed.join(", ")))
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

/// Whether anything is missing.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Completeness {
    /// The log was closed properly, is undamaged, and lacks nothing up to the end of its flight.
    pub complete: bool,
    /// Why the log could not be read to its end, if so.
    pub damage: Option<String>,
    /// The log says how many records it has. Otherwise nothing shows that the last ones are
    /// missing.
    pub counted: bool,
    /// A checksum covers every message.
    pub checksummed: bool,
    /// The last time that could be read, s after the first record.
    pub readable_until_s: Option<f64>,
    /// Messages missing before the last of their channel.
    pub messages_lost: u64,
    /// Number of flights with frames: more than one in a joined log.
    pub flights: usize,
    /// Where the record of a flight ends, if that is before the end of the flight.
    pub cut: Option<Cut>,
}

impl Completeness {
    /// Warns about the damage and the missing end of a log that was described.
    pub(crate) fn warn(&self, name: &str) {
        warn_of_loss(name, self.damage.as_deref(), self.cut.as_ref());
    }

    fn of<R: Read>(log: &FlightLog<R>, span: Option<&Span>) -> Self {
        let (damage, cut, messages_lost) = (log.damage(), log.flights.cut(), log.messages_lost());
        Self {
            complete: damage.is_none() && messages_lost == 0 && cut.is_none(),
            damage: damage.map(ToString::to_string),
            counted: log.is_counted(),
            checksummed: log.is_checksummed(),
            readable_until_s: span.map(|span| span.duration_s),
            messages_lost,
            flights: log.flights.flown(),
            cut,
        }
    }
}

/// Most phases that are shown; a flight has about ten.
const PHASES_SHOWN: usize = 14;

/// One screen; JSON has the rest.
impl Answer for Info {
    fn sentences(&self) -> Vec<String> {
        let size = self.size_bytes.map(|bytes| format!(", {}", size_text(bytes))).unwrap_or_default();
        let mut rows = self.ending();
        // The events have the times of a flight without a reset.
        let shows = |timeline: &&PhaseTimeline| {
            self.events.is_empty() || timeline.spans.iter().any(|span| span.phase == RESET)
        };
        rows.extend(self.phases.first().filter(shows).map(|timeline| ("phases", phases(timeline))));
        rows.extend(self.clocks.flight_zero_s.map(|_| ("events", self.events())));
        rows.push(("grade", format!("{}: {}", self.grade.level.name(), self.grade.reason)));
        rows.push(("complete", self.completeness()));
        let flights = self.completeness.flights;
        if flights > 1 {
            let of = "phases and verdict are of the last; `replay verify` reports on each";
            rows.push(("flights", format!("{flights}; {of}")));
        }
        rows.extend(self.frames.iter().flat_map(Frames::rows));
        rows.extend(self.origin());
        let schema = &self.schema;
        if schema.version.as_ref() != Some(&schema.this_build) {
            let version = schema.version.as_deref().map_or("not stated", short);
            rows.push(("schema", format!("{version}; this build reads {}", schema.this_build)));
        }
        rows.extend(self.span.map(|span| {
            let (first, last) = (utc(span.first_ns), utc(span.last_ns));
            ("time", format!("{first} to {last}, {:.3} s", span.duration_s))
        }));
        rows.extend(self.clocks.station_jump.map(|Jump { at_s, by_s }| {
            ("clock", format!("the station's clock jumps by {by_s:+.1} s at log {at_s:.1} s: its later records are dated that much off"))
        }));
        rows.push(("channels", channels(&self.channels)));
        let attached: Vec<&str> =
            self.attachments.iter().map(|attachment| attachment.name.as_str()).collect();
        rows.push(("attached", or_none(&attached.join(", ")).to_owned()));
        rows.extend(self.unreadable.iter().map(|reason| ("unreadable", reason.clone())));
        let lines = rows.iter().map(|(name, text)| format!("{name:<11} {text}").trim_end().to_owned());
        std::iter::once(format!("{}{size}", self.file)).chain(lines).collect()
    }
}

/// A line: its name and its text.
type Row = (&'static str, String);

impl Info {
    /// How it ended, what was broken, and what went wrong.
    fn ending(&self) -> Vec<Row> {
        let touchdown = |contact| format!("touchdown at {}", self.clocks.words(contact));
        let words = [self.ending.clone(), self.verdict.as_ref().and(self.contact()).map(touchdown)];
        let words: Vec<String> = words.into_iter().flatten().collect();
        let mut rows = Vec::new();
        if !words.is_empty() {
            rows.push(("verdict", words.join("; ")));
        }
        if let Some(verdict) = &self.verdict {
            for (whose, limits) in
                [("", &verdict.borne), ("envelope: ", &verdict.envelope), ("Table 2: ", &verdict.table_2)]
            {
                rows.extend(limits.iter().filter(|limit| !limit.passed).map(|limit| {
                    let LimitResult { name, value, unit, .. } = limit;
                    // Without the error of converting degrees to radians and back.
                    let [minimum, maximum] =
                        [limit.minimum, limit.maximum].map(|end| (end * 1e6).round() / 1e6);
                    let value = format!("{value:.4} {unit} is").replace("  ", " ");
                    ("", format!("{whose}{name} {value} {} {minimum} to {maximum}", beyond(limit)))
                }));
            }
        }
        if self.grade.level != GradeLevel::BitExact && self.findings.is_none() {
            return rows;
        }
        let words = |found: &Finding| format!("{:.2} {}", found.since(), found.words);
        let mut found: Vec<String> = self.findings.iter().flatten().map(words).collect();
        if found.is_empty() {
            found.push(self.no_findings());
        }
        let names = std::iter::once("findings").chain(std::iter::repeat(""));
        rows.extend(names.zip(found));
        rows
    }

    fn events(&self) -> String {
        let words = |FlightEvent { name, at_s, height_m, .. }: &FlightEvent| {
            // Without the sign of a zero.
            format!("{name} {at_s:.2} {:.1} m", (10.0 * height_m).round() / 10.0 + 0.0)
        };
        let words: Vec<String> = self.events.iter().map(words).collect();
        match &words[..] {
            [] => "not reported by the vehicle".to_owned(),
            words => format!("{} (T+ s, height)", words.join(", ")),
        }
    }

    fn completeness(&self) -> String {
        let found = &self.completeness;
        if found.complete && found.counted {
            let checksums = if found.checksummed {
                "every checksum holds"
            } else {
                "but NO CHECKSUM protects all of its messages"
            };
            return format!("yes: ended properly, {checksums}");
        }
        if found.complete {
            return "as far as can be known: it has no summary, which would say how many records there were"
                .to_owned();
        }
        let mut faults = Vec::new();
        if let Some(damage) = &found.damage {
            faults.push(damage.clone());
            faults.push(match found.readable_until_s {
                None => "no record could be read".to_owned(),
                Some(until_s) => format!("readable until {until_s:.3} s after the first record"),
            });
        }
        if found.messages_lost > 0 {
            faults.push(messages_lost(found.messages_lost));
        }
        faults.extend(found.cut.as_ref().map(|cut| format!("the flight {cut}")));
        format!("NO: {}", faults.join("; "))
    }

    /// Who wrote it, of which run, by which build and mission.
    fn origin(&self) -> Vec<Row> {
        let run = self.run.iter().map(|(key, value)| format!("{key} {}", or_none(short(value))));
        let run = run.collect::<Vec<_>>().join(", ");
        let BuildComparison { recorded, differences } = &self.build_comparison;
        let value = |value: &Option<String>| value.as_deref().map_or("not noted", short).to_owned();
        let differences = differences.iter().map(|difference| {
            let (recorded, this) = (value(&difference.recorded), value(&difference.this_build));
            format!("{} {recorded} (this one: {this})", difference.fact)
        });
        let build = match differences.collect::<Vec<_>>() {
            _ if !recorded => "not recorded".to_owned(),
            same if same.is_empty() => "this one".to_owned(),
            differences => format!("differs from this build: {}", differences.join(", ")),
        };
        let profile = match &self.profile {
            None => "not attached".to_owned(),
            Some(Profile { name: Some(name), summary: Some(summary), .. }) => {
                format!("{name}: {summary}")
            }
            Some(profile) => {
                format!("cannot be used: {}", profile.problem.as_deref().unwrap_or_default())
            }
        };
        let mut rows = vec![
            ("written by", or_none(&self.library).to_owned()),
            ("run", or_none(&run).to_owned()),
            ("build", build),
            ("profile", profile),
        ];
        let controller = self.profile.as_ref().and_then(Profile::controller);
        rows.extend(controller.map(|controller| ("controller", controller)));
        rows
    }
}

impl Frames {
    fn rows(&self) -> Vec<Row> {
        let Self { first, last, restarts, lost, repeated, start, latency, solver_work, .. } = self;
        let start = if *start { "" } else { ", start NOT RECORDED" };
        let lost = match lost {
            0 => "none lost".to_owned(),
            gaps => format!("{} LOST", counted(*gaps as u64, "gap")),
        };
        let restarts = counted(*restarts as u64, "restart");
        let mut rows = vec![("frames", format!("{first} to {last}, {restarts}, {lost}{start}"))];
        if *repeated > 0 {
            rows.push(("", format!("{repeated} repeated")));
        }
        // From the request of a plan to its use, on the vehicle's clock: of a simulated flight it
        // is simulated, and says nothing of this machine.
        rows.push(("planning", match latency {
            None => "latency not recorded: no plan was timed".to_owned(),
            Some(PlanningLatency { count, median_s, p99_s, max_s, deadline_s, over_deadline }) => {
                let [median_ms, p99_ms, max_ms, deadline_ms] =
                    [median_s, p99_s, max_s, deadline_s].map(|time_s| time_s * 1e3);
                let plans = counted(*count, "plan");
                format!("latency median {median_ms:.2} ms, p99 {p99_ms:.2} ms, worst {max_ms:.2} ms from request to use on the vehicle's clock; deadline {deadline_ms:.0} ms: {over_deadline} over it, of {plans}")
            }
        }));
        rows.extend(solver_work.map(|SolverWork { plans, median, max }| {
            let plans = counted(plans as u64, "plan");
            ("solver", format!("work median {median:.0}, worst {max:.0} Newton iterations, of {plans}; CPU time not recorded"))
        }));
        rows
    }
}

/// When each phase began.
fn phases(timeline: &PhaseTimeline) -> String {
    let clock = match timeline.source {
        PhaseSource::Vehicle => "T+ in s, from the vehicle's frames",
        PhaseSource::Telemetry => "the station's clock in s, from the ground station's telemetry",
    };
    let spans = &timeline.spans;
    let began = spans.iter().take(PHASES_SHOWN).map(|span| format!("{} {:.2}", span.phase, span.from_s));
    let began = began.collect::<Vec<_>>().join(", ");
    let more = spans.len().saturating_sub(PHASES_SHOWN) as u64 + timeline.further_changes;
    let more = if more > 0 { format!(" and {}", counted(more, "more change")) } else { String::new() };
    format!("{began}{more} ({clock})")
}

/// How many there are, and which of them lack something.
fn channels(channels: &[Channel]) -> String {
    let messages = channels.iter().map(|channel| channel.messages).sum();
    let number = counted(channels.len() as u64, "channel");
    let mut words = vec![format!("{number} with {}", counted(messages, "message"))];
    for Channel { topic, lost, unreadable, .. } in channels {
        let faults =
            [(lost, "LOST"), (unreadable, "UNREADABLE")].into_iter().filter(|(count, _)| **count > 0);
        words.extend(faults.map(|(count, what)| format!("{topic} {count} {what}")));
    }
    words.join(", ")
}

/// Only the beginning of a hash; JSON has all of it.
fn short(value: &str) -> &str {
    const HASH_MIN: usize = 40;
    const SHOWN: usize = 12;
    let hash = value.len() >= HASH_MIN && value.bytes().all(|byte| byte.is_ascii_hexdigit());
    if hash { &value[..SHOWN] } else { value }
}

fn or_none(text: &str) -> &str {
    if text.is_empty() { "none" } else { text }
}

fn size_text(bytes: u64) -> String {
    match bytes {
        0..10_000 => format!("{bytes} bytes"),
        10_000..10_000_000 => format!("{:.0} kB", bytes as f64 / 1e3),
        _ => format!("{:.1} MB", bytes as f64 / 1e6),
    }
}

/// To the millisecond.
pub(crate) fn utc(unix_ns: u64) -> String {
    const MILLISECOND_NS: u64 = 1_000_000;
    OffsetDateTime::from_unix_timestamp_nanos(i128::from(unix_ns - unix_ns % MILLISECOND_NS))
        .ok()
        .and_then(|time| time.format(&Rfc3339).ok())
        .unwrap_or_else(|| format!("{unix_ns} ns"))
}

#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The logs, MCAP files; - is standard input. Of a folder every log is a line of a table.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Answer in JSON: a description, or a list of descriptions for several logs.
    #[arg(long)]
    json: bool,
    /// Print the table of a folder as CSV.
    #[arg(long, conflicts_with = "json")]
    csv: bool,
    /// Run the flight computer again even if the findings of the vehicle suffice: adds the work of
    /// its solver.
    #[arg(long)]
    again: bool,
}

impl Args {
    pub(crate) fn run(self) -> Result<Exit> {
        if let [folder] = self.files.as_slice()
            && folder.is_dir()
        {
            let season = season::Season(season::season(folder)?);
            if !self.csv {
                return give(&season, self.json);
            }
            answer(|output| {
                let mut table = csv::Writer::from_writer(output);
                season.0.iter().try_for_each(|line| table.serialize(line).map_err(std::io::Error::other))?;
                table.flush()
            })?;
            return Ok(season.outcome());
        }
        ensure!(!self.csv, "--csv is for a folder of logs, as in `replay info DIR --csv`");
        // On a terminal the description contains it already.
        let said = !self.json && std::io::stdout().is_terminal();
        give_each(&self.files, self.json, |file| {
            let mut info = description(file)?;
            if self.again && info.size_bytes.is_some() {
                info = run_again(file, info);
            }
            if !said {
                info.completeness.warn(&info.file);
            }
            Ok(vec![info])
        })
    }
}

fn description(file: &std::path::Path) -> Result<Info, LogError> {
    if file.as_os_str() == "-" {
        return info_of(&mut FlightLog::read("standard input".to_owned(), std::io::stdin().lock())?);
    }
    // A pipe of the shell, as in `info <(...)`, is open already, and its writer is there.
    if file.starts_with("/dev/fd") {
        let name = file.display().to_string();
        let pipe = std::fs::File::open(file);
        let pipe = pipe.map_err(|source| LogError::Read { name: name.clone(), source })?;
        return info_of(&mut FlightLog::read(name, std::io::BufReader::new(pipe))?);
    }
    info(file)
}
