//! Confirmation between a key and its effect: the dialog (typing a word, or confirming), the abort
//! chord, and the test whether the keys were typed by hand.

use std::time::Duration;

use protocol::dialect::TdAct;

use super::{CommandKind, Proposal, Request};
use crate::key::Key;

/// Time limit for typing a word.
pub const WORD_TIME_LIMIT: Duration = Duration::from_secs(10);
/// How long the crew has for Enter where it confirms alone.
pub const CONFIRM_TIME_LIMIT: Duration = Duration::from_secs(5);
/// The word that confirms another operator's proposal.
pub const CONFIRM_WORD: &str = "CONFIRM";
/// The key that confirms a dialog completed by keys that arrived faster than a hand types; no text
/// contains it.
pub const AGAIN_KEY: Key = Key::CtrlY;
/// That key counts this long after the question: a paste has no such pause before it, and who reads
/// first needs longer.
pub const AGAIN_AFTER: Duration = Duration::from_millis(500);
/// How long the crew has for that key.
pub const AGAIN_TIME_LIMIT: Duration = Duration::from_secs(10);
/// The first letter of a word whose dialog does not open, or has closed, is swallowed for this
/// long, and then the word until Enter.
const REST_WITHIN: Duration = Duration::from_secs(1);

/// The action to confirm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Prompt {
    /// The second step of arming.
    Arm,
    /// Start the countdown.
    Start,
    /// Confirm another operator's proposal: that one and no other.
    Confirm(Proposal),
    /// Continue although the station's log is unfit.
    WithoutLog,
    /// Arm although no burn of the motor's lot has confirmed its curve.
    Untested,
    /// Command the vehicle that another station has armed.
    TakeCommand,
    /// Disarm on the pad.
    Disarm,
    /// Abort a vehicle with another autopilot, after the crew has read the effect there.
    AbortForeign,
    /// Hold the countdown.
    Hold,
    /// Check the vehicle on its pad; with `moves`, gimbal and fins move.
    Check { moves: bool },
    /// Confirm that every surface moved as it should.
    Seen,
    /// Sign a step of the checklist, counted from zero, or take its signature back.
    Sign { step: usize, void: bool },
    /// Quit, although the vehicle is armed or in flight.
    Quit,
}

impl Prompt {
    /// Opens the dialog.
    pub fn open(self, now: Duration) -> Dialog {
        let limit = match self {
            Self::Confirm(proposal) => proposal.left,
            _ if self.word().is_some() => WORD_TIME_LIMIT,
            _ => CONFIRM_TIME_LIMIT,
        };
        Dialog { prompt: self, typed: String::new(), until: now + limit, again_from: None }
    }

    /// Whether it acts only on keys typed by hand, and otherwise needs another confirmation.
    /// Anything that stops something acts immediately.
    pub fn needs_a_hand(self) -> bool {
        !matches!(self, Self::Hold | Self::Disarm | Self::AbortForeign)
    }

    /// Its name for the list of events, the word to type, and its request once it is complete.
    fn row(self) -> (&'static str, Option<&'static str>, Option<Request>) {
        let command = |kind| Some(Request::Command(kind));
        match self {
            Self::Arm => ("arming", Some("ARM"), command(CommandKind::Arm)),
            Self::Start => ("start", Some("START"), command(CommandKind::Start)),
            Self::Confirm(Proposal { act: TdAct::TD_ACT_START, .. }) => {
                ("confirmation", Some(CONFIRM_WORD), command(CommandKind::ConfirmStart))
            }
            Self::Confirm(_) => ("confirmation", Some(CONFIRM_WORD), command(CommandKind::ConfirmArm)),
            Self::WithoutLog => ("going on without a log", Some("NOLOG"), Some(Request::WithoutLog)),
            Self::Untested => ("going on with an untested motor", Some("UNTESTED"), Some(Request::Untested)),
            Self::TakeCommand => ("take-over", Some("TAKE"), command(CommandKind::TakeCommand)),
            Self::AbortForeign => ("abort", Some("ABORT"), command(CommandKind::Abort)),
            Self::Disarm => ("disarm", None, command(CommandKind::Disarm)),
            Self::Hold => ("hold", None, command(CommandKind::Hold)),
            Self::Check { moves: true } => ("check", None, command(CommandKind::Check)),
            Self::Check { moves: false } => ("check", None, command(CommandKind::CheckStill)),
            Self::Seen => ("seen motion", Some("SEEN"), command(CommandKind::Seen)),
            Self::Sign { step, void } => {
                let step = u8::try_from(step).unwrap_or(u8::MAX);
                (if void { "voiding" } else { "signature" }, None, Some(Request::Sign { step, void }))
            }
            Self::Quit => ("quit", Some("QUIT"), None),
        }
    }

