//! A seat: a screen of the station and the operator who sits at it.

use std::fmt;

/// An operator at a screen. The station numbers its screens from 1.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Seat {
    /// The screen's number; 0 for none.
    pub screen: u32,
    /// The operator, as in `anna on pts/3`; empty if unknown.
    pub operator: String,
}

impl Seat {
    pub fn new(screen: u32, operator: impl Into<String>) -> Self {
        Self { screen, operator: operator.into() }
    }

    /// The automatic mode, which has no screen.
    pub fn automatic() -> Self {
        Self::new(0, "automatic mode")
    }

    /// For the end of a text, as in ` (screen 2, anna on pts/3)`; empty if nothing is known.
    pub fn in_brackets(&self) -> String {
        let words = self.to_string();
        if words.is_empty() { words } else { format!(" ({words})") }
    }
}

impl fmt::Display for Seat {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.screen, self.operator.as_str()) {
            (0, operator) => out.write_str(operator),
            (screen, "") => write!(out, "screen {screen}"),
            (screen, operator) => write!(out, "screen {screen}, {operator}"),
        }
    }
}
