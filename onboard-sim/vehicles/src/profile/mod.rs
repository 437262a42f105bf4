//! Profiles of planar landings, from TOML.
//!
//! Keys carry their units; angles are in degrees. Unknown keys are errors, so a misspelt key cannot pass silently.

mod validate;

use flight::vehicle::profile::Profile;

use super::file_error::FileError;

/// The built-in profiles: name and TOML text.
pub const BUILTIN: &[(&str, &str)] = &[
    ("paper-calibrated", include_str!("../../profiles/paper-calibrated.toml")),
    ("paper-as-printed", include_str!("../../profiles/paper-as-printed.toml")),
    ("paper-dispersed", include_str!("../../profiles/paper-dispersed.toml")),
];

/// Reads a profile; `origin` (a path or a name) is only used in messages.
///
/// # Errors
/// [`FileError::Parse`] if the text is not a profile; [`FileError::Value`] if a value is out of range.
pub fn from_toml(text: &str, origin: &str) -> Result<Profile, FileError> {
    let profile: Profile = toml::from_str(text).map_err(|error| FileError::not_toml(origin, &error))?;
    validate::validate(&profile).map_err(|bad| FileError::bad_value(origin, bad))?;
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
