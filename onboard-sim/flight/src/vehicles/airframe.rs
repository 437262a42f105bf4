//! Airframes, from TOML. Unknown keys are errors.

use alloc::borrow::ToOwned as _;
use alloc::string::{String, ToString as _};
use alloc::vec::Vec;

use crate::vehicle::airframe::{Airframe, BadValue};

/// The built-in airframes: name and TOML text.
const BUILTIN: &[(&str, &str)] = &[
    ("mk2", include_str!("../../vehicles/airframes/mk2.toml")),
    ("mk3", include_str!("../../vehicles/airframes/mk3.toml")),
    ("mk2-h53", include_str!("../../vehicles/airframes/mk2-h53.toml")),
    ("mini-f10", include_str!("../../vehicles/airframes/mini-f10.toml")),
    ("vlr", include_str!("../../vehicles/airframes/vlr.toml")),
    ("vlr-f15", include_str!("../../vehicles/airframes/vlr-f15.toml")),
    ("vlr-f16", include_str!("../../vehicles/airframes/vlr-f16.toml")),
];

/// Why an airframe cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum AirframeError {
    /// The text is not an airframe.
    #[error("{0}")]
    Toml(String),
    /// A value is outside its range.
    #[error(transparent)]
    BadValue(#[from] BadValue),
    /// No built-in airframe has this name.
    #[error("no airframe is named '{name}'; these are built in: {known}")]
    Unknown {
        /// The name asked for.
        name: String,
        /// The names there are.
        known: String,
    },
}

/// Reads an airframe from TOML and checks it.
///
/// # Errors
/// [`AirframeError`] names the key and what would be accepted.
pub fn from_toml(text: &str) -> Result<Airframe, AirframeError> {
    let airframe: Airframe = toml::from_str(text).map_err(|error| AirframeError::Toml(error.to_string()))?;
    airframe.validate()?;
    Ok(airframe)
}

/// The built-in airframe of that name.
///
/// # Errors
/// [`AirframeError::Unknown`] lists the names there are.
pub fn builtin(name: &str) -> Result<Airframe, AirframeError> {
    from_toml(known_toml(name)?)
}

/// The TOML text of the built-in airframe of that name.
pub fn builtin_toml(name: &str) -> Option<&'static str> {
    BUILTIN.iter().find(|(known, _)| *known == name).map(|(_, text)| *text)
}

/// The names of the built-in airframes.
pub fn builtin_names() -> impl Iterator<Item = &'static str> {
    BUILTIN.iter().map(|(name, _)| *name)
}

/// The TOML text of the built-in airframe of that name, or an error that lists the known names.
pub(super) fn known_toml(name: &str) -> Result<&'static str, AirframeError> {
    builtin_toml(name).ok_or_else(|| {
        let known = builtin_names().collect::<Vec<_>>().join(", ");
        AirframeError::Unknown { name: name.to_owned(), known }
    })
}
