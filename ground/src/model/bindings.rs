//! Which key does what. The crew may choose other keys in the settings.
//!
//! Ctrl-X, Enter and Esc are not here and cannot be taken: the abort, the confirmations and the way out always keep
//! their keys. An action that opens a ladder keeps a capital letter, so that no slip of a finger opens it.

use std::collections::BTreeMap;
use std::str::FromStr;

use serde::Deserialize;

use super::act::{Act, DEFINITIONS, Definition};
use crate::key::Key;

/// The keys of all actions, in the order of [`DEFINITIONS`].
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(try_from = "BTreeMap<String, String>")]
pub struct Bindings([Key; DEFINITIONS.len()]);

impl Default for Bindings {
    fn default() -> Self {
        Self(DEFINITIONS.map(|definition| definition.usual))
    }
}

/// Why keys cannot be chosen so.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum BindingError {
    #[error("`{given}` is no action; give one of {}", names())]
    UnknownAction { given: String },
    #[error("{action}: `{given}` cannot be chosen; give one printable ASCII character or Space")]
    UnknownKey { action: &'static str, given: String },
    #[error("{action}: `{given}` is no capital letter, and {action} needs one")]
    NotCapital { action: &'static str, given: String },
    #[error("{first} and {second} have the same key `{key}`; give each its own")]
    Twice { first: &'static str, second: &'static str, key: String },
    #[error("`{given}` is no list of keys; give ACTION=KEY,ACTION=KEY, as in theme=w,path=m")]
    NoList { given: String },
}

fn names() -> String {
    DEFINITIONS.map(|definition| definition.name).join(", ")
}

impl Bindings {
    /// The action of a key. A letter also counts with Shift, unless its capital letter has an action of its own.
    pub fn act(&self, key: Key) -> Option<Act> {
        self.exactly(key).or_else(|| match key {
            Key::Char(letter) if letter.is_ascii_uppercase() => {
                self.exactly(Key::Char(letter.to_ascii_lowercase()))
            }
            Key::F1 => Some(Act::Show(super::page::Page::Help)),
            Key::CtrlC => Some(Act::Quit),
            Key::Escape => Some(Act::Follow),
            _ => None,
        })
    }

    fn exactly(&self, key: Key) -> Option<Act> {
        let place = self.0.iter().position(|bound| *bound == key)?;
        Some(DEFINITIONS[place].act)
    }

    /// The key of an action.
    pub fn key(&self, act: Act) -> Key {
        let place = DEFINITIONS.iter().position(|definition| definition.act == act);
        self.0[place.unwrap_or(0)]
    }

    /// The name of the key of an action.
    pub fn name(&self, act: Act) -> String {
        self.key(act).name()
    }

    /// The action that this small letter would have opened as a capital letter.
    pub fn meant_as_capital(&self, letter: char) -> Option<Act> {
        self.exactly(Key::Char(letter.to_ascii_uppercase())).filter(|act| act.opens_ladder())
    }

    fn chosen<'a>(pairs: impl Iterator<Item = (&'a str, &'a str)>) -> Result<Self, BindingError> {
        let mut bindings = Self::default();
        for (name, given) in pairs {
            let place = DEFINITIONS.iter().position(|definition| definition.name == name);
            let place = place.ok_or_else(|| BindingError::UnknownAction { given: name.to_owned() })?;
            bindings.0[place] = key_for(&DEFINITIONS[place], given)?;
        }
        for (place, key) in bindings.0.iter().enumerate() {
            if let Some(other) = bindings.0[..place].iter().position(|bound| bound == key) {
                let (first, second) = (DEFINITIONS[other].name, DEFINITIONS[place].name);
                return Err(BindingError::Twice { first, second, key: key.name() });
            }
        }
        Ok(bindings)
    }
}

fn key_for(definition: &Definition, given: &str) -> Result<Key, BindingError> {
    let action = definition.name;
    let mut letters = given.chars();
    let letter = match (given, letters.next(), letters.next()) {
        ("Space", ..) => ' ',
        (_, Some(letter), None) if letter.is_ascii_graphic() => letter,
        _ => return Err(BindingError::UnknownKey { action, given: given.to_owned() }),
    };
    if definition.act.opens_ladder() && !letter.is_ascii_uppercase() {
        return Err(BindingError::NotCapital { action, given: given.to_owned() });
    }
    Ok(Key::Char(letter))
}

impl TryFrom<BTreeMap<String, String>> for Bindings {
    type Error = BindingError;

    fn try_from(given: BTreeMap<String, String>) -> Result<Self, BindingError> {
        Self::chosen(given.iter().map(|(name, key)| (name.as_str(), key.as_str())))
    }
}

impl FromStr for Bindings {
    type Err = BindingError;

    fn from_str(given: &str) -> Result<Self, BindingError> {
        let pairs: Option<Vec<(&str, &str)>> = given.split(',').map(|pair| pair.split_once('=')).collect();
        let pairs = pairs.ok_or_else(|| BindingError::NoList { given: given.to_owned() })?;
        Self::chosen(pairs.into_iter())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::page::Page;
    use proptest::prelude::*;

    #[test]
    fn the_usual_keys_are_each_used_once() {
        let usual = Bindings::default();
        for definition in &DEFINITIONS {
            assert_eq!(usual.act(definition.usual), Some(definition.act), "{}", definition.name);
        }
        assert_eq!(Bindings::chosen(std::iter::empty()), Ok(usual));
    }

    #[test]
    fn a_wrong_choice_is_refused_with_what_would_do() {
        let refused = |given: &str| given.parse::<Bindings>().unwrap_err().to_string();
        assert!(refused("abort=x").contains("`abort` is no action; give one of arm, start"));
        assert!(refused("theme=Enter").contains("one printable ASCII character"));
        assert!(refused("theme=").contains("theme: ``"));
        assert!(refused("arm=a").contains("no capital letter"));
        assert!(refused("theme=p").contains("path and theme have the same key `p`"));
        assert!(refused("theme").contains("ACTION=KEY"));
    }

    #[test]
    fn shift_counts_unless_the_capital_letter_has_its_own_action() {
        let keys: Bindings = "theme=a,hold=J".parse().unwrap();
        assert_eq!(keys.act(Key::Char('a')), Some(Act::NextTheme));
        assert_eq!(keys.act(Key::Char('A')), Some(Act::Arm));
        assert_eq!(keys.act(Key::Char('P')), Some(Act::Show(Page::Path)));
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
            if let Ok(keys) = Bindings::chosen(list.into_iter()) {
                prop_assert_eq!(keys.act(Key::CtrlX), None);
                prop_assert_eq!(keys.act(Key::Enter), None);
                prop_assert_eq!(keys.act(Key::Escape), Some(Act::Follow));
                for act in [Act::Arm, Act::Start, Act::Disarm] {
                    let key = keys.key(act);
                    prop_assert!(matches!(key, Key::Char(letter) if letter.is_ascii_uppercase()), "{key:?}");
                    prop_assert_eq!(keys.act(key), Some(act));
                }
            }
        }
    }
}
