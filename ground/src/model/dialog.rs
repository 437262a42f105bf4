//! The dialog that takes the keys: typing the word that arms, starts or quits, or confirming a disarm.

use std::time::Duration;

use super::two_person::Ask;
use crate::key::Key;

/// How long the crew has to type the word that arms.
pub const ARM_TIME_LIMIT: Duration = Duration::from_secs(10);
pub const ARM_WORD: &str = "ARM";
/// How long the crew has to type the word that starts.
pub const START_TIME_LIMIT: Duration = Duration::from_secs(10);
/// The word that starts the countdown.
pub const START_WORD: &str = "START";
/// The word that confirms what another operator asks.
pub const CONFIRM_WORD: &str = "CONFIRM";
/// The word that arms and starts although the station's log is unfit.
pub const WITHOUT_LOG_WORD: &str = "NOLOG";
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
/// The key that confirms what was completed by keys that arrived faster than a hand types; no text contains it.
pub const AGAIN_KEY: Key = Key::CtrlY;
/// That key counts this long after the question: a paste has no such pause before it, and who reads first needs longer.
pub const AGAIN_AFTER: Duration = Duration::from_millis(500);
/// How long the crew has for that key.
pub const AGAIN_TIME_LIMIT: Duration = Duration::from_secs(10);
/// Letters of a word whose dialog does not open, or has closed, are swallowed for this long after the one before.
const REST_WITHIN: Duration = Duration::from_secs(1);

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
    /// The word that goes on without the station's log is typed.
    WithoutLog {
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
    /// Keys that arrived faster than a hand types have completed a dialog: [`AGAIN_KEY`] confirms it.
    Again {
        of: Box<Dialog>,
        /// The key counts from this time on.
        from: Duration,
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

    pub fn without_log(now: Duration) -> Self {
        Self::WithoutLog { typed: String::new(), until: now + ARM_TIME_LIMIT }
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

    /// The question whether the keys that completed this dialog were typed by a person.
    #[must_use]
    pub fn again(self, now: Duration) -> Self {
        Self::Again { of: Box::new(self), from: now + AGAIN_AFTER, until: now + AGAIN_TIME_LIMIT }
    }

    /// Whether it acts only on keys that were typed by hand, or else asks again. Whatever stops something acts at once.
    pub fn needs_a_hand(&self) -> bool {
        !matches!(self, Self::Hold { .. } | Self::Disarm { .. } | Self::AbortForeign { .. })
    }

    /// When the dialog closes by itself.
    pub fn until(&self) -> Option<Duration> {
        match self {
            Self::Closed => None,
            Self::Arm { until, .. }
            | Self::Start { until, .. }
            | Self::Confirm { until, .. }
            | Self::WithoutLog { until, .. }
            | Self::TakeCommand { until, .. }
            | Self::AbortForeign { until, .. }
            | Self::Disarm { until }
            | Self::Hold { until }
            | Self::Check { until, .. }
            | Self::Sign { until, .. }
            | Self::Quit { until, .. }
            | Self::Again { until, .. } => Some(*until),
        }
    }

    /// The name for the list of events.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Closed => "nothing",
            Self::Arm { .. } => "arming",
            Self::Start { .. } => "start",
            Self::Confirm { .. } => "confirmation",
            Self::WithoutLog { .. } => "going on without a log",
            Self::TakeCommand { .. } => "take-over",
            Self::AbortForeign { .. } => "abort",
            Self::Disarm { .. } => "disarm",
            Self::Hold { .. } => "hold",
            Self::Check { .. } => "check",
            Self::Sign { void: false, .. } => "signature",
            Self::Sign { void: true, .. } => "voiding",
            Self::Quit { .. } => "quit",
            Self::Again { of, .. } => of.name(),
        }
    }

    /// The word to type; `None` where Enter alone confirms.
    pub fn word(&self) -> Option<&'static str> {
        match self {
            Self::Closed
            | Self::Disarm { .. }
            | Self::Hold { .. }
            | Self::Check { .. }
            | Self::Sign { .. }
            | Self::Again { .. } => None,
            Self::Confirm { .. } => Some(CONFIRM_WORD),
            Self::WithoutLog { .. } => Some(WITHOUT_LOG_WORD),
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
            Self::Closed | Self::Again { .. } => false,
            Self::Disarm { .. } | Self::Hold { .. } | Self::Check { .. } | Self::Sign { .. } => true,
            _ => self.word().is_some_and(|word| word.len() == self.typed().len()),
        }
    }

    /// The beginning of the word that has been typed.
    fn typed(&self) -> &str {
        match self {
            Self::Arm { typed, .. }
            | Self::Start { typed, .. }
            | Self::Confirm { typed, .. }
            | Self::WithoutLog { typed, .. }
            | Self::TakeCommand { typed, .. }
            | Self::AbortForeign { typed, .. }
            | Self::Quit { typed, .. } => typed,
            _ => "",
        }
    }

    /// Takes a letter. Returns whether it is the next letter of the word.
    pub fn take(&mut self, letter: char) -> bool {
        let Some(word) = self.word() else { return false };
        let (Self::Arm { typed, .. }
        | Self::Start { typed, .. }
        | Self::Confirm { typed, .. }
        | Self::WithoutLog { typed, .. }
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

/// What is left of a typed word whose dialog did not open, or has closed: the crew types on, and no letter of it may act
/// as a key.
#[derive(Debug, Clone, PartialEq)]
pub struct RestOfWord {
    /// The words that the crew may be typing, and how many of their letters have passed.
    words: Vec<(&'static str, usize)>,
    /// Why nothing is done; it is said again after the word.
    pub why: String,
    until: Duration,
}

impl RestOfWord {
    /// The whole word: its dialog did not open.
    pub fn refused(words: &[&'static str], why: String, now: Duration) -> Self {
        let words = words.iter().map(|word| (*word, 0)).collect();
        Self { words, why, until: now + REST_WITHIN }
    }

    /// The dialog has closed while its word was typed; `wrong` is the letter that closed it.
    pub fn of(dialog: &Dialog, wrong: Option<char>, why: String, now: Duration) -> Option<Self> {
        let word = dialog.word()?;
        let typed = dialog.typed().len();
        let mut words = vec![(word, typed.max(1))];
        // The crew may have meant the other word of the same key.
        let other =
            wrong.filter(|letter| typed == 0 && CONFIRM_WORD.starts_with(letter.to_ascii_uppercase()));
        words.extend(other.map(|_| (CONFIRM_WORD, 1)));
        Some(Self { words, why, until: now + REST_WITHIN })
    }

    /// Whether this letter belongs to the word: its first, or after that any later one, because letters may be missing
    /// or wrong.
    pub fn takes(&mut self, letter: char, now: Duration) -> bool {
        let letter = letter.to_ascii_uppercase();
        let goes_on = |(word, passed): &(&'static str, usize)| {
            let ahead = if *passed == 0 { word.get(..1)? } else { word.get(*passed..)? };
            Some((*word, passed + ahead.find(letter)? + 1))
        };
        let words: Vec<_> = self.words.iter().filter_map(goes_on).collect();
        let takes = self.waits(now) && !words.is_empty();
        if takes {
            (self.words, self.until) = (words, now + REST_WITHIN);
        }
        takes
    }

    /// Whether the crew may still be typing the word.
    pub fn waits(&self, now: Duration) -> bool {
        now <= self.until
    }
}
