//! The motors that come with the program, by name. Each file states its origin in its header.

use alloc::borrow::ToOwned as _;
use alloc::string::String;
use alloc::vec::Vec;

use crate::vehicle::thrust_curve::ThrustCurve;

use super::thrust_curve::{self, ThrustCurveError};

/// Name and RASP text of every built-in motor.
pub const BUILTIN: &[(&str, &str)] = &[
    ("F10", include_str!("../../vehicles/motors/Apogee_F10.eng")),
    ("F13-RCT", include_str!("../../vehicles/motors/AeroTech_F13-RCT.eng")),
    ("F15", include_str!("../../vehicles/motors/Estes_F15.eng")),
    ("F16-RCJ", include_str!("../../vehicles/motors/AeroTech_F16-RCJ.eng")),
    ("F30", include_str!("../../vehicles/motors/Cesaroni_73F30-6A.eng")),
    ("G12", include_str!("../../vehicles/motors/AeroTech_G12ST.eng")),
    ("G33", include_str!("../../vehicles/motors/Cesaroni_143G33-9A.eng")),
    ("H42", include_str!("../../vehicles/motors/Cesaroni_186H42-10A.eng")),
    ("H45W", include_str!("../../vehicles/motors/AeroTech_H45.eng")),
    ("H53", include_str!("../../vehicles/motors/Cesaroni_234H53-12A.eng")),
    ("HP-H45W", include_str!("../../vehicles/motors/AeroTech_HP-H45W.eng")),
    ("I243", include_str!("../../vehicles/motors/Cesaroni_382I243-13A.eng")),
];

/// Why a motor cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MotorError {
    /// No motor has this name.
    #[error("no motor is named '{name}'; these are built in: {available}")]
    Unknown {
        /// The requested name.
        name: String,
        /// The names there are.
        available: String,
    },
    /// The file does not parse.
    #[error("motor '{name}'")]
    Unusable {
        /// The motor's name.
        name: &'static str,
        #[source]
        source: ThrustCurveError,
    },
}

/// The names of the built-in motors, sorted.
pub fn names() -> impl Iterator<Item = &'static str> {
    BUILTIN.iter().map(|(name, _)| *name)
}

/// Production status of a built-in motor, and the day of that information (YYYY-MM-DD), from its
/// file.
pub fn status(name: &str) -> Option<(bool, &'static str)> {
    let (_, text) = BUILTIN.iter().find(|(available, _)| *available == name)?;
    let line = text.lines().find_map(|line| line.strip_prefix("; status: "))?;
    let (state, dated) = line.split_once(" production on ")?;
    Some((state == "in", dated.get(..10)?))
}

/// The built-in motor of that name.
///
/// # Errors
///
/// [`MotorError::Unknown`] lists the names there are.
pub fn builtin(name: &str) -> Result<ThrustCurve, MotorError> {
    let Some((name, text)) = BUILTIN.iter().find(|(available, _)| *available == name) else {
        let available = names().collect::<Vec<_>>().join(", ");
        return Err(MotorError::Unknown { name: name.to_owned(), available });
    };
    thrust_curve::from_rasp(text).map_err(|source| MotorError::Unusable { name, source })
}

/// The motor of an airframe: the name of a built-in motor, or the text of a RASP (`.eng`) or
/// RockSim (`.rse`) file. With the text inside, a mission and the log of its flight need no other
/// file.
///
/// # Errors
///
/// There is no motor of that name, or the text is not a motor file.
pub fn named(motor: &str) -> Result<ThrustCurve, MotorError> {
    if !motor.contains('\n') {
        return builtin(motor);
    }
    let curve = if motor.trim_start().starts_with('<') {
        thrust_curve::from_rocksim(motor)
    } else {
        thrust_curve::from_rasp(motor)
    };
    curve.map_err(|source| MotorError::Unusable { name: "of the airframe", source })
}
