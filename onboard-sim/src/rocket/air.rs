//! The flight itself, from apogee until it lies still, and what the crew is told of it.

use std::time::Duration;

use campaign::sortie::Sortie;
use flight::controller::ControlLevel;
use flight::phase::{Effect, Interlocks, Mode, Motor, Phase};
use flight::pilot::{FRAMES_PER_PLAN, Sensed};
use world::RestOutcome;

use super::{Air, FRAME_S, Rocket};
use crate::craft::{Craft as _, Judged, Severity, VehicleEvent, words_of, words_of_landing_here};
use crate::plant::Impact;

/// Time on the ground after which nothing more is flown, s.
const AT_REST_S: f64 = 1.0;
/// A flight computer that does not notice within this time that it lies on the ground is waited for no longer, s.
const UNNOTICED_S: f64 = 15.0;

impl Air {
    pub(super) fn new(sortie: Sortie, released_at_s: f64) -> Self {
        Self {
            sortie,
            released_at_s,
            flown: false,
            goes_on: true,
            level: ControlLevel::Idle,
            gate_refusal: None,
            touched: false,
            took_s: 0.0,
            judged: None,
            over: false,
            given_up: false,
        }
    }

    /// The flight computer is dead: it neither hears nor speaks.
    pub(super) fn computer_is_dead(&self) -> bool {
        self.sortie.flight().frame() > 0 && self.sortie.flight().input().is_none()
    }
}

impl Rocket {
    /// One frame in the air, or on the ground after it.
    pub(super) fn fly_frame(&mut self, stopwatch: &mut dyn FnMut() -> Duration) {
        let time_s = self.time_s();
        let Some(air) = &mut self.air else { return };
        air.flown = !air.over && !air.given_up;
        if !air.flown {
            return;
        }
        air.goes_on = air.sortie.step_timed(stopwatch);
        let flight = air.sortie.flight();
        let pilot = flight.pilot();
        let before = self.mode;
        let piloted = pilot.mode().on_clock_ahead_by(air.released_at_s);
        // The pin is moved by hand, and on the ground a crew may disarm: neither is its pilot's to know.
        let interlocks = Interlocks {
            pin_out: before.interlocks.pin_out,
            armed: before.interlocks.armed && piloted.interlocks.armed,
            ..piloted.interlocks
        };
        self.mode = Mode { interlocks, ..piloted };
        if let Some(input) = flight.input() {
            if let Sensed::Measured(measurements) = &input.sensed {
                self.watch.take(measurements, self.frame);
            }
            let plans = self.mode.phase.in_descent() || self.mode.phase.in_landing_burn();
            if plans && flight.frame().is_multiple_of(FRAMES_PER_PLAN) {
                let took_s = flight.pilot_took().as_secs_f64();
                air.took_s = took_s;
                self.events.push(VehicleEvent::Planned {
                    frame: input.frame,
                    time_s: input.time_s,
                    took_s,
                    deadline_s: FRAME_S,
                });
            }
        }
        self.tell(&before);
        self.watch_the_ground(time_s);
    }

    /// Tells the crew what has changed.
    fn tell(&mut self, before: &Mode) {
        let after = self.mode;
        let mut said = Vec::new();
        for effect in effects_between(before, &after) {
            said.extend(words_of(effect, 0.0));
        }
        said.extend(words_of_landing_here(before.interlocks, after.interlocks));
        if let Some(air) = &mut self.air {
            let pilot = air.sortie.flight().pilot();
            let level = air.sortie.flight().output().map_or(ControlLevel::Idle, |output| output.level);
            if after.phase.in_landing_burn() && level != air.level {
                said.push((Severity::Notice, format!("controller level {}", level.name())));
            }
            air.level = level;
            let refusal = pilot.gate_refusal().filter(|_| after.phase == Phase::LandArmed);
            if let Some(check) = refusal.filter(|_| refusal != air.gate_refusal) {
                said.push((Severity::Critical, format!("ignition gate closed: {check}")));
            }
            air.gate_refusal = refusal;
            if let Some(touchdown) = air.sortie.flight().world().touchdown().filter(|_| !air.touched) {
                air.touched = true;
                said.push((Severity::Notice, format!("ground contact at {:.2} m/s", touchdown.vertical_m_s)));
            }
        }
        for (severity, words) in said {
            self.say(severity, words);
        }
        if after.phase != before.phase {
            self.events.push(VehicleEvent::PhaseChanged { from: before.phase, to: after.phase });
        }
    }

