//! The rehearsal on the pad: one flight of the mission with its nominal data, faster than real time.
//!
//! It shows whether the flight computer's solver works, and whether a landing is possible with this vehicle, motor and
//! mission. It knows neither the wind of the day nor the scatter of the real motor.

use flight::computer::Rehearsed;
use flight::guidance::powered::ControlLevel;
use flight::guidance::powered::PoweredReport;
use flight::rules::arming::PredictedLanding;
use flight::rules::phase::Phase;

use super::{SetUpError, Sortie};
use crate::dispersion::Dispersion;
use crate::limits::Limits;
use crate::recipe::Recipe;

/// Frames rehearsed in each frame on the pad: the whole flight takes a second or two.
const FRAMES_AT_ONCE: u32 = 20;

/// A rehearsal, running or finished.
#[derive(Debug, Clone)]
pub(super) enum Rehearsal {
    Flying {
        flight: Box<Sortie>,
        /// How many plans there were so far, and how many of them converged.
        plans: [u64; 2],
    },
    Over(Box<(Rehearsed, PoweredReport)>),
}

impl Rehearsal {
    pub(super) fn new(recipe: &Recipe) -> Result<Self, SetUpError> {
        let as_data_stand =
            Recipe { dispersion: Dispersion::default(), faults: Vec::new(), ..recipe.clone() };
        Ok(Self::Flying { flight: Box::new(Sortie::new(&as_data_stand, 0)?), plans: [0; 2] })
    }

    /// Flies some frames of the rehearsal.
    pub(super) fn step(&mut self) {
        let Self::Flying { flight, plans } = self else { return };
        for _ in 0..FRAMES_AT_ONCE {
            let flown = flight.step();
            let level = flight.computer().piloted().map(|(_, output)| output.level);
            let powered = flight.computer().mode().phase == Phase::Powered;
            if flown.planned() && powered && flight.world().touchdown().is_none() {
                plans[0] += 1;
                plans[1] += u64::from(level == Some(ControlLevel::Converged));
            }
            if !flight.goes_on() {
                break;
            }
        }
        if flight.goes_on() {
            return;
        }
        let [plans, converged] = *plans;
        let outcome = flight.outcome();
        let how = outcome.failure.map_or("landed", |failure| failure.name());
        let limits = Limits::of(flight.mission());
        let landing =
            outcome.touchdown.map(|touchdown| PredictedLanding::from(&limits.by_legs(&touchdown).1));
        let rehearsed = Rehearsed {
            warm: outcome.legs && converged > 0,
            found: format!("{how}, {converged} of {plans} plans converged"),
            landing,
        };
        let report = *flight.pilot().report();
        *self = Self::Over(Box::new((rehearsed, report)));
    }

    pub(super) fn over(&self) -> Option<&(Rehearsed, PoweredReport)> {
        match self {
            Self::Flying { .. } => None,
            Self::Over(over) => Some(over),
        }
    }
}
