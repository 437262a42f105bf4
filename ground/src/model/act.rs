//! Everything that one key does, with its name in the settings, its usual key and its words; which key the crew has
//! chosen for it; and the palette, which lists it all.
//!
//! The abort is not among them: its keys cannot be changed. What commands the vehicle only opens a dialog.

use std::collections::BTreeMap;
use std::time::Duration;

use serde::Deserialize;

use super::{
    Model, Page, Role, Vehicle,
    quantity::{self, Quantity},
    why_not_arm, why_not_check, why_not_here, why_not_seen, why_not_start, why_not_take, words,
};
use crate::key::Key;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Act {
    /// Open the dialog that arms.
    Arm,
    /// Open the dialog that starts the countdown.
    Start,
    /// Open the dialog that disarms.
    Disarm,
    /// Open the dialog that holds the countdown.
    HoldCountdown,
    /// Tap: our operator has confirmed the start and is still there.
    Tap,
    /// Open the dialog that takes command.
    TakeCommand,
    /// Open the dialog that checks the vehicle; end the check that runs.
    Check,
    /// The same for a check without motion.
    CheckStill,
    /// Open the dialog that says that every surface moved as it should.
    Seen,
    /// Begin the radio range test.
    RangeTest,
    Acknowledge,
    /// Show the checklist on the Pad page, or the arming checks again.
    Checklist,
    /// Show the flight just flown again.
    ReplayFlight,
    /// Write the report of the flight.
    Report,
    /// Move the pin of the demonstration's vehicle.
    MovePin,
    /// Open the dialog that signs the chosen step of the checklist.
    SignStep,
    /// Open the dialog that takes the signature of the chosen step back.
    VoidStep,
    Show(Page),
    Hold,
    Follow,
    Palette,
    /// Type a note for the log and the book.
    Note,
    NextTheme,
    Redraw,
    Quit,
}

/// An action, its name in the settings, its usual key, and what it does.
pub struct Definition {
    effect: Effect,
    pub act: Act,
    pub name: &'static str,
    pub usual: Key,
    pub words: &'static str,
}

/// What a key may do at once.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Effect {
    /// Changes only what is shown.
    Shows,
    /// Opens a dialog that commands the vehicle.
    Asks,
    /// Commands the vehicle, and moves nothing.
    Commands,
    /// Does something else.
    Acts,
}

const fn shows(act: Act, name: &'static str, usual: char, words: &'static str) -> Definition {
    Definition { effect: Effect::Shows, act, name, usual: Key::Char(usual), words }
}

const fn asks(act: Act, name: &'static str, usual: char, words: &'static str) -> Definition {
    Definition { effect: Effect::Asks, act, name, usual: Key::Char(usual), words }
}

const fn commands(act: Act, name: &'static str, usual: char, words: &'static str) -> Definition {
    Definition { effect: Effect::Commands, act, name, usual: Key::Char(usual), words }
}

const fn acts(act: Act, name: &'static str, usual: char, words: &'static str) -> Definition {
    Definition { effect: Effect::Acts, act, name, usual: Key::Char(usual), words }
}

