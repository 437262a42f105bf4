//! Properties of the keyboard: whatever the keys, only the complete ladder arms, and an abort always works.

use std::time::Duration;

use ground::attach::codec::Asked;
use ground::key::Key;
use ground::model::Role;
use ground::model::chord::ABORT_TIME_LIMIT;
use ground::model::command::CommandKind;
use ground::model::dialog::ARM_TIME_LIMIT;
use ground::update::Action;
use proptest::prelude::*;

use crate::bench::{Bench, is_abort, is_arm, typed};
use crate::hand::ladder;

/// Whether the keys up to the last one end in a complete ladder, read backwards from the Enter.
fn ends_in_complete_ladder(history: &[(Key, Duration)]) -> bool {
    let Some(((Key::Enter, entered_at), before)) = history.split_last() else { return false };
    let opens = |(k, (key, at)): (usize, &(Key, Duration))| {
        if *key != Key::Char('A') || entered_at.saturating_sub(*at) > ARM_TIME_LIMIT {
            return false;
        }
        let mut word = String::new();
        for (key, _) in &before[k + 1..] {
            match key {
                Key::Char(c) => word.push(*c),
                Key::Backspace => drop(word.pop()),
                Key::Enter | Key::Escape | Key::CtrlC => return false,
                _ => {}
            }
        }
        word.eq_ignore_ascii_case("ARM")
    };
    before.iter().enumerate().any(opens)
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
        Key::Char(' '),
        Key::Char('h'),
        Key::Char('0'),
        Key::Char('1'),
        Key::Char('7'),
        Key::Up,
        Key::PageDown,
        Key::Home,
    ]);
    // Pieces of the ladder, so that near misses are common.
    prop_oneof![
        4 => single.prop_map(|key| vec![key]),
        1 => Just(typed("AARM")),
        1 => Just(typed("Aar")),
        1 => Just(ladder()),
        1 => Just([typed("ARM"), vec![Key::Enter]].concat()),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn no_keys_without_the_complete_ladder_arm(
        steps in prop::collection::vec((some_keys(), 0_u64..4_000), 1..40),
    ) {
        let mut bench = Bench::crewed();
        let mut history = Vec::new();
        bench.take_commands();
        for (keys, pause_ms) in steps {
            bench.run((pause_ms / 100) as f64 / 10.0);
            prop_assert!(!bench.take_commands().iter().any(is_arm), "armed while no key was pressed");
            for key in keys {
                history.push((key, bench.now));
                bench.key(key);
                if bench.take_commands().iter().any(is_arm) {
                    prop_assert!(ends_in_complete_ladder(&history), "{history:?}");
                }
            }
        }
    }

    #[test]
    fn abort_works_after_any_keys(keys in prop::collection::vec(some_keys(), 0..12)) {
        let mut bench = Bench::crewed();
        bench.keys(&keys.concat());
        // A half chord among the keys is over.
        bench.run(ABORT_TIME_LIMIT.as_secs_f64() + 0.2);
        bench.take_commands();
        bench.abort_chord();
        prop_assert!(bench.take_commands().iter().any(is_abort));
    }

    /// Ctrl-X and then Enter, whatever was pressed before, sends an abort with that Enter.
    #[test]
    fn ctrl_x_and_enter_abort_at_once_after_any_keys(keys in prop::collection::vec(some_keys(), 0..12)) {
        let mut bench = Bench::crewed();
        bench.keys(&keys.concat());
        bench.take_commands();
        bench.abort();
        prop_assert!(bench.take_commands().iter().any(is_abort));
    }

    /// An abort that is sent at a key was begun by a Ctrl-X just before it; and one that is sent later, by two.
    #[test]
    fn no_keys_without_the_chord_abort(
        steps in prop::collection::vec((some_keys(), 0_u64..4_000), 1..40),
    ) {
        let mut bench = Bench::crewed();
        let mut history = Vec::new();
        bench.take_commands();
        for (keys, pause_ms) in steps {
            bench.run((pause_ms / 100) as f64 / 10.0);
            for key in keys {
                let begun = history.last() == Some(&Key::CtrlX);
                let twice = history.ends_with(&[Key::CtrlX, Key::CtrlX]);
                let earlier = bench.take_commands().iter().any(is_abort);
                prop_assert!(!earlier || twice, "while no key was pressed: {history:?}");
                bench.key(key);
                history.push(key);
                if bench.take_commands().iter().any(is_abort) {
                    prop_assert!(twice || (begun && key == Key::Enter), "{history:?}");
                }
                // What was sent is answered: a repeat of it is no new abort.
                bench.model.commands = ground::model::command::Commands::default();
            }
        }
    }

    /// The same ladder on a screen whose station runs elsewhere; it asks, and sends nothing itself.
    #[test]
    fn an_attached_screen_asks_to_arm_by_the_complete_ladder_alone(
        steps in prop::collection::vec((some_keys(), 0_u64..4_000), 1..40),
    ) {
        let mut bench = Bench::crewed();
        bench.model.settings.role = Role::Attached;
        let mut history = Vec::new();
        bench.take_commands();
        for (keys, pause_ms) in steps {
            bench.run((pause_ms / 100) as f64 / 10.0);
            for key in keys {
                history.push((key, bench.now));
                bench.key(key);
                let asks = bench.actions.contains(&Action::Request(Asked::Command(CommandKind::Arm)));
                prop_assert!(!asks || ends_in_complete_ladder(&history), "{history:?}");
                prop_assert!(bench.take_commands().is_empty());
            }
        }
    }

    #[test]
    fn a_screen_that_only_watches_asks_for_nothing(
        keys in prop::collection::vec(some_keys(), 0..40),
    ) {
        let mut bench = Bench::crewed();
        bench.model.settings.role = Role::Watching;
        bench.take_commands();
        bench.keys(&keys.concat());
        bench.abort();
        bench.abort_chord();
        let asked = |action: &Action| matches!(action, Action::Request(Asked::Command(_)));
        prop_assert!(!bench.actions.iter().any(asked) && bench.take_commands().is_empty());
    }
}
