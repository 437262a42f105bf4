//! The checklist of a mission: its steps, who signs each, and what has been signed; and its text
//! form. The station stores it; every screen of the station shows the same. The station does not
//! arm before every step is done.

use std::time::Duration;

use protocol::dialect::TdRole;
use protocol::text::shown;
use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};

use super::quantity::{self, Quantity};
use super::{FlownMission, Model, words};

/// The most steps of a checklist.
pub const STEPS_MAX: usize = 40;
/// The longest text of a step, in characters.
pub const WORDS_MAX: usize = 60;

/// The steps of one mission and how far they are done.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Checklist {
    pub name: String,
    /// The name of the only mission that it applies to, as the vehicle reports it; `None` for any.
    pub mission: Option<String>,
    /// The first eight bytes of the SHA-256 of its text, as hexadecimal digits. Signatures count
    /// for this text only.
    pub hash: String,
    pub steps: Vec<Step>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Step {
    /// The action or observation.
    pub words: String,
    /// The role that signs; `None` for anybody who may command.
    #[serde(with = "role_words")]
    pub role: Option<TdRole>,
    /// A value of the vehicle that must be within its limits when the step is signed, and while it
    /// counts.
    pub value: Option<Limits>,
    pub mark: Mark,
}

/// A value that the vehicle sends, with its limits.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Limits {
    #[serde(with = "quantity_name")]
    pub quantity: &'static Quantity,
    pub least: Option<f64>,
    pub most: Option<f64>,
}

impl Limits {
    pub fn hold(&self, value: f64) -> bool {
        self.least.is_none_or(|least| value >= least) && self.most.is_none_or(|most| value <= most)
    }

    /// As in `7.4 to 8.5 V`.
    pub fn words(&self) -> String {
        let unit = self.quantity.unit;
        match (self.least, self.most) {
            (Some(least), Some(most)) => format!("{least} to {most} {unit}"),
            (Some(least), None) => format!("at least {least} {unit}"),
            (None, Some(most)) => format!("at most {most} {unit}"),
            (None, None) => "any value".to_owned(),
        }
    }
}

/// The status of a step.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub enum Mark {
    #[default]
    Open,
    Signed(Signature),
    /// The signature was taken back: the step must be signed again.
    Voided(Signature),
}

/// Who signed or voided a step, and when.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Signature {
    pub by: String,
    /// The signer's role in the crew; `None` without a crew.
    #[serde(with = "role_words")]
    pub role: Option<TdRole>,
    /// Seconds since 1970, UTC.
    pub unix_s: u64,
    /// The value found at that moment.
    pub found: Option<f64>,
}

/// Whether a step counts now.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StepState {
    Open,
    Done,
    Voided,
    /// Signed, but the value has left its limits since.
    Outside,
    /// Signed, but the value is no longer received.
    Unknown,
}

/// A quantity for a screen: its name.
mod quantity_name {
    use serde::{Deserialize, Deserializer, Serializer, de};

    use super::Quantity;

    pub(super) fn serialize<S: Serializer>(quantity: &Quantity, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(quantity.name)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<&'static Quantity, D::Error> {
        let name = <&str>::deserialize(from)?;
        Quantity::named(name).ok_or_else(|| de::Error::custom("an unknown value"))
    }
}

/// A role for a screen: its word in the crew file; empty without one.
mod role_words {
    use serde::{Deserialize, Deserializer, Serializer, de};

    use super::{TdRole, role_of, role_word};

    #[expect(clippy::ref_option, clippy::trivially_copy_pass_by_ref, reason = "serde gives the field itself")]
    pub(super) fn serialize<S: Serializer>(role: &Option<TdRole>, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(&role.map_or_else(String::new, role_word))
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Option<TdRole>, D::Error> {
        match <&str>::deserialize(from)? {
            "" => Ok(None),
            word => role_of(word).map(Some).ok_or_else(|| de::Error::custom("an unknown role")),
        }
    }
}

/// A change of a checklist, for the file of its signatures.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum ChecklistEntry {
    /// A step was signed, or its signature taken back.
    Marked { step: usize, mark: Mark },
    /// The vehicle has left the pad: every step is open for the next flight.
    Flown { unix_s: u64 },
}

impl Checklist {
    /// Applies a change. Returns false if there is no such step.
    pub fn apply(&mut self, entry: &ChecklistEntry) -> bool {
        match entry {
            ChecklistEntry::Marked { step, mark } => {
                self.steps.get_mut(*step).map(|step| step.mark = mark.clone()).is_some()
            }
            ChecklistEntry::Flown { .. } => {
                self.steps.iter_mut().for_each(|step| step.mark = Mark::Open);
                true
            }
        }
    }

    pub fn is_touched(&self) -> bool {
        self.steps.iter().any(|step| step.mark != Mark::Open)
    }
}

