//! Every action of one key, with its name, its key and its words; and the palette, which lists
//! them.
//!
//! The abort is not among them. What commands the vehicle only opens a dialog.

use std::time::Duration;

use super::quantity::{self, Quantity};
use super::{
    Checklist, Mark, Model, Page, Role, Vehicle, why_not_arm, why_not_check, why_not_here, why_not_seen,
    why_not_start, why_not_take, words,
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
    /// Open the dialog that confirms that every surface moved as it should.
    Seen,
    /// Begin the radio range test.
    RangeTest,
    Acknowledge,
    /// Show the checklist on the Pad page, or the arming checks again.
    Checklist,
    /// Show the flight just flown again.
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

/// An action: its name, its key and its effect in words.
pub struct Definition {
    effect: Effect,
    pub act: Act,
    pub name: &'static str,
    pub key: Key,
    pub words: &'static str,
}

/// What a key may do immediately.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Effect {
    /// Changes only what is shown.
    Shows,
    /// Opens a dialog that commands the vehicle.
    Confirms,
    /// Commands the vehicle, and moves nothing.
    Commands,
    /// Does something else.
    Acts,
}

const fn row(effect: Effect, act: Act, name: &'static str, key: char, words: &'static str) -> Definition {
    Definition { effect, act, name, key: Key::Char(key), words }
}

use Effect::{Acts, Commands, Confirms, Shows};

/// Every action; the most important first.
pub const DEFINITIONS: [Definition; 35] = [
    row(Confirms, Act::Arm, "arm", 'A', "arm: then type ARM and Enter within 10 s"),
    row(Confirms, Act::Start, "start", 'S', "start the countdown: then type START and Enter within 10 s"),
    row(Confirms, Act::Disarm, "disarm", 'D', "disarm: then Enter within 5 s"),
    row(Confirms, Act::HoldCountdown, "hold-countdown", 'H', "hold the countdown: then Enter within 5 s"),
    row(Commands, Act::Tap, "tap", 'T', "two people: tap twice a second, from the start to the release"),
    row(Confirms, Act::TakeCommand, "take", 'C', "take command from a silent station: then TAKE and Enter"),
    row(Confirms, Act::Check, "check", 'X', "check the vehicle: then Enter; fins and gimbal MOVE"),
    row(Confirms, Act::CheckStill, "check-still", 'E', "the same check without motion: then Enter"),
    row(Confirms, Act::Seen, "moved-right", 'Y', "every surface moved as page x says: then SEEN and Enter"),
    row(Commands, Act::RangeTest, "range-test", 'U', "radio range test: 30 s, nothing is commanded"),
    row(Acts, Act::Acknowledge, "acknowledge", ' ', "acknowledge the shown alarm"),
    row(Shows, Act::Checklist, "checklist", 'k', "the checklist on the Pad page; Up and Down choose a step"),
    row(Confirms, Act::SignStep, "sign", 'G', "sign the chosen step of the checklist: then Enter within 5 s"),
    row(Confirms, Act::VoidStep, "void", 'V', "take a step's signature back: then Enter within 5 s"),
    row(Shows, Act::Show(Page::Pad), "pad", '1', "page: arming checks and ladder"),
    row(Shows, Act::Show(Page::Descent), "flight", '2', "page: ascent and descent"),
    row(Shows, Act::Show(Page::Landing), "landing", '3', "page: the burn"),
    row(Shows, Act::Show(Page::Review), "review", '4', "page: verdict, limits, what went wrong"),
    row(Shows, Act::Show(Page::Link), "link", '5', "page: link rates and the age of every message"),
    row(Shows, Act::Show(Page::Messages), "texts", '6', "page: events and messages"),
    row(Shows, Act::Show(Page::Log), "log", '7', "page: the recording"),
    row(Shows, Act::Show(Page::Alarms), "alarms", '8', "page: every alarm"),
    row(Shows, Act::Show(Page::Find), "find", 'f', "page: where to look for the vehicle, and the way there"),
    row(Shows, Act::Show(Page::Checks), "checks", 'x', "page: pad checks, radio range, battery and storage"),
    row(Shows, Act::Show(Page::Plot), "plot", 't', "page: every number, and one of them over time"),
    row(Shows, Act::Show(Page::Help), "help", '?', "page: the keys that work now"),
    row(Shows, Act::Hold, "hold", 'h', "hold this page, or follow the flight again"),
    row(Shows, Act::Follow, "follow", '0', "follow the flight again (Esc does too)"),
    row(Shows, Act::Palette, "palette", ':', "list every action; type a part of its words"),
    row(Shows, Act::Note, "note", 'n', "a note into log and book: type it, then Enter"),
    row(Shows, Act::NextTheme, "theme", 'c', "colours: dark, light for sunlight, none"),
    row(Acts, Act::Report, "report", 'W', "write the report of the flight beside the log"),
    row(Acts, Act::MovePin, "pin", 'I', "demonstration: put the vehicle's pin in, or pull it, by hand"),
    Definition { key: Key::CtrlL, ..row(Shows, Act::Redraw, "redraw", ' ', "draw the screen again") },
    row(Acts, Act::Quit, "quit", 'q', "quit; while it is not over: then type QUIT and Enter"),
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
            Self::Tap => acts && model.tapping(now).is_some_and(|(by, _)| by == model.seat_key()),
            Self::TakeCommand => acts && why_not_take(model, now).is_none(),
            Self::Note => commands,
            Self::RangeTest => commands && why_not_check(model, now).is_none(),
            Self::Seen => acts && why_not_seen(model, now).is_none(),
            Self::Check | Self::CheckStill => acts && why_not_check(model, now).is_none(),
            Self::Acknowledge => !model.alarms.list().is_empty() && model.settings.role != Role::Replaying,
            Self::Follow => model.pages.held.is_some(),
            Self::Checklist => model.checklist.is_some(),
            Self::Report => commands && why_nothing_flown(model).is_none(),
            Self::MovePin => {
                let is_ours = model.settings.demonstration && model.settings.role == Role::Station;
                is_ours && !model.vehicle.in_flight() && model.vehicle.interlocks().is_some()
            }
            Self::SignStep | Self::VoidStep => {
                let is_signed = |list: &Checklist| {
                    let step = model.chosen_step(now).and_then(|step| list.steps.get(step));
                    step.is_some_and(|step| matches!(step.mark, Mark::Signed(_)) == (self == Self::VoidStep))
                };
                commands && model.checklist.as_ref().is_some_and(is_signed)
            }
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
        matches!(self.effect(), Effect::Confirms | Effect::Commands)
    }

    /// Whether it changes only the display, or opens a dialog: then its key works at any typing
    /// speed.
    pub fn is_harmless(self, model: &Model) -> bool {
        if self == Self::Quit {
            model.is_at_risk()
        } else {
            matches!(self.effect(), Effect::Shows | Effect::Confirms)
        }
    }
}

