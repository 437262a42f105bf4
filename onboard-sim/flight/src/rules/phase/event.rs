//! The events of a flight, their effects, and the reasons for a refusal.

use super::{HoldCause, LAST_HOLD_S, Phase, StartPoint};

/// A detected occurrence or a request.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Event {
    SelfTestPassed,
    /// The physical pin was pulled.
    PinPulled,
    /// The physical pin was put back.
    PinInserted,
    /// Radio command: arm. `checks_passed` is the result of the [arming
    /// checks](crate::rules::arming).
    ArmRequested {
        /// Every arming check passed.
        checks_passed: bool,
    },
    /// Radio command: disarm; during a countdown it cancels it.
    DisarmRequested {
        /// The vehicle has left its rail.
        lifted_off: bool,
    },
    /// Radio command: start the countdown.
    StartRequested {
        /// Every arming check passes now, too.
        checks_passed: bool,
        /// Length of the countdown, s.
        countdown_s: f64,
    },
    /// Hold the countdown: the station that armed the vehicle is silent, or a station requests a
    /// hold.
    Hold {
        cause: HoldCause,
        /// Start of the flight, which sets the time of the last possible hold.
        start: StartPoint,
    },
    /// A hold has lasted for [`HOLD_LIMIT_S`](super::HOLD_LIMIT_S).
    HoldElapsed,
    /// The countdown of a pad start ended: light the ascent motor. A simulation that starts in the
    /// air sends [`Event::ReleasedAt`] instead.
    CountdownElapsed,
    /// The countdown is over, and the vehicle falls: a simulation that starts in the air let it go,
    /// or a drone did.
    ReleasedAt(StartPoint),
    /// The vehicle left the pad.
    LiftOff,
    /// The ascent motor was commanded to light and the vehicle did not leave the pad in time.
    NoLiftOff,
    /// The burning motor burnt out; the landing motor may do so on the ground.
    Burnout,
    /// Apogee is near: separate the booster.
    SeparationDue,
    /// Vertical speed changed sign.
    Apogee {
        /// The booster has not separated.
        booster_attached: bool,
    },
    /// The drone let the vehicle go before it was cleared for it.
    ReleasedEarly {
        /// The parachute fills before the ground is reached.
        parachute_fills: bool,
    },
    /// All fins have reached their deployed angle.
    FinsConfirmed,
    /// The vehicle is close enough to the ground for the landing controller.
    LandArm,
    /// The ignition gate was evaluated.
    IgnitionGate {
        /// Every [gate check](crate::rules::gate) passed.
        open: bool,
    },
    /// The accelerometer shows landing-motor thrust.
    ThrustConfirmed,
    /// No thrust within [`NO_THRUST_TIMEOUT_S`](super::NO_THRUST_TIMEOUT_S) of the ignition
    /// command.
    NoThrustTimeout,
    /// The vehicle itself finds, in its descent, that its ignition gate will not open any more.
    GateShutForGood {
        /// The parachute fills before the ground is reached.
        parachute_fills: bool,
    },
    /// Abort by radio.
    AbortRequested {
        /// The vehicle has left its rail.
        lifted_off: bool,
        /// The height is still sufficient for the parachute: with a margin if the gate is open,
        /// else without.
        above_commit_height: bool,
        /// The ignition gate is open at this moment.
        gate_open: bool,
    },
    /// Contact with the ground was sensed.
    Contact {
        /// Thrust is below the weight, so the vehicle will stay down.
        thrust_below_weight: bool,
    },
    /// On the ground, every actuator and igniter line is shut down. The event is accepted only if
    /// the motor is safe, too.
    SafingDone,
}

