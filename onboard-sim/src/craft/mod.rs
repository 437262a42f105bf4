//! What every simulated vehicle is to its run loop and its radio, whatever flies inside.
//!
//! Two crafts exist: [`Vehicle`](crate::vehicle::Vehicle), planar and released at ignition, and
//! [`Rocket`](crate::rocket::Rocket), in space from apogee. Crew, links, telemetry and log meet them here only.

mod answer;
mod events;
mod motor;
mod self_test;
mod snapshot;
mod words;

use std::time::Duration;

use flight::arming::{Check, Uplink};
use flight::phase::{Effect, Event, HOLD_LIMIT_S, Mode, Phase, Refusal, transition};
use flight::profile::StateWeights;
use protocol::log::record::Record;
use protocol::log::v1;

pub use answer::{Answer, Asker, Request, Result};
pub use campaign::fly::Radio;
pub use events::{Severity, Tick, VehicleEvent};
pub use motor::MotorWatch;
pub(crate) use self_test::{ANSWERING_RAD, SelfTest, TestStep};
pub use snapshot::{
    AbortEffect, Chute, ControllerFacts, DescentFacts, EstimatorFacts, Judged, Motion, PATH_POINTS, Path,
    Prediction, SensorFacts, Snapshot,
};
pub(crate) use snapshot::{bits, violations};
pub(crate) use words::{LOG_STOPPED, Readiness, self_test_failed, words_of, words_of_landing_here};

use crate::streams::Standard;

/// What a craft is told of its log.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LogState {
    /// The log is being written; also true where the operator chose to fly without one.
    pub running: bool,
    /// Free space for it, bytes.
    pub space_bytes: u64,
}

/// A simulated vehicle with its flight computer.
///
/// Pure but for the stopwatch handed to [`Craft::advance_frame`]. Time is simulated and moves in frames.
pub trait Craft {
    /// Simulated time since power-up, s.
    fn time_s(&self) -> f64;

    /// Length of a frame, s.
    fn frame_s(&self) -> f64;

    /// Phase, latches and countdown.
    fn mode(&self) -> &Mode;

    /// The phase.
    fn phase(&self) -> Phase {
        self.mode().phase
    }

    /// Whether an abort has been accepted.
    fn aborted(&self) -> bool {
        self.mode().interlocks.abort_latched
    }

    /// Whether nothing more will happen in this flight: it lies on the ground and is judged, or was aborted on the pad.
    /// SAFED may come much later, or never: that is a matter of its motor.
    fn is_over(&self) -> bool;

    /// Every message that is sent unasked.
    fn standard(&self) -> &'static [Standard];

    /// Weights of the landing cost.
    fn weights(&self) -> &StateWeights;

    /// The arming checks with the values found now.
    fn arming_checks(&self) -> Vec<Check>;

    /// Arming checks pass after this long, s, or never will.
    fn ready_within_s(&self) -> f64 {
        3.0
    }

    /// Length of the countdown, s.
    fn countdown_s(&self) -> f64;

    /// What the crew pulls by hand; the simulation does it when the program starts.
    fn pull_pin(&mut self) {
        self.happen(Event::PinPulled);
    }

    /// What it was told of its log.
    fn log_state(&mut self) -> &mut LogState;

    /// Tells the craft how its log fares; a log that stops is announced.
    fn set_log_state(&mut self, log: LogState) {
        let before = core::mem::replace(self.log_state(), log);
        if before.running && !log.running {
            self.say(Severity::Error, LOG_STOPPED.to_owned());
        }
    }

    /// How well the ground is heard. [`Uplink::NotNeeded`] where the vehicle starts by itself.
    fn uplink(&mut self) -> &mut Uplink;

    /// What the crew was told of the landing motor.
    fn motor_watch(&mut self) -> &mut MotorWatch;

