//! The sections of a report, in the order they are read.

mod control;
mod motion;
mod outcome;
pub(super) mod overlay;

use super::track::Flight;
use crate::info::Info;

/// A section: its heading and its HTML.
pub(super) struct Section {
    pub(super) title: &'static str,
    pub(super) html: String,
}

/// Every section.
pub(super) fn all(flight: &Flight, info: &Info) -> Vec<Section> {
    let section = |title, html| Section { title, html };
    let in_space = flight.in_space.is_some();
    let mut all = vec![
        section("", outcome::verdict(flight, info)),
        section("Phases", outcome::phases(flight, info)),
        section("Events", outcome::events(flight)),
    ];
    if in_space {
        all.push(section("The whole flight", motion::whole_flight(flight)));
    }
    all.push(section("Path, states and input", motion::motion(flight)));
    if in_space {
        all.push(section("Wind, fins, roll and sensors", motion::descent(flight)));
    }
    all.extend([
        section("Tracking error by phase", control::tracking(flight)),
        section("Gimbal and fin saturation", control::saturation(flight)),
        section("Solver", control::solver(flight, info)),
        section("Predicted against actual touchdown", control::prediction(flight)),
        section("Thrust expected against inferred", control::thrust(flight)),
        section("Estimator error", control::estimator(flight)),
        section("Link", outcome::link(flight)),
        section("Log", outcome::described(info)),
    ]);
    all
}

/// Root mean square and largest magnitude of some numbers; `None` without any.
fn rms_and_max(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    let (mut count, mut squares, mut largest) = (0_u32, 0.0, 0.0_f64);
    for value in values.filter(|value| value.is_finite()) {
        count += 1;
        squares += value * value;
        largest = largest.max(value.abs());
    }
    (count > 0).then(|| (libm::sqrt(squares / f64::from(count)), largest))
}

/// A column of the six state components: name, unit, and the factor to that unit.
const COMPONENTS: [(&str, &str, f64); 6] = [
    ("x", "m", 1.0),
    ("altitude", "m", 1.0),
    ("pitch", "deg", DEGREES),
    ("u", "m/s", 1.0),
    ("w", "m/s", 1.0),
    ("pitch rate", "deg/s", DEGREES),
];

const DEGREES: f64 = 180.0 / core::f64::consts::PI;