// Ctrl-X, Enter and Esc have no action: the abort, the confirmations and the way out. An action
// that opens a ladder has a capital letter, so that no slip of a finger opens it.

impl Act {
    /// The action of a key. A letter also counts with Shift, unless its capital letter has an
    /// action.
    pub fn of_key(key: Key) -> Option<Self> {
        Self::exactly(key).or_else(|| match key {
            Key::Char(letter) if letter.is_ascii_uppercase() => {
                Self::exactly(Key::Char(letter.to_ascii_lowercase()))
            }
            Key::F1 => Some(Self::Show(Page::Help)),
            Key::CtrlC => Some(Self::Quit),
            Key::Escape => Some(Self::Follow),
            _ => None,
        })
    }

    fn exactly(key: Key) -> Option<Self> {
        DEFINITIONS.iter().find(|definition| definition.key == key).map(|definition| definition.act)
    }

    /// The name of the action's key; empty without one.
    pub fn key_name(self) -> String {
        self.definition().map_or_else(String::new, |definition| definition.key.name())
    }

    /// The action of the capital letter, if it opens a confirmation.
    pub fn of_small_letter(letter: char) -> Option<Self> {
        Self::exactly(Key::Char(letter.to_ascii_uppercase())).filter(|act| act.opens_confirmation())
    }
}

// The palette: every action with its key, and every number to plot; found by a part of its words.

/// How to abort.
pub const ABORT_WORDS: &str = "abort, anywhere: Enter within 2 s, or Ctrl-X twice";

/// What an entry of the palette does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PaletteAction {
    /// The same as its key.
    Act(Act),
    /// Only explains which keys abort.
    ExplainAbort,
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
    let entry = |words: String, key: String, action| PaletteEntry { words, key, action };
    let abort = entry(ABORT_WORDS.to_owned(), "Ctrl-X".to_owned(), PaletteAction::ExplainAbort);
    let acts = DEFINITIONS.iter().map(move |Definition { act, key, words, .. }| {
        entry((*words).to_owned(), key.name(), PaletteAction::Act(*act))
    });
    let others = model.other_boots(now);
    let shown = model.vehicle.boot.number().filter(|_| !others.is_empty());
    let choices = shown.into_iter().chain(others).map(move |boot| {
        let number = words::boot(boot);
        let words = format!("choose boot {number}: show and command this one of several vehicles");
        entry(words, String::new(), PaletteAction::Choose(boot))
    });
    let plots = quantity::ALL.iter().map(move |quantity| {
        entry(format!("plot {}", quantity.name), String::new(), PaletteAction::Plot(quantity))
    });
    std::iter::once(abort).chain(choices).chain(acts).chain(plots).filter(fits).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_key_is_used_once_and_a_ladder_has_a_capital_letter() {
        for definition in &DEFINITIONS {
            assert_eq!(Act::of_key(definition.key), Some(definition.act), "{}", definition.name);
            if definition.act.opens_confirmation() {
                let is_capital = matches!(definition.key, Key::Char(letter) if letter.is_ascii_uppercase());
                assert!(is_capital, "{}", definition.name);
            }
        }
    }

    #[test]
    fn no_action_takes_a_key_of_the_abort_or_of_the_way_out() {
        assert_eq!(Act::of_key(Key::CtrlX), None);
        assert_eq!(Act::of_key(Key::Enter), None);
        assert_eq!(Act::of_key(Key::Escape), Some(Act::Follow));
    }

    /// The ascent shares the key of the descent: it has no definition, and was the first action,
    /// which arms.
    #[test]
    fn an_action_without_a_definition_is_no_other_action() {
        let ascent = Act::Show(Page::Ascent);
        assert!(ascent.definition().is_none());
        assert_eq!(ascent.key_name(), "");
    }

    #[test]
    fn shift_is_ignored_unless_the_capital_letter_has_an_action() {
        assert_eq!(Act::of_key(Key::Char('F')), Some(Act::Show(Page::Find)));
        assert_eq!(Act::of_key(Key::Char('T')), Some(Act::Tap));
        assert_eq!(Act::of_key(Key::Char('j')), None);
        assert_eq!(Act::of_small_letter('d'), Some(Act::Disarm));
        assert_eq!(Act::of_small_letter('h'), Some(Act::HoldCountdown));
        assert_eq!(Act::of_small_letter('r'), None, "it opens no ladder");
    }
}
