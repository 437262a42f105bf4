//! RASP motor files: a header line, then one point on each line; `;` starts a comment.
//!
//! ```text
//! name  diameter_mm  length_mm  delays  propellant_kg  total_kg  manufacturer
//! time_s  thrust_n
//! ```
//!
//! The point (0, 0) comes before the first point and is not in the file.

use flight::vehicle::thrust_curve::{MotorData, ThrustPoint};

use super::{ThrustCurveError, bad, check_masses, not_negative, push_point};

const HEADER: &str =
    "a header is: name, diameter in mm, length in mm, delays, propellant in kg, total mass in kg, maker";

pub(super) fn parse(text: &str) -> Result<MotorData, ThrustCurveError> {
    let mut lines = text
        .lines()
        .zip(1..)
        .map(|(line, number)| (line.split(';').next().unwrap_or_default().trim(), number))
        .filter(|(line, _)| !line.is_empty());
    let Some((header, number)) = lines.next() else {
        return Err(ThrustCurveError::Missing { what: "the motor's header", required: HEADER });
    };
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
    Ok(data)
}

fn parse_header(line: &str, number: usize) -> Result<MotorData, ThrustCurveError> {
    let mut words = line.split_whitespace();
    let mut word = || words.next().ok_or_else(|| bad(number, "the header", line, HEADER));
    let name = word()?.to_owned();
    let diameter_m = not_negative(number, "diameter", word()?)? / 1000.0;
    let length_m = not_negative(number, "length", word()?)? / 1000.0;
    word()?;
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
