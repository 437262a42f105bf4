//! Decides the crew's requests, and holds the countdown when the commanding station falls silent.

use alloc::format;

use super::crew::{Answer, Asked, Ending, Request, event_of, is_so_already, refused};
use super::news::Severity;
use super::{Commander, Computer, Input, Vehicle};
use crate::rules::phase::{Event, HoldCause, Phase, UPLINK_SILENT_S};

impl Computer {
    /// Decides a request; `None` for an abort in the air in space, which the pilot handles in this frame.
    pub(super) fn answer(&mut self, request: &Request) -> Option<Answer> {
        let mode = *self.table.mode();
        let Request { asked, uplink, station } = *request;
        if is_so_already(&mode, asked) {
            return Some(Answer::ACCEPTED);
        }
        let on_ground = mode.phase.on_pad() || matches!(mode.phase, Phase::Touchdown | Phase::Safed);
        if asked == Asked::Abort && matches!(self.vehicle, Vehicle::Space(_)) && !on_ground {
            return None;
        }
        let checks = self.arming_checks_by(uplink);
        let event = event_of(asked, &checks, self.countdown_s, self.abort_event());
        if let (Asked::Hold, Some(_), Some((system, component))) = (asked, mode.countdown_end_s, station) {
            self.table.say(Severity::Notice, format!("station {system}/{component} asks for a hold"));
        }
        Some(match self.happen(event) {
            Ok(()) => Answer::ACCEPTED,
            Err(refusal) => refused(&mut self.table, asked, event, refusal, &checks),
        })
    }

    /// The answer to an abort that the pilot has handled.
    pub(super) fn abort_answer(&self) -> Answer {
        if self.table.mode().interlocks.abort_latched {
            return Answer::ACCEPTED;
        }
        Answer { ending: Ending::Failed, reason: Some("the flight ended before it".into()) }
    }

    /// Holds the countdown if the station that armed the vehicle has fallen silent.
    pub(super) fn watch_the_commander(&mut self, input: &Input<'_>) {
        let Some(Commander { station: (system, component), age_s }) = input.commander else { return };
        if self.table.mode().countdown_end_s.is_none() || age_s <= UPLINK_SILENT_S {
            return;
        }
        let words = format!("nothing heard of {system}/{component} for {UPLINK_SILENT_S} s");
        self.table.say(Severity::Critical, words);
        let _ = self.table.happen(Event::Hold { cause: HoldCause::UplinkSilent });
    }
}
