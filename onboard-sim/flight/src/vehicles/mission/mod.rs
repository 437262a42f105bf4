//! Missions, from TOML. Unknown keys are errors.
//!
//! A file contains a club's measurements and decisions. `controller.toml` has the values common to
//! all vehicles, [`controller`] the derived values, and `defaults.toml` the values that a file may
//! omit. A file may state any of them.

mod controller;
mod validate;

use alloc::borrow::ToOwned as _;
use alloc::format;
use alloc::string::{String, ToString as _};
use alloc::vec::Vec;

use core::ops::Range;

use crate::vehicle::airframe::Airframe;
use crate::vehicle::mission::{Mission, StartPoint};
use serde::Deserialize as _;
use serde::de::IntoDeserializer as _;
use toml::Spanned;
use toml::de::{DeTable, DeValue, Deserializer};

use self::controller::Formulas;
use super::file_error::FileError;
use super::motors::{self, MotorError};

/// The built-in missions: name and TOML text.
pub const BUILTIN: &[(&str, &str)] = &[
    ("mk2", include_str!("../../../vehicles/missions/mk2.toml")),
    ("mk3", include_str!("../../../vehicles/missions/mk3.toml")),
    ("vlr", include_str!("../../../vehicles/missions/vlr.toml")),
];

#[cfg(test)]
#[path = "../../../tests/missions/mod.rs"]
pub(crate) mod test_missions;

/// The default built-in mission: the vehicle that a club should build.
pub const DEFAULT: &str = "mk3";

/// Why a mission cannot be flown.
#[derive(Debug, thiserror::Error)]
pub enum MissionError {
    /// The text is not a mission, or a key holds a value outside its range.
    #[error(transparent)]
    File(#[from] FileError),
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

/// Values common to all vehicles.
const CONTROLLER: &str = include_str!("../../../vehicles/controller.toml");
/// Values that a mission may omit.
const DEFAULTS: &str = include_str!("../../../vehicles/defaults.toml");

/// Reads a mission and its motors, and gives its vehicle the controller; `origin` names the text in
/// error messages.
///
/// # Errors
/// [`MissionError`] names the key and what would be accepted.
pub fn from_toml(text: &str, origin: &str) -> Result<Mission, MissionError> {
    let not_a_mission = |mut error: toml::de::Error| {
        // A missing section is reported by its name.
        error.set_input(Some(text).filter(|_| error.span() != Some(NOWHERE)));
        FileError::not_toml(origin, &error)
    };
    let bad_value = |bad| FileError::bad_value(origin, bad);
    let mut table = DeTable::parse(text).map_err(not_a_mission)?;
    // The lines of the field are for people: nothing on board depends on them.
    let field = match table.get_mut().get_mut("site").map(Spanned::get_mut) {
        Some(DeValue::Table(site)) => site.remove("field"),
        _ => None,
    };
    let (mut stated, mut changed) = (Vec::new(), Vec::new());
    leaves("", table.get_ref(), &mut |key| stated.push(key));
    for (defaults, are_ours) in [(CONTROLLER, true), (DEFAULTS, false)] {
        let defaults = DeTable::parse(defaults).map_err(not_a_mission)?;
        if are_ours {
            leaves("", defaults.get_ref(), &mut |key| {
                changed.extend(Some(key).filter(|key| stated.contains(key)));
            });
        }
        fill(table.get_mut(), defaults.into_inner());
    }
    let mut mission = Mission::deserialize(Deserializer::from(table)).map_err(not_a_mission)?;
    if let Some(field) = field {
        mission.field_file = Some(String::deserialize(field.into_deserializer()).map_err(not_a_mission)?);
    }
    check_start(&mission, origin)?;
    let own = mission.lot.as_ref().and_then(|lot| lot.curve.as_deref());
    let curve = motors::named(own.unwrap_or(&mission.airframe.motor))?;
    let mut formulas = Formulas { stated: &stated, changed };
    formulas.airframe(&mut mission.airframe, &curve);
    if let Some(launch) = &mut mission.launch {
        launch.booster.motor_curve = motors::named(&launch.booster.motor)?;
        formulas.launch(launch, &mission.airframe);
    }
    validate::vehicle(&mission).map_err(bad_value)?;
    if let Some(lot) = &mission.lot {
        lot.validate_weights(curve.total_mass_kg(), mission.airframe.mass.loaded_kg).map_err(bad_value)?;
    }
    mission.expect(curve);
    validate::room_to_swing(&mission).map_err(bad_value)?;
    validate::numbers(&mission, &|key| formulas.states(key)).map_err(bad_value)?;
    formulas.controller(&mut mission);
    mission.changed = formulas.changed;
    validate::numbers(&mission, &|_| true).map_err(bad_value)?;
    mission.other_curve = mission.other_motor.as_deref().map(motors::named).transpose()?;
    Ok(mission)
}

/// Calls a function for the path of every value of a table.
fn leaves(prefix: &str, table: &DeTable<'_>, found: &mut dyn FnMut(String)) {
    for (key, value) in table {
        let path =
            if prefix.is_empty() { key.get_ref().to_string() } else { format!("{prefix}.{}", key.get_ref()) };
        match value.get_ref() {
            DeValue::Table(inner) => leaves(&path, inner, found),
            _ => found(path),
        }
    }
}

/// Where in a text a section is that the text does not have.
const NOWHERE: Range<usize> = usize::MAX..usize::MAX;

/// Adds the defaults that are missing from a table. Launch and drop sections are completed only if
/// present.
fn fill<'a>(table: &mut DeTable<'a>, defaults: DeTable<'a>) {
    for (key, default) in defaults {
        if matches!(key.get_ref().as_ref(), "launch" | "drop") && !table.contains_key(&key) {
            continue;
        }
        match default.into_inner() {
            DeValue::Table(default) => {
                let section = || Spanned::new(NOWHERE, DeValue::Table(DeTable::new()));
                if let DeValue::Table(section) = table.entry(key).or_insert_with(section).get_mut() {
                    fill(section, default);
                }
            }
            default => _ = table.entry(key).or_insert_with(|| Spanned::new(NOWHERE, default)),
        }
    }
}

/// Checks that the mission has the sections of its start.
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
    BUILTIN.iter().find(|(available, _)| *available == name).map(|(name, text)| from_toml(text, name))
}

/// The airframe of the built-in mission of that name, if there is one.
pub fn builtin_airframe(name: &str) -> Option<Airframe> {
    Some(builtin(name)?.ok()?.airframe)
}
