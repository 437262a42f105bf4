//! Missions, from TOML. Unknown keys are errors.
//!
//! A mission contains its airframe as a table, or names a built-in airframe.

mod validate;

use alloc::borrow::ToOwned as _;
use alloc::format;
use alloc::string::String;

use crate::estimation::estimator::EstimatorConfigError;
use crate::vehicle::mission::Mission;
use crate::vehicle::mission::StartPoint;
use serde::Deserialize;
use toml::Spanned;

use super::airframe;
use super::file_error::FileError;
use super::motors::{self, MotorError};

/// The built-in missions: name and TOML text.
pub const BUILTIN: &[(&str, &str)] = &[
    ("mk2", include_str!("../../../vehicles/missions/mk2.toml")),
    ("mk3", include_str!("../../../vehicles/missions/mk3.toml")),
    ("mk2-h53", include_str!("../../../vehicles/missions/mk2-h53.toml")),
    ("mini-f10", include_str!("../../../vehicles/missions/mini-f10.toml")),
    ("vlr", include_str!("../../../vehicles/missions/vlr.toml")),
    ("vlr-f15", include_str!("../../../vehicles/missions/vlr-f15.toml")),
    ("vlr-f16", include_str!("../../../vehicles/missions/vlr-f16.toml")),
];

/// The built-in mission that is flown if no other is asked for: the vehicle that a club should build.
pub const DEFAULT: &str = "mk3";

/// Why a mission cannot be flown.
#[derive(Debug, thiserror::Error)]
pub enum MissionError {
    /// The text is not a mission, or a key holds a value outside its range.
    #[error(transparent)]
    File(#[from] FileError),
    /// What the mission expects of the sensors is out of range.
    #[error("{origin}")]
    Estimator {
        /// Where the text came from.
        origin: String,
        #[source]
        source: EstimatorConfigError,
    },
    /// The start needs a section that the mission does not have, or is not one of a mission.
    #[error("{origin}: start.at = \"{at}\" {problem}")]
    StartAt {
        /// Where the text came from.
        origin: String,
        at: &'static str,
        problem: &'static str,
    },
    /// There is no motor of that name, or its file cannot be used.
    #[error(transparent)]
    Motor(#[from] MotorError),
}

/// Reads a mission and its landing motor; `origin` names the text in error messages.
///
/// # Errors
/// [`MissionError`] names the key and what would be accepted.
pub fn from_toml(text: &str, origin: &str) -> Result<Mission, MissionError> {
    let not_a_mission = |error: toml::de::Error| FileError::not_toml(origin, &error);
    let mut mission: Mission = match with_the_named_airframe(text).map_err(not_a_mission)? {
        Some(expanded) => toml::from_str(&expanded),
        None => toml::from_str(text),
    }
    .map_err(not_a_mission)?;
    mission
        .estimator
        .validate()
        .map_err(|source| MissionError::Estimator { origin: origin.to_owned(), source })?;
    validate::validate(&mission).map_err(|bad| FileError::bad_value(origin, bad))?;
    check_start(&mission, origin)?;
    let own = mission.lot.as_ref().and_then(|lot| lot.curve.as_deref());
    let curve = motors::named(own.unwrap_or(&mission.airframe.motor))?;
    if let Some(lot) = &mission.lot {
        let weights = lot.validate_weights(curve.total_mass_kg(), mission.airframe.mass.loaded_kg);
        weights.map_err(|bad| FileError::bad_value(origin, bad.into()))?;
    }
    mission.expect(curve);
    validate::room_to_swing(&mission).map_err(|bad| FileError::bad_value(origin, bad))?;
    for other in &mission.other_motors {
        let other = motors::named(other)?;
        mission.other_curves.extend([mission.motor_curve.towards(&other, 0.5), other]);
    }
    if let Some(launch) = &mut mission.launch {
        launch.booster.motor_curve = motors::named(&launch.booster.motor)?;
    }
    Ok(mission)
}

/// Checks that the mission has what its start needs.
fn check_start(mission: &Mission, origin: &str) -> Result<(), MissionError> {
    let refuse = |at, problem| Err(MissionError::StartAt { origin: origin.to_owned(), at, problem });
    match mission.start.at {
        StartPoint::Pad if mission.launch.is_none() => {
            refuse("pad", "needs the section [launch] with its rail and booster")
        }
        StartPoint::Drone if mission.drop.is_none() => refuse("drone", "needs the section [drop]"),
        StartPoint::Pad | StartPoint::Apogee | StartPoint::Drone => Ok(()),
    }
}

/// The built-in mission of that name.
pub fn builtin(name: &str) -> Option<Result<Mission, MissionError>> {
    BUILTIN.iter().find(|(known, _)| *known == name).map(|(name, text)| from_toml(text, name))
}

/// Whether a text is a mission rather than a [profile](super::profile): a mission names or contains an airframe.
pub fn is_meant(text: &str) -> bool {
    toml::from_str::<toml::Table>(text).is_ok_and(|table| table.contains_key("airframe"))
}

/// The text with the named built-in airframe appended as a table; `None` if the text names no airframe.
///
/// The line with the name becomes empty, so the line numbers in error messages stay right.
fn with_the_named_airframe(text: &str) -> Result<Option<String>, toml::de::Error> {
    #[derive(Deserialize)]
    struct Named {
        #[serde(default)]
        airframe: Option<Spanned<NameOrTable>>,
    }
    let Ok(Named { airframe: Some(found) }) = toml::from_str(text) else {
        // The reader of the whole mission reports what is wrong with the text.
        return Ok(None);
    };
    let span = found.span();
    let NameOrTable::Name(name) = found.into_inner() else { return Ok(None) };
    let Ok(airframe_toml) = airframe::known_toml(&name) else {
        return Err(unknown_airframe(text));
    };
    let begins = text[..span.start].rfind('\n').map_or(0, |end| end + 1);
    let ends = text[span.end..].find('\n').map_or(text.len(), |end| span.end + end);
    let blank_lines = "\n".repeat(text[begins..ends].matches('\n').count());
    let mut expanded = format!("{}{blank_lines}{}\n[airframe]\n", &text[..begins], &text[ends..]);
    for line in airframe_toml.lines() {
        match line.strip_prefix('[') {
            Some(section) => expanded.extend(["[airframe.", section]),
            None => expanded.push_str(line),
        }
        expanded.push('\n');
    }
    Ok(Some(expanded))
}

/// The name of an airframe, or any other value.
#[derive(Deserialize)]
#[serde(untagged)]
enum NameOrTable {
    Name(String),
    Table(serde::de::IgnoredAny),
}

/// The parser's error, with line and column, for an unknown airframe name.
fn unknown_airframe(text: &str) -> toml::de::Error {
    #[derive(Debug, Deserialize)]
    struct Named {
        #[serde(rename = "airframe", deserialize_with = "known")]
        _airframe: (),
    }
    fn known<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<(), D::Error> {
        let name = String::deserialize(deserializer)?;
        airframe::known_toml(&name).map_err(serde::de::Error::custom)?;
        Ok(())
    }
    match toml::from_str::<Named>(text) {
        Err(error) => error,
        Ok(_) => serde::de::Error::custom("unknown airframe"),
    }
}