    /// Judges a vehicle that lies still, and ends the flight. SAFED comes when its motor is safe.
    fn watch_the_ground(&mut self, time_s: f64) {
        let Some(air) = &mut self.air else { return };
        if air.goes_on {
            return;
        }
        let world = air.sortie.flight().world();
        let waited_s = world.rest().map_or(f64::INFINITY, |rest| world.time_s() - rest.time_s);
        if air.judged.is_none()
            && let Some(touchdown) = world.touchdown()
        {
            let outcome = air.sortie.flight().outcome();
            let time_s = air.released_at_s + touchdown.time_s;
            let judged = |(state, verdict), landed| {
                let impact = Impact { time_s, state };
                Judged { impact, verdict, landed }
            };
            let by_legs = judged(self.limits.by_legs(touchdown), outcome.legs);
            let by_table_2 = judged(self.limits.by_table_2(touchdown), outcome.strict);
            let words = outcome_in_words(&outcome, world.rest().map(|rest| rest.outcome));
            air.judged = Some((by_legs, by_table_2));
            let Judged { impact, verdict, .. } = by_legs;
            self.events.push(VehicleEvent::Verdict { impact, verdict: Box::new(verdict) });
            self.say(Severity::Notice, words);
        }
        if self.mode.phase == Phase::Touchdown {
            let burning = self.mode.motor == Motor::Burning && waited_s <= UNNOTICED_S;
            if let Some(air) = &mut self.air {
                air.over = !burning && time_s - self.mode.entered_at_s >= AT_REST_S;
            }
        } else if waited_s > UNNOTICED_S {
            self.give_up();
        }
    }

    fn give_up(&mut self) {
        if let Some(air) = &mut self.air {
            air.given_up = true;
        }
        let words = format!("the simulation ends here, in {}", self.mode.phase.name());
        self.say(Severity::Error, words);
    }
}

fn outcome_in_words(outcome: &campaign::outcome::Outcome, rest: Option<RestOutcome>) -> String {
    let stands = match rest {
        Some(RestOutcome::Upright) => "stands",
        Some(RestOutcome::TippedOver) => "tipped over",
        Some(RestOutcome::BodyStrike) => "hit the ground with its body",
        None => "is not at rest",
    };
    let held = |kept: bool| if kept { "kept" } else { "broken" };
    let why = outcome.failure.map_or_else(String::new, |failure| format!(" ({})", failure.name()));
    format!("it {stands}; limits of the legs {}{why}, Table 2 {}", held(outcome.legs), held(outcome.strict))
}

/// What the phase table must have done between two frames: the flight computer keeps its effects to itself.
pub(super) fn effects_between(before: &Mode, after: &Mode) -> Vec<Effect> {
    let (was, is) = (before.interlocks, after.interlocks);
    let entered = |phase| after.phase == phase && before.phase != phase;
    let inhibited = is.landing_motor_inhibited && !was.landing_motor_inhibited;
    let aborted_too_low = is.abort_latched && !was.abort_latched && inhibited && after.phase.in_descent();
    let lost = (is.no_light_latched && !was.no_light_latched) || aborted_too_low;
    [
        (entered(Phase::Ignition), Effect::IgniteLandingMotor),
        (inhibited, Effect::InhibitLandingMotor),
        (entered(Phase::Chute), Effect::DeployChute),
        (lost, Effect::RecordLoss),
    ]
    .into_iter()
    .filter_map(|(happened, effect)| happened.then_some(effect))
    .collect()
}