    pub fn name(self) -> &'static str {
        self.row().0
    }

    /// The word to type; `None` where Enter alone confirms.
    pub fn word(self) -> Option<&'static str> {
        self.row().1
    }

    /// Its request once it is complete; `None` if it concerns this screen alone.
    pub fn request(self) -> Option<Request> {
        self.row().2
    }
}

/// The open dialog. It accepts the next letter of its word (in either case), or Enter after the
/// complete word. Any other key closes it. The abort chord works in every dialog.
#[derive(Debug, Clone, PartialEq)]
pub struct Dialog {
    pub prompt: Prompt,
    /// The beginning of the word that has been typed.
    pub typed: String,
    /// When it closes by itself.
    pub until: Duration,
    /// Keys that arrived faster than a hand types have completed it: [`AGAIN_KEY`] confirms it,
    /// from this time on.
    pub again_from: Option<Duration>,
}

impl Dialog {
    /// The question whether the keys that completed this dialog were typed by a person.
    #[must_use]
    pub fn again(self, now: Duration) -> Self {
        Self { again_from: Some(now + AGAIN_AFTER), until: now + AGAIN_TIME_LIMIT, ..self }
    }

    /// The word to type.
    pub fn word(&self) -> Option<&'static str> {
        self.prompt.word().filter(|_| self.again_from.is_none())
    }

    /// Whether Enter now confirms.
    pub fn is_complete(&self) -> bool {
        self.again_from.is_none() && self.prompt.word().is_none_or(|word| word.len() == self.typed.len())
    }

    /// Takes a letter. Returns whether it is the next letter of the word.
    pub fn take(&mut self, letter: char) -> bool {
        let next = self.word().and_then(|word| word.chars().nth(self.typed.len()));
        let fits = next.is_some_and(|next| next.eq_ignore_ascii_case(&letter));
        if fits {
            self.typed.push(letter);
        }
        fits
    }
}

/// The rest of a typed word whose dialog did not open, or has closed: the crew types on, and no
/// letter of it may act as a key.
#[derive(Debug, Clone, PartialEq)]
pub struct RestOfWord {
    /// The words that the crew may be typing, and how many of their letters have passed.
    words: Vec<(&'static str, usize)>,
    /// Why nothing is done; it is repeated after the word.
    pub why: String,
    until: Duration,
}

impl RestOfWord {
    /// The word of a dialog that did not open, or the one that confirms a second person's proposal.
    /// The key of a take-over is the first letter of that one.
    pub fn refused(prompt: Prompt, why: String, now: Duration) -> Self {
        let passed = usize::from(prompt == Prompt::TakeCommand);
        let words = prompt.word().map(|word| (word, 0)).into_iter().chain([(CONFIRM_WORD, passed)]).collect();
        Self { words, why, until: now + REST_WITHIN }
    }

    /// The dialog has closed while its word was typed; `wrong` is the letter that closed it.
    pub fn of(dialog: &Dialog, wrong: Option<char>, why: String, now: Duration) -> Option<Self> {
        let word = dialog.word()?;
        let typed = dialog.typed.len();
        let mut words = vec![(word, typed.max(1))];
        // The crew may have intended the other word of the same key.
        let passed = usize::from(dialog.prompt == Prompt::TakeCommand);
        let rest = &CONFIRM_WORD[passed..];
        let other = wrong.filter(|letter| typed == 0 && rest.starts_with(letter.to_ascii_uppercase()));
        words.extend(other.map(|_| (CONFIRM_WORD, passed + 1)));
        Some(Self { words, why, until: now + REST_WITHIN })
    }

