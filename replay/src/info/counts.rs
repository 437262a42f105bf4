//! Counters over the records of a log: channels, frames, phases, planning latencies, and the
//! outcome of the flight.

use std::collections::BTreeMap;
use std::io::Read;

use avionics::log::frame::accepts_abort;
use flight::rules::phase::Phase;
use onboard_sim::statistics::{quantile, sorted};
use protocol::dialect::TdInterlock;
use protocol::log::flight_v1::PilotTiming;
use protocol::log::reader::LogChannel;
use serde::Serialize;

use super::{Grade, GradeLevel, Profile};
use crate::log::{Entry, FlightLog, FrameOrder, Gap, StampedEntry, Verdict};

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
}

impl ChannelCounter {
    pub(super) fn count(&mut self, stamped: &StampedEntry) {
        let counts = self.counts.entry(stamped.channel_id).or_default();
        counts.messages += 1;
        counts.unreadable += u64::from(matches!(stamped.entry, Entry::Unreadable { .. }));
    }

    pub(super) fn into_facts<R: Read>(mut self, log: &FlightLog<R>) -> Vec<Channel> {
        // A program that joined logs has given each part channels of its own.
        let mut facts: BTreeMap<_, Channel> = BTreeMap::new();
        for (id, LogChannel { topic, message_encoding, schema_name, metadata, .. }) in log.channels() {
            let counts = self.counts.remove(&id).unwrap_or_default();
            let fact = facts.entry((topic, metadata)).or_insert_with(|| Channel {
                topic: topic.clone(),
                message_encoding: message_encoding.clone(),
                schema: schema_name.clone(),
                metadata: metadata.clone(),
                messages: 0,
                unreadable: 0,
                lost: log.lost_of(id),
            });
            fact.messages += counts.messages;
            fact.unreadable += counts.unreadable;
        }
        facts.into_values().collect()
    }
}

/// The frames of the flight computer.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
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
    /// `None` before the first frame.
    found: Option<Frames>,
    order: FrameOrder,
    /// Latency and deadline of each plan, s.
    plans: Vec<[f64; 2]>,
    /// The start record of the flight computer was read.
    pub(super) start: bool,
}

impl FrameCounter {
    /// Counts a frame and the records lost before it. Returns whether the computer was reset
    /// between it and the frame before.
    pub(super) fn count(&mut self, frame: u64, lost_before: u32) -> bool {
        let before = self.order.last_frame;
        let gap = self.order.note(frame, lost_before);
        let is_first = self.found.is_none();
        let found = self.found.get_or_insert(Frames { first: frame, last: frame, ..Frames::default() });
        let mut reset = false;
        if let Some(gap) = gap {
            found.lost += 1;
            found.first_lost.get_or_insert(gap);
        } else if !is_first {
            found.restarts += usize::from(frame > before.saturating_add(1));
            // A frame that was late is no reset.
            reset = frame > before.saturating_add(2);
        }
        // A number that is not above every one before it.
        found.repeated += u64::from(!is_first && frame <= found.last);
        (found.first, found.last) = (found.first.min(frame), found.last.max(frame));
        reset
    }

    pub(super) fn time(&mut self, timing: &PilotTiming) {
        if self.plans.len() < PLANS_MAX {
            self.plans.push([timing.solve_time_s, timing.deadline_s]);
        }
    }

    pub(super) fn into_facts(self) -> Option<Frames> {
        Some(Frames { start: self.start, latency: PlanningLatency::of(&self.plans), ..self.found? })
    }
}

impl Grade {
    pub(super) fn of_frames(frames: &Frames, profile: Option<&Profile>) -> Self {
        let numeric = |why: &str| Self { level: GradeLevel::Numeric, reason: format!("frames, but {why}") };
        let mission = match profile {
            _ if !frames.start => return numeric("no start record of the flight computer"),
            None => return numeric("no attachment profile.toml to build the flight computer from"),
            Some(Profile { problem: Some(problem), .. }) => return numeric(problem),
            Some(Profile { name, .. }) => name.as_deref().unwrap_or_default(),
        };
        // They can be executed again up to the first loss.
        let Frames { first, last, lost, first_lost, repeated, .. } = frames;
        let reason = match first_lost {
            Some(Gap { after: 0, before }) => {
                return numeric(&format!("they begin with frame {before}, and those before it are lost"));
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
        Self { level: GradeLevel::BitExact, reason }
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

/// Limit on the plans kept for the percentiles: 16 MB, more than a day of flight at 10 Hz.
const PLANS_MAX: usize = 1_000_000;

/// Newton iterations of the plans of a flight.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SolverWork {
    pub plans: usize,
    pub median: f64,
    pub max: f64,
}

impl SolverWork {
    /// `None` without a plan.
    pub(super) fn of(iterations: Vec<f64>) -> Option<Self> {
        let iterations = sorted(iterations.into_iter());
        let [median, max] = [0.5, 1.0].map(|share| quantile(&iterations, share));
        Some(Self { plans: iterations.len(), median: median?, max: max? })
    }
}

/// Planning latencies: from the request of a plan to its use, on the vehicle's clock.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
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

impl PlanningLatency {
    /// Of latencies and deadlines, s; `None` if nothing was measured.
    fn of(plans: &[[f64; 2]]) -> Option<Self> {
        let times_s = sorted(plans.iter().map(|[time_s, _]| *time_s));
        let [median_s, p99_s, max_s] = [0.5, 0.99, 1.0].map(|share| quantile(&times_s, share));
        Some(Self {
            count: plans.len() as u64,
            median_s: median_s?,
            p99_s: p99_s?,
            max_s: max_s?,
            deadline_s: plans.iter().map(|[_, deadline_s]| *deadline_s).reduce(f64::min)?,
            over_deadline: plans.iter().filter(|[time_s, deadline_s]| time_s > deadline_s).count() as u64,
        })
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