impl Model {
    /// Whether a step counts now.
    pub fn step_state(&self, step: &Step, now: Duration) -> StepState {
        match (&step.mark, &step.value) {
            (Mark::Open, _) => StepState::Open,
            (Mark::Voided(_), _) => StepState::Voided,
            (Mark::Signed(_), None) => StepState::Done,
            (Mark::Signed(_), Some(limits)) => match self.fresh(limits, now) {
                None => StepState::Unknown,
                Some(value) if limits.hold(value) => StepState::Done,
                Some(_) => StepState::Outside,
            },
        }
    }

    /// The value of a step, if it is still received.
    pub fn fresh(&self, limits: &Limits, now: Duration) -> Option<f64> {
        let sample = limits.quantity.read(self, now).filter(|sample| !sample.is_stale(now));
        sample.map(|sample| sample.value)
    }

    /// How many steps of the checklist are done, and of how many; `None` without a checklist.
    pub fn steps_done(&self, now: Duration) -> Option<(usize, usize)> {
        let checklist = self.checklist.as_ref()?;
        let is_done = |step: &&Step| self.step_state(step, now) == StepState::Done;
        Some((checklist.steps.iter().filter(is_done).count(), checklist.steps.len()))
    }

    /// The first step that does not count yet.
    pub fn first_open_step(&self, now: Duration) -> Option<usize> {
        let steps = &self.checklist.as_ref()?.steps;
        steps.iter().position(|step| self.step_state(step, now) != StepState::Done)
    }

    /// The step that the crew has chosen, otherwise the first that does not count yet.
    pub fn chosen_step(&self, now: Duration) -> Option<usize> {
        let count = self.checklist.as_ref()?.steps.len();
        let last = count.checked_sub(1)?;
        Some(self.pages.step.or_else(|| self.first_open_step(now)).unwrap_or(last).min(last))
    }

    /// Why the checklist is not done; `None` if it is, and without one.
    pub fn why_checklist(&self, now: Duration) -> Option<String> {
        let checklist = self.checklist.as_ref()?;
        if let Some(mission) = &checklist.mission {
            match self.vehicle.mission() {
                Some(FlownMission { name, .. }) if name == *mission => {}
                Some(FlownMission { name: flies, .. }) => {
                    return Some(format!("the checklist is for {mission}, the vehicle flies {flies}"));
                }
                None => {
                    let why = "the vehicle has not reported whether it flies";
                    return Some(format!("{why} {mission} (checklist)"));
                }
            }
        }
        let first = self.first_open_step(now)?;
        let (done, all) = self.steps_done(now)?;
        let step = &checklist.steps[first];
        let state = match self.step_state(step, now) {
            StepState::Open | StepState::Done => "is open",
            StepState::Voided => "is void",
            StepState::Outside => "is outside its limits",
            StepState::Unknown => "has no value",
        };
        Some(format!("checklist {done} of {all}: step {} {state}: {}", first + 1, step.words))
    }

    /// Why this person may not sign or void steps now; the role of whoever may, if there is a crew.
    ///
    /// # Errors
    /// The reason.
    pub fn may_sign(&self, by: &str) -> Result<Option<TdRole>, String> {
        match self.settings.crew_roles.iter().find(|(name, _)| name == by) {
            _ if self.vehicle.is_armed() => Err("the vehicle is armed: disarm first".to_owned()),
            _ if self.vehicle.in_flight() => Err("the vehicle is in flight".to_owned()),
            _ if self.settings.crew_roles.is_empty() => Ok(None),
            None if by.is_empty() => Err("no operator is named (--operator)".to_owned()),
            None => Err(format!("{by} is not in the crew (--operator)")),
            Some((_, TdRole::TD_ROLE_OBSERVER)) => Err(format!("{by} is an observer")),
            Some((_, role)) => Ok(Some(*role)),
        }
    }
}

// Reads a checklist (TOML) and the list of its signatures, and writes one signature as text.
//
// The signatures are in a file of their own that only grows: one line of JSON for each change, so
// that nothing that was signed is ever lost. A line begins with a line break, so one that a crash
// has cut off hides no other.

/// A signature older than this, when the station starts, no longer counts: it was for another day.
pub const SIGNED_FOR_S: u64 = 12 * 3_600;
/// How far ahead of the clock a signature may be: clocks of laptops differ.
const AHEAD_MAX_S: u64 = 600;

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
    signs: String,
    value: Option<String>,
    least: Option<f64>,
    most: Option<f64>,
}