    /// Whether this letter belongs to the word: its first, or after that any later one, because
    /// letters may be missing or wrong.
    pub fn takes(&mut self, letter: char, now: Duration) -> bool {
        let letter = letter.to_ascii_uppercase();
        let goes_on = |(word, passed): &(&'static str, usize)| {
            let ahead = if *passed == 0 { word.get(..1)? } else { word.get(*passed..)? };
            Some((*word, passed + ahead.find(letter)? + 1))
        };
        let words: Vec<_> = self.words.iter().filter_map(goes_on).collect();
        let takes = self.waits(now) && !words.is_empty();
        if takes {
            (self.words, self.until) = (words, now + WORD_TIME_LIMIT);
        }
        takes
    }

    /// Whether the crew may still be typing the word.
    pub fn waits(&self, now: Duration) -> bool {
        now <= self.until
    }
}

// The abort chord: Ctrl-X then Enter, or Ctrl-X twice, distinguished from a held Ctrl-X.
//
// Enter completes the chord at once on every terminal. A second Ctrl-X is harder to recognise. Many
// terminals send a held key as the same bytes over and over: once at the press, again after the
// keyboard's delay (250 ms or more), then every 20 to 100 ms. The first repeat looks like a second
// press; the repeats after it do not. So a second Ctrl-X counts only if no further one follows
// within [`REPEATS_WITHIN`], and a held key is one press. On a terminal that reports repeats, the
// second Ctrl-X counts at once.

/// How long the second key may take, from the first press or from the end of its hold.
pub const ABORT_TIME_LIMIT: Duration = Duration::from_secs(2);
/// An Enter within this time of Ctrl-X, but after its time limit, was intended for the abort.
const LATE_WITHIN: Duration = Duration::from_secs(10);
/// Presses closer together than this are repeats of a held key: keyboards repeat every 20 to 100
/// ms, fingers are slower. A second press also waits this long to show that it is no repeat.
pub const REPEATS_WITHIN: Duration = Duration::from_millis(120);

/// The state of the chord.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum AbortChord {
    #[default]
    Open,
    /// Pressed once and perhaps still held; the time of the last Ctrl-X.
    Once(Duration),
    /// Pressed a second time, at this time. It counts unless a repeat follows.
    Twice(Duration),
}

impl AbortChord {
    /// Whether the first key was pressed and its time limit has not expired.
    pub fn is_begun(self, now: Duration) -> bool {
        match self {
            Self::Open => false,
            Self::Once(at) => now.saturating_sub(at) <= ABORT_TIME_LIMIT,
            Self::Twice(_) => true,
        }
    }

    /// When a second press counts.
    pub fn acts_at(self) -> Option<Duration> {
        let Self::Twice(at) = self else { return None };
        Some(at + REPEATS_WITHIN)
    }

    pub fn press(&mut self, now: Duration) {
        *self = match *self {
            Self::Once(at) if now.saturating_sub(at) >= REPEATS_WITHIN && self.is_begun(now) => {
                Self::Twice(now)
            }
            // The ground was too busy to act in time, so the time of this key press is unknown.
            Self::Twice(at) if now.saturating_sub(at) >= REPEATS_WITHIN => Self::Twice(now),
            // The first press, or a repeat of a held key.
            Self::Open | Self::Once(_) | Self::Twice(_) => Self::Once(now),
        };
    }

    /// A key that cannot be a repeat of the first was pressed: Enter, or Ctrl-X on a terminal that
    /// reports repeats. Returns whether it completes the chord, which then starts over.
    pub fn confirm(&mut self, now: Duration) -> bool {
        let complete = self.is_begun(now);
        if complete {
            *self = Self::Open;
        }
        complete
    }

    /// Another key was pressed, so Ctrl-X is no longer held. Returns whether the chord is complete;
    /// then it starts over. A chord that has only begun stays begun until its time limit.
    pub fn end(&mut self) -> bool {
        let complete = matches!(self, Self::Twice(_));
        if complete {
            *self = Self::Open;
        }
        complete
    }

