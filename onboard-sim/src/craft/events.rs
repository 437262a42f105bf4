//! What a craft reports as it goes.

use flight::controller::{ControllerInput, ControllerOutput};
use flight::phase::Phase;
use flight::verdict::LandingVerdict;

use crate::plant::Impact;

/// How grave a text is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// As planned.
    Info,
    /// Worth noticing.
    Notice,
    /// Not as planned.
    Warning,
    /// Something failed or was refused for a fault.
    Error,
    /// The vehicle is at stake.
    Critical,
}

/// One controller tick, whole.
#[derive(Debug, Clone, PartialEq)]
pub struct Tick {
    /// What it was given.
    pub input: ControllerInput,
    /// What it decided.
    pub output: ControllerOutput,
    /// Digest of the controller's memory afterwards.
    pub state_digest: u64,
    /// Measured, s.
    pub solve_time_s: f64,
    /// Allowed, s.
    pub deadline_s: f64,
}

/// Something a vehicle reports.
#[derive(Debug, Clone, PartialEq)]
pub enum VehicleEvent {
    /// Words for the crew.
    Text {
        /// How grave.
        severity: Severity,
        /// The words.
        text: String,
    },
    /// The phase changed.
    PhaseChanged {
        /// From.
        from: Phase,
        /// To.
        to: Phase,
    },
    /// The controller ran.
    Tick(Box<Tick>),
    /// The flight computer from apogee ran a frame with a plan in it.
    Planned {
        /// The frame's number, from apogee.
        frame: u64,
        /// Its time since apogee, s.
        time_s: f64,
        /// Measured, s.
        took_s: f64,
        /// Allowed, s.
        deadline_s: f64,
    },
    /// Touched down and judged.
    Verdict {
        /// The contact that was judged.
        impact: Impact,
        /// Limit by limit.
        verdict: Box<LandingVerdict>,
    },
}
