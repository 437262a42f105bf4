//! The palette and plotted numbers.

use ground::key::Key;
use ground::model::{DEFINITIONS, Page, PaletteAction, Prompt, palette_entries, quantity};
use ground::update::{Action, Msg};
use proptest::prelude::*;
use protocol::dialect::TdPhase;

use crate::pictures::flying;
use crate::rig::{Rig, is_abort, is_arm, settings, typed};
use crate::screens::{armed, descending, on_the_pad, powered};

/// Opens the palette, types a text and presses Enter.
fn choose(rig: &mut Rig, text: &str) {
    rig.keys(&[typed(":"), typed(text), vec![Key::Enter]].concat());
}

#[test]
fn the_palette_lists_every_action_with_its_key() {
    let rig = on_the_pad();
    let listed = palette_entries(&rig.model, "", rig.now);
    for definition in &DEFINITIONS {
        let entry = listed.iter().find(|entry| entry.action == PaletteAction::Act(definition.act)).unwrap();
        assert_eq!((entry.words.as_str(), &entry.key), (definition.words, &definition.key.name()));
    }
    assert!(listed.iter().any(|entry| entry.action == PaletteAction::ExplainAbort && entry.key == "Ctrl-X"));
    for quantity in &quantity::ALL {
        assert!(listed.iter().any(|entry| entry.action == PaletteAction::Plot(quantity)));
    }
}

#[test]
fn an_entry_is_found_by_parts_of_its_words_and_does_what_its_key_does() {
    let mut rig = on_the_pad();
    rig.keys(&[typed(":"), typed("look FOR the")].concat());
    let screen = rig.screen(80, 24);
    assert!(screen.contains(":look FOR the_") && screen.contains("1 found"), "{screen}");
    rig.key(Key::Enter);
    assert_eq!(rig.model.page(), Page::Find);
    choose(&mut rig, "colours");
    assert!(rig.actions.contains(&Action::NextTheme));
    rig.keys(&[typed(":"), vec![Key::Escape]].concat());
    assert_eq!((rig.model.pages.entry.clone(), rig.model.page()), (None, Page::Find), "Esc only closes it");
}

/// The palette opens the dialog of a ladder and goes no further: the word and Enter are still to be
/// typed.
#[test]
fn the_palette_opens_a_ladder_and_does_not_shorten_it() {
    let mut rig = on_the_pad();
    choose(&mut rig, "type ARM");
    assert!(
        rig.model
            .dialog
            .as_ref()
            .is_some_and(|dialog| dialog.prompt == Prompt::Arm && dialog.typed.is_empty())
    );
    assert!(rig.take_commands().is_empty(), "nothing is sent yet");
    rig.keys(&[typed("ARM"), vec![Key::Enter]].concat());
    assert!(rig.take_commands().iter().any(is_arm));
}

/// A held Enter that chose an entry must not confirm what the entry opened.
#[test]
fn a_held_enter_confirms_nothing_that_the_palette_opened() {
    for text in ["disarm", "type ARM", "type START", "abort"] {
        let mut rig = armed();
        rig.take_commands();
        rig.keys(&[typed(":"), typed(text)].concat());
        rig.run(0.5);
        rig.hold(Key::Enter, 250, 30, 2);
        assert!(rig.take_commands().is_empty(), "{text}");
    }
}

#[test]
fn the_palette_only_explains_how_to_abort() {
    let mut rig = powered();
    rig.take_commands();
    choose(&mut rig, "abort");
    rig.key(Key::Enter);
    rig.run(1.0);
    assert!(rig.take_commands().is_empty());
    assert!(rig.events().contains("press Ctrl-X, then Enter: only these keys abort"));
}

/// Whatever is open or chosen, Ctrl-X and Enter abort.
#[test]
fn the_abort_works_in_the_palette() {
    for opened in [typed(":"), typed(":arm"), typed("t")] {
        let mut rig = Rig::new(settings(false, true));
        rig.run(1.0);
        rig.keys(&opened);
        rig.abort();
        assert!(rig.take_commands().iter().any(is_abort), "{opened:?}");
    }
}