    /// A key with another meaning was pressed: an Enter after it is not a late one.
    pub fn forget_if_over(&mut self, now: Duration) {
        if !self.is_begun(now) {
            *self = Self::Open;
        }
    }

    /// Lets time pass. Returns whether the chord is complete; then it starts over.
    pub fn pass(&mut self, now: Duration) -> bool {
        self.acts_at().is_some_and(|at| now >= at) && self.end()
    }

    /// Enter was pressed: returns whether it came too late, shortly after the time limit. Only the
    /// first call returns true.
    pub fn take_late_enter(&mut self, now: Duration) -> bool {
        matches!(std::mem::take(self), Self::Once(at) if now.saturating_sub(at) <= LATE_WITHIN)
    }
}

// Distinguishes by their timing keys that were typed, repeated by a held key, or arrived faster
// than a hand types.
//
// Keys that arrive too fast may be a paste, but also typed keys that a slow connection delivered in
// bunches. So they only show and prepare; what they complete needs another confirmation
// ([`Dialog::again`]). The keys of the abort count in every case.

/// Different keys closer together than this were not typed by hand. Two fingers are about 40 ms
/// apart; pasted text arrives at 1 ms a letter on a serial console at 9,600 baud, 8 ms at 1,200
/// baud, and at once everywhere else.
pub const FINGERS_APART: Duration = Duration::from_millis(25);
/// After a key that has no meaning among keys that arrive too fast, the others are dropped until
/// none has arrived for this long. A connection may pause within a paste, and a hand is no faster.
const RUN_ENDS: Duration = REPEATS_WITHIN;
/// Dropped keys are reported at most this often.
const REPORTED_EVERY: Duration = Duration::from_secs(2);

/// How a key arrived.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum KeyOrigin {
    /// Typed by hand.
    Typed,
    /// A repeat: the key is held down.
    Repeat,
    /// In one read with other keys, or sooner after another key than a hand can type.
    TooFast,
    /// In a run of keys that is dropped.
    Dropped,
}

/// The last key and when it arrived.
#[derive(Debug, Clone, Copy, Default)]
pub struct KeyTiming {
    /// The key is `None` after a paste.
    last: Option<(Option<Key>, Duration)>,
    /// The rest of this run of keys is dropped.
    drops: bool,
    /// A key of the open dialog was not typed by hand.
    pub hurried: bool,
    reported_at: Option<Duration>,
}

impl KeyTiming {
    /// How this key arrived; `together` if one read of the terminal brought several.
    pub fn origin(&mut self, key: Key, together: bool, now: Duration) -> KeyOrigin {
        let before = self.last.replace((Some(key), now)).map(|(last, at)| (last, now.saturating_sub(at)));
        self.drops &= before.is_some_and(|(_, ago)| ago < RUN_ENDS);
        match before {
            _ if self.drops => KeyOrigin::Dropped,
            Some((Some(last), ago)) if last == key && ago < REPEATS_WITHIN => KeyOrigin::Repeat,
            Some((_, ago)) if ago < FINGERS_APART => KeyOrigin::TooFast,
            _ if together => KeyOrigin::TooFast,
            _ => KeyOrigin::Typed,
        }
    }

    /// The keys of this run are no input for this program: the rest of them is dropped.
    pub fn drop_run(&mut self) {
        self.drops = true;
    }

    /// Something was pasted; keys shortly after it were not typed by hand either.
    pub fn pasted(&mut self, now: Duration) {
        self.last = Some((None, now));
    }

    /// A key was dropped. Returns whether to report it.
    pub fn reports_drop(&mut self, now: Duration) -> bool {
        let reports = self.reported_at.is_none_or(|at| now.saturating_sub(at) >= REPORTED_EVERY);
        if reports {
            self.reported_at = Some(now);
        }
        reports
    }
}

#[cfg(test)]
mod chord_tests {
    use super::*;
    use proptest::prelude::*;

    /// Presses Ctrl-X at these times and lets time pass every 10 ms. Returns how often the chord
    /// was completed.
    fn aborts(presses_ms: &[u64]) -> usize {
        let mut chord = AbortChord::default();
        let end = presses_ms.last().copied().unwrap_or(0) + 3_000;
        let mut count = 0;
        for now in 0..end {
            if presses_ms.contains(&now) {
                chord.press(Duration::from_millis(now));
            }
            if now % 10 == 0 {
                count += usize::from(chord.pass(Duration::from_millis(now)));
            }
        }
        count
    }

