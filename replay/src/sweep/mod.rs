//! Flies many settings over many flights in closed loop and ranks them by the worst flight's margin.
//!
//! A point is one choice of every varied setting; a job is one point on one flight. Jobs are independent and their
//! results are put in the order of the points, so the answer does not depend on how many run at the same time. With a
//! state file every finished job is kept, and a sweep that was stopped can be continued.

mod bisect;
mod run;
mod state;
mod vary;

pub use bisect::{BisectError, BisectOptions, BisectReport, Flip, RefusedValue, bisect};
pub use run::{Progress, sweep};
pub use state::{State, StateError};
pub use vary::{Choice, Vary, VaryError, grid, random};

use serde::Serialize;

use crate::refly::ReflyError;

/// Why a sweep could not be finished.
#[derive(Debug, thiserror::Error)]
pub enum SweepError {
    /// A flight cannot be flown again at some point.
    #[error("{settings}")]
    Refly {
        /// The settings of the point.
        settings: String,
        /// What is wrong.
        source: Box<ReflyError>,
    },
    /// The state file cannot be used.
    #[error(transparent)]
    State(#[from] StateError),
}

/// The outcome of one flight at one point.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FlightOutcome {
    /// Inside every touchdown limit.
    pub landed: bool,
    /// Distance to the nearest limit as a fraction of it; see [`ReflyReport::margin`](crate::refly::ReflyReport).
    /// `None` if the vehicle did not come down.
    pub margin: Option<f64>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PointOutcome {
    /// Its number among the points.
    pub point: usize,
    pub settings: Vec<String>,
    /// Flights that landed.
    pub landed: usize,
    /// The worst flight's margin; `None` if one did not come down.
    pub worst_margin: Option<f64>,
    pub worst_flight: String,
    /// Every flight, in the order given.
    pub flights: Vec<FlightOutcome>,
}

/// The result of a sweep.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SweepReport {
    /// Marks the report as closed loop.
    pub kind: &'static str,
    pub flights: Vec<String>,
    /// The flights of this run that this build, with nothing changed, does not fly as recorded.
    pub not_reproduced: Vec<String>,
    /// The points, the best first.
    pub points: Vec<PointOutcome>,
}

impl SweepReport {
    /// Ranks the points by largest worst-case margin, then by number of landings, then in the given order.
    fn ranked(flights: Vec<String>, not_reproduced: Vec<String>, mut points: Vec<PointOutcome>) -> Self {
        let margin = |point: &PointOutcome| point.worst_margin.unwrap_or(f64::NEG_INFINITY);
        points.sort_by(|a, b| {
            margin(b).total_cmp(&margin(a)).then(b.landed.cmp(&a.landed)).then(a.point.cmp(&b.point))
        });
        Self { kind: "closed loop: flown again in simulation", flights, not_reproduced, points }
    }
}
