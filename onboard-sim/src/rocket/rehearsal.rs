//! The landing rehearsed on the pad: the mission flown once as its data stand, faster than real time.
//!
//! It says whether the flight computer's solver works and whether vehicle, motor and mission make a landing at all. It
//! knows nothing of the day's wind or of this motor.

use campaign::dispersion::Dispersion;
use campaign::fly::FlyError;
use campaign::order::Order;
use campaign::sortie::Sortie;
use flight::powered::PoweredReport;
use flight::verdict::LandingVerdict;

use super::limits::Limits;

/// Frames rehearsed in a frame on the pad: a flight takes a second or two.
const FRAMES_AT_ONCE: u32 = 20;

/// A rehearsal under way, or what it came to.
pub(super) enum Rehearsal {
    /// Under way.
    Flying(Box<Sortie>),
    /// Over.
    Over(Box<Rehearsed>),
}

/// What a rehearsal came to.
pub(super) struct Rehearsed {
    /// The flight computer found plans, and landed within what the legs take.
    pub(super) warm: bool,
    /// In words.
    pub(super) found: String,
    /// The touchdown against the limits of the legs.
    pub(super) landing: Option<LandingVerdict>,
    /// The last plan.
    pub(super) report: PoweredReport,
}

impl Rehearsal {
    pub(super) fn new(order: &Order) -> Result<Self, FlyError> {
        let as_data_stand = Order { dispersion: Dispersion::default(), faults: Vec::new(), ..order.clone() };
        Ok(Self::Flying(Box::new(Sortie::new(&as_data_stand, 0)?)))
    }

    /// Some frames of it.
    pub(super) fn step(&mut self, limits: &Limits) {
        let Self::Flying(sortie) = self else { return };
        if (0..FRAMES_AT_ONCE).all(|_| sortie.step()) {
            return;
        }
        let row = sortie.row();
        let plans = row.plans_converged + row.plans_best_feasible + row.plans_shifted + row.plans_stabiliser;
        let world = sortie.flight().world();
        let landing = world.touchdown().map(|touchdown| limits.by_legs(touchdown).1);
        *self = Self::Over(Box::new(Rehearsed {
            warm: row.legs && row.plans_converged > 0,
            found: match row.failure.as_str() {
                "" => format!("landed, {} of {plans} plans converged", row.plans_converged),
                failure => format!("{failure}, {} of {plans} plans converged", row.plans_converged),
            },
            landing,
            report: *sortie.flight().pilot().report(),
        }));
    }

    pub(super) fn over(&self) -> Option<&Rehearsed> {
        match self {
            Self::Flying(_) => None,
            Self::Over(rehearsed) => Some(rehearsed),
        }
    }
}
