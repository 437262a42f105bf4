//! Tells the stations what the check on the pad finds: one value after the other, again and again.
//!
//! The values are requested messages, after all telemetry: on the pad there is room for them within a radio's budget.

use flight::computer::pad_check::CheckState;
use protocol::dialect::MavMessage;

use crate::telemetry;
use crate::vehicle::Vehicle;

/// While a check runs, and until every value has been told twice after it, a value is told each so many seconds: 250 B/s
/// when signed.
const OFTEN_S: f64 = 0.2;
/// Later: for a station that comes late.
const SELDOM_S: f64 = 1.0;

/// Whose turn it is.
#[derive(Debug, Default)]
pub(super) struct CheckTeller {
    told: Option<(u16, CheckState)>,
    place: usize,
    /// How often every value has been told since the check changed.
    rounds: u32,
    due_s: f64,
    /// How many values had been found when the last one was told.
    found: usize,
}

impl CheckTeller {
    /// The message to send now.
    pub(super) fn due(&mut self, vehicle: &dyn Vehicle, now_s: f64) -> Option<MavMessage> {
        let check = vehicle.computer().pad_check();
        let mode = vehicle.mode();
        let now = (check.run(), check.state());
        if check.state() == CheckState::NotRun || !mode.phase.on_pad() || mode.interlocks.armed {
            return None;
        }
        let found = check.findings().len();
        if self.told != Some(now) {
            // At once: a new check, or its end.
            (self.told, self.rounds, self.due_s) = (Some(now), 0, now_s);
        }
        if now_s < self.due_s {
            return None;
        }
        // New values first.
        if found > self.found {
            self.place = self.found;
        } else if self.place >= found {
            (self.place, self.rounds) = (0, self.rounds.saturating_add(1));
        }
        let place = self.place;
        self.place += 1;
        self.found = if found > self.found { place + 1 } else { found };
        let often = check.is_running() || self.rounds < 2;
        self.due_s = now_s + if often { OFTEN_S } else { SELDOM_S };
        Some(telemetry::pad_check(check, place, vehicle.time_s()))
    }
}
