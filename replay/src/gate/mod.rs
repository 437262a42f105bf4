//! Holds a directory of flights against a baseline: did this build make any of them worse?
//!
//! Each flight is verified (the recorded decisions, made again) and flown again closed loop. A flight is a log, or one
//! flight of a campaign's directory, which is flown again from its order and held against its row. The outcomes are
//! compared with those of a baseline file that an earlier run wrote. Flights are independent, so the answer does not
//! depend on how many are flown at the same time.

mod baseline;
mod campaign;
mod find;
mod fly;
mod judge;
mod run;
mod state;

pub use baseline::{Baseline, BaselineError};
pub use find::{Found, GateError, Skipped, find};
pub use judge::{Change, Judged, judge};
pub use run::{GateProgress, fly_all};
pub use state::GateState;

use serde::{Deserialize, Serialize};

/// Whether the recorded decisions are made again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Checked {
    /// All of them, bit for bit; of a campaign's flight, its row.
    Identical,
    /// Some differ.
    Diverged,
    /// The log is damaged, or not all of it can be made again.
    Unverified,
    /// The file holds no flight: no ticks and no frames, as an empty log or that of a ground station.
    NoFlight,
}

impl Checked {
    /// The word in the table.
    pub fn word(self) -> &'static str {
        match self {
            Self::Identical => "identical",
            Self::Diverged => "DIVERGED",
            Self::Unverified => "unverified",
            Self::NoFlight => "-",
        }
    }
}

/// How a flight ended when it was flown again.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Flown {
    pub landed: bool,
    /// In one sentence.
    pub ending: String,
    /// The smallest distance to a limit as a fraction of it; see [`margin`](crate::refly::margin). Text, because every
    /// reader reads text back as the same number.
    pub margin: Option<String>,
}

impl Flown {
    /// The margin as a number.
    pub fn margin(&self) -> Option<f64> {
        self.margin.as_ref()?.parse().ok()
    }
}

/// What this build makes of a flight.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// Which flight it is, by its content; `None` if the file has none, and in baselines of earlier releases.
    #[serde(default)]
    pub flight: Option<String>,
    pub checked: Checked,
    /// `None` if it did not come down, or cannot be flown again.
    pub flown: Option<Flown>,
    /// Why it was not verified or not flown again.
    pub problem: Option<String>,
}
