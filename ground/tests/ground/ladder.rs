//! Properties of the keyboard: only a complete ladder that was typed by hand, or confirmed by
//! another key after a pause, arms, starts or quits; only a complete one disarms; and an abort
//! always works.
//!
//! The ladders are defined here a second time, as a small oracle that reads a history of keys
//! backwards and does not use dialogs.

use std::time::Duration;

use ground::key::Key;
use ground::model::{ABORT_TIME_LIMIT, CommandKind, Role};
use ground::update::{Action, Msg, Request};
use proptest::prelude::*;
use protocol::dialect::{COMMAND_LONG_DATA, MavCmd};

use crate::keys::{armed_on_pad, ladder, leaves, quit_ladder, start_ladder};
use crate::rig::{Rig, enter, is_abort, is_arm, typed};

/// An input from the terminal, and its time.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Input {
    /// `None` is a paste with its marks.
    key: Option<Key>,
    at: Duration,
    /// Whether it came with others in one read.
    together: bool,
}

/// The history without the repeats of held keys; `None` for keys that were not typed by hand.
fn typed_by_hand(history: &[Input]) -> Vec<(Option<Key>, Duration)> {
    let mut told = Vec::new();
    for (k, came) in history.iter().enumerate() {
        let before = k.checked_sub(1).map(|before| history[before]);
        let gap = before.map_or(Duration::MAX, |before| came.at.saturating_sub(before.at));
        let repeats = before.is_some_and(|before| before.key == came.key) && gap < Duration::from_millis(120);
        if repeats {
            continue;
        }
        let struck = !came.together && gap >= Duration::from_millis(25);
        told.push((came.key.filter(|_| struck), came.at));
    }
    told
}

/// Whether the history ends in one of these keys, the word (in either case) and Enter, within the
/// time.
fn ends_in_ladder(history: &[Input], opens: &[Key], word: &str, within_s: u64) -> bool {
    let told = typed_by_hand(history);
    let Some(begin) = told.len().checked_sub(word.len() + 2) else { return false };
    let rungs = &told[begin..];
    let letter = |(key, wanted): (Option<Key>, char)| matches!(key, Some(Key::Char(c)) if c.eq_ignore_ascii_case(&wanted));
    rungs[0].0.is_some_and(|key| opens.contains(&key))
        && rungs[1..=word.len()].iter().map(|(key, _)| *key).zip(word.chars()).all(letter)
        && rungs[word.len() + 1].0 == Some(Key::Enter)
        && rungs[word.len() + 1].1.saturating_sub(rungs[0].1) <= Duration::from_secs(within_s)
}

/// Whether the history ends in these keys at any speed. Repeats of a held key may be among them.
fn ends_at_any_speed(history: &[Input], opens: &[Key], word: &str, within_s: u64) -> bool {
    let fits = |key: Key, wanted: Option<char>| match (key, wanted) {
        (Key::Char(letter), Some(wanted)) => letter.eq_ignore_ascii_case(&wanted),
        (key, None) => key == Key::Enter,
        _ => false,
    };
    let wanted: Vec<Option<char>> = word.chars().map(Some).chain([None]).collect();
    let Some(end) = history.last().map(|last| last.at) else { return false };
    let mut left = history;
    for rung in wanted.into_iter().rev() {
        let Some((input, mut before)) = left.split_last() else { return false };
        if !input.key.is_some_and(|key| fits(key, rung)) {
            return false;
        }
        // `A`, then `A` of `ARM`: the one may be a repeat of the other.
        while before.len() > 1 && before[before.len() - 2..].iter().all(|same| same.key == input.key) {
            before = &before[..before.len() - 1];
        }
        left = before;
    }
    left.last().is_some_and(|input| {
        let opened = input.key.is_some_and(|key| opens.contains(&key));
        opened && end.saturating_sub(input.at) <= Duration::from_secs(within_s)
    })
}

