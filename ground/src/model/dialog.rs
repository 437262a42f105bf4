//! What the keyboard talks to.

use std::time::Duration;

/// Time to type the word after opening the arming dialog.
pub const ARM_TIME_LIMIT: Duration = Duration::from_secs(10);
/// The word that arms.
pub const ARM_WORD: &str = "ARM";
/// Time to type the word that starts.
pub const START_TIME_LIMIT: Duration = Duration::from_secs(10);
/// The word that starts the countdown.
pub const START_WORD: &str = "START";
/// Time to confirm a disarming.
pub const CONFIRM_TIME_LIMIT: Duration = Duration::from_secs(5);
/// Time to type the word that quits.
pub const QUIT_TIME_LIMIT: Duration = Duration::from_secs(10);
/// The word that quits while the vehicle is armed or in flight.
pub const QUIT_WORD: &str = "QUIT";

/// The open dialog, which takes the keys: the next letter of its word (in either case), or Enter behind the whole word.
/// Any other key closes it. The abort chord works in every one of them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Dialog {
    /// None.
    Closed,
    /// Second step of arming: the word is typed.
    Arm {
        /// What was typed so far: the beginning of [`ARM_WORD`].
        typed: String,
        /// When the offer ends.
        until: Duration,
    },
    /// The word that starts the countdown is typed.
    Start {
        /// What was typed so far: the beginning of [`START_WORD`].
        typed: String,
        /// When the offer ends.
        until: Duration,
    },
    /// Enter disarms.
    Disarm {
        /// When the offer ends.
        until: Duration,
    },
    /// The word that quits although the vehicle is armed or flying is typed.
    Quit {
        /// What was typed so far: the beginning of [`QUIT_WORD`].
        typed: String,
        /// When the offer ends.
        until: Duration,
    },
}

impl Dialog {
    /// Offers to arm.
    pub fn arm(now: Duration) -> Self {
        Self::Arm { typed: String::new(), until: now + ARM_TIME_LIMIT }
    }

    /// Offers to start.
    pub fn start(now: Duration) -> Self {
        Self::Start { typed: String::new(), until: now + START_TIME_LIMIT }
    }

    /// Offers to disarm.
    pub fn disarm(now: Duration) -> Self {
        Self::Disarm { until: now + CONFIRM_TIME_LIMIT }
    }

    /// Offers to quit.
    pub fn quit(now: Duration) -> Self {
        Self::Quit { typed: String::new(), until: now + QUIT_TIME_LIMIT }
    }

    /// When the dialog closes by itself.
    pub fn until(&self) -> Option<Duration> {
        match self {
            Self::Closed => None,
            Self::Arm { until, .. }
            | Self::Start { until, .. }
            | Self::Disarm { until }
            | Self::Quit { until, .. } => Some(*until),
        }
    }

    /// What is offered, for the list of events.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Closed => "nothing",
            Self::Arm { .. } => "arming",
            Self::Start { .. } => "start",
            Self::Disarm { .. } => "disarm",
            Self::Quit { .. } => "quit",
        }
    }

    /// The word that is wanted; `None` where Enter alone does.
    pub fn word(&self) -> Option<&'static str> {
        match self {
            Self::Closed | Self::Disarm { .. } => None,
            Self::Arm { .. } => Some(ARM_WORD),
            Self::Start { .. } => Some(START_WORD),
            Self::Quit { .. } => Some(QUIT_WORD),
        }
    }

    /// Whether Enter does it now.
    pub fn is_complete(&self) -> bool {
        match self {
            Self::Closed => false,
            Self::Disarm { .. } => true,
            Self::Arm { typed, .. } | Self::Start { typed, .. } | Self::Quit { typed, .. } => {
                self.word().is_some_and(|word| word.len() == typed.len())
            }
        }
    }

    /// Takes a letter. Returns whether it is the next one of the word.
    pub fn take(&mut self, letter: char) -> bool {
        let Some(word) = self.word() else { return false };
        let (Self::Arm { typed, .. } | Self::Start { typed, .. } | Self::Quit { typed, .. }) = self else {
            return false;
        };
        let fits = word.chars().nth(typed.len()).is_some_and(|next| next.eq_ignore_ascii_case(&letter));
        if fits {
            typed.push(letter);
        }
        fits
    }
}