/// Every action; the most important first.
pub const DEFINITIONS: [Definition; 36] = [
    asks(Act::Arm, "arm", 'A', "arm: then type ARM and Enter within 10 s"),
    asks(Act::Start, "start", 'S', "start the countdown: then type START and Enter within 10 s"),
    asks(Act::Disarm, "disarm", 'D', "disarm: then Enter within 5 s"),
    asks(Act::HoldCountdown, "hold-countdown", 'H', "hold the countdown: then Enter within 5 s"),
    commands(Act::Tap, "tap", 'T', "two people: tap twice a second, from the start to the release"),
    asks(Act::TakeCommand, "take", 'C', "take command from a silent station: then TAKE and Enter"),
    asks(Act::Check, "check", 'X', "check the vehicle: then Enter; fins and gimbal MOVE"),
    asks(Act::CheckStill, "check-still", 'E', "the same check without motion: then Enter"),
    asks(Act::Seen, "moved-right", 'Y', "I saw every surface move as the page x says: then SEEN and Enter"),
    commands(Act::RangeTest, "range-test", 'U', "radio range test: 30 s, nothing is commanded"),
    acts(Act::Acknowledge, "acknowledge", ' ', "acknowledge the shown alarm"),
    shows(Act::Checklist, "checklist", 'k', "the checklist on the Pad page; Up and Down choose a step"),
    asks(Act::SignStep, "sign", 'G', "sign the chosen step of the checklist: then Enter within 5 s"),
    asks(Act::VoidStep, "void", 'V', "take a step's signature back: then Enter within 5 s"),
    shows(Act::Show(Page::Pad), "pad", '1', "page: arming checks and ladder"),
    shows(Act::Show(Page::Descent), "flight", '2', "page: ascent and descent"),
    shows(Act::Show(Page::Landing), "landing", '3', "page: the burn"),
    shows(Act::Show(Page::Review), "review", '4', "page: verdict, limits, what went wrong"),
    shows(Act::Show(Page::Link), "link", '5', "page: link rates and the age of every message"),
    shows(Act::Show(Page::Messages), "texts", '6', "page: events and messages"),
    shows(Act::Show(Page::Log), "log", '7', "page: the recording"),
    shows(Act::Show(Page::Alarms), "alarms", '8', "page: every alarm"),
    shows(Act::Show(Page::Find), "find", 'f', "page: where to look for the vehicle, and the way there"),
    shows(
        Act::Show(Page::Checks),
        "checks",
        'x',
        "page: checks on the pad, radio range, battery and storage",
    ),
    shows(Act::Show(Page::Plot), "plot", 't', "page: every number, and one of them over time"),
    shows(Act::Show(Page::Help), "help", '?', "page: the keys that work now"),
    shows(Act::Hold, "hold", 'h', "hold this page, or follow the flight again"),
    shows(Act::Follow, "follow", '0', "follow the flight again (Esc does too)"),
    shows(Act::Palette, "palette", ':', "list every action; type a part of its words"),
    shows(Act::Note, "note", 'n', "a note into log and book: type it, then Enter"),
    shows(Act::NextTheme, "theme", 'c', "colours: dark, light for sunlight, none"),
    acts(Act::ReplayFlight, "replay", 'R', "the flight just flown, again on this screen; q ends it"),
    acts(Act::Report, "report", 'W', "write the report of the flight beside the log"),
    acts(Act::MovePin, "pin", 'I', "demonstration: put the vehicle's pin in, or pull it, by hand"),
    Definition { usual: Key::CtrlL, ..shows(Act::Redraw, "redraw", ' ', "draw the screen again") },
    acts(Act::Quit, "quit", 'q', "quit; while it is not over: then type QUIT and Enter"),
];

/// Why no flight can be shown again or reported here now.
pub fn why_nothing_flown(model: &Model) -> Option<&'static str> {
    match model.settings.role {
        Role::Replaying => Some("this is a replay"),
        _ if model.is_at_risk() => Some("the vehicle is armed or in flight"),
        _ if model.settings.log_path.is_none() => Some("there is no log (--log none)"),
        _ => (!model.outcome.started).then_some("no flight has been flown yet"),
    }
}

