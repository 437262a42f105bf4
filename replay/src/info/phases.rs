//! The flight phases and their times.

use flight::rules::phase::Phase;
use serde::Serialize;

/// Limit on the phase changes kept; a flight has about ten.
const SPANS_KEPT: usize = 200;

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
    /// Its name, or `unknown (n)`.
    pub phase: String,
    /// The source's time of its first record, s.
    pub from_s: f64,
    /// The source's time of its last record, s.
    pub until_s: f64,
}

/// Follows the phase through a log.
#[derive(Default)]
pub(super) struct PhaseTracker {
    current: Option<u32>,
    spans: Vec<PhaseSpan>,
    further_changes: u64,
}

impl PhaseTracker {
    pub(super) fn note(&mut self, time_s: f64, phase: u32) {
        if self.current != Some(phase) {
            self.current = Some(phase);
            if self.spans.len() < SPANS_KEPT {
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

    pub(super) fn into_timeline(self, source: PhaseSource) -> Option<PhaseTimeline> {
        let Self { spans, further_changes, .. } = self;
        (!spans.is_empty()).then_some(PhaseTimeline { source, spans, further_changes })
    }
}

fn phase_name(number: u32) -> String {
    let known = u8::try_from(number).ok().and_then(Phase::from_index);
    known.map_or_else(|| format!("unknown ({number})"), |phase| phase.name().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_change_begins_a_span_and_an_unknown_phase_keeps_its_number() {
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
        assert_eq!(timeline.spans.len(), SPANS_KEPT);
        assert_eq!(timeline.further_changes, 10_000 - SPANS_KEPT as u64);
    }
}