proptest! {
    /// No keys in the palette send a command without the word of its ladder.
    #[test]
    fn nothing_typed_into_the_palette_commands_the_vehicle(
        keys in prop::collection::vec(prop_oneof![
            4 => (b'a'..=b'z').prop_map(|letter| Key::Char(char::from(letter))),
            1 => Just(Key::Enter),
            1 => Just(Key::Char(':')),
            1 => Just(Key::Down),
            1 => Just(Key::Escape),
        ], 0..40),
    ) {
        let mut rig = on_the_pad();
        for key in keys {
            // The word of a ladder ends the attempt.
            if rig.model.dialog.as_ref().is_some_and(|dialog| dialog.word().is_some()) {
                rig.key(Key::Escape);
            }
            rig.key(key);
        }
        prop_assert!(rig.commands().iter().all(|command| !is_arm(command) && !is_abort(command)));
    }
}

#[test]
fn any_number_can_be_plotted() {
    let mut rig = descending();
    for quantity in &quantity::ALL {
        choose(&mut rig, &format!("plot {}", quantity.name));
        assert_eq!((rig.model.page(), rig.model.pages.plotted), (Page::Plot, quantity));
    }
    rig.key(Key::Up);
    assert_eq!(rig.model.pages.plotted.place(), quantity::COUNT - 2);
}

#[test]
fn help_shows_only_the_keys_that_work_now() {
    let mut rig = on_the_pad();
    rig.key(Key::Char('?'));
    let screen = rig.screen(80, 24);
    assert!(
        screen.contains("type ARM") && !screen.contains("type START") && !screen.contains("disarm:"),
        "{screen}"
    );
    let mut rig = armed();
    rig.key(Key::Char('?'));
    let screen = rig.screen(80, 24);
    assert!(
        !screen.contains("type ARM") && screen.contains("type START") && screen.contains("disarm:"),
        "{screen}"
    );
}

/// Pasted text does nothing through the palette, and a marked paste closes it.
#[test]
fn a_paste_into_the_palette_does_nothing() {
    let mut rig = on_the_pad();
    let pasted = [typed(":type ARM"), vec![Key::Enter], typed("ARM"), vec![Key::Enter]].concat();
    rig.msg(Msg::Keys(pasted));
    rig.run(1.0);
    assert!(rig.take_commands().is_empty());
    rig.key(Key::Escape);
    assert_eq!((rig.model.pages.entry.clone(), rig.model.dialog.clone()), (None, None));
    rig.key(Key::Char(':'));
    rig.msg(Msg::Pasted);
    assert_eq!(rig.model.pages.entry, None);
    assert!(rig.take_commands().is_empty());
}

/// A vehicle that stands a hand below zero has no tick at -100 m, and ticks are as far apart as
/// what they tell.
#[test]
fn the_ticks_of_a_plot_are_at_their_places() {
    let mut rig = flying(TdPhase::TD_PHASE_TOUCHDOWN);
    rig.state_in_space([1.0, 0.0, -0.01], [0.0; 3], (0.0, 0.0));
    rig.run(1.0);
    choose(&mut rig, "plot height");
    for (columns, rows) in [(80, 24), (120, 36), (200, 50)] {
        let screen = rig.screen(columns, rows);
        let ticks: Vec<(usize, f64)> = screen
            .lines()
            .enumerate()
            .filter_map(|(row, line)| {
                let words: String = line.chars().skip(37).take(6).collect();
                Some((row, words.trim_end_matches(['┄', '─']).trim().parse().ok()?))
            })
            .collect();
        let pairs: Vec<f64> =
            ticks.windows(2).map(|pair| (pair[0].1 - pair[1].1) / (pair[1].0 - pair[0].0) as f64).collect();
        assert!(ticks.len() >= 2 && ticks.iter().all(|(_, tick)| *tick >= 0.0), "{ticks:?}\n{screen}");
        // A row is the least that a place can be off.
        let [least, most] = [
            pairs.iter().fold(f64::INFINITY, |a, b| a.min(*b)),
            pairs.iter().fold(0.0, |a: f64, b| a.max(*b)),
        ];
        assert!(most < 2.0 * least, "{pairs:?}\n{screen}");
    }
}
