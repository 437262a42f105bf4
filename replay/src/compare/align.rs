//! The event on which two flights are aligned for a comparison.

use flight::rules::phase::Phase;
use serde::Serialize;

use super::{CompareError, Flown};
use crate::log::Entry;

/// The event on which the flights are aligned.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Align {
    /// Ignition of the landing motor.
    Ignition,
    /// Touchdown, from the verdict.
    Touchdown,
    /// Vehicle time itself.
    Time,
}

/// The moments of a flight to align on, vehicle time, s.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Anchors {
    /// Ignition of the landing motor.
    pub ignition_s: Option<f64>,
    pub touchdown_s: Option<f64>,
}

impl Anchors {
    /// Looks for the ignition in a record.
    pub(super) fn note(&mut self, entry: &Entry) {
        if self.ignition_s.is_some() {
            return;
        }
        let lit = |phase: u32| {
            u8::try_from(phase).ok().and_then(Phase::from_index).is_some_and(Phase::in_landing_burn)
        };
        match entry {
            Entry::PilotTick(tick) if lit(tick.output.phase) => self.ignition_s = Some(tick.input.time_s),
            Entry::Telemetry(telemetry) if telemetry.phase.is_some_and(lit) => {
                self.ignition_s = Some(telemetry.time_s);
            }
            _ => {}
        }
    }
}

impl Align {
    /// What to add to the other flight's times, s.
    pub(super) fn shift_s(self, baseline: &Flown, other: &Flown) -> Result<f64, CompareError> {
        let (event, anchor): (_, fn(&Anchors) -> Option<f64>) = match self {
            Self::Time => return Ok(0.0),
            Self::Ignition => ("ignition", |anchors| anchors.ignition_s),
            Self::Touchdown => ("touchdown", |anchors| anchors.touchdown_s),
        };
        let of = |flown: &Flown| {
            anchor(&flown.anchors).ok_or(CompareError::NoAnchor { name: flown.name.clone(), event })
        };
        Ok(of(baseline)? - of(other)?)
    }

    /// On ignition if both flights have one, else on time. What went over the air has the vehicle's own time.
    pub fn best_for(baseline: &Flown, other: &Flown) -> Self {
        if baseline.only_one_has_ticks(other) {
            return Self::Time;
        }
        let both = baseline.anchors.ignition_s.is_some() && other.anchors.ignition_s.is_some();
        if both { Self::Ignition } else { Self::Time }
    }
}
