//! The palette: every action with its key, and every number to plot or to pin; found by a part of its words.

use super::Model;
use super::act::{Act, DEFINITIONS};
use super::quantity::{self, Quantity};

/// How to abort.
pub const ABORT_WORDS: &str = "abort, from anywhere: Enter within 2 s of Ctrl-X (or Ctrl-X twice)";

/// What an entry of the palette does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Does {
    /// The same as its key.
    Act(Act),
    /// Only says which keys abort.
    TellAbort,
    Plot(&'static Quantity),
    Pin(&'static Quantity),
}

#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    pub words: String,
    /// Empty without a key.
    pub key: String,
    pub does: Does,
}

/// The entries whose words contain every typed word.
pub fn found(model: &Model, typed: &str) -> Vec<Entry> {
    let typed = typed.to_lowercase();
    let fits = |entry: &Entry| typed.split_whitespace().all(|word| entry.words.to_lowercase().contains(word));
    every(model).filter(fits).collect()
}

fn every(model: &Model) -> impl Iterator<Item = Entry> {
    let abort = Entry { words: ABORT_WORDS.to_owned(), key: "Ctrl-X".to_owned(), does: Does::TellAbort };
    let acts = DEFINITIONS.iter().map(|definition| Entry {
        words: definition.words.to_owned(),
        key: model.settings.keys.name(definition.act),
        does: Does::Act(definition.act),
    });
    let plots = quantity::ALL.iter().map(|quantity| Entry {
        words: format!("plot {}", quantity.name),
        key: String::new(),
        does: Does::Plot(quantity),
    });
    let pins = quantity::ALL.iter().map(|quantity| {
        let verb = if model.pages.pinned.contains(&quantity) { "unpin" } else { "pin" };
        Entry { words: format!("{verb} {}", quantity.name), key: String::new(), does: Does::Pin(quantity) }
    });
    std::iter::once(abort).chain(acts).chain(plots).chain(pins)
}
