//! Contact with the ground, the verdict on it, and the end of the flight: what only the simulation knows.

use flight::computer::Computer;
use flight::computer::news::Severity;
use flight::rules::phase::Phase;
use sim::limits::Limits;
use sim::outcome::Outcome;
use sim::sortie::Sortie;
use sim::world::RestOutcome;

use super::{Impact, Judged, VehicleEvent};

/// A flight computer that does not notice within this time that it lies on the ground is waited for no longer, s.
const UNNOTICED_S: f64 = 15.0;

/// What has become of the flight.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Ground {
    contacts: usize,
    judged: Option<Judged>,
    judged_by_table_2: Option<Judged>,
    given_up: bool,
}

impl Ground {
    pub(super) fn judged(&self) -> Option<Judged> {
        self.judged
    }

    pub(super) fn judged_by_table_2(&self) -> Option<Judged> {
        self.judged_by_table_2
    }

    pub(super) fn is_over(&self, computer: &Computer) -> bool {
        computer.is_over() || self.given_up
    }

    /// Looks at a rocket after a frame.
    pub(super) fn watch(&mut self, sortie: &Sortie) -> Vec<VehicleEvent> {
        let mut events = Vec::new();
        let Some(released_at_s) = sortie.computer().released_at_s() else { return events };
        let world = sortie.world();
        if let Some(touchdown) = world.touchdown().filter(|_| self.contacts == 0) {
            self.contacts = 1;
            events.push(contact(touchdown.vertical_m_s));
        }
        if sortie.goes_on() {
            return events;
        }
        if let (Some(touchdown), None) = (world.touchdown(), self.judged) {
            let outcome = sortie.outcome();
            let time_s = released_at_s + touchdown.time_s;
            let limits = Limits::of(sortie.mission());
            let judged =
                |(state, verdict), landed| Judged { impact: Impact { time_s, state }, verdict, landed };
            let by_legs = judged(limits.by_legs(touchdown), outcome.legs);
            self.judged = Some(by_legs);
            self.judged_by_table_2 = Some(judged(limits.by_table_2(touchdown), outcome.strict));
            let Judged { impact, verdict, .. } = by_legs;
            events.push(VehicleEvent::Verdict { impact, verdict: Box::new(verdict) });
            let words = outcome_in_words(&outcome);
            events.push(VehicleEvent::Text { severity: Severity::Notice, text: words });
        }
        let waited_s = world.rest().map_or(f64::INFINITY, |rest| world.time_s() - rest.time_s);
        let phase = sortie.computer().mode().phase;
        let unnoticed = !matches!(phase, Phase::Touchdown | Phase::Safed);
        if unnoticed && waited_s > UNNOTICED_S && !self.given_up {
            self.given_up = true;
            let text = format!("the simulation ends here, in {}", phase.name());
            events.push(VehicleEvent::Text { severity: Severity::Error, text });
        }
        events
    }
}

fn contact(vertical_m_s: f64) -> VehicleEvent {
    let text = format!("ground contact at {vertical_m_s:.2} m/s");
    VehicleEvent::Text { severity: Severity::Notice, text }
}

fn outcome_in_words(outcome: &Outcome) -> String {
    let stands = match outcome.rest.map(|rest| rest.outcome) {
        Some(RestOutcome::Upright) => "stands",
        Some(RestOutcome::TippedOver) => "tipped over",
        Some(RestOutcome::BodyStrike) => "hit the ground with its body",
        None => "is not at rest",
    };
    let why = outcome.failure.map_or_else(String::new, |failure| format!(" ({})", failure.name()));
    if let Some(strain) = outcome.rest.and_then(|rest| rest.strain) {
        let [stroke, load] = [strain.stroke_used, strain.strength_used].map(|share| 100.0 * share);
        let undamaged = if outcome.legs { ", undamaged" } else { "" };
        format!("it {stands}{undamaged}{why}; stroke {stroke:.0} %, leg load {load:.0} %")
    } else {
        let legs = if outcome.legs { "kept" } else { "broken" };
        format!("it {stands}; limits of the legs {legs}{why}")
    }
}
