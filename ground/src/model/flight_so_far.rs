//! How the flight ended, as far as the ground has seen it; the exit code follows from it.

use std::time::Duration;

/// How the flight has gone so far.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FlightSoFar {
    /// The vehicle has left the pad (or the simulation was released).
    pub started: bool,
    /// When the vehicle latched an abort.
    pub aborted_at: Option<Duration>,
    /// The last arming or start was refused: the reason and the time.
    pub refusal: Option<(String, Duration)>,
    /// The vehicle's verdict (whether it landed inside every limit) and its time.
    pub verdict: Option<(bool, Duration)>,
    /// When the vehicle reached SAFED after a flight.
    pub safed_at: Option<Duration>,
    /// Why the run cannot continue.
    pub error: Option<String>,
}
