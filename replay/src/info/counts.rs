//! Counters over the records of a log: channels, frames, phases, planning latencies, and the
//! outcome of the flight.

use std::collections::BTreeMap;

use avionics::log::frame::accepts_abort;
use flight::rules::phase::Phase;
use onboard_sim::statistics::quantile;
use protocol::dialect::TdInterlock;
use protocol::log::flight_v1::PilotTiming;
use protocol::log::reader::LogChannel;
use serde::Serialize;

use super::{Grade, GradeLevel, Profile};
use crate::log::{Entry, FrameOrder, Gap, StampedEntry, Verdict};

/// A channel of a log.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Channel {
    pub topic: String,
    /// How its messages are encoded.
    pub message_encoding: String,
    /// The name of its schema.
    pub schema: String,
    /// Metadata of the channel: link, endpoint, dialect.
    pub metadata: BTreeMap<String, String>,
    pub messages: u64,
    /// Messages that this build cannot read.
    pub unreadable: u64,
    /// Missing messages before the last one, by the gaps in the sequence numbers.
    pub lost: u64,
}

/// Counts messages by channel.
#[derive(Default)]
pub(super) struct ChannelCounter {
    counts: BTreeMap<u16, Counts>,
}

#[derive(Default)]
struct Counts {
    messages: u64,
    unreadable: u64,
    last_sequence: u32,
}

impl ChannelCounter {
    pub(super) fn count(&mut self, stamped: &StampedEntry) {
        let counts = self.counts.entry(stamped.channel_id).or_default();
        counts.messages += 1;
        counts.unreadable += u64::from(matches!(stamped.entry, Entry::Unreadable { .. }));
        counts.last_sequence = counts.last_sequence.max(stamped.sequence);
    }

    pub(super) fn into_facts<'a>(
        mut self,
        channels: impl Iterator<Item = (u16, &'a LogChannel)>,
        share_a_counter: bool,
    ) -> Vec<Channel> {
        let mut facts: Vec<Channel> = channels
            .map(|(id, channel)| {
                let counts = self.counts.remove(&id).unwrap_or_default();
                // Sequence numbers start at 0; a writer without numbering leaves 0 everywhere.
                let unnumbered = counts.last_sequence == 0 || share_a_counter;
                let numbered = if unnumbered { 0 } else { u64::from(counts.last_sequence) + 1 };
                Channel {
                    topic: channel.topic.clone(),
                    message_encoding: channel.message_encoding.clone(),
                    schema: channel.schema_name.clone(),
                    metadata: channel.metadata.clone(),
                    messages: counts.messages,
                    unreadable: counts.unreadable,
                    // Those that there should be, so far.
                    lost: numbered,
                }
            })
            .collect();
        facts.sort_by(|a, b| (&a.topic, &a.metadata).cmp(&(&b.topic, &b.metadata)));
        // A program that joined logs has given each part channels of its own.
        facts.dedup_by(|more, first| {
            let same = (&first.topic, &first.metadata) == (&more.topic, &more.metadata);
            if same {
                first.messages += more.messages;
                first.unreadable += more.unreadable;
                first.lost = first.lost.max(more.lost);
            }
            same
        });
        for channel in &mut facts {
            channel.lost = channel.lost.saturating_sub(channel.messages);
        }
        facts
    }
}

/// The frames of the flight computer.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Frames {
    /// The lowest number.
    pub first: u64,
    /// The highest number.
    pub last: u64,
    /// Ranges of numbers left out because the computer was dead.
    pub restarts: usize,
    /// Ranges that the log has lost.
    pub lost: usize,
    /// The first lost range: no frame after it can be re-executed.
    pub first_lost: Option<Gap>,
    pub repeated: u64,
    /// Whether the log has the computer's start record.
    pub start: bool,
    /// Planning latency; `None` for a flight simulated without a clock.
    pub latency: Option<PlanningLatency>,
    /// Solver work, of a log whose computer was run again.
    pub solver_work: Option<SolverWork>,
}

