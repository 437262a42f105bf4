//! Why a TOML file of ours cannot be used.

use alloc::borrow::ToOwned as _;
use alloc::string::{String, ToString as _};

use super::mission::BadValue;

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
    #[error("{origin}: {key} = {found}: must be {required}")]
    Value {
        /// Where the text came from (a path or a built-in's name).
        origin: String,
        /// The key, with its section.
        key: String,
        found: String,
        /// The accepted range, in words.
        required: &'static str,
    },
}

impl FileError {
    pub(super) fn not_toml(origin: &str, error: &toml::de::Error) -> Self {
        Self::Parse { origin: origin.to_owned(), message: error.to_string() }
    }

    pub(super) fn bad_value(origin: &str, bad: BadValue) -> Self {
        let BadValue { key, found, required } = bad;
        Self::Value { origin: origin.to_owned(), key, found, required }
    }
}