impl Act {
    /// Whether the key would do something now.
    pub fn works(self, model: &Model, now: Duration) -> bool {
        let commands = model.settings.role.why_not_command().is_none();
        let acts = why_not_here(model).is_none();
        match self {
            Self::Arm => acts && why_not_arm(model, now).is_none(),
            Self::Start => acts && why_not_start(model, now).is_none(),
            Self::Disarm => acts && model.every_vehicle(now).any(|v| v.is_armed() && !v.in_flight()),
            Self::HoldCountdown => commands && model.every_vehicle(now).any(Vehicle::counts_down),
            Self::Tap => acts && model.tapping(now).is_some_and(|(by, _)| by == model.own_number()),
            Self::TakeCommand => acts && why_not_take(model, now).is_none(),
            Self::Note => commands,
            Self::RangeTest => commands && why_not_check(model, now).is_none(),
            Self::Seen => acts && why_not_seen(model, now).is_none(),
            Self::Check | Self::CheckStill => acts && why_not_check(model, now).is_none(),
            Self::Acknowledge => !model.alarms.list().is_empty() && model.settings.role != Role::Replaying,
            Self::Follow => model.pages.held.is_some(),
            Self::Checklist => model.checklist.is_some(),
            Self::ReplayFlight => why_nothing_flown(model).is_none(),
            Self::Report => commands && why_nothing_flown(model).is_none(),
            Self::MovePin => {
                let is_ours = model.settings.demonstration && model.settings.role == Role::Station;
                is_ours && !model.vehicle.in_flight() && model.vehicle.interlocks().is_some()
            }
            Self::SignStep | Self::VoidStep => commands && model.checklist.is_some(),
            Self::Show(_) | Self::Hold | Self::Palette | Self::NextTheme | Self::Redraw | Self::Quit => true,
        }
    }

    /// One word for the row of the keys.
    pub fn short(self) -> &'static str {
        match self {
            Self::Acknowledge => "seen",
            Self::HoldCountdown => "hold",
            Self::Hold => "hold page",
            Self::RangeTest => "radio test",
            act => act.definition().map_or("", |definition| definition.name),
        }
    }

    /// Its definition; `None` for the page that shares another one's key.
    pub fn definition(self) -> Option<&'static Definition> {
        DEFINITIONS.iter().find(|definition| definition.act == self)
    }

    /// Ascent and descent share a definition.
    fn effect(self) -> Effect {
        self.definition().map_or(Effect::Shows, |definition| definition.effect)
    }

    /// Whether it commands the vehicle, or opens a dialog that does.
    pub fn opens_confirmation(self) -> bool {
        matches!(self.effect(), Effect::Asks | Effect::Commands)
    }

    /// Whether it changes only what is shown, or opens a dialog: it works however fast its key arrives.
    pub fn only_shows_or_asks(self, model: &Model) -> bool {
        if self == Self::Quit {
            model.is_at_risk()
        } else {
            matches!(self.effect(), Effect::Shows | Effect::Asks)
        }
    }
}

// Which key does what. The crew may choose other keys in the settings.
//
// Ctrl-X, Enter and Esc are not here and cannot be taken: the abort, the confirmations and the way out always keep
// their keys. An action that opens a ladder keeps a capital letter, so that no slip of a finger opens it.

/// The keys of all actions, in the order of [`DEFINITIONS`].
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(try_from = "BTreeMap<String, String>")]
pub struct Bindings([Key; DEFINITIONS.len()]);

impl Default for Bindings {
    fn default() -> Self {
        Self(DEFINITIONS.map(|definition| definition.usual))
    }
}

impl Bindings {
    /// The action of a key. A letter also counts with Shift, unless its capital letter has an action of its own.
    pub fn act(&self, key: Key) -> Option<Act> {
        self.exactly(key).or_else(|| match key {
            Key::Char(letter) if letter.is_ascii_uppercase() => {
                self.exactly(Key::Char(letter.to_ascii_lowercase()))
            }
            Key::F1 => Some(Act::Show(Page::Help)),
            Key::CtrlC => Some(Act::Quit),
            Key::Escape => Some(Act::Follow),
            _ => None,
        })
    }

    fn exactly(&self, key: Key) -> Option<Act> {
        let place = self.0.iter().position(|bound| *bound == key)?;
        Some(DEFINITIONS[place].act)
    }

    /// The key of an action, if it has one.
    pub fn key(&self, act: Act) -> Option<Key> {
        let place = DEFINITIONS.iter().position(|definition| definition.act == act)?;
        self.0.get(place).copied()
    }

    /// The name of the key of an action; empty without one.
    pub fn name(&self, act: Act) -> String {
        self.key(act).map_or_else(String::new, Key::name)
    }

