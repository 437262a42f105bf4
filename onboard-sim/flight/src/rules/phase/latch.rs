//! Why the landing motor is inhibited for good.

use serde::{Deserialize, Serialize};

use super::{Event, Interlocks};

/// What has latched an abort, or the inhibition of a landing motor that gave no thrust.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[repr(u8)]
pub enum Latch {
    /// An abort of the crew.
    Commanded = 1,
    /// The vehicle lifted off although nobody had armed it.
    UncommandedLiftOff = 2,
    /// It was released although nobody had cleared the release.
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
    /// What an accepted event has latched; `None` if it has latched nothing.
    pub fn of(event: &Event, before: Interlocks, after: Interlocks) -> Option<Self> {
        let latches = |of: fn(&Interlocks) -> bool| of(&after) && !of(&before);
        if !(latches(|locks| locks.abort_latched) || latches(|locks| locks.no_light_latched)) {
            return None;
        }
        Some(match event {
            Event::AbortRequested { .. } => Self::Commanded,
            Event::LiftOff => Self::UncommandedLiftOff,
            Event::ReleasedEarly { .. } => Self::UncommandedRelease,
            Event::Apogee { .. } => Self::NoSeparation,
            Event::GateShutForGood { .. } => Self::Gate,
            Event::NoThrustTimeout => Self::NoLight,
            _ => Self::Other,
        })
    }
}
