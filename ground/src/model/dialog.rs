//! What the keyboard talks to.

use std::time::Duration;

/// Time to type the word after opening the arming dialog.
pub const ARM_TIME_LIMIT: Duration = Duration::from_secs(10);
/// The word that arms.
pub const ARM_WORD: &str = "ARM";
/// Time to confirm a start or a disarming.
pub const CONFIRM_TIME_LIMIT: Duration = Duration::from_secs(5);
/// Time for the second press that quits.
pub const QUIT_TIME_LIMIT: Duration = Duration::from_secs(3);

/// The open dialog, which takes the keys. The abort chord works in every one of them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Dialog {
    /// None.
    Closed,
    /// Second step of arming: the word is typed.
    Arm {
        /// What was typed so far.
        typed: String,
        /// When the offer ends.
        until: Duration,
    },
    /// Enter starts the countdown.
    Start {
        /// When the offer ends.
        until: Duration,
    },
    /// Enter disarms.
    Disarm {
        /// When the offer ends.
        until: Duration,
    },
    /// A second press quits although the vehicle is armed or flying.
    Quit {
        /// When the offer ends.
        until: Duration,
    },
}

impl Dialog {
    /// When the dialog closes by itself.
    pub fn until(&self) -> Option<Duration> {
        match self {
            Self::Closed => None,
            Self::Arm { until, .. }
            | Self::Start { until }
            | Self::Disarm { until }
            | Self::Quit { until } => Some(*until),
        }
    }
}