    /// The action that this small letter would have opened as a capital letter.
    pub fn meant_as_capital(&self, letter: char) -> Option<Act> {
        self.exactly(Key::Char(letter.to_ascii_uppercase())).filter(|act| act.opens_confirmation())
    }
}

fn key_for(definition: &Definition, given: &str) -> Result<Key, String> {
    let action = definition.name;
    let mut letters = given.chars();
    let letter = match (given, letters.next(), letters.next()) {
        ("Space", ..) => ' ',
        (_, Some(letter), None) if letter.is_ascii_graphic() => letter,
        _ => {
            let give = "give one printable ASCII character or Space";
            return Err(format!("{action}: `{given}` cannot be chosen; {give}"));
        }
    };
    if definition.act.opens_confirmation() && !letter.is_ascii_uppercase() {
        return Err(format!("{action}: `{given}` is no capital letter, and {action} needs one"));
    }
    Ok(Key::Char(letter))
}

impl TryFrom<BTreeMap<String, String>> for Bindings {
    type Error = String;

    fn try_from(chosen: BTreeMap<String, String>) -> Result<Self, String> {
        let mut bindings = Self::default();
        for (name, given) in chosen {
            let place = DEFINITIONS.iter().position(|definition| definition.name == name);
            let names = || DEFINITIONS.map(|definition| definition.name).join(", ");
            let place = place.ok_or_else(|| format!("`{name}` is no action; give one of {}", names()))?;
            bindings.0[place] = key_for(&DEFINITIONS[place], &given)?;
        }
        for (place, key) in bindings.0.iter().enumerate() {
            if let Some(other) = bindings.0[..place].iter().position(|bound| bound == key) {
                let (first, second) = (DEFINITIONS[other].name, DEFINITIONS[place].name);
                let key = key.name();
                return Err(format!("{first} and {second} have the same key `{key}`; give each its own"));
            }
        }
        Ok(bindings)
    }
}

// The palette: every action with its key, and every number to plot; found by a part of its words.

/// How to abort.
pub const ABORT_WORDS: &str = "abort, anywhere: Enter within 2 s of Ctrl-X, or Ctrl-X twice";

/// What an entry of the palette does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PaletteAction {
    /// The same as its key.
    Act(Act),
    /// Only says which keys abort.
    TellAbort,
    /// Shows and commands this boot, of several vehicles under one id.
    Choose(u32),
    Plot(&'static Quantity),
}

#[derive(Debug, Clone, PartialEq)]
pub struct PaletteEntry {
    pub words: String,
    /// Empty without a key.
    pub key: String,
    pub action: PaletteAction,
}

/// The entries whose words contain every typed word.
pub fn palette_entries(model: &Model, typed: &str, now: Duration) -> Vec<PaletteEntry> {
    let typed = typed.to_lowercase();
    let fits =
        |entry: &PaletteEntry| typed.split_whitespace().all(|word| entry.words.to_lowercase().contains(word));
    every_entry(model, now).filter(fits).collect()
}