    fn held(delay_ms: u64, period_ms: u64, repeats: u64) -> Vec<u64> {
        std::iter::once(0).chain((0..repeats).map(|k| delay_ms + k * period_ms)).collect()
    }

    #[test]
    fn two_presses_abort_once_whether_fast_or_slow() {
        for pause_ms in [120, 150, 200, 350, 600, 1_000, 1_500, 2_000] {
            assert_eq!(aborts(&[0, pause_ms]), 1, "{pause_ms} ms between");
        }
        assert_eq!(aborts(&[0, 2_100]), 0);
        assert_eq!(aborts(&[0, 20]), 0, "a contact that bounces");
    }

    #[test]
    fn a_held_key_is_one_press_and_the_next_press_aborts() {
        let mut presses = held(500, 33, 30);
        let released = presses.last().copied().unwrap();
        presses.push(released + 400);
        assert_eq!(aborts(&presses), 1);
    }

    #[test]
    fn enter_completes_the_chord_only_after_ctrl_x_and_in_time() {
        let at = Duration::from_millis;
        let mut chord = AbortChord::default();
        assert!(!chord.confirm(at(0)));
        chord.press(at(0));
        assert!(chord.confirm(at(1)));
        assert!(!chord.confirm(at(2)), "once");
        chord.press(at(10));
        assert!(!chord.confirm(at(2_011)), "too late");
        for repeat in held(500, 33, 30) {
            chord.press(at(5_000 + repeat));
        }
        assert!(chord.confirm(at(7_000)), "a hold is a first press");
    }

    #[test]
    fn many_quick_presses_abort() {
        assert!(aborts(&[0, 140, 280, 420, 560]) >= 1);
        assert!(aborts(&[0, 100, 200, 300, 600]) >= 1, "too fast to tell from a hold, until the last");
    }

    proptest! {
        #[test]
        fn a_held_key_never_aborts_at_any_repeat_rate(
            delay_ms in 150_u64..1_900,
            gaps in prop::collection::vec(15_u64..119, 2..200),
        ) {
            let mut presses = vec![0, delay_ms];
            for gap in gaps {
                presses.push(presses.last().copied().unwrap_or(0) + gap);
            }
            prop_assert_eq!(aborts(&presses), 0);
        }
    }
}

#[cfg(test)]
mod key_timing_tests {
    use super::*;

    #[test]
    fn typed_repeated_and_pasted_keys_are_distinguished() {
        let at = Duration::from_millis;
        let mut timing = KeyTiming::default();
        let mut touch = |key, now| timing.origin(Key::Char(key), false, at(now));
        assert_eq!(touch('A', 0), KeyOrigin::Typed);
        assert_eq!(touch('R', 40), KeyOrigin::Typed);
        assert_eq!(touch('M', 48), KeyOrigin::TooFast);
        // Held: the keyboard's delay first, then a repeat every 33 ms.
        assert_eq!(touch('q', 1_000), KeyOrigin::Typed);
        assert_eq!(touch('q', 1_500), KeyOrigin::Typed);
        assert_eq!(touch('q', 1_533), KeyOrigin::Repeat);
        assert_eq!(timing.origin(Key::Char('S'), true, at(9_000)), KeyOrigin::TooFast);
        assert_eq!(timing.origin(Key::Char('S'), true, at(9_000)), KeyOrigin::Repeat);
    }

    #[test]
    fn a_dropped_run_ends_with_a_pause() {
        let at = Duration::from_millis;
        let mut timing = KeyTiming::default();
        timing.origin(Key::Char('e'), true, at(0));
        timing.drop_run();
        assert_eq!(timing.origin(Key::Char('A'), true, at(0)), KeyOrigin::Dropped);
        assert_eq!(timing.origin(Key::Char('A'), false, at(100)), KeyOrigin::Dropped);
        assert_eq!(timing.origin(Key::Char('A'), false, at(250)), KeyOrigin::Typed);
    }
}
