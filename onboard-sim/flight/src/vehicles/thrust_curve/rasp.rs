//! RASP motor files: a header line, then one point on each line; `;` starts a comment.
//!
//! ```text
//! name  diameter_mm  length_mm  delays  propellant_kg  total_kg  manufacturer
//! time_s  thrust_n
//! ```
//!
//! The point (0, 0) comes before the first point and is not in the file.

use alloc::borrow::ToOwned as _;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;
use core::fmt::Write as _;

use crate::vehicle::thrust_curve::{MotorData, ThrustCurve, ThrustPoint};

use super::{ThrustCurveError, bad, check_masses, not_negative, push_point};

const HEADER: &str =
    "a header is: name, diameter in mm, length in mm, delays, propellant in kg, total mass in kg, maker";

/// The data, and the line of the header.
pub(super) fn parse(text: &str) -> Result<(MotorData, usize), ThrustCurveError> {
    let mut lines = text
        .lines()
        .zip(1..)
        .map(|(line, number)| (line.split(';').next().unwrap_or_default().trim(), number))
        .filter(|(line, _)| !line.is_empty());
    let Some((header, number)) = lines.next() else {
        return Err(ThrustCurveError::Missing { what: "the motor's header", required: HEADER });
    };
    let header_line = number;
    let mut data = parse_header(header, number)?;
    for (line, number) in lines {
        let mut words = line.split_whitespace();
        match (words.next(), words.next(), words.next()) {
            (Some(time), Some(thrust), None) => push_point(&mut data.points, number, time, thrust)?,
            _ => {
                return Err(bad(
                    number,
                    "a point",
                    line,
                    "a time in s and a thrust in N are accepted, and one motor a file",
                ));
            }
        }
    }
    if data.points.first().is_some_and(|first| first.time_s > 0.0) {
        data.points.insert(0, ThrustPoint { time_s: 0.0, thrust_n: 0.0 });
    }
    Ok((data, header_line))
}

/// The text of a RASP file of a motor. It has no delays. White space in the motor's name becomes
/// `_`, because the format separates its fields by white space.
pub fn to_rasp(curve: &ThrustCurve) -> String {
    let name = curve.name().split_whitespace().collect::<Vec<_>>().join("_");
    let name = if name.is_empty() { "unnamed" } else { &name };
    let maker = curve.manufacturer().split_whitespace().collect::<Vec<_>>().join(" ");
    let mut text = format!(
        "{} {:?} {:?} P {:?} {:?} {}\n",
        name.replace(';', "_"),
        to_mm(curve.diameter_m()),
        to_mm(curve.length_m()),
        curve.propellant_mass_kg(),
        curve.total_mass_kg(),
        maker.replace(';', "_")
    );
    let points = curve.points().iter().filter(|point| point.time_s > 0.0 || point.thrust_n > 0.0);
    for point in points {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "   {:?} {:?}", point.time_s, point.thrust_n);
    }
    text
}

/// Millimetres, to a thousandth.
fn to_mm(length_m: f64) -> f64 {
    libm::round(length_m * 1e6) / 1e3
}

fn parse_header(line: &str, number: usize) -> Result<MotorData, ThrustCurveError> {
    let mut words = line.split_whitespace();
    let mut word = || words.next().ok_or_else(|| bad(number, "the header", line, HEADER));
    let name = word()?.to_owned();
    let diameter_m = not_negative(number, "diameter", word()?)? / 1000.0;
    let length_m = not_negative(number, "length", word()?)? / 1000.0;
    let delays = word()?;
    // Without them the masses are one column too far to the left.
    if delays.parse().is_ok_and(|number: f64| number > 0.0 && number < 1.0) {
        return Err(bad(number, "delays", delays, "whole seconds as in 6-10-14, P or 0 are accepted"));
    }
    let propellant_mass_kg = not_negative(number, "propellant mass", word()?)?;
    let total_mass_kg = not_negative(number, "total mass", word()?)?;
    check_masses(number, propellant_mass_kg, total_mass_kg)?;
    let manufacturer = words.collect::<Vec<_>>().join(" ");
    Ok(MotorData {
        name,
        manufacturer,
        diameter_m,
        length_m,
        propellant_mass_kg,
        total_mass_kg,
        points: Vec::new(),
    })
}
