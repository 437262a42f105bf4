//! The dialog that takes the keys: typing the word that arms, starts or quits, or confirming a disarm.

use std::time::Duration;

use super::two_person::Ask;

/// How long the crew has to type the word that arms.
pub const ARM_TIME_LIMIT: Duration = Duration::from_secs(10);
pub const ARM_WORD: &str = "ARM";
/// How long the crew has to type the word that starts.
pub const START_TIME_LIMIT: Duration = Duration::from_secs(10);
/// The word that starts the countdown.
pub const START_WORD: &str = "START";
/// The word that confirms what another operator asks.
pub const CONFIRM_WORD: &str = "CONFIRM";
/// The word that takes command.
pub const TAKE_WORD: &str = "TAKE";
/// The word that aborts a vehicle with another autopilot.
pub const ABORT_WORD: &str = "ABORT";
/// How long the crew has to confirm a disarm.
pub const CONFIRM_TIME_LIMIT: Duration = Duration::from_secs(5);
/// How long the crew has to type the word that quits.
pub const QUIT_TIME_LIMIT: Duration = Duration::from_secs(10);
/// The word that quits while the vehicle is armed or in flight.
pub const QUIT_WORD: &str = "QUIT";

/// The open dialog. It accepts the next letter of its word (in either case), or Enter after the whole word. Any other
/// key closes it. The abort chord works in every dialog.
#[derive(Debug, Clone, PartialEq)]
pub enum Dialog {
    Closed,
    /// The second step of arming: the word is typed.
    Arm {
        /// The beginning of [`ARM_WORD`] that has been typed.
        typed: String,
        until: Duration,
    },
    /// The word that starts the countdown is typed.
    Start {
        /// The beginning of [`START_WORD`] that has been typed.
        typed: String,
        until: Duration,
    },
    /// The word that confirms another operator's ask is typed.
    Confirm {
        /// The ask: that one and no other is confirmed.
        ask: Ask,
        typed: String,
        until: Duration,
    },
    /// The word that takes command is typed.
    TakeCommand {
        typed: String,
        until: Duration,
    },
    Disarm {
        until: Duration,
    },
    /// An abort of a vehicle with another autopilot: the word is typed after what it would do there was read.
    AbortForeign {
        typed: String,
        until: Duration,
    },
    Hold {
        until: Duration,
    },
    /// Checks the vehicle on its pad.
    Check {
        /// Gimbal and fins move.
        moves: bool,
        until: Duration,
    },
    /// Signs a step of the checklist, or takes its signature back.
    Sign {
        /// Counted from zero.
        step: usize,
        void: bool,
        until: Duration,
    },
    /// The word that quits is typed, because the vehicle is armed or in flight.
    Quit {
        /// The beginning of [`QUIT_WORD`] that has been typed.
        typed: String,
        until: Duration,
    },
}

impl Dialog {
    pub fn arm(now: Duration) -> Self {
        Self::Arm { typed: String::new(), until: now + ARM_TIME_LIMIT }
    }

    pub fn start(now: Duration) -> Self {
        Self::Start { typed: String::new(), until: now + START_TIME_LIMIT }
    }

    pub fn confirm(ask: Ask, now: Duration) -> Self {
        Self::Confirm { ask, typed: String::new(), until: now + ask.left }
    }

    pub fn take_command(now: Duration) -> Self {
        Self::TakeCommand { typed: String::new(), until: now + ARM_TIME_LIMIT }
    }

    pub fn hold(now: Duration) -> Self {
        Self::Hold { until: now + CONFIRM_TIME_LIMIT }
    }

    pub fn check(moves: bool, now: Duration) -> Self {
        Self::Check { moves, until: now + CONFIRM_TIME_LIMIT }
    }

    pub fn sign(step: usize, void: bool, now: Duration) -> Self {
        Self::Sign { step, void, until: now + CONFIRM_TIME_LIMIT }
    }

    pub fn abort_foreign(now: Duration) -> Self {
        Self::AbortForeign { typed: String::new(), until: now + ARM_TIME_LIMIT }
    }

    pub fn disarm(now: Duration) -> Self {
        Self::Disarm { until: now + CONFIRM_TIME_LIMIT }
    }

    pub fn quit(now: Duration) -> Self {
        Self::Quit { typed: String::new(), until: now + QUIT_TIME_LIMIT }
    }

    /// When the dialog closes by itself.
    pub fn until(&self) -> Option<Duration> {
        match self {
            Self::Closed => None,
            Self::Arm { until, .. }
            | Self::Start { until, .. }
            | Self::Confirm { until, .. }
            | Self::TakeCommand { until, .. }
            | Self::AbortForeign { until, .. }
            | Self::Disarm { until }
            | Self::Hold { until }
            | Self::Check { until, .. }
            | Self::Sign { until, .. }
            | Self::Quit { until, .. } => Some(*until),
        }
    }

    /// The name for the list of events.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Closed => "nothing",
            Self::Arm { .. } => "arming",
            Self::Start { .. } => "start",
            Self::Confirm { .. } => "confirmation",
            Self::TakeCommand { .. } => "take-over",
            Self::AbortForeign { .. } => "abort",
            Self::Disarm { .. } => "disarm",
            Self::Hold { .. } => "hold",
            Self::Check { .. } => "check",
            Self::Sign { void: false, .. } => "signature",
            Self::Sign { void: true, .. } => "voiding",
            Self::Quit { .. } => "quit",
        }
    }

    /// The word to type; `None` where Enter alone confirms.
    pub fn word(&self) -> Option<&'static str> {
        match self {
            Self::Closed
            | Self::Disarm { .. }
            | Self::Hold { .. }
            | Self::Check { .. }
            | Self::Sign { .. } => None,
            Self::Confirm { .. } => Some(CONFIRM_WORD),
            Self::TakeCommand { .. } => Some(TAKE_WORD),
            Self::AbortForeign { .. } => Some(ABORT_WORD),
            Self::Arm { .. } => Some(ARM_WORD),
            Self::Start { .. } => Some(START_WORD),
            Self::Quit { .. } => Some(QUIT_WORD),
        }
    }

    /// Whether Enter now confirms.
    pub fn is_complete(&self) -> bool {
        match self {
            Self::Closed => false,
            Self::Disarm { .. } | Self::Hold { .. } | Self::Check { .. } | Self::Sign { .. } => true,
            Self::Arm { typed, .. }
            | Self::Start { typed, .. }
            | Self::Confirm { typed, .. }
            | Self::TakeCommand { typed, .. }
            | Self::AbortForeign { typed, .. }
            | Self::Quit { typed, .. } => self.word().is_some_and(|word| word.len() == typed.len()),
        }
    }

    /// Takes a letter. Returns whether it is the next letter of the word.
    pub fn take(&mut self, letter: char) -> bool {
        let Some(word) = self.word() else { return false };
        let (Self::Arm { typed, .. }
        | Self::Start { typed, .. }
        | Self::Confirm { typed, .. }
        | Self::TakeCommand { typed, .. }
        | Self::AbortForeign { typed, .. }
        | Self::Quit { typed, .. }) = self
        else {
            return false;
        };
        let fits = word.chars().nth(typed.len()).is_some_and(|next| next.eq_ignore_ascii_case(&letter));
        if fits {
            typed.push(letter);
        }
        fits
    }
}