/// Reads the text of a checklist. Every step is open.
///
/// # Errors
/// It is not TOML of this shape, or a step is wrong; the message says which and what would do.
pub fn parse_checklist(text: &str) -> anyhow::Result<Checklist> {
    let written: Written = toml::from_str(text)?;
    let count = written.step.len();
    let fits = (1..=STEPS_MAX).contains(&count);
    anyhow::ensure!(fits, "give a checklist from 1 to {STEPS_MAX} steps, not {count}");
    let step = |(place, step): (usize, WrittenStep)| {
        step.checked().map_err(|why| anyhow::anyhow!("step {}: {why}", place + 1))
    };
    let steps = written.step.into_iter().enumerate().map(step).collect::<anyhow::Result<_>>()?;
    Ok(Checklist {
        name: words::printable(&written.name, WORDS_MAX),
        mission: written.mission,
        hash: shown(&Sha256::digest(text)[..8]).replace('-', ""),
        steps,
    })
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
                let quantity = Quantity::named(&name).ok_or_else(|| {
                    format!(
                        "`{name}` is no value; give one of {}",
                        quantity::ALL.each_ref().map(|quantity| quantity.name).join(", ")
                    )
                })?;
                let ordered = least.zip(most).is_none_or(|(least, most)| least <= most);
                let finite = [least, most].into_iter().flatten().all(f64::is_finite);
                if !(ordered && finite) {
                    return Err("least and most must be numbers, least not above most".to_owned());
                }
                Some(Limits { quantity, least, most })
            }
        };
        let role = role_of(&self.signs).filter(|role| *role != TdRole::TD_ROLE_OBSERVER);
        if role.is_none() && self.signs != "anybody" {
            let signs = &self.signs;
            return Err(format!("signs: `{signs}`; give range-safety, flight, pad or anybody"));
        }
        Ok(Step { words: words::printable(&self.words, WORDS_MAX), role, value, mark: Mark::Open })
    }
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
    for line in list.lines().filter(|line| !line.is_empty()) {
        let Ok((of, mut entry)) = serde_json::from_str::<(String, ChecklistEntry)>(line) else {
            found.broken += 1;
            continue;
        };
        if of != hash {
            continue;
        }
        if let ChecklistEntry::Marked { mark, .. } = &mut entry
            && let Mark::Signed(signature) | Mark::Voided(signature) = mark
        {
            signature.by = words::printable(&signature.by, WORDS_MAX);
        }
        if let ChecklistEntry::Marked { mark: Mark::Signed(Signature { unix_s, .. }), .. } = &entry
            && !(now_unix_s.saturating_sub(SIGNED_FOR_S)..=now_unix_s + AHEAD_MAX_S).contains(unix_s)
        {
            found.outdated += 1;
        } else {
            found.entries.push(entry);
        }
    }
    found
}

/// The line of an entry, to be added at the end of the list.
pub fn entry_text(hash: &str, entry: &ChecklistEntry) -> String {
    // Numbers and texts are always JSON.
    format!("\n{}\n", serde_json::to_string(&(hash, entry)).unwrap_or_default())
}

/// As in the crew file.
fn role_word(role: TdRole) -> String {
    words::lower_case(&role, "TD_ROLE_").replace(' ', "-")
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

    const SHIPPED: &str = include_str!("../../checklist-example.toml");

    #[test]
    fn the_shipped_example_is_a_checklist() {
        let list = parse_checklist(SHIPPED).unwrap();
        assert!(list.steps.len() >= 6 && list.steps.iter().any(|step| step.value.is_some()));
        assert!(list.steps.iter().all(|step| step.mark == Mark::Open));
    }

    #[test]
    fn a_wrong_step_is_named_with_what_would_do() {
        let refused = |step: &str| {
            let text = format!("name = \"a\"\n[[step]]\n{step}");
            parse_checklist(&text).unwrap_err().to_string()
        };
        for (step, why) in [
            ("words = \"\"\nsigns = \"pad\"", "words: give 1 to 60 characters, not 0"),
            ("words = \"a\"\nsigns = \"cook\"", "signs: `cook`; give range-safety, flight, pad or anybody"),
            ("words = \"a\"\nsigns = \"pad\"\nleast = 1.0", "least and most need a value"),
        ] {
            assert_eq!(refused(step), format!("step 1: {why}"));
        }
        let unknown = refused("words = \"a\"\nsigns = \"pad\"\nvalue = \"x\"\nmost = 1.0");
        assert!(unknown.contains("`x` is no value; give one of height"), "{unknown}");
        let value =
            |limits: &str| refused(&format!("words = \"a\"\nsigns = \"pad\"\nvalue = \"tilt\"\n{limits}"));
        let numbers = "step 1: least and most must be numbers, least not above most";
        assert_eq!(value("least = 2.0\nmost = 1.0"), numbers);
        assert_eq!(value("most = nan"), numbers);
        assert_eq!(value(""), "step 1: a value needs least, most or both");
        let none = parse_checklist("name = \"a\"").unwrap_err().to_string();
        assert_eq!(none, "give a checklist from 1 to 40 steps, not 0");
        assert!(refused("words = \"a\"\nsigns = \"pad\"\ncolour = 1").contains("colour"));
    }

    fn signed(step: usize, unix_s: u64) -> ChecklistEntry {
        let signature = Signature {
            by: "Ann \"x\" \\ ü".to_owned(),
            role: Some(TdRole::TD_ROLE_RANGE_SAFETY),
            unix_s,
            found: Some(7.25),
        };
        ChecklistEntry::Marked { step, mark: Mark::Signed(signature) }
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
                found.entries.iter().all(|entry| matches!(entry, ChecklistEntry::Marked { step: 0, .. }))
            );
        }
    }

    proptest! {
        #[test]
        fn no_text_causes_a_panic(text in ".*", list in "(\\[\"hash\",)?.*") {
            let _ = parse_checklist(&text);
            let _ = remembered(&list, "hash", 100);
        }
    }
}
