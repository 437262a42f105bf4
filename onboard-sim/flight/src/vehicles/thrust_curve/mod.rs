//! Motor files in the two formats that hobbyists use, RASP (`.eng`) and `RockSim` (`.rse`), and
//! tables of a test stand.

mod plausible;
mod rasp;
mod rocksim;
mod stand;

use alloc::borrow::ToOwned as _;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

use crate::vehicle::thrust_curve::{MotorData, ThrustCurve, ThrustPoint};

pub use self::rasp::to_rasp;
pub use self::stand::{from_stand, read_stand};
use super::table::TableError;

/// Why a motor file cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ThrustCurveError {
    /// A line or element is wrong.
    #[error("line {line}: {field} is '{found}'; {required}")]
    BadField {
        /// Line, from 1.
        line: usize,
        /// The expected content of the field.
        field: &'static str,
        found: String,
        required: &'static str,
    },
    /// The file ends before it holds a motor.
    #[error("{what} is missing; {required}")]
    Missing {
        /// The missing item.
        what: &'static str,
        required: &'static str,
    },
    /// The file name has an unknown extension.
    #[error("motor file '{file_name}': names that end in .eng (RASP) and .rse (RockSim) are accepted")]
    UnknownFormat { file_name: String },
    /// The table of a test stand is wrong.
    #[error(transparent)]
    Table(#[from] TableError),
    /// The text is not XML.
    #[error("not XML: {0}")]
    Xml(String),
}

/// Reads a RASP file that holds one motor.
///
/// # Errors
/// [`ThrustCurveError`] names the line, the field and what would be accepted.
pub fn from_rasp(text: &str) -> Result<ThrustCurve, ThrustCurveError> {
    checked(rasp::parse(text)?)
}

/// Reads a `RockSim` file that holds one motor.
///
/// # Errors
/// [`ThrustCurveError`] names the line, the field and what would be accepted.
pub fn from_rocksim(text: &str) -> Result<ThrustCurve, ThrustCurveError> {
    checked(rocksim::parse(text)?)
}

/// Reads a motor file by the ending of its name: `.eng` or `.rse`, in any case.
///
/// # Errors
/// [`ThrustCurveError`] names the line, the field and what would be accepted.
pub fn from_file_text(file_name: &str, text: &str) -> Result<ThrustCurve, ThrustCurveError> {
    let ending = file_name.rsplit_once('.').map_or("", |(_, ending)| ending);
    if ending.eq_ignore_ascii_case("eng") {
        from_rasp(text)
    } else if ending.eq_ignore_ascii_case("rse") {
        from_rocksim(text)
    } else {
        Err(ThrustCurveError::UnknownFormat { file_name: file_name.to_owned() })
    }
}

/// The motor of data whose masses and size are on this line.
fn checked((data, line): (MotorData, usize)) -> Result<ThrustCurve, ThrustCurveError> {
    let curve = ThrustCurve::new(data).ok_or(ThrustCurveError::Missing {
        what: "thrust",
        required: "a motor has at least one point with thrust after the first",
    })?;
    plausible::check(&curve, line)?;
    Ok(curve)
}

/// A number that is finite and not negative, or the reason why not.
fn not_negative(line: usize, field: &'static str, text: &str) -> Result<f64, ThrustCurveError> {
    match text.trim().parse::<f64>() {
        Ok(value) if value.is_finite() && value >= 0.0 => Ok(value),
        _ => Err(bad(line, field, text, "a number, 0 or more, is accepted")),
    }
}

fn bad(line: usize, field: &'static str, found: &str, required: &'static str) -> ThrustCurveError {
    // A hostile file may contain a very long line; the message is cut.
    ThrustCurveError::BadField { line, field, found: found.chars().take(40).collect(), required }
}

/// Appends a point.
fn push_point(
    points: &mut Vec<ThrustPoint>,
    line: usize,
    time: &str,
    thrust: &str,
) -> Result<(), ThrustCurveError> {
    let point = ThrustPoint {
        time_s: not_negative(line, "time", time)?,
        thrust_n: not_negative(line, "thrust", thrust)?,
    };
    if points.last().is_some_and(|last| point.time_s <= last.time_s) {
        return Err(bad(line, "time", time, "times must increase from point to point"));
    }
    points.push(point);
    Ok(())
}

/// Checks that the two masses fit each other.
fn check_masses(line: usize, propellant_kg: f64, total_kg: f64) -> Result<(), ThrustCurveError> {
    if propellant_kg > 0.0 && propellant_kg < total_kg {
        return Ok(());
    }
    Err(bad(
        line,
        "propellant mass",
        &format!("{propellant_kg} kg of {total_kg} kg"),
        "above 0 and below the motor's total mass is accepted",
    ))
}