fn every_entry(model: &Model, now: Duration) -> impl Iterator<Item = PaletteEntry> {
    let entry = |words: String, key: String, action| PaletteEntry { words, key, action };
    let abort = entry(ABORT_WORDS.to_owned(), "Ctrl-X".to_owned(), PaletteAction::TellAbort);
    let acts = DEFINITIONS.iter().map(move |Definition { act, words, .. }| {
        entry((*words).to_owned(), model.settings.keys.name(*act), PaletteAction::Act(*act))
    });
    let others = model.other_boots(now);
    let own = model.vehicle.boot.number().filter(|_| !others.is_empty());
    let choices = own.into_iter().chain(others).map(move |boot| {
        let number = words::boot(boot);
        let words = format!("choose boot {number}: show and command this one of several vehicles");
        entry(words, String::new(), PaletteAction::Choose(boot))
    });
    let plots = quantity::ALL.iter().map(move |quantity| {
        entry(format!("plot {}", quantity.name), String::new(), PaletteAction::Plot(quantity))
    });
    std::iter::once(abort).chain(choices).chain(acts).chain(plots)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Page;
    use proptest::prelude::*;

    fn chosen(pairs: &[(&str, &str)]) -> Result<Bindings, String> {
        let pairs = pairs.iter().map(|(name, key)| ((*name).to_owned(), (*key).to_owned()));
        Bindings::try_from(pairs.collect::<BTreeMap<_, _>>())
    }

    #[test]
    fn the_usual_keys_are_each_used_once() {
        let usual = Bindings::default();
        for definition in &DEFINITIONS {
            assert_eq!(usual.act(definition.usual), Some(definition.act), "{}", definition.name);
        }
        assert_eq!(chosen(&[]), Ok(usual));
    }

    /// The ascent shares the key of the descent: it has no definition, and was the first action, which arms.
    #[test]
    fn an_action_without_a_definition_is_no_other_action() {
        let keys = Bindings::default();
        let defined =
            DEFINITIONS.iter().filter(|definition| keys.key(definition.act) == Some(definition.usual));
        assert_eq!(defined.count(), DEFINITIONS.len());
        let ascent = Act::Show(Page::Ascent);
        assert!(ascent.definition().is_none() && keys.key(ascent).is_none());
        assert_eq!(keys.name(ascent), "");
    }

    #[test]
    fn a_wrong_choice_is_refused_with_what_would_do() {
        let refused = |given: &str| chosen(&[given.split_once('=').unwrap()]).unwrap_err();
        assert!(refused("abort=x").contains("`abort` is no action; give one of arm, start"));
        let one = "give one printable ASCII character or Space";
        assert_eq!(refused("theme=Enter"), format!("theme: `Enter` cannot be chosen; {one}"));
        assert_eq!(refused("theme="), format!("theme: `` cannot be chosen; {one}"));
        assert_eq!(refused("arm=a"), "arm: `a` is no capital letter, and arm needs one");
        assert_eq!(refused("theme=t"), "plot and theme have the same key `t`; give each its own");
    }

    #[test]
    fn shift_counts_unless_the_capital_letter_has_its_own_action() {
        let keys = chosen(&[("theme", "a"), ("hold", "J")]).unwrap();
        assert_eq!(keys.act(Key::Char('a')), Some(Act::NextTheme));
        assert_eq!(keys.act(Key::Char('A')), Some(Act::Arm));
        assert_eq!(keys.act(Key::Char('T')), Some(Act::Tap));
        assert_eq!(keys.act(Key::Char('j')), None);
        assert_eq!(keys.meant_as_capital('d'), Some(Act::Disarm));
        assert_eq!(keys.meant_as_capital('h'), Some(Act::HoldCountdown));
        assert_eq!(keys.meant_as_capital('j'), None, "it opens no ladder");
    }

    proptest! {
        /// Whatever is chosen, the keys of the abort, of confirmations and of the way out keep their meaning.
        #[test]
        fn no_choice_takes_a_key_of_the_abort(
            pairs in prop::collection::vec((0..DEFINITIONS.len(), "[ -~]|Enter|Ctrl-X|Esc|Space"), 0..6),
        ) {
            let list: Vec<(&str, &str)> =
                pairs.iter().map(|(place, key)| (DEFINITIONS[*place].name, key.as_str())).collect();
            if let Ok(keys) = chosen(&list) {
                prop_assert_eq!(keys.act(Key::CtrlX), None);
                prop_assert_eq!(keys.act(Key::Enter), None);
                prop_assert_eq!(keys.act(Key::Escape), Some(Act::Follow));
                for act in [Act::Arm, Act::Start, Act::Disarm] {
                    let key = keys.key(act).unwrap();
                    prop_assert!(matches!(key, Key::Char(letter) if letter.is_ascii_uppercase()), "{key:?}");
                    prop_assert_eq!(keys.act(key), Some(act));
                }
            }
        }
    }
}