    /// What time alone brings about, in every frame: a hold ends, a motor cools, the vehicle is SAFED.
    fn keep_time(&mut self) {
        let (mode, time_s) = (*self.mode(), self.time_s());
        if mode.held(time_s).is_some_and(|(_, left_s)| left_s <= 0.0) {
            self.say(Severity::Warning, format!("held for {HOLD_LIMIT_S} s without a new start"));
            self.happen(Event::HoldElapsed);
        }
        if mode.phase == Phase::Touchdown && self.is_over() {
            if mode.interlocks.armed {
                self.happen(Event::DisarmRequested);
            }
            if mode.may_be_safed(time_s).is_ok() {
                self.happen(Event::SafingDone);
            }
        }
        if let Some((severity, words)) = self.motor_watch().news(&mode, time_s) {
            self.say(severity, words);
        }
    }

    /// Puts an event to the phase table and does what follows from it; returns the refusal, if any.
    fn happen(&mut self, event: Event) -> Option<Refusal>;

    /// Says something to the crew.
    fn say(&mut self, severity: Severity, text: String);

    /// The abort as it would be meant now.
    fn abort_event(&self) -> Event;

    /// Advances by one frame. `stopwatch` is any clock; only differences of it are used, to time the controller.
    fn advance_frame(&mut self, stopwatch: &mut dyn FnMut() -> Duration) -> Vec<VehicleEvent>;

    /// The state now, for telemetry.
    fn snapshot(&self) -> Snapshot;

    /// What of this frame belongs into a log beside the events. `changed`: the phase has just changed.
    fn log(&self, changed: bool) -> Vec<Record>;

    /// The touchdown limits with the values found, once it is judged.
    fn judged(&self) -> Option<Judged>;

    /// The landing by the landing paper's Table 2, where [`Craft::judged`] goes by what the legs take.
    fn judged_by_table_2(&self) -> Option<Judged> {
        None
    }

    /// The landing as a log's record, once it is judged.
    fn verdict_record(&self) -> Option<v1::LandingVerdict> {
        let Judged { impact, verdict, .. } = self.judged()?;
        Some(tick_log::verdict_to_log(impact.time_s, &impact.state, &verdict))
    }

    /// What the radio does to what is sent and heard.
    fn radio(&self) -> Radio {
        Radio::default()
    }

    /// Answers a request of the vehicle's own programme and acts on it.
    fn request(&mut self, request: Request) -> Answer {
        self.request_by(request, Asker::NO_STATION)
    }

    /// Answers a request and acts on it.
    fn request_by(&mut self, request: Request, asker: Asker) -> Answer {
        answer::answer(self, request, asker)
    }

    /// Whether a plan to land can be had under thrust; true as long as nobody has tried.
    fn plans_a_landing(&self) -> bool;

    /// Speed at the ground after a fall from here without thrust, m/s, falling positive.
    fn impact_m_s(&self) -> f64;

    /// Asked of the phase table itself, so that the words beside the abort key are what it would do.
    fn abort_effect(&self) -> AbortEffect {
        let next = transition(self.mode(), self.abort_event(), self.time_s());
        let does = |effect| next.effects.contains(effect);
        // To be sure, more rather than less; 254 is the most that is told, 255 would be "unknown".
        let impact = || AbortEffect::Impact { m_s: libm::ceil(self.impact_m_s()).clamp(0.0, 254.0) as u8 };
        match () {
            () if next.refusal.is_some() => AbortEffect::None,
            () if does(Effect::ShowPadWait) => AbortEffect::SafeOnPad,
            () if does(Effect::DeployChute) => AbortEffect::ChuteNow,
            () if does(Effect::IgniteLandingMotor) => AbortEffect::Burn,
            () if does(Effect::RecordLoss) => impact(),
            () if next.mode.interlocks.lands_here => match () {
                // It was commanded to light and has not.
                () if self.phase() == Phase::Ignition && self.mode().interlocks.no_light_latched => impact(),
                () if self.plans_a_landing() => AbortEffect::LandHere,
                () => AbortEffect::UprightOnly,
            },
            () => AbortEffect::ChuteAtApogee,
        }
    }
}
