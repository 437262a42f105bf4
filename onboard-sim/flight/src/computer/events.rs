//! The events of a flight, each with its time and height: the one source of both for every screen,
//! log and report.

use super::findings::LEGS_M;
use super::{Computer, SensedInput};
use crate::estimation::estimator::Estimate;
use crate::rules::phase::{Mode, Phase};

/// Time since the release, s, and height of the feet above the pad, m.
pub type At = (f64, f64);

/// The first entry of each phase; of `Boost` the lift-off, of `Touchdown` the first contact.
#[derive(Debug, Clone, Default)]
pub struct FlightEvents([Option<At>; Phase::ALL.len()]);

impl FlightEvents {
    /// The event that begins a phase.
    pub fn of(&self, phase: Phase) -> Option<At> {
        self.0[usize::from(phase.index())]
    }

    /// Looks at a frame in the air.
    pub(super) fn note(&mut self, computer: &Computer, flown: &SensedInput, estimate: &Estimate) {
        let (&Mode { phase, entered_at_s, .. }, pilot) = (computer.mode(), computer.pilot());
        let height_m = pilot.feet_height_m(estimate);
        let mut set = |phase: Phase, at_s: f64| {
            self.0[usize::from(phase.index())].get_or_insert((at_s, height_m));
        };
        match phase {
            Phase::Boost if pilot.ascent.has_lifted_off() => set(phase, flown.time_s),
            Phase::Boost => {}
            _ => set(phase, entered_at_s - computer.released_at_s().unwrap_or(0.0)),
        }
        if flown.contact && !phase.before_apogee() && height_m < LEGS_M {
            set(Phase::Touchdown, flown.time_s);
        }
    }
}
