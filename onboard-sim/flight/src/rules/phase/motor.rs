//! The state of the landing motor, for a person who approaches the vehicle.
//!
//! A motor that was not lit stays dangerous on the ground: only software keeps it from lighting, and after an ignition
//! command it may light late. A burnt motor is hot. The vehicle is not SAFED in either case.

use super::{Mode, Phase, Refusal};
use serde::{Deserialize, Serialize};

/// How long nobody may approach a motor that was not lit or did not light on command, s. The safety codes of the
/// National Association of Rocketry ask for 60 s after the last launch attempt. Here the time counts from the
/// touchdown, because that was the last shock to the igniter line.
pub const MISFIRE_WAIT_S: f64 = 60.0;

/// How long a burnt motor counts as hot, s. The value was chosen, not measured. It equals the misfire wait, so that a
/// crew has to remember only one number.
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
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MotorStatus {
    /// Not lit, and the pin is in: the igniter line is cut by hand.
    PinIn,
    /// Not lit, and only software keeps it from lighting.
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
        // After "no light", and on the ground, the command no longer means that the motor burns; it may still light
        // late.
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

    /// Time until the vehicle may be approached, s, 0 if it may be now; `None` while this is unknown: armed, in the
    /// air, or with a burning motor.
    pub fn approach_wait_s(&self, time_s: f64) -> Option<f64> {
        let until = |end_s: f64| Some((end_s - time_s).max(0.0));
        match (self.phase, self.motor_status(time_s)) {
            (Phase::Safe | Phase::PadIdle, _) => Some(self.pad_wait_remaining_s(time_s).unwrap_or(0.0)),
            // The vehicle is never SAFED before the wait is over.
            (Phase::Safed, _) | (Phase::Touchdown, MotorStatus::Burnt) => Some(0.0),
            (Phase::Touchdown, MotorStatus::Live | MotorStatus::PinIn) => {
                until(self.entered_at_s + MISFIRE_WAIT_S)
            }
            (Phase::Touchdown, MotorStatus::Hot) => match self.motor {
                Motor::BurntOut { at_s } => until(at_s + MOTOR_HOT_S),
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
