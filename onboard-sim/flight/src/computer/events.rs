//! The events of a flight, each with its time and height: the one source of both for every screen,
//! log and report.

use super::SensedInput;
use super::findings::LEGS_M;
use crate::rules::phase::{Mode, Phase};

/// Time since the release, s, and height of the feet above the pad, m.
pub type At = (f64, f64);

/// The first entry of each phase.
#[derive(Debug, Clone, Default)]
pub struct FlightEvents {
    entered: [Option<At>; Phase::ALL.len()],
    highest: Option<At>,
}

impl FlightEvents {
    /// The event that begins a phase: of `Deploy` the highest point of an ascent, of `Touchdown` the
    /// first contact, otherwise the frame that entered it.
    pub fn of(&self, phase: Phase) -> Option<At> {
        self.entered[usize::from(phase.index())]
    }

    /// Looks at a frame in the air.
    pub(super) fn note(&mut self, mode: &Mode, released_at_s: f64, flown: &SensedInput, height_m: f64) {
        let now = (flown.time_s, height_m);
        let rises = mode.phase.before_apogee();
        if rises && self.highest.is_none_or(|(_, highest_m)| height_m > highest_m) {
            self.highest = Some(now);
        }
        let entered = (mode.entered_at_s - released_at_s, height_m);
        let at = self.highest.filter(|_| mode.phase == Phase::Deploy).unwrap_or(entered);
        self.entered[usize::from(mode.phase.index())].get_or_insert(at);
        if flown.contact && !rises && height_m < LEGS_M {
            self.entered[usize::from(Phase::Touchdown.index())].get_or_insert(now);
        }
    }
}
