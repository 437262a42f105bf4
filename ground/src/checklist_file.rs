//! Reads a checklist (TOML) and the list of its signatures, and writes one signature as text.
//!
//! The signatures are in a file of their own that only grows: one `[[entry]]` for each change, so that nothing that was
//! signed is ever lost, and an entry that was cut off by a crash hides no other.

use std::fmt::Write as _;

use protocol::dialect::TdRole;
use serde::Deserialize;
use sha2::{Digest as _, Sha256};

use crate::model::checklist::{
    Checklist, ChecklistEntry, Limits, Mark, STEPS_MAX, Signature, Step, WORDS_MAX,
};
use crate::model::quantity::{self, Quantity};

/// A signature older than this, when the station starts, no longer counts: it was for another day.
pub const SIGNED_FOR_S: u64 = 12 * 3_600;
/// How far ahead of the clock a signature may be: clocks of laptops differ.
const AHEAD_MAX_S: u64 = 600;
/// Bytes of a checklist's hash.
const HASH_BYTES: usize = 8;
/// What every entry of the list of signatures begins with.
const ENTRY: &str = "[[entry]]";
/// The last line of every entry.
const END: &str = "\nwhole = true\n";

/// Why a checklist cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ChecklistError {
    #[error(transparent)]
    Parse(#[from] toml::de::Error),
    #[error("give a checklist from 1 to {STEPS_MAX} steps, not {0}")]
    StepCount(usize),
    #[error("step {number}: {why}")]
    Step { number: usize, why: String },
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum RoleName {
    RangeSafety,
    Flight,
    Pad,
    Anybody,
}

/// The file as it is written.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    name: String,
    mission: Option<String>,
    #[serde(default)]
    step: Vec<WrittenStep>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenStep {
    words: String,
    signs: RoleName,
    value: Option<String>,
    least: Option<f64>,
    most: Option<f64>,
}

/// Reads the text of a checklist. Every step is open.
///
/// # Errors
/// It is not TOML of this shape, or a step is wrong; the message says which and what would do.
pub fn parse(text: &str) -> Result<Checklist, ChecklistError> {
    let written: Written = toml::from_str(text)?;
    let count = written.step.len();
    if !(1..=STEPS_MAX).contains(&count) {
        return Err(ChecklistError::StepCount(count));
    }
    let step = |(place, step): (usize, WrittenStep)| {
        step.checked().map_err(|why| ChecklistError::Step { number: place + 1, why })
    };
    let steps = written.step.into_iter().enumerate().map(step).collect::<Result<_, _>>()?;
    Ok(Checklist { name: printable(&written.name), mission: written.mission, hash: hash(text), steps })
}

/// The beginning of the SHA-256, as hexadecimal digits.
fn hash(text: &str) -> String {
    Sha256::digest(text).iter().take(HASH_BYTES).fold(String::new(), |mut digits, byte| {
        // Writing to a string cannot fail.
        let _ = write!(digits, "{byte:02x}");
        digits
    })
}

fn printable(text: &str) -> String {
    protocol::text::printable(text.as_bytes()).chars().take(WORDS_MAX).collect()
}

impl WrittenStep {
    fn checked(self) -> Result<Step, String> {
        let length = self.words.chars().count();
        if !(1..=WORDS_MAX).contains(&length) {
            return Err(format!("words: give 1 to {WORDS_MAX} characters, not {length}"));
        }
        let value = match (self.value, self.least, self.most) {
            (None, None, None) => None,
            (None, ..) => return Err("least and most need a value".to_owned()),
            (Some(_), None, None) => return Err("a value needs least, most or both".to_owned()),
            (Some(name), least, most) => {
                let quantity = Quantity::named(&name)
                    .ok_or_else(|| format!("`{name}` is no value; give one of {}", names()))?;
                let ordered = least.zip(most).is_none_or(|(least, most)| least <= most);
                let finite = [least, most].into_iter().flatten().all(f64::is_finite);
                if !(ordered && finite) {
                    return Err("least and most must be numbers, least not above most".to_owned());
                }
                Some(Limits { quantity, least, most })
            }
        };
        let role = match self.signs {
            RoleName::RangeSafety => Some(TdRole::TD_ROLE_RANGE_SAFETY),
            RoleName::Flight => Some(TdRole::TD_ROLE_FLIGHT),
            RoleName::Pad => Some(TdRole::TD_ROLE_PAD),
            RoleName::Anybody => None,
        };
        Ok(Step { words: printable(&self.words), role, value, mark: Mark::Open })
    }
}

fn names() -> String {
    quantity::ALL.iter().map(|quantity| quantity.name).collect::<Vec<_>>().join(", ")
}

/// An entry of the list of signatures.
#[derive(Debug, Deserialize)]
struct WrittenEntry {
    checklist: String,
    unix_s: u64,
    what: What,
    step: Option<usize>,
    by: Option<String>,
    role: Option<String>,
    found: Option<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum What {
    Signed,
    Voided,
    Flown,
}

/// What a list of signatures holds for a checklist.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Remembered {
    /// The changes of this checklist, in their order, without those that are too old.
    pub entries: Vec<ChecklistEntry>,
    /// How many signatures are too old, or from the future.
    pub outdated: usize,
    /// How many entries cannot be read.
    pub broken: usize,
}

/// Reads a list of signatures for a checklist of this hash.
pub fn remembered(list: &str, hash: &str, now_unix_s: u64) -> Remembered {
    let mut found = Remembered::default();
    for part in list.split(ENTRY).skip(1) {
        // An entry that a crash cut off lacks its last line.
        let whole = part.split_once(END).map(|(entry, _)| entry);
        let Some(entry) = whole.and_then(|entry| toml::from_str::<WrittenEntry>(entry).ok()) else {
            found.broken += 1;
            continue;
        };
        if entry.checklist != hash {
            continue;
        }
        let age_s = now_unix_s.saturating_sub(entry.unix_s);
        let counts = age_s <= SIGNED_FOR_S && entry.unix_s <= now_unix_s + AHEAD_MAX_S;
        match entry.read() {
            None => found.broken += 1,
            Some(ChecklistEntry::Signed { .. }) if !counts => found.outdated += 1,
            Some(entry) => found.entries.push(entry),
        }
    }
    found
}

impl WrittenEntry {
    fn read(self) -> Option<ChecklistEntry> {
        let signature = Signature {
            by: printable(&self.by.unwrap_or_default()),
            role: self.role.as_deref().and_then(role_of),
            unix_s: self.unix_s,
            found: self.found,
        };
        let step = self.step.and_then(|number| number.checked_sub(1));
        match self.what {
            What::Flown => Some(ChecklistEntry::Flown { unix_s: self.unix_s }),
            What::Signed => Some(ChecklistEntry::Signed { step: step?, signature }),
            What::Voided => Some(ChecklistEntry::Voided { step: step?, signature }),
        }
    }
}

/// The text of an entry, to be added at the end of the list.
pub fn entry_text(hash: &str, entry: &ChecklistEntry) -> String {
    let (what, unix_s, step) = match entry {
        ChecklistEntry::Signed { step, signature } => ("signed", signature.unix_s, Some((step, signature))),
        ChecklistEntry::Voided { step, signature } => ("voided", signature.unix_s, Some((step, signature))),
        ChecklistEntry::Flown { unix_s } => ("flown", *unix_s, None),
    };
    let mut text = format!("\n{ENTRY}\nchecklist = \"{hash}\"\nunix_s = {unix_s}\nwhat = \"{what}\"\n");
    if let Some((step, signature)) = step {
        let by = toml::Value::String(signature.by.clone());
        // Writing to a string cannot fail.
        let _ = writeln!(text, "step = {}\nby = {by}", step + 1);
        if let Some(role) = signature.role {
            let _ = writeln!(text, "role = \"{}\"", role_word(role));
        }
        if let Some(found) = signature.found.filter(|found| found.is_finite()) {
            let _ = writeln!(text, "found = {found:?}");
        }
    }
    text.truncate(text.trim_end().len());
    text + END
}

/// As in the crew file.
pub fn role_word(role: TdRole) -> &'static str {
    match role {
        TdRole::TD_ROLE_OBSERVER => "observer",
        TdRole::TD_ROLE_RANGE_SAFETY => "range-safety",
        TdRole::TD_ROLE_FLIGHT => "flight",
        TdRole::TD_ROLE_PAD => "pad",
    }
}