/// Whether the history ends in these keys at any speed, and then Ctrl-Y after a pause.
fn ends_in_confirmed_ladder(history: &[Input], opens: &[Key], word: &str, within_s: u64) -> bool {
    let Some((last, before)) = history.split_last() else { return false };
    let pause = before.last().map_or(Duration::ZERO, |input| last.at.saturating_sub(input.at));
    let by_hand = last.key == Some(Key::CtrlY) && !last.together && pause >= Duration::from_millis(500);
    let mut before = before;
    while let [earlier @ .., input] = before {
        let repeats = earlier.last().is_some_and(|one| one.key == input.key && input.key == Some(Key::Enter));
        if input.key != Some(Key::CtrlY) && !repeats {
            break;
        }
        before = earlier;
    }
    by_hand && ends_at_any_speed(before, opens, word, within_s)
}

/// Whether the history ends in an abort chord: Ctrl-X and Enter within 2 s, or Ctrl-X twice but not
/// held. Other keys may come in between.
fn ends_in_chord(history: &[Input]) -> bool {
    let presses: Vec<Duration> =
        history.iter().filter(|came| came.key == Some(Key::CtrlX)).map(|came| came.at).collect();
    let (Some(newest), Some(last)) = (presses.last(), history.last()) else { return false };
    let entered = last.key == Some(Key::Enter) && last.at.saturating_sub(*newest) <= ABORT_TIME_LIMIT;
    let twice = presses.len() > 1 && {
        let gap = newest.saturating_sub(presses[presses.len() - 2]);
        gap >= Duration::from_millis(120) && gap <= ABORT_TIME_LIMIT
    };
    entered || twice
}

/// Whether the last key quits while nothing is at risk.
fn ends_in_quit(history: &[Input]) -> bool {
    let told = typed_by_hand(history);
    matches!(told.last(), Some((Some(Key::Char('q' | 'Q') | Key::CtrlC), _)))
}

/// Input from a keyboard, a clipboard or a noisy line.
#[derive(Debug, Clone)]
enum Stream {
    ByHand(Vec<Key>),
    Held {
        key: Key,
        delay_ms: u64,
        period_ms: u64,
        repeats: usize,
    },
    /// Several keys in one read.
    Together(Vec<Key>),
    /// One by one, this many milliseconds apart.
    TooFast(Vec<Key>, u64),
    Marked,
    Pause(u64),
}

/// The key for a byte of a terminal.
fn key_of(byte: u8) -> Option<Key> {
    match byte {
        0x03 => Some(Key::CtrlC),
        0x0C => Some(Key::CtrlL),
        0x0D => Some(Key::Enter),
        0x18 => Some(Key::CtrlX),
        0x19 => Some(Key::CtrlY),
        0x1B => Some(Key::Escape),
        0x7F => Some(Key::Backspace),
        b' '..=b'~' => Some(Key::Char(char::from(byte))),
        _ => None,
    }
}

fn stream() -> impl Strategy<Value = Stream> {
    let bytes = prop::collection::vec(any::<u8>(), 1..40)
        .prop_map(|bytes| bytes.into_iter().filter_map(key_of).collect::<Vec<_>>());
    let ladders = prop::sample::select(vec![
        ladder(),
        start_ladder(),
        quit_ladder(),
        vec![Key::Char('D'), Key::Enter],
        typed("Send the crew away"),
        enter("Thanks"),
    ]);
    let keys = prop_oneof![2 => ladders.clone(), 1 => bytes, 2 => some_keys()];
    // Also parts from the start or the end of a ladder.
    let part = (ladders, 0_usize..8, any::<bool>()).prop_map(|(keys, at, end)| {
        let at = at.min(keys.len());
        if end { keys[at..].to_vec() } else { keys[..at].to_vec() }
    });
    prop_oneof![
        4 => keys.clone().prop_map(Stream::ByHand),
        2 => part.clone().prop_map(Stream::ByHand),
        2 => (some_keys(), 150_u64..900, 20_u64..100, 1_usize..30).prop_map(
            |(keys, delay_ms, period_ms, repeats)| Stream::Held { key: keys[0], delay_ms, period_ms, repeats }
        ),
        2 => keys.clone().prop_map(Stream::Together),
        1 => part.prop_map(Stream::Together),
        2 => (keys, 0_u64..60).prop_map(|(keys, apart_ms)| Stream::TooFast(keys, apart_ms)),
        1 => Just(Stream::Marked),
        2 => Just(Stream::ByHand(vec![Key::CtrlY])),
        2 => (0_u64..3_000).prop_map(Stream::Pause),
    ]
}

