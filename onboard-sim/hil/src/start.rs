//! What begins a flight of hardware in the loop.

use flight::vehicle::rigid::RigidState;

/// Who waits for whom.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pace {
    /// The world waits for each answer.
    Lockstep,
    /// A frame every 5 ms of the world's clock.
    RealTime,
}

/// The beginning of a flight in the air, or on the rail: the computer starts anew and is released at once.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Start {
    /// Random: another number is another flight.
    pub flight_id: u32,
    /// The computer's estimate of its state, in full precision.
    pub believed: RigidState,
    pub pace: Pace,
}