/// Counts frames.
#[derive(Debug, Default)]
pub(super) struct FrameCounter {
    /// The lowest and the highest number.
    bounds: Option<(u64, u64)>,
    order: FrameOrder,
    restarts: usize,
    repeated: u64,
    lost: usize,
    first_lost: Option<Gap>,
    latencies: LatencyCounter,
    /// Notes the start record of the flight computer.
    start: bool,
}

impl FrameCounter {
    pub(super) fn start(&mut self) {
        self.start = true;
    }

    /// Counts a frame and the records lost before it. Returns whether the computer was reset
    /// between it and the frame before.
    pub(super) fn count(&mut self, frame: u64, lost_before: u32) -> bool {
        let before = self.order.last_frame;
        let mut reset = false;
        if let Some(gap) = self.order.note(frame, lost_before) {
            self.lost += 1;
            self.first_lost.get_or_insert(gap);
        } else if self.bounds.is_some() {
            self.restarts += usize::from(frame > before.saturating_add(1));
            // A frame that was late is no reset.
            reset = frame > before.saturating_add(2);
        }
        // A number that is not above every one before it.
        self.repeated += u64::from(self.bounds.is_some_and(|(_, last)| frame <= last));
        let (first, last) = self.bounds.unwrap_or((frame, frame));
        self.bounds = Some((first.min(frame), last.max(frame)));
        reset
    }

    pub(super) fn time(&mut self, timing: &PilotTiming) {
        self.latencies.count(timing.solve_time_s, timing.deadline_s);
    }

    pub(super) fn into_facts(self) -> Option<Frames> {
        let Self { bounds, restarts, repeated, lost, first_lost, start, .. } = self;
        let (first, last) = bounds?;
        let latency = self.latencies.into_facts();
        Some(Frames { first, last, restarts, lost, first_lost, repeated, start, latency, solver_work: None })
    }
}

impl Grade {
    pub(super) fn of_frames(frames: &Frames, profile: Option<&Profile>) -> Self {
        let numeric = |why: &str| Self { level: GradeLevel::Numeric, reason: format!("frames, but {why}") };
        match profile {
            _ if !frames.start => numeric("no start record of the flight computer"),
            None => numeric("no attachment profile.toml to build the flight computer from"),
            Some(Profile { problem: Some(problem), .. }) => numeric(problem),
            Some(Profile { name, .. }) => {
                Self::of_replayable_frames(frames, name.as_deref().unwrap_or_default())
            }
        }
    }

    /// The grade of a log whose frames can be executed again up to the first loss.
    fn of_replayable_frames(frames: &Frames, mission: &str) -> Self {
        let Frames { first, last, lost, first_lost, repeated, .. } = frames;
        let level = GradeLevel::BitExact;
        let reason = match first_lost {
            Some(Gap { after: 0, before }) => {
                let reason =
                    format!("frames, but they begin with frame {before}, and those before it are lost");
                return Self { level: GradeLevel::Numeric, reason };
            }
            Some(Gap { after, before }) => {
                let more = if *lost > 1 { format!(", the first of {lost} gaps") } else { String::new() };
                format!(
                    "up to frame {after} of {last}: those up to frame {before} are lost{more}, and nothing after them can be run again; mission {mission}"
                )
            }
            None if *repeated > 0 => format!(
                "frames {first} to {last} of the flight computer up to the first that is there twice; mission {mission}"
            ),
            None => format!(
                "frames {first} to {last} of the flight computer, its start and its mission {mission}"
            ),
        };
        Self { level, reason }
    }
}

/// Limit on the phase changes kept; a flight has about ten.
const SPANS_MAX: usize = 200;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum PhaseSource {
    /// The vehicle's own frames.
    Vehicle,
    /// A ground station's telemetry.
    Telemetry,
}

impl PhaseSource {
    /// The source's name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Vehicle => "vehicle's frames",
            Self::Telemetry => "ground station's telemetry",
        }
    }
}

/// The phases from one source.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PhaseTimeline {
    pub source: PhaseSource,
    /// The phases in order.
    pub spans: Vec<PhaseSpan>,
    /// Number of changes that are not listed because there were too many.
    pub further_changes: u64,
}