/// A rig that takes streams of input and compares every result with the oracle.
struct Watched {
    rig: Rig,
    history: Vec<Input>,
}

impl Watched {
    fn play(&mut self, stream: Stream) -> Result<(), TestCaseError> {
        match stream {
            Stream::ByHand(keys) => keys.into_iter().try_for_each(|key| self.key_after(130, key)),
            Stream::TooFast(keys, apart_ms) => {
                keys.into_iter().try_for_each(|key| self.key_after(apart_ms, key))
            }
            Stream::Held { key, delay_ms, period_ms, repeats } => {
                self.key_after(130, key)?;
                self.key_after(delay_ms, key)?;
                (0..repeats).try_for_each(|_| self.key_after(period_ms, key))
            }
            Stream::Together(keys) => {
                self.pass(50)?;
                let together = keys.len() > 1;
                let at = self.rig.now;
                self.history.extend(keys.iter().map(|key| Input { key: Some(*key), at, together }));
                self.rig.msg(Msg::Keys(keys.clone()));
                self.check(keys.len())
            }
            Stream::Marked => {
                self.pass(50)?;
                self.history.push(Input { key: None, at: self.rig.now, together: true });
                self.rig.msg(Msg::Pasted);
                self.check(1)
            }
            Stream::Pause(ms) => self.pass(ms),
        }
    }

    fn key_after(&mut self, ms: u64, key: Key) -> Result<(), TestCaseError> {
        self.pass(ms)?;
        self.history.push(Input { key: Some(key), at: self.rig.now, together: false });
        self.rig.press(key);
        self.check(1)
    }

    /// Lets time pass with ticks.
    fn pass(&mut self, ms: u64) -> Result<(), TestCaseError> {
        for _ in 0..ms / 10 {
            self.rig.now += Duration::from_millis(10);
            if self.rig.now.as_millis().is_multiple_of(500) {
                self.rig.heartbeat();
                self.rig.flight_status();
            }
            self.rig.msg(Msg::Tick);
            self.check(0)?;
        }
        self.rig.now += Duration::from_millis(ms % 10);
        Ok(())
    }

    /// Compares what was done with the history as it was after each of the latest keys.
    fn check(&mut self, latest: usize) -> Result<(), TestCaseError> {
        let leaves = leaves(&self.rig);
        let history = &self.history;
        let whens: Vec<&[Input]> =
            (history.len() - latest.min(history.len())..=history.len()).map(|end| &history[..end]).collect();
        let chord = whens.iter().any(|history| ends_in_chord(history));
        let by_hand = |opens: &[Key], word, within_s| {
            whens.iter().any(|history| {
                ends_in_ladder(history, opens, word, within_s)
                    || ends_in_confirmed_ladder(history, opens, word, within_s)
            })
        };
        let is = |sent: &COMMAND_LONG_DATA, command| sent.command == command;
        for sent in self.rig.take_commands() {
            let allowed = if is_abort(&sent) {
                chord
            } else if is_arm(&sent) {
                by_hand(&[Key::Char('A')], "ARM", 10)
            } else if is(&sent, MavCmd::MAV_CMD_COMPONENT_ARM_DISARM) {
                whens.iter().any(|history| ends_at_any_speed(history, &[Key::Char('D')], "", 5))
            } else if is(&sent, MavCmd::MAV_CMD_TD_PAD_CHECK) {
                // The end of a check moves nothing: it needs no ladder.
                let key = if sent.param1 > 1.5 { 'E' } else { 'X' };
                sent.param1 < 0.5 || by_hand(&[Key::Char(key)], "", 5)
            } else {
                by_hand(&[Key::Char('S')], "START", 10)
            };
            // A resent command was allowed when it was first sent.
            prop_assert!(allowed || sent.confirmation > 0, "{sent:?} by {history:?}");
        }
        let opens = [Key::Char('q'), Key::Char('Q'), Key::CtrlC];
        let at_risk = self.rig.model.is_at_risk();
        // The palette does what the key does: at risk it opens the same ladder.
        let by_palette = ends_in_ladder(history, &[Key::Char(':')], "QUIT", 60);
        let quits = by_hand(&opens, "QUIT", 10) || (!at_risk && (by_palette || ends_in_quit(history)));
        prop_assert!(!leaves || quits, "left by {history:?}");
        if chord {
            // The abort counts as answered, so that its resends do not look like new ones.
            self.rig.model.commands = ground::model::Commands::default();
        }
        Ok(())
    }
}