fn role_of(word: &str) -> Option<TdRole> {
    let roles =
        [TdRole::TD_ROLE_OBSERVER, TdRole::TD_ROLE_RANGE_SAFETY, TdRole::TD_ROLE_FLIGHT, TdRole::TD_ROLE_PAD];
    roles.into_iter().find(|role| role_word(*role) == word)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const SHIPPED: &str = include_str!("../checklist-example.toml");

    #[test]
    fn the_shipped_example_is_a_checklist() {
        let list = parse(SHIPPED).unwrap();
        assert!(list.steps.len() >= 6 && list.steps.iter().any(|step| step.value.is_some()));
        assert!(list.steps.iter().all(|step| step.mark == Mark::Open));
    }

    #[test]
    fn a_wrong_step_is_named_with_what_would_do() {
        let refused = |step: &str| {
            let text = format!("name = \"a\"\n[[step]]\n{step}");
            parse(&text).unwrap_err().to_string()
        };
        assert!(refused("words = \"\"\nsigns = \"pad\"").contains("step 1: words: give 1 to 60"));
        assert!(refused("words = \"a\"\nsigns = \"cook\"").contains("range-safety"));
        assert!(refused("words = \"a\"\nsigns = \"pad\"\nleast = 1.0").contains("need a value"));
        let unknown = refused("words = \"a\"\nsigns = \"pad\"\nvalue = \"x\"\nmost = 1.0");
        assert!(unknown.contains("`x` is no value; give one of height"), "{unknown}");
        let value =
            |limits: &str| refused(&format!("words = \"a\"\nsigns = \"pad\"\nvalue = \"tilt\"\n{limits}"));
        assert!(value("least = 2.0\nmost = 1.0").contains("least not above most"));
        assert!(value("most = nan").contains("must be numbers"));
        assert!(value("").contains("needs least, most or both"));
        assert!(parse("name = \"a\"").unwrap_err().to_string().contains("not 0"));
        assert!(refused("words = \"a\"\nsigns = \"pad\"\ncolour = 1").contains("colour"));
    }

    fn signed(step: usize, unix_s: u64) -> ChecklistEntry {
        let signature = Signature {
            by: "Ann \"x\" \\ ü".to_owned(),
            role: Some(TdRole::TD_ROLE_RANGE_SAFETY),
            unix_s,
            found: Some(7.25),
        };
        ChecklistEntry::Signed { step, signature }
    }

    #[test]
    fn what_was_written_is_remembered_for_the_same_text_and_the_same_day() {
        let now = 1_800_000_000;
        let mut list = entry_text("old", &signed(0, now));
        list += &entry_text("hash", &signed(1, now - SIGNED_FOR_S - 1));
        list += &entry_text("hash", &signed(2, now + AHEAD_MAX_S + 1));
        list += &entry_text("hash", &signed(3, now - 60));
        list += &entry_text("hash", &ChecklistEntry::Flown { unix_s: now });
        let found = remembered(&list, "hash", now);
        assert_eq!(found.entries, [signed(3, now - 60), ChecklistEntry::Flown { unix_s: now }]);
        assert_eq!((found.outdated, found.broken), (2, 0));
    }

    /// A crash while an entry is written must not hide the others, nor count the half as a whole.
    #[test]
    fn an_entry_that_was_cut_off_hides_no_other() {
        let whole = entry_text("hash", &signed(0, 100));
        for end in 0..whole.len() {
            if !whole.is_char_boundary(end) {
                continue;
            }
            let list = format!("{whole}{}{whole}", &whole[..end]);
            let found = remembered(&list, "hash", 100);
            assert!(found.entries.len() >= 2, "{end}: {found:?}");
            assert!(
                found.entries.iter().all(|entry| matches!(entry, ChecklistEntry::Signed { step: 0, .. }))
            );
        }
    }

    proptest! {
        #[test]
        fn no_text_causes_a_panic(text in ".*", list in "(\\[\\[entry\\]\\]\n)?.*") {
            let _ = parse(&text);
            let _ = remembered(&list, "hash", 100);
        }
    }
}
