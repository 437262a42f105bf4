//! The events that a vehicle reports.

use flight::computer::news::{News, Severity};
use flight::rules::phase::Phase;
use flight::rules::verdict::LandingVerdict;

use super::Impact;

/// An event that a vehicle reports.
#[derive(Debug, Clone, PartialEq)]
pub enum VehicleEvent {
    /// A message to the crew.
    Text {
        severity: Severity,
        text: String,
    },
    PhaseChanged {
        from: Phase,
        to: Phase,
    },
    /// The pilot planned in this frame.
    Planned {
        /// The frame's number, from the release.
        frame: u64,
        /// Its time since the release, s.
        time_s: f64,
        /// Measured, s.
        took_s: f64,
        /// Allowed, s.
        deadline_s: f64,
    },
    /// The vehicle touched down and its landing was judged.
    Verdict {
        /// The contact that was judged.
        impact: Impact,
        /// The verdict, limit by limit.
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
