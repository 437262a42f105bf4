//! How a flight ended, from all that its log says.

use flight::rules::phase::Phase;
use protocol::dialect::TdInterlock;
use tick_log::computer::accepts_abort;

use super::VerdictFacts;
use crate::log::Entry;

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
                self.aborted |= accepts_abort(frame);
                frame.output.phase
            }
            Entry::PilotTick(tick) => {
                self.aborted |= tick.input.abort;
                tick.output.phase
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
    pub(super) fn words(&self, verdict: Option<&VerdictFacts>) -> Option<String> {
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