/// A time in one phase.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PhaseSpan {
    /// Its name, `unknown (n)`, or [`RESET`].
    pub phase: String,
    /// The source's time of its first record, s.
    pub from_s: f64,
    /// The source's time of its last record, s.
    pub until_s: f64,
}

/// Name of the time between a reset of the flight computer in the air and its first frame.
pub(crate) const RESET: &str = "RESET";

/// Follows the phase through a log.
#[derive(Default)]
pub(super) struct PhaseTracker {
    current: Option<u32>,
    /// Number of resets of the flight computer in the air.
    pub(super) resets: u64,
    spans: Vec<PhaseSpan>,
    further_changes: u64,
}

impl PhaseTracker {
    pub(super) fn note(&mut self, time_s: f64, phase: u32) {
        if self.current != Some(phase) {
            self.current = Some(phase);
            if self.spans.len() < SPANS_MAX {
                self.spans.push(PhaseSpan { phase: phase_name(phase), from_s: time_s, until_s: time_s });
            } else {
                self.further_changes += 1;
            }
        } else if self.further_changes == 0
            && let Some(span) = self.spans.last_mut()
        {
            span.until_s = time_s;
        }
    }

    /// Marks a reset of the flight computer, which ended at this time, s, if it was in the air.
    pub(super) fn reset(&mut self, until_s: f64) {
        let phase = self.current.and_then(|phase| Phase::from_index(u8::try_from(phase).ok()?));
        let is_down = matches!(phase, None | Some(Phase::Touchdown | Phase::Safed));
        if let Some(PhaseSpan { until_s: from_s, .. }) = self.spans.last()
            && !is_down
        {
            let span = PhaseSpan { phase: RESET.to_owned(), from_s: *from_s, until_s };
            (self.current, self.resets) = (None, self.resets + 1);
            self.spans.push(span);
        }
    }

    pub(super) fn into_timeline(self, source: PhaseSource) -> Option<PhaseTimeline> {
        let Self { spans, further_changes, .. } = self;
        (!spans.is_empty()).then_some(PhaseTimeline { source, spans, further_changes })
    }
}

fn phase_name(number: u32) -> String {
    let known = u8::try_from(number).ok().and_then(Phase::from_index);
    known.map_or_else(|| format!("unknown ({number})"), |phase| phase.name().to_owned())
}

/// Begins the event of a start that was refused.
const REFUSED: &str = "REFUSED: ";

/// Whether an abort is latched, in the interlocks of telemetry.
fn has_latched_abort(interlocks: u32) -> bool {
    interlocks & u32::from(TdInterlock::TD_INTERLOCK_ABORT_LATCHED.bits()) != 0
}

/// Follows what decides how a flight ended.
#[derive(Debug, Default)]
pub(super) struct EndingTracker {
    aborted: bool,
    refused: Option<String>,
    last_phase: Option<u32>,
}

impl EndingTracker {
    pub(super) fn note(&mut self, entry: &Entry) {
        let phase = match entry {
            Entry::ComputerFrame(frame) => {
                self.aborted |= accepts_abort(&frame.record);
                frame.record.output.phase
            }
            Entry::Telemetry(telemetry) => {
                self.aborted |= telemetry.interlocks.is_some_and(has_latched_abort);
                let Some(phase) = telemetry.phase else { return };
                phase
            }
            Entry::Event(event) => {
                if let Some(reason) = event.message.strip_prefix(REFUSED) {
                    self.refused = Some(reason.to_owned());
                }
                return;
            }
            _ => return,
        };
        self.last_phase = Some(phase);
    }

    /// The sentence; `None` for a log that ends in flight without saying anything.
    pub(super) fn words(&self, verdict: Option<&Verdict>) -> Option<String> {
        if let Some(verdict) = verdict {
            return Some(verdict.ending.clone());
        }
        let phase = self.last_phase.and_then(|phase| u8::try_from(phase).ok()).and_then(Phase::from_index);
        let name = phase.map_or("an unknown phase", Phase::name);
        if let Some(reason) = &self.refused {
            return Some(format!("REFUSED: {reason}"));
        }
        if self.aborted {
            return Some(format!("ABORTED in {name}"));
        }
        match phase {
            Some(Phase::Chute) => Some("under the parachute when the log ends; no verdict".to_owned()),
            Some(phase) if phase.on_pad() => Some(format!("NOT FLOWN: the log ends in {name}")),
            _ => None,
        }
    }
}

