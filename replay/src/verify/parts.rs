//! What of a record was compared, and what was not.

use serde::Serialize;

use crate::print::columns;

/// A part of a record.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Part {
    pub name: &'static str,
    /// How many of it there are, or should be.
    pub recorded: u64,
    /// Of these, how many were compared.
    pub compared: u64,
    /// Of these, how many differ.
    pub different: u64,
    /// Why not all of it was compared, or what is wrong with it first.
    pub why: Option<String>,
    /// It follows from the inputs, so a whole verification compares it.
    pub follows: bool,
}

impl Part {
    pub(super) fn of(name: &'static str, recorded: u64) -> Self {
        Self { name, recorded, follows: true, ..Self::default() }
    }

    /// A part that follows from nothing that is recorded.
    pub(super) fn beside(name: &'static str, recorded: u64) -> Self {
        Self { follows: false, ..Self::of(name, recorded) }
    }

    pub(super) fn compare(&mut self, same: bool) {
        self.compared += 1;
        self.different += u64::from(!same);
    }

    pub(super) fn because(self, why: impl Into<String>) -> Self {
        Self { why: Some(why.into()), ..self }
    }

    /// All of it was compared, if it can be.
    pub fn is_complete(&self) -> bool {
        !self.follows || self.compared == self.recorded
    }
}

/// The parts as a table.
pub(super) fn table(parts: &[Part]) -> Vec<String> {
    let head = ["  part", "recorded", "compared", "different", ""].map(str::to_owned);
    let row = |Part { name, recorded, compared, different, why, follows }: &Part| {
        let words = match why {
            Some(why) => why.clone(),
            None if !follows => "follows from nothing recorded".to_owned(),
            None => String::new(),
        };
        let [recorded, compared, different] = [recorded, compared, different].map(ToString::to_string);
        let name = if *name == "inputs" { "inputs, judged" } else { name };
        [format!("  {name}"), recorded, compared, different, words]
    };
    columns(['<', '>', '>', '>', '<'], std::iter::once(head).chain(parts.iter().map(row)))
}
