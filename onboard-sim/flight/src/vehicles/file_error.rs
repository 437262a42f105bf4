//! Why a TOML file of ours cannot be used.

use alloc::borrow::ToOwned as _;
use alloc::string::{String, ToString as _};

use crate::vehicle::airframe::BadValue;

/// Why a mission cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FileError {
    /// The text is not TOML of the expected shape: a missing, misspelt or mistyped key.
    #[error("{origin}: {message}")]
    Parse {
        /// Where the text came from (a path or a built-in's name).
        origin: String,
        /// The parser's words, with line, column and key.
        message: String,
    },
    /// A key holds a value outside its range.
    #[error("{origin}: {} = {}: must be {}", bad.key, bad.found, bad.required)]
    Value {
        /// Where the text came from (a path or a built-in's name).
        origin: String,
        bad: BadValue,
    },
}

impl FileError {
    pub(super) fn not_toml(origin: &str, error: &toml::de::Error) -> Self {
        Self::Parse { origin: origin.to_owned(), message: error.to_string() }
    }

    pub(super) fn bad_value(origin: &str, bad: BadValue) -> Self {
        Self::Value { origin: origin.to_owned(), bad }
    }
}
