//! The flight phases, the events that change them, and the one table of all transitions.
//!
//! [`transition()`] is a pure function: it takes a mode and an event, and returns a mode and
//! effects, or a [`Refusal`] as text. The vehicle ignites a motor on the way down, which staging
//! electronics forbid for good reason. So the table is explicit and conservative: only one row
//! ignites the landing motor, once, and only if every interlock permits it.

mod event;
#[cfg(test)]
mod tests;
mod transition;

use serde::{Deserialize, Serialize};

pub use self::event::{Effect, Effects, Event, Refusal};
pub use self::transition::{Transition, transition};
pub use crate::vehicle::mission::StartPoint;

/// Time for which the pad must not be approached after an abort there, s.
pub const PAD_ABORT_WAIT_S: f64 = 60.0;

/// Time after the ignition command at which missing thrust counts as "no light", s.
pub const NO_THRUST_TIMEOUT_S: f64 = 0.5;

numbered_enum! {
/// The phase of the flight.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Phase {
    /// Powered up, self-test not passed.
    Safe = "SAFE",
    /// On the pad, self-test passed, disarmed.
    PadIdle = "PAD_IDLE",
    /// On the pad, armed; a countdown may be running.
    PadArmed = "PAD_ARMED",
    /// Under the ascent motor.
    Boost = "BOOST",
    /// Rising without thrust.
    Coast = "COAST",
    /// Past apogee, fins opening.
    Deploy = "DEPLOY",
    /// Falling on the fins.
    AeroDescent = "AERO_DESCENT",
    /// Falling, landing controller running, waiting for the ignition gate.
    LandArmed = "LAND_ARMED",
    /// Landing motor commanded to light; entered at most once.
    Ignition = "IGNITION",
    /// Landing motor burning.
    Powered = "POWERED",
    /// On the ground, thrust below weight.
    Touchdown = "TOUCHDOWN",
    /// On the ground, everything inhibited, and the vehicle safe to approach: the motor burnt out
    /// and cooled, or its pin in.
    Safed = "SAFED",
    /// Under the parachute.
    Chute = "CHUTE",
}
}

impl Phase {
    /// On the pad, before lift-off or release.
    pub fn on_pad(self) -> bool {
        matches!(self, Self::Safe | Self::PadIdle | Self::PadArmed)
    }

    /// On the pad or rising.
    pub fn before_apogee(self) -> bool {
        self.on_pad() || matches!(self, Self::Boost | Self::Coast)
    }

    /// Falling without thrust, before ignition.
    pub fn in_descent(self) -> bool {
        matches!(self, Self::Deploy | Self::AeroDescent | Self::LandArmed)
    }

    /// The landing motor has been commanded to light or burns.
    pub fn in_landing_burn(self) -> bool {
        matches!(self, Self::Ignition | Self::Powered)
    }

    /// The landing controller plans the real landing.
    pub fn is_landing(self) -> bool {
        self == Self::LandArmed || self.in_landing_burn()
    }
}

/// The latches.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Interlocks {
    /// The physical pin has been pulled.
    pub pin_out: bool,
    /// Armed by radio after the checks passed.
    pub armed: bool,
    /// Ignition of the landing motor is permanently inhibited.
    pub landing_motor_inhibited: bool,
    /// An abort was accepted; nothing arms again until a restart.
    pub abort_latched: bool,
    /// The landing motor was commanded and gave no thrust in time.
    pub no_light_latched: bool,
    /// Aborted too low for the parachute, or with the landing motor ignited, which has no cut-off:
    /// the vehicle lands on the ground below.
    pub lands_in_place: bool,
}

/// Phase, latches, countdown and motor: the complete state of the table.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Mode {
    /// The phase of the flight.
    pub phase: Phase,
    /// The latches.
    pub interlocks: Interlocks,
    /// When the phase was entered (after a pad abort: the time of the abort), vehicle time, s.
    pub entered_at_s: f64,
    /// When the running countdown ends, vehicle time, s; `None` if none runs.
    pub countdown_end_s: Option<f64>,
    /// The hold of the last countdown, if no new one was started since.
    pub hold: Option<Hold>,
    /// The state of the landing motor.
    pub motor: Motor,
    /// Time of an abort on the pad in an earlier power-up, vehicle time, s: at most zero. People
    /// keep away and nothing arms before its wait is over, and the pin is due until it was inserted
    /// and is pulled again.
    pub aborted_before_s: Option<f64>,
}

impl Mode {
    /// The mode after power-up: [`Phase::Safe`] and no latches. Only a restart leads back here.
    pub fn power_up(time_s: f64) -> Self {
        Self {
            phase: Phase::Safe,
            interlocks: Interlocks::default(),
            entered_at_s: time_s,
            countdown_end_s: None,
            hold: None,
            motor: Motor::Unlit,
            aborted_before_s: None,
        }
    }

    /// Time left of the running countdown, s, never negative; `None` without a countdown.
    pub fn countdown_remaining_s(&self, time_s: f64) -> Option<f64> {
        self.countdown_end_s.map(|end_s| (end_s - time_s).max(0.0))
    }

