//! What became of the flight.

use std::time::Duration;

/// What became of the flight, as far as it was seen.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Outcome {
    /// The vehicle left the pad (or the simulation was released).
    pub started: bool,
    /// An abort is latched on the vehicle.
    pub aborted_at: Option<Duration>,
    /// The last arming or start was refused: what, and when.
    pub refusal: Option<(String, Duration)>,
    /// The vehicle's verdict arrived; whether it landed inside every limit.
    pub verdict: Option<(bool, Duration)>,
    /// The vehicle reached SAFED after a flight.
    pub safed_at: Option<Duration>,
    /// The run cannot go on: why.
    pub error: Option<String>,
}
