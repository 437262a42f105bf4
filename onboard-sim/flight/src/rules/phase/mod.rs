//! The flight phases, the events that change them, and the one table of all transitions.
//!
//! [`transition`] is a pure function: it takes a mode and an event, and returns a mode and effects, or a [`Refusal`] in
//! words. The vehicle lights a motor on the way down, which staging electronics forbid for good reason. So the table is
//! explicit and conservative: only one line of it lights the landing motor, once, and only if every interlock allows
//! it.

mod event;
mod hold;
mod latch;
mod motor;
mod transition;

pub use crate::vehicle::mission::StartPoint;
pub use event::{Effect, Effects, Event, Refusal};
pub use hold::{HOLD_LIMIT_S, Hold, HoldCause, LAST_HOLD_S, UPLINK_SILENT_S};
pub use latch::Latch;
pub use motor::{MISFIRE_WAIT_S, MOTOR_HOT_S, Motor, MotorStatus};
use serde::{Deserialize, Serialize};
pub use transition::{Transition, transition};

/// How long nobody may approach the pad after an abort there, s.
pub const PAD_ABORT_WAIT_S: f64 = 60.0;

/// Time after the ignition command at which missing thrust counts as "no light", s.
pub const NO_THRUST_TIMEOUT_S: f64 = 0.5;

/// The phase of the flight.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[repr(u8)]
pub enum Phase {
    /// Powered up, self-test not passed.
    Safe = 0,
    /// On the pad, self-test passed, disarmed.
    PadIdle = 1,
    /// On the pad, armed; a countdown may be running.
    PadArmed = 2,
    /// Under the ascent motor.
    Boost = 3,
    /// Rising without thrust.
    Coast = 4,
    /// Past apogee, fins opening.
    Deploy = 5,
    /// Falling on the fins.
    AeroDescent = 6,
    /// Falling, landing controller running, waiting for the ignition gate.
    LandArmed = 7,
    /// Landing motor commanded to light; entered at most once.
    Ignition = 8,
    /// Landing motor burning.
    Powered = 9,
    /// On the ground, thrust below weight.
    Touchdown = 10,
    /// On the ground, everything inhibited, and the vehicle safe to approach: the motor burnt out and cooled, or its
    /// pin in.
    Safed = 11,
    /// Under the parachute.
    Chute = 12,
}

impl Phase {
    /// Every phase, in index order.
    pub const ALL: [Self; 13] = [
        Self::Safe,
        Self::PadIdle,
        Self::PadArmed,
        Self::Boost,
        Self::Coast,
        Self::Deploy,
        Self::AeroDescent,
        Self::LandArmed,
        Self::Ignition,
        Self::Powered,
        Self::Touchdown,
        Self::Safed,
        Self::Chute,
    ];

    /// The name operators see.
    pub fn name(self) -> &'static str {
        match self {
            Self::Safe => "SAFE",
            Self::PadIdle => "PAD_IDLE",
            Self::PadArmed => "PAD_ARMED",
            Self::Boost => "BOOST",
            Self::Coast => "COAST",
            Self::Deploy => "DEPLOY",
            Self::AeroDescent => "AERO_DESCENT",
            Self::LandArmed => "LAND_ARMED",
            Self::Ignition => "IGNITION",
            Self::Powered => "POWERED",
            Self::Touchdown => "TOUCHDOWN",
            Self::Safed => "SAFED",
            Self::Chute => "CHUTE",
        }
    }

    /// The number sent over the air and written to logs, 0 to 12.
    pub fn index(self) -> u8 {
        self as u8
    }

    /// The phase of a number, or `None` above 12.
    pub fn from_index(index: u8) -> Option<Self> {
        Self::ALL.get(usize::from(index)).copied()
    }

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
    /// The landing motor must not be lit any more.
    pub landing_motor_inhibited: bool,
    /// An abort was accepted; nothing arms again until a restart.
    pub abort_latched: bool,
    /// The landing motor was commanded and gave no thrust in time.
    pub no_light_latched: bool,
    /// Aborted with the landing motor lit. The motor has no cut-off, so the vehicle lands on the ground below.
    pub lands_here: bool,
}

/// Phase, latches, countdown and motor: the whole state of the table.
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
        }
    }

    /// The same mode on a clock that is ahead by this much, s.
    #[must_use]
    pub fn on_clock_ahead_by(&self, ahead_s: f64) -> Self {
        Self {
            entered_at_s: self.entered_at_s + ahead_s,
            countdown_end_s: self.countdown_end_s.map(|end_s| end_s + ahead_s),
            hold: self.hold.map(|hold| Hold { at_s: hold.at_s + ahead_s, ..hold }),
            motor: match self.motor {
                Motor::BurntOut { at_s } => Motor::BurntOut { at_s: at_s + ahead_s },
                motor => motor,
            },
            ..*self
        }
    }

    /// Time left of the running countdown, s, never negative; `None` without a countdown.
    pub fn countdown_remaining_s(&self, time_s: f64) -> Option<f64> {
        self.countdown_end_s.map(|end_s| (end_s - time_s).max(0.0))
    }

    /// Time until the pad may be approached after an abort there, s; `None` unless that wait is running.
    pub fn pad_wait_remaining_s(&self, time_s: f64) -> Option<f64> {
        if !(self.interlocks.abort_latched && self.phase.on_pad()) {
            return None;
        }
        let remaining_s = self.entered_at_s + PAD_ABORT_WAIT_S - time_s;
        (remaining_s > 0.0).then_some(remaining_s)
    }
}

#[cfg(test)]
mod tests;