    /// Time until the pad may be approached after an abort there, s; `None` unless that wait is
    /// running.
    pub fn pad_wait_remaining_s(&self, time_s: f64) -> Option<f64> {
        let remaining_s = self.aborted_on_the_pad_s()? + PAD_ABORT_WAIT_S - time_s;
        (remaining_s > 0.0).then_some(remaining_s)
    }

    /// When it was aborted on the pad, in this power-up or before it, vehicle time, s.
    fn aborted_on_the_pad_s(&self) -> Option<f64> {
        let now_s = (self.interlocks.abort_latched && self.phase.on_pad()).then_some(self.entered_at_s);
        now_s.or(self.aborted_before_s)
    }

    /// The abort that a power cycle must not wipe out: until its wait is over and the pin is in.
    /// When it was, vehicle time, s.
    pub fn abort_to_save_s(&self, time_s: f64) -> Option<f64> {
        let is_over = self.pad_wait_remaining_s(time_s).is_none() && !self.interlocks.pin_out;
        self.aborted_on_the_pad_s().filter(|_| !is_over)
    }
}

// The hold of a countdown.

/// Maximum age of the last heartbeat of a station that arms, or commands an armed vehicle, s: two
/// of its heartbeats outside a countdown.
pub const UPLINK_PROVEN_S: f64 = 2.0;

/// Time without an accepted frame after which the station that armed the vehicle counts as silent
/// in a countdown, s. At ten heartbeats a second, nine in a row would have to be lost by chance. A
/// loss is detected after this time, so together with [`LAST_HOLD_S`] it gives the time before the
/// release until which every loss holds.
pub const UPLINK_SILENT_S: f64 = 1.0;

/// A held vehicle disarms after this long without a new start, s.
pub const HOLD_LIMIT_S: f64 = 60.0;

/// Time before the release, s, from which no key and no silence holds the countdown any more: a
/// hold as late as the release itself must not leave the crew uncertain whether the motor ignites.
/// An abort and a disarm still end the countdown, and so does a failing arming check: the vehicle
/// detects it itself, and nothing is energised before the release.
pub const LAST_HOLD_S: f64 = 2.0;

/// Why a countdown was held.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[repr(u8)]
pub enum HoldCause {
    /// No frame of the station that armed the vehicle was accepted for [`UPLINK_SILENT_S`].
    UplinkSilent = 1,
    /// A station requested a hold.
    Commanded = 2,
    /// Whoever confirmed the start has not tapped in time.
    TapOverdue = 3,
    /// The station that armed the vehicle reports that it receives nothing from it.
    StationDeaf = 4,
    /// An arming check fails.
    CheckFailed = 5,
}

/// A hold: the countdown is cancelled, but the vehicle is still armed. Only a new start continues
/// the launch.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Hold {
    pub cause: HoldCause,
    /// When the countdown was held, vehicle time, s.
    pub at_s: f64,
}

impl StartPoint {
    /// Time before the release from which nothing holds, s. `None` below a drone: its pilot
    /// releases the vehicle at no fixed time after the countdown, so a hold is possible until then.
    pub fn last_hold_s(self) -> Option<f64> {
        (self != Self::Drone).then_some(LAST_HOLD_S)
    }
}

impl Mode {
    /// Whether a countdown runs that may still be held for this.
    pub fn may_hold_for(&self, cause: HoldCause, start: StartPoint, time_s: f64) -> bool {
        let last_s = start.last_hold_s().filter(|_| cause != HoldCause::CheckFailed);
        let in_time = |end_s: f64| last_s.is_none_or(|last_s| end_s - time_s > last_s);
        self.countdown_end_s.is_some_and(in_time)
    }

    /// Why the last countdown was held, and the time left until the vehicle disarms, s; `None`
    /// unless it is held.
    pub fn held(&self, time_s: f64) -> Option<(HoldCause, f64)> {
        let hold = self.hold.filter(|_| self.phase == Phase::PadArmed)?;
        Some((hold.cause, (hold.at_s + HOLD_LIMIT_S - time_s).max(0.0)))
    }
}

// Why the landing motor is permanently inhibited.

/// Cause of a latched abort, or of the inhibition of a landing motor without thrust.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[repr(u8)]
pub enum Latch {
    /// An abort by the crew, or a disarm during the ignition of the ascent motor.
    Commanded = 1,
    /// The vehicle lifted off unarmed.
    UncommandedLiftOff = 2,
    /// The vehicle was released without clearance.
    UncommandedRelease = 3,
    /// The booster stayed on.
    NoSeparation = 4,
    /// The ignition gate did not open in time.
    Gate = 5,
    /// The landing motor was commanded to light and gave no thrust.
    NoLight = 6,
    /// The ascent motor did not lift the vehicle off.
    Other = 7,
}

