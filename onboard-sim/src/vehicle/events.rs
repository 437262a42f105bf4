//! What a vehicle reports as it goes.

use flight::computer::news::{News, Severity};
use flight::computer::plane::PlanarTick;
use flight::rules::phase::Phase;
use flight::rules::verdict::LandingVerdict;

use sim::plane::plant::Impact;

/// One tick of the planar vehicle's landing controller, and how long it took.
#[derive(Debug, Clone, PartialEq)]
pub struct Tick {
    pub tick: PlanarTick,
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
    PhaseChanged {
        from: Phase,
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

impl From<News> for VehicleEvent {
    fn from(news: News) -> Self {
        match news {
            News::Said { severity, words } => Self::Text { severity, text: words },
            News::PhaseChanged { from, to } => Self::PhaseChanged { from, to },
        }
    }
}
