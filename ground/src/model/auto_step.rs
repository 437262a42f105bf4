//! How far the automatic mode has come.

use std::time::Duration;

/// After a temporary refusal, what the vehicle says about its checks is believed again only after this.
const RETRY_AFTER: Duration = Duration::from_secs(1);

/// The steps of the automatic mode.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum AutoStep {
    /// Waits until the checks pass; after a temporary refusal, also until this time.
    WaitForReady {
        not_before: Duration,
    },
    WaitForArmed,
    Done,
}

impl Default for AutoStep {
    fn default() -> Self {
        Self::WaitForReady { not_before: Duration::ZERO }
    }
}

impl AutoStep {
    /// The vehicle has temporarily refused to arm. Returns whether the automatic mode will command it again once the
    /// checks pass, as a new command and never by resending the old frame.
    pub(crate) fn retry_after_refusal(&mut self, now: Duration) -> bool {
        let retries = *self == Self::WaitForArmed;
        if retries {
            *self = Self::WaitForReady { not_before: now + RETRY_AFTER };
        }
        retries
    }
}