impl Latch {
    /// The latch set by an accepted event, if any.
    pub fn of(event: &Event, before: Interlocks, after: Interlocks) -> Option<Self> {
        let latches = |of: fn(&Interlocks) -> bool| of(&after) && !of(&before);
        if !(latches(|locks| locks.abort_latched) || latches(|locks| locks.no_light_latched)) {
            return None;
        }
        Some(match event {
            Event::AbortRequested { .. } | Event::DisarmRequested { .. } => Self::Commanded,
            Event::LiftOff => Self::UncommandedLiftOff,
            Event::ReleasedEarly { .. } => Self::UncommandedRelease,
            Event::Apogee { .. } => Self::NoSeparation,
            Event::GateShutForGood { .. } => Self::Gate,
            Event::NoThrustTimeout => Self::NoLight,
            _ => Self::Other,
        })
    }
}

// The state of the landing motor, for a person who approaches the vehicle.
//
// An unignited motor stays dangerous on the ground: only software inhibits it, and after an
// ignition command it may ignite late. A burned-out motor is hot. The vehicle is not SAFED in
// either case.

/// Time for which a motor that was not ignited, or did not ignite on command, must not be
/// approached, s. The safety codes of the National Association of Rocketry require 60 s after the
/// last launch attempt. Here the time counts from touchdown, because that was the last shock to the
/// igniter line.
pub const MISFIRE_WAIT_S: f64 = 60.0;

/// Time for which a burned-out motor counts as hot, s. The value was chosen, not measured. It
/// equals the misfire wait, so that a crew has to remember only one number.
pub const MOTOR_HOT_S: f64 = 60.0;

/// The state of the landing motor.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub enum Motor {
    /// Never commanded to light.
    #[default]
    Unlit,
    /// Commanded to light; its thrust is not confirmed yet.
    Commanded,
    /// Its thrust is confirmed.
    Burning,
    /// Burnt out at this vehicle time, s.
    BurntOut { at_s: f64 },
}

/// The motor's state for a person near the vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum MotorStatus {
    /// Not ignited, with the pin in: the igniter line is cut by hand.
    PinIn,
    /// Not ignited, and inhibited by software only.
    Live,
    /// Commanded to light, or burning.
    Burning,
    /// Burnt out and hot.
    Hot,
    /// Burnt out and cooled.
    Burnt,
}

impl Mode {
    /// The motor's status at a vehicle time.
    pub fn motor_status(&self, time_s: f64) -> MotorStatus {
        // After "no light", and on the ground, the command no longer means that the motor burns; it
        // may still light late.
        let expected = self.phase == Phase::Ignition && !self.interlocks.no_light_latched;
        match self.motor {
            Motor::Burning => MotorStatus::Burning,
            Motor::Commanded if expected => MotorStatus::Burning,
            Motor::BurntOut { at_s } if time_s < at_s + MOTOR_HOT_S => MotorStatus::Hot,
            Motor::BurntOut { .. } => MotorStatus::Burnt,
            Motor::Unlit | Motor::Commanded if self.interlocks.pin_out => MotorStatus::Live,
            Motor::Unlit | Motor::Commanded => MotorStatus::PinIn,
        }
    }

    /// Time until the vehicle may be approached, s, 0 if it may be now; `None` while this is
    /// unknown: armed, in the air, or with a burning motor.
    pub fn approach_wait_s(&self, time_s: f64) -> Option<f64> {
        // Never longer than the wait itself, as a sum of times could be by rounding.
        let left = |since_s: f64, wait_s: f64| Some((wait_s - (time_s - since_s)).max(0.0));
        match (self.phase, self.motor_status(time_s)) {
            (Phase::Safe | Phase::PadIdle, _) => Some(self.pad_wait_remaining_s(time_s).unwrap_or(0.0)),
            // The vehicle is never SAFED before the wait is over.
            (Phase::Safed, _) | (Phase::Touchdown, MotorStatus::Burnt) => Some(0.0),
            (Phase::Touchdown, MotorStatus::Live | MotorStatus::PinIn) => {
                left(self.entered_at_s, MISFIRE_WAIT_S)
            }
            (Phase::Touchdown, MotorStatus::Hot) => match self.motor {
                Motor::BurntOut { at_s } => left(at_s, MOTOR_HOT_S),
                _ => None,
            },
            _ => None,
        }
    }

    /// Whether the vehicle on the ground may become SAFED.
    ///
    /// # Errors
    /// Why its motor is still dangerous.
    pub fn may_be_safed(&self, time_s: f64) -> Result<(), Refusal> {
        match self.motor_status(time_s) {
            MotorStatus::Live => Err(Refusal::MotorLive),
            MotorStatus::Burning => Err(Refusal::MotorBurning),
            MotorStatus::Hot => Err(Refusal::MotorHot),
            // The pin was put in too soon: only time ends the danger of a late light, not the pin.
            MotorStatus::PinIn if self.approach_wait_s(time_s) != Some(0.0) => Err(Refusal::MisfireWait),
            MotorStatus::PinIn | MotorStatus::Burnt => Ok(()),
        }
    }
}
