//! One line of a checklist: what was required, what was found.

use alloc::borrow::ToOwned as _;
use alloc::format;
use alloc::string::String;

/// A check with its result.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Check {
    /// What was checked.
    pub name: &'static str,
    /// Whether it passed.
    pub passed: bool,
    /// The value found, with its unit.
    pub found: String,
    /// The value required, with its unit.
    pub required: String,
}

impl Check {
    /// A check of a yes-or-no condition, with a text for each result.
    pub(crate) fn condition(name: &'static str, passed: bool, yes: &str, no: &str) -> Self {
        let found = if passed { yes } else { no };
        Self { name, passed, found: found.to_owned(), required: yes.to_owned() }
    }

    /// A check of a magnitude against a limit. A value that is not a number fails.
    pub(crate) fn at_most(name: &'static str, value: f64, limit: f64, unit: &str) -> Self {
        Self {
            name,
            passed: value.abs() <= limit,
            found: format!("{:.2} {unit}", value.abs()),
            required: format!("at most {limit} {unit}"),
        }
    }

    /// The refusal in words, or `None` if passed.
    pub fn refusal(&self) -> Option<String> {
        (!self.passed).then(|| format!("{}: found {}, required {}", self.name, self.found, self.required))
    }
}

/// Whether every check passed.
pub fn all_passed(checks: &[Check]) -> bool {
    checks.iter().all(|check| check.passed)
}

/// The first failed check in words, or `None` if all passed.
pub fn first_refusal(checks: &[Check]) -> Option<String> {
    checks.iter().find_map(Check::refusal)
}
