//! Operators: their names and roles. Their keys are handled elsewhere.

use core::fmt;
use serde::Serialize;

numbered_enum! {
/// The role of an operator.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Role {
    /// May observe, but not command.
    Observer = "OBSERVER",
    RangeSafety = "RANGE SAFETY",
    Flight = "FLIGHT",
    Pad = "PAD",
}
}

impl Role {
    /// The roles that may command.
    const COMMANDING: [Self; 3] = [Self::RangeSafety, Self::Flight, Self::Pad];

    pub fn may_command(self) -> bool {
        self != Self::Observer
    }

    /// The two other roles that may command.
    pub fn others(self) -> impl Iterator<Item = Self> {
        Self::COMMANDING.into_iter().filter(move |role| *role != self)
    }
}

/// A name of at most [`Name::LEN`] bytes; a longer one is cut at a character.
#[derive(Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Name([u8; Name::LEN]);

impl Name {
    /// Longest name, bytes.
    pub const LEN: usize = 16;

    pub fn new(name: &str) -> Self {
        let mut bytes = [0; Self::LEN];
        let mut end = 0;
        for letter in name.chars().take_while(|letter| *letter != '\0') {
            if end + letter.len_utf8() > Self::LEN {
                break;
            }
            end += letter.encode_utf8(&mut bytes[end..]).len();
        }
        Self(bytes)
    }

    pub fn as_str(&self) -> &str {
        let end = self.0.iter().position(|byte| *byte == 0).unwrap_or(Self::LEN);
        // It consists of complete characters only.
        core::str::from_utf8(&self.0[..end]).unwrap_or("")
    }

    /// Padded with zeros.
    pub fn bytes(&self) -> &[u8; Self::LEN] {
        &self.0
    }
}

impl fmt::Debug for Name {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(self.as_str(), out)
    }
}

/// A person with a signing key.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Operator {
    /// Number of the operator's key, 1 to 15, unique.
    pub number: u8,
    pub role: Role,
    pub name: Name,
}

impl fmt::Display for Operator {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{} {}", self.role.name(), self.name.as_str())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_cut_at_a_character() {
        assert_eq!(Name::new("Ann").as_str(), "Ann");
        assert_eq!(Name::new("").as_str(), "");
        assert_eq!(Name::new("0123456789abcdefg").as_str(), "0123456789abcdef");
        assert_eq!(Name::new("0123456789abcde\u{e9}").as_str(), "0123456789abcde");
        assert_eq!(Name::new("a\0b").as_str(), "a");
    }
}
