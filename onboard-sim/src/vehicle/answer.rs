//! What the crew may ask of the vehicle, and what it answers.

use flight::arming;
use flight::phase::{Effect, Event, Phase, Refusal, transition};

use super::{Severity, Vehicle};

/// Something asked by radio.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Request {
    /// Arm.
    Arm,
    /// Disarm; cancels a countdown.
    Disarm,
    /// Start the countdown.
    Start,
    /// Abort, irreversibly.
    Abort,
}

/// How a request ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Result {
    /// Done, or already so.
    Accepted,
    /// Not now: the reason can be mended.
    NotNow,
    /// Not in this phase or state.
    Denied,
    /// Understood and impossible.
    Failed,
}

/// An answer with its reason.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Answer {
    /// How it ended.
    pub result: Result,
    /// Why, if not accepted.
    pub reason: Option<String>,
}

impl Answer {
    fn accepted() -> Self {
        Self { result: Result::Accepted, reason: None }
    }
}

impl Vehicle {
    /// Answers a request and acts on it.
    pub fn request(&mut self, request: Request) -> Answer {
        let locks = self.mode.interlocks;
        // What is so already is accepted: a repeated request must not frighten the crew.
        let already = match request {
            Request::Arm => locks.armed && self.mode.phase == Phase::PadArmed,
            Request::Disarm => !locks.armed && matches!(self.mode.phase, Phase::PadIdle | Phase::Safed),
            Request::Start => locks.armed && self.mode.countdown_end_s.is_some(),
            // Repeated, an abort may mean more than the first time: the phase table decides.
            Request::Abort => false,
        };
        if already {
            return Answer::accepted();
        }
        let checks = self.arming_checks();
        let event = match request {
            Request::Arm => Event::ArmRequested { checks_passed: arming::all_passed(&checks) },
            Request::Disarm => Event::DisarmRequested,
            Request::Start => Event::StartRequested { countdown_s: self.profile.start.countdown_s },
            Request::Abort => self.abort_event(),
        };
        match self.happen(event) {
            None | Some(Refusal::AlreadyAborted) => Answer::accepted(),
            Some(refusal) => {
                let reason = match refusal {
                    Refusal::ChecksFailed => {
                        arming::first_refusal(&checks).unwrap_or_else(|| refusal.reason())
                    }
                    other => other.reason(),
                };
                let result = match (request, refusal) {
                    (Request::Abort, _) => Result::Failed,
                    (_, Refusal::ChecksFailed | Refusal::PinIn) => Result::NotNow,
                    _ => Result::Denied,
                };
                self.say(Severity::Warning, format!("{} refused: {reason}", event.name()));
                Answer { result, reason: Some(reason) }
            }
        }
    }

    /// The abort as it would be meant now. This vehicle carries no parachute: no height is above its commit
    /// height.
    pub(super) fn abort_event(&self) -> Event {
        let gate_open = self.mode.phase.in_descent() && arming::all_passed(&self.gate_checks());
        Event::AbortRequested { above_commit_height: false, gate_open }
    }

    /// Puts an event to the phase table and does what follows from it; returns the refusal, if any.
    pub(super) fn happen(&mut self, event: Event) -> Option<Refusal> {
        let time_s = self.time_s();
        let from = self.mode;
        let next = transition(&self.mode, event, time_s);
        if next.refusal.is_some() {
            return next.refusal;
        }
        self.mode = next.mode;
        for effect in next.effects.iter() {
            self.take_effect(effect);
        }
        if self.mode.interlocks.degraded && !from.interlocks.degraded {
            let words = "ABORT: no cut-off exists; holding upright at full vertical thrust";
            self.say(Severity::Critical, words.to_owned());
        }
        if self.mode.phase != from.phase {
            self.events.push(super::VehicleEvent::PhaseChanged { from: from.phase, to: self.mode.phase });
        }
        None
    }

    fn take_effect(&mut self, effect: Effect) {
        match effect {
            Effect::IgniteLandingMotor => {
                self.plant.ignite();
                self.ignition_sample = Some(self.frame.div_ceil(self.frames_per_sample));
                self.say(Severity::Notice, "landing motor commanded to light".to_owned());
            }
            Effect::FinsOpen => self.fin_command_rad = [self.profile.fins.deployed_rad(); 4],
            Effect::InhibitLandingMotor => {
                self.say(Severity::Notice, "landing motor inhibited".to_owned());
            }
            Effect::Disarm => self.say(Severity::Notice, "disarmed".to_owned()),
            Effect::StartCountdown => {
                let countdown_s = self.profile.start.countdown_s;
                self.say(Severity::Notice, format!("countdown started: release in {countdown_s} s"));
            }
            Effect::CancelCountdown => self.say(Severity::Warning, "countdown cancelled".to_owned()),
            Effect::ShowPadWait => {
                self.say(Severity::Critical, "ABORT on the pad: keep away for 60 s".to_owned());
            }
            Effect::RecordLoss => {
                self.say(Severity::Critical, "vehicle will be lost: landing motor inhibited".to_owned());
            }
            Effect::DeployChute => self.say(Severity::Critical, "parachute deployed".to_owned()),
            // A start at ignition has no ascent motor.
            Effect::IgniteAscentMotor => {}
        }
    }

    pub(super) fn say(&mut self, severity: Severity, text: String) {
        self.events.push(super::VehicleEvent::Text { severity, text });
    }
}