fn some_keys() -> impl Strategy<Value = Vec<Key>> {
    let single = proptest::sample::select(vec![
        Key::Char('A'),
        Key::Char('a'),
        Key::Char('r'),
        Key::Char('M'),
        Key::Char('S'),
        Key::Char('D'),
        Key::Char('q'),
        Key::Char('?'),
        Key::Enter,
        Key::Enter,
        Key::Escape,
        Key::Backspace,
        Key::F1,
        Key::CtrlC,
        Key::CtrlL,
        Key::CtrlX,
        Key::CtrlY,
        Key::Char(' '),
        Key::Char('h'),
        Key::Char('0'),
        Key::Char('1'),
        Key::Char('7'),
        Key::Up,
        Key::PageDown,
        Key::Home,
    ]);
    // Parts of the ladder, so that near misses are common.
    prop_oneof![
        4 => single.prop_map(|key| vec![key]),
        1 => Just(typed("AARM")),
        1 => Just(typed("Aar")),
        1 => Just(ladder()),
        1 => Just(enter("ARM")),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// Held keys, pastes, random bytes, near misses and whole ladders, in any order, with an armed
    /// or disarmed vehicle.
    #[test]
    fn no_command_without_its_complete_ladder(streams in prop::collection::vec(stream(), 1..25), armed in any::<bool>()) {
        let mut rig = if armed { armed_on_pad() } else { Rig::crewed() };
        rig.take_commands();
        let mut watched = Watched { rig, history: Vec::new() };
        for stream in streams {
            watched.play(stream)?;
        }
        watched.pass(500)?;
    }

    /// Ctrl-X and Enter at once, Ctrl-X twice once a chord that the keys have begun has expired.
    #[test]
    fn ctrl_x_and_enter_or_ctrl_x_twice_abort_after_any_keys(
        keys in prop::collection::vec(some_keys(), 0..12),
        twice in any::<bool>(),
    ) {
        let mut rig = Rig::crewed();
        rig.keys(&keys.concat());
        if twice {
            rig.run(ABORT_TIME_LIMIT.as_secs_f64() + 0.2);
            rig.take_commands();
            rig.abort_chord();
        } else {
            rig.take_commands();
            rig.abort();
        }
        prop_assert!(rig.take_commands().iter().any(is_abort));
    }

    /// The same ladder on an attached screen, which sends a request instead of a command.
    #[test]
    fn an_attached_screen_requests_an_arming_only_after_the_complete_ladder(
        steps in prop::collection::vec((some_keys(), 0_u64..4_000), 1..40),
    ) {
        let mut rig = Rig::crewed();
        rig.model.settings.role = Role::Attached;
        let mut history = Vec::new();
        rig.take_commands();
        for (keys, pause_ms) in steps {
            rig.run((pause_ms / 100) as f64 / 10.0);
            for key in keys {
                rig.now += Duration::from_millis(130);
                rig.press(key);
                history.push(Input { key: Some(key), at: rig.now, together: false });
                let asks = rig.actions.contains(&Action::Request(Request::Command(CommandKind::Arm)));
                let complete = ends_in_ladder(&history, &[Key::Char('A')], "ARM", 10);
                prop_assert!(!asks || complete, "{history:?}");
                rig.actions.clear();
                prop_assert!(rig.take_commands().is_empty());
            }
        }
    }

    #[test]
    fn a_screen_that_only_watches_sends_no_request(
        keys in prop::collection::vec(some_keys(), 0..40),
    ) {
        let mut rig = Rig::crewed();
        rig.model.settings.role = Role::Watching;
        rig.take_commands();
        rig.keys(&keys.concat());
        rig.abort();
        rig.abort_chord();
        let asked = |action: &Action| matches!(action, Action::Request(Request::Command(_)));
        prop_assert!(!rig.actions.iter().any(asked) && rig.take_commands().is_empty());
    }
}
