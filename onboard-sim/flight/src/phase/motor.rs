//! What is known of the landing motor, for whoever walks up to the vehicle.
//!
//! A motor that was not lit stays dangerous on the ground: nothing but software keeps it from lighting, and one that
//! was commanded may light late. A burnt one is hot. SAFED is claimed of neither.

use super::{Mode, Phase, Refusal};

/// How long nobody approaches a motor that was not lit or was commanded in vain, s. The safety codes of the National
/// Association of Rocketry ask for 60 s after the last launch attempt; here it counts from the touchdown, the last
/// shock that the igniter line has had.
pub const MISFIRE_WAIT_S: f64 = 60.0;

/// How long a burnt motor counts as hot, s. Chosen, not measured, and as long as the misfire wait: a crew remembers
/// one number.
pub const MOTOR_HOT_S: f64 = 60.0;

/// Where the landing motor is in its life.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Motor {
    /// Never commanded to light.
    #[default]
    Unlit,
    /// Commanded to light; its thrust was not confirmed yet.
    Commanded,
    /// Its thrust was confirmed.
    Burning,
    /// Burnt out at this vehicle time, s.
    BurntOut {
        /// When, s.
        at_s: f64,
    },
}

/// What a person near the vehicle has to know of the landing motor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MotorStatus {
    /// Not lit, and the pin is in: the igniter line is cut by hand.
    PinIn,
    /// Not lit, and nothing but software keeps it from it.
    Live,
    /// Commanded to light, or burning.
    Burning,
    /// Burnt out, and hot.
    Hot,
    /// Burnt out and cooled.
    Burnt,
}

impl Mode {
    /// What is known of the landing motor at a vehicle time.
    pub fn motor_status(&self, time_s: f64) -> MotorStatus {
        // After "no light", and on the ground, a command is no sign of a fire any more; a late one still may come.
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

    /// Time before anybody may approach the vehicle, s, 0 when free; `None` while that cannot be said: armed, in the
    /// air, or with a motor that burns.
    pub fn approach_wait_s(&self, time_s: f64) -> Option<f64> {
        let until = |end_s: f64| Some((end_s - time_s).max(0.0));
        match (self.phase, self.motor_status(time_s)) {
            (Phase::Safe | Phase::PadIdle, _) => Some(self.pad_wait_remaining_s(time_s).unwrap_or(0.0)),
            // Nothing becomes SAFED before the wait is over.
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

    /// Whether the vehicle on the ground may be called SAFED.
    ///
    /// # Errors
    /// What is still dangerous about its motor.
    pub fn may_be_safed(&self, time_s: f64) -> Result<(), Refusal> {
        match self.motor_status(time_s) {
            MotorStatus::Live => Err(Refusal::MotorLive),
            MotorStatus::Burning => Err(Refusal::MotorBurning),
            MotorStatus::Hot => Err(Refusal::MotorHot),
            // Somebody has put the pin in too soon: a late light is a matter of time, not of the pin.
            MotorStatus::PinIn if self.approach_wait_s(time_s) != Some(0.0) => Err(Refusal::MisfireWait),
            MotorStatus::PinIn | MotorStatus::Burnt => Ok(()),
        }
    }
}
