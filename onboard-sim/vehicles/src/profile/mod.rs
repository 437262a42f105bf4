//! Profiles of planar landings, from TOML.
//!
//! Keys carry their units; angles are in degrees. Unknown keys are errors, so a misspelt key cannot pass silently.

mod validate;

use alloc::borrow::ToOwned as _;
use alloc::string::{String, ToString as _};

use flight::vehicle::profile::Profile;

/// The built-in profiles: name and TOML text.
pub const BUILTIN: &[(&str, &str)] = &[
    ("paper-calibrated", include_str!("../../profiles/paper-calibrated.toml")),
    ("paper-as-printed", include_str!("../../profiles/paper-as-printed.toml")),
    ("paper-dispersed", include_str!("../../profiles/paper-dispersed.toml")),
];

/// Why a profile cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ProfileError {
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

/// Reads a profile; `origin` (a path or a name) is only used in messages.
///
/// # Errors
/// [`ProfileError::Parse`] if the text is not a profile; [`ProfileError::Value`] if a value is out of range.
pub fn from_toml(text: &str, origin: &str) -> Result<Profile, ProfileError> {
    let profile: Profile = toml::from_str(text)
        .map_err(|error| ProfileError::Parse { origin: origin.to_owned(), message: error.to_string() })?;
    validate::validate(&profile).map_err(|bad| ProfileError::Value {
        origin: origin.to_owned(),
        key: bad.key,
        found: bad.found,
        required: bad.required,
    })?;
    Ok(profile)
}

/// The built-in profile of that name, or `None` if there is no such built-in.
///
/// A test checks that every entry of [`BUILTIN`] parses.
pub fn builtin(name: &str) -> Option<Profile> {
    from_toml(builtin_toml(name)?, name).ok()
}

/// The TOML text of the built-in profile of that name.
pub fn builtin_toml(name: &str) -> Option<&'static str> {
    BUILTIN.iter().find(|(known, _)| *known == name).map(|(_, text)| *text)
}
