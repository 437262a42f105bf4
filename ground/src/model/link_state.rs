//! Whether one direction of the link works, by the age of the last frame that arrived on it.

use std::time::Duration;

/// After this long without a frame a direction of the link is doubtful: one and a half heartbeat periods.
pub const AMBER_AFTER: Duration = Duration::from_millis(1_500);
/// After longer than this without a frame a direction of the link is lost: three heartbeat periods.
pub const RED_AFTER: Duration = Duration::from_secs(3);

/// The state of one direction of the link, with the age of its last frame. Reports of a radio about itself do not
/// count.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LinkState {
    NeverHeard,
    Alive(Duration),
    Doubtful(Duration),
    Lost(Duration),
}

impl LinkState {
    /// The state that follows from the time of the last frame.
    pub fn of(last_at: Option<Duration>, now: Duration) -> Self {
        let Some(at) = last_at else { return Self::NeverHeard };
        let age = now.saturating_sub(at);
        if age > RED_AFTER {
            Self::Lost(age)
        } else if age >= AMBER_AFTER {
            Self::Doubtful(age)
        } else {
            Self::Alive(age)
        }
    }

    /// Whether a command can be expected to arrive.
    pub fn carries(self) -> bool {
        matches!(self, Self::Alive(_) | Self::Doubtful(_))
    }
}
