//! Ground contact, the verdict on it, and the end of the flight, all of which only the simulation
//! has.

use crate::outcome::Outcome;
use crate::sortie::Sortie;
use flight::computer::Computer;
use flight::computer::messages::Severity;
use flight::rules::phase::Phase;

use super::{Judged, VehicleEvent};

/// A flight computer that does not notice within this time that it lies on the ground is waited for
/// no longer, s.
const UNNOTICED_S: f64 = 15.0;

/// State of the flight's end.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct GroundWatch {
    contacts: usize,
    /// It has left its pad, whatever its computer decides.
    flew: bool,
    judged: Option<Judged>,
    given_up: bool,
}

impl GroundWatch {
    pub(super) fn judged(&self) -> Option<Judged> {
        self.judged
    }

    pub(super) fn is_over(&self, computer: &Computer) -> bool {
        // The computer may be sure of the ground before the vehicle lies still.
        (computer.is_over() && (!self.flew || self.judged.is_some())) || self.given_up
    }

    /// Looks at a rocket after a frame.
    pub(super) fn watch(&mut self, sortie: &Sortie) -> Vec<VehicleEvent> {
        let mut events = Vec::new();
        let Some(released_at_s) = sortie.computer().released_at_s() else { return events };
        let world = sortie.world();
        self.flew = world.leaves_pad();
        if let Some(touchdown) = world.touchdown().filter(|_| self.contacts == 0) {
            self.contacts = 1;
            let text = format!("ground contact at {:.2} m/s", touchdown.over_ground.vertical_m_s);
            events.push(VehicleEvent::text(Severity::Notice, &text));
        }
        if sortie.goes_on() {
            return events;
        }
        if let (Some(touchdown), None) = (world.touchdown(), self.judged) {
            let outcome = sortie.outcome();
            let time_s = released_at_s + touchdown.time_s;
            let (touchdown, landing) = (touchdown.over_ground, outcome.landing);
            self.judged = Some(Judged { time_s, touchdown, landing });
            events.push(VehicleEvent::Verdict);
            let text = in_words(&outcome, sortie.computer().mode().interlocks.abort_latched);
            events.push(VehicleEvent::text(Severity::Notice, &text));
        }
        let waited_s = world.rest().map_or(f64::INFINITY, |rest| world.time_s() - rest.time_s);
        let phase = sortie.computer().mode().phase;
        let unnoticed = !matches!(phase, Phase::Touchdown | Phase::Safed);
        if unnoticed && waited_s > UNNOTICED_S && !self.given_up {
            self.given_up = true;
            let text = format!("the simulation ends here, in {}", phase.name());
            events.push(VehicleEvent::text(Severity::Error, &text));
        }
        events
    }
}

/// The outcome of the flight, and the loads of crushable legs, as text.
fn in_words(outcome: &Outcome, aborted: bool) -> String {
    let strain = outcome.rest.and_then(|rest| rest.strain).map_or_else(String::new, |strain| {
        let [stroke, load] = [strain.stroke_used, strain.strength_used].map(|share| 100.0 * share);
        format!("; stroke {stroke:.0} %, leg load {load:.0} %")
    });
    format!("{}{strain}", outcome.ending(aborted))
}
