//! What the shadow found different from what it expects.

use serde::Serialize;

/// A check of the shadow.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Check {
    /// The strength of the landing motor, as the vehicle has estimated it.
    MotorStrength,
    /// The acceleration along the nose during the burn, against the certified curve.
    Thrust,
    /// The gimbal's angle against its command.
    Gimbal,
    /// The turning of the vehicle against the gimbal's command.
    Turning,
    /// The fins' angles against their commands.
    Fins,
    /// The height chosen for the ignition, against that of the flight computer of this build.
    Ignition,
}

impl Check {
    /// Every check, in the order in which they are listed.
    pub const ALL: [Self; 6] =
        [Self::MotorStrength, Self::Thrust, Self::Gimbal, Self::Turning, Self::Fins, Self::Ignition];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::MotorStrength => "motor strength",
            Self::Thrust => "thrust",
            Self::Gimbal => "gimbal",
            Self::Turning => "turning",
            Self::Fins => "fins",
            Self::Ignition => "ignition height",
        }
    }
}

/// One difference. A check flags the same signal once in a flight.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Flag {
    /// When the frame arrived that shows it, s on the caller's clock.
    pub time_s: f64,
    /// The vehicle's time in that frame, s since its power-up.
    pub boot_s: f64,
    pub check: Check,
    /// Message and field, for example `TD_GIMBAL.pitch_measured`.
    pub signal: &'static str,
    pub found: f64,
    /// What the flight computer of this build expects or commands.
    pub expected: f64,
    pub unit: &'static str,
    /// What that means, in a sentence.
    pub means: String,
}

impl std::fmt::Display for Flag {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { check, signal, found, expected, unit, means, .. } = self;
        let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
        write!(f, "{}: {signal} {found:.3}{unit}, expected {expected:.3}{unit}: {means}", check.name())
    }
}