numbered_enum! {
/// An action that must follow now, in the crew's words.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Effect {
    /// Light the ascent motor.
    IgniteAscentMotor = "ascent motor commanded to light",
    /// Light the landing motor. This is emitted at most once until a restart.
    IgniteLandingMotor = "landing motor commanded to light",
    /// Cut the landing motor's igniter line.
    InhibitLandingMotor = "landing motor inhibited",
    /// Disarm both igniter lines.
    Disarm = "disarmed",
    /// Deploy the parachute.
    DeployChute = "parachute deployed",
    /// Open the fins fully. The crew can see them.
    FinsOpen = "",
    /// The countdown began.
    StartCountdown = "countdown started",
    CancelCountdown = "countdown cancelled",
    /// Show the 60 s wait before the pad may be approached.
    ShowPadWait = "ABORT on the pad: keep away for 60 s",
    /// Record the loss of the vehicle.
    RecordLoss = "vehicle will be lost: landing motor inhibited",
    /// The countdown was held: it is cancelled, but the vehicle is still armed.
    HoldCountdown = "HOLD: no countdown",
    /// Fire the charge between booster and vehicle.
    SeparateBooster = "booster commanded to separate",
}
}

/// A small set of [`Effect`]s.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Effects(u16);

impl Effects {
    /// No effect.
    pub const NONE: Self = Self(0);

    /// The set of these effects.
    pub fn of(effects: &[Effect]) -> Self {
        Self(effects.iter().fold(0, |bits, effect| bits | 1 << (*effect as u16)))
    }

    /// Whether the effect is in the set.
    pub fn contains(self, effect: Effect) -> bool {
        self.0 & (1 << (effect as u16)) != 0
    }

    /// Whether the set is empty.
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// The effects in the set, in index order.
    pub fn iter(self) -> impl Iterator<Item = Effect> {
        Effect::ALL.into_iter().filter(move |effect| self.contains(*effect))
    }
}

/// Why an event changed nothing, in words for an operator.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    /// The event belongs to other phases.
    #[error("cannot {action} in {}: {only}", phase.name())]
    WrongPhase {
        /// The requested action, as a verb.
        action: &'static str,
        /// The phase at the request.
        phase: Phase,
        /// Where the action would be accepted.
        only: &'static str,
    },
    #[error("an abort is latched: restart the vehicle to clear it")]
    AbortLatched,
    #[error("the pin is in: pull it before arming")]
    PinIn,
    /// An arming check failed.
    #[error("an arming check failed")]
    ChecksFailed,
    #[error("not armed")]
    NotArmed,
    #[error("the landing motor is inhibited")]
    LandingMotorInhibited,
    /// A countdown is already running.
    #[error("a countdown is running: disarm to cancel it")]
    CountdownRunning,
    /// There is no countdown to hold.
    #[error("no countdown is running")]
    NoCountdown,
    /// The countdown is already held.
    #[error("already held")]
    AlreadyHeld,
    /// The release is too near for a hold.
    #[error("the last {LAST_HOLD_S} s have begun, and nothing holds any more: abort to stop it")]
    TooLateToHold,
    /// No hold has reached its time limit.
    #[error("no hold has lasted its time")]
    HoldNotOver,
    /// The countdown has not ended, or was never started.
    #[error("the countdown has not ended")]
    CountdownNotElapsed,
    /// The countdown's length is not a number of seconds.
    #[error("the countdown must be a number of seconds, 0 or more")]
    BadCountdown,
    /// The abort is already latched.
    #[error("already aborted")]
    AlreadyAborted,
    /// Contact with thrust above the weight: the vehicle will not stay down yet.
    #[error("contact with thrust above weight: not down yet")]
    ThrustAboveWeight,
    /// The landing motor has not ignited, and its pin is out.
    #[error("the landing motor is live: put the pin in")]
    MotorLive,
    /// The landing motor burns.
    #[error("the landing motor burns")]
    MotorBurning,
    /// The landing motor has burnt out and is still hot.
    #[error("the landing motor is hot")]
    MotorHot,
    /// The landing motor did not light, and may still light late.
    #[error("the landing motor may still light late")]
    MisfireWait,
}
