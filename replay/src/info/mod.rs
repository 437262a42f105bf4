//! Describes a log: its content, how complete it is, and what can be done with it.

mod channels;
mod ending;
mod facts;
mod frames;
mod phases;
mod solve_times;

pub use channels::ChannelFacts;
pub use facts::{
    Completeness, Grade, GradeLevel, Info, ProfileFacts, SchemaFacts, Span, VerdictFacts, VerdictLimit,
};
pub use frames::FrameFacts;
pub use phases::{PhaseSource, PhaseSpan, PhaseTimeline};
pub use solve_times::SolveTimes;

use std::io::Read;
use std::path::Path;

use protocol::log::record::SCHEMA_VERSION;

use crate::log::{
    Clocks, Entry, FlightLog, Flights, LogError, SummaryFacts, Verdicts, heard_message, summary_of,
};
use channels::ChannelCounter;
use ending::EndingTracker;
use frames::FrameCounter;
use phases::PhaseTracker;

/// Describes a log file.
///
/// # Errors
/// The file is not a flight log or cannot be read. Damage is part of the description, not an error.
pub fn info(path: &Path) -> Result<Info, LogError> {
    let mut log = FlightLog::open(path)?;
    let mut info = info_of(&mut log, || summary_of(path))?;
    info.size_bytes = std::fs::metadata(path).ok().map(|metadata| metadata.len());
    Ok(info)
}

/// Describes a log that is being read. `summary` is asked for the file's summary if the log is damaged.
///
/// # Errors
/// As [`info`].
pub fn info_of<R: Read>(
    log: &mut FlightLog<R>,
    summary: impl FnOnce() -> Option<SummaryFacts>,
) -> Result<Info, LogError> {
    let mut seen = Seen::default();
    while let Some(stamped) = log.next_entry()? {
        seen.channels.count(&stamped);
        seen.span = Some(match seen.span {
            None => (stamped.log_time_ns, stamped.log_time_ns),
            Some((first, last)) => (first.min(stamped.log_time_ns), last.max(stamped.log_time_ns)),
        });
        seen.flights.note(&stamped.entry);
        let channel = log.channel(stamped.channel_id);
        let first_ns = *seen.first_ns.get_or_insert(stamped.log_time_ns);
        let since_s = stamped.log_time_ns.saturating_sub(first_ns) as f64 / 1e9;
        let message = heard_message(channel, &stamped);
        seen.clocks.note(&stamped, message.as_ref(), since_s);
        seen.verdicts.note(&stamped, message.as_ref());
        seen.ending.note(&stamped.entry);
        seen.take(stamped.entry, stamped.sequence);
    }
    Ok(seen.into_info(log, summary))
}

/// Facts collected while the log is read.
#[derive(Default)]
struct Seen {
    channels: ChannelCounter,
    flights: Flights,
    span: Option<(u64, u64)>,
    vehicle_phases: PhaseTracker,
    telemetry_phases: PhaseTracker,
    first_ns: Option<u64>,
    clocks: Clocks,
    verdicts: Verdicts,
    ending: EndingTracker,
    frames: FrameCounter,
    unreadable: Option<String>,
}

impl Seen {
    fn take(&mut self, entry: Entry, record: u32) {
        match entry {
            Entry::Telemetry(telemetry) => {
                if let Some(phase) = telemetry.phase {
                    self.telemetry_phases.note(telemetry.time_s, phase);
                }
            }
            Entry::Unreadable { reason } => {
                self.unreadable.get_or_insert(reason);
            }
            Entry::PilotStart(_) => self.frames.let_go(),
            Entry::PilotTiming(timing) => self.frames.time(&timing),
            Entry::PilotTick(tick) => {
                self.vehicle_phases.note(tick.input.time_s, tick.output.phase);
                self.frames.count(tick.input.frame, record);
            }
            Entry::ComputerStart(_)
            | Entry::ComputerFrame(_)
            | Entry::Verdict(_)
            | Entry::Estimate(_)
            | Entry::World(_)
            | Entry::RawFrame
            | Entry::Operator
            | Entry::Event(_)
            | Entry::Other => {}
        }
    }

    fn into_info<R: Read>(self, log: &FlightLog<R>, summary: impl FnOnce() -> Option<SummaryFacts>) -> Info {
        let head = log.head();
        let profile = ProfileFacts::of(head);
        let frames = self.frames.into_facts();
        let span = self.span.map(|(first_ns, last_ns)| Span::new(first_ns, last_ns));
        let channels = self.channels.into_facts(log.channels());
        let completeness = Completeness::new(log.damage(), span.as_ref(), &channels, summary);
        let completeness = completeness.with_flights(&self.flights);
        let verdict = self.verdicts.found().as_ref().map(VerdictFacts::found);
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
            schema: SchemaFacts { version: head.schema_version(), this_build: SCHEMA_VERSION },
            library: head.library.clone(),
            build: head.build.clone(),
            build_comparison: head.compare_build(),
            run: head.run.clone(),
            profile,
            span,
            channels,
            phases: timelines
                .into_iter()
                .filter_map(|(source, tracker)| tracker.into_timeline(source))
                .collect(),
            ending: self.ending.words(verdict.as_ref()),
            verdict,
            clocks: self.clocks,
            unreadable: self.unreadable,
            completeness,
            attachments: head.attachments.clone(),
        }
    }
}
