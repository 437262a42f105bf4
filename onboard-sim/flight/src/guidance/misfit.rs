//! Whether a vehicle weighs what its motor can land.

use crate::guidance::vertical::EvenLanding;

/// Why no height lands a vehicle on its motor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Misfit {
    #[error("too heavy for its motor: the thrust does not stop it")]
    TooHeavy,
    #[error("too light for its motor: no height lands it")]
    TooLight,
}

impl Misfit {
    /// From this tilt on, rad, a vehicle that throws away thrust all the way down has nothing left for a motor that is stronger.
    /// 62 degrees.
    pub const MOST_TILT_RAD: f64 = 1.082;

    /// That of the even landing of a vehicle, if it has one.
    pub fn of(landing: &EvenLanding) -> Option<Self> {
        match landing.tilt_rad {
            None => Some(Self::TooHeavy),
            Some(tilt_rad) if tilt_rad > Self::MOST_TILT_RAD => Some(Self::TooLight),
            Some(_) => None,
        }
    }
}
