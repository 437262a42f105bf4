//! Past states of the vehicle, so that the crew can look back during a flight.

use std::time::Duration;

use super::flown_path::{FlownPath, every_second};
use super::vehicle::Vehicle;

/// The most states; when they are full, every second one is dropped.
const KEPT: usize = 400;
/// How often a state is kept.
const STEP: Duration = Duration::from_millis(500);
/// A look back ends by itself after this time without a key.
pub const LOOKS_FOR: Duration = Duration::from_secs(10);

/// The states since the countdown, oldest first, without their paths.
#[derive(Debug, Clone, Default)]
pub struct Recall {
    states: Vec<(Duration, Vehicle)>,
}

/// The crew looks at this moment of the past.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LookBack {
    pub at: Duration,
    /// Then the screen is live again.
    pub until: Duration,
}

impl Recall {
    /// Keeps a state, if one is due.
    pub(crate) fn note(&mut self, vehicle: &Vehicle, now: Duration) {
        if self.states.last().is_some_and(|(at, _)| now < *at + STEP) {
            return;
        }
        if self.states.len() >= KEPT {
            every_second(&mut self.states);
        }
        let lean = Vehicle { flown: FlownPath::default(), burn: FlownPath::default(), ..vehicle.clone() };
        self.states.push((now, lean));
    }

    /// The last state at or before a time, or the first, with its time and the path flown until then.
    pub fn at(&self, at: Duration, present: &Vehicle) -> Option<(Duration, Vehicle)> {
        let after = self.states.partition_point(|(time, _)| *time <= at);
        let (time, state) = self.states.get(after.saturating_sub(1))?;
        let (flown, burn) = (present.flown.until(*time), present.burn.until(*time));
        Some((*time, Vehicle { flown, burn, ..state.clone() }))
    }

    /// When the first state was kept.
    pub fn begin(&self) -> Option<Duration> {
        self.states.first().map(|(at, _)| *at)
    }
}
