//! A screen, and who sits at it.

use std::fmt;

/// Who commands, and from which screen of a station. Screens are numbered by their station, from 1.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Seat {
    /// The screen's number; 0 for none.
    pub screen: u32,
    /// Who sits there, as in `anna on pts/3`; empty where nobody said.
    pub operator: String,
}

impl Seat {
    /// The station's own screen, or an attached one's.
    pub fn new(screen: u32, operator: impl Into<String>) -> Self {
        Self { screen, operator: operator.into() }
    }

    /// No hand: the automatic mode.
    pub fn automatic() -> Self {
        Self::new(0, "automatic mode")
    }

    /// Behind a command's words, as in ` (screen 2, anna on pts/3)`; nothing where nothing is known.
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