/// Limit on the times kept for the percentiles: 8 MB, more than a day of flight at 10 Hz.
const TIMES_MAX: usize = 1_000_000;

/// Newton iterations of the plans of a flight.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SolverWork {
    pub plans: usize,
    pub median: f64,
    pub max: f64,
}

impl SolverWork {
    /// `None` without a plan.
    pub(super) fn of(mut iterations: Vec<f64>) -> Option<Self> {
        iterations.sort_by(f64::total_cmp);
        let [median, max] = [0.5, 1.0].map(|share| quantile(&iterations, share));
        Some(Self { plans: iterations.len(), median: median?, max: max? })
    }
}

/// Planning latencies: from the request of a plan to its use, on the vehicle's clock.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct PlanningLatency {
    /// Number of measurements.
    pub count: u64,
    pub median_s: f64,
    /// 99th percentile, s.
    pub p99_s: f64,
    /// The longest, s.
    pub max_s: f64,
    /// The shortest deadline, s.
    pub deadline_s: f64,
    /// Number of frames that missed their deadline.
    pub over_deadline: u64,
}

/// Counts planning latencies.
#[derive(Debug, Default)]
pub(super) struct LatencyCounter {
    times_s: Vec<f64>,
    /// All but the quantiles.
    found: Option<PlanningLatency>,
}

impl LatencyCounter {
    pub(super) fn count(&mut self, time_s: f64, deadline_s: f64) {
        if self.times_s.len() < TIMES_MAX {
            self.times_s.push(time_s);
        }
        let PlanningLatency { count, deadline_s: least_s, over_deadline, .. } =
            self.found.unwrap_or(PlanningLatency { deadline_s, ..PlanningLatency::default() });
        self.found = Some(PlanningLatency {
            count: count + 1,
            deadline_s: least_s.min(deadline_s),
            over_deadline: over_deadline + u64::from(time_s > deadline_s),
            ..PlanningLatency::default()
        });
    }

    /// `None` if nothing was measured.
    pub(super) fn into_facts(mut self) -> Option<PlanningLatency> {
        self.times_s.sort_by(f64::total_cmp);
        let [median_s, p99_s, max_s] = [0.5, 0.99, 1.0].map(|share| quantile(&self.times_s, share));
        Some(PlanningLatency { median_s: median_s?, p99_s: p99_s?, max_s: max_s?, ..self.found? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_change_begins_a_span_and_an_unknown_phase_has_its_number() {
        let mut tracker = PhaseTracker::default();
        for (time_s, phase) in [(0.0, 1), (0.1, 1), (0.2, 9), (0.3, 1), (0.4, 99)] {
            tracker.note(time_s, phase);
        }
        let spans = tracker.into_timeline(PhaseSource::Vehicle).unwrap().spans;
        let shown: Vec<_> =
            spans.iter().map(|span| (span.phase.as_str(), span.from_s, span.until_s)).collect();
        assert_eq!(
            shown,
            [
                ("PAD_IDLE", 0.0, 0.1),
                ("POWERED", 0.2, 0.2),
                ("PAD_IDLE", 0.3, 0.3),
                ("unknown (99)", 0.4, 0.4)
            ]
        );
    }

    #[test]
    fn a_flickering_phase_does_not_fill_the_memory() {
        let mut tracker = PhaseTracker::default();
        (0..10_000_u32).for_each(|n| tracker.note(f64::from(n), n % 2));
        let timeline = tracker.into_timeline(PhaseSource::Vehicle).unwrap();
        assert_eq!(timeline.spans.len(), SPANS_MAX);
        assert_eq!(timeline.further_changes, 10_000 - SPANS_MAX as u64);
    }
}
