//! The sections of a report, in the order they are read.

mod completeness;
mod descent;
mod estimator;
mod events;
mod link;
mod motion;
pub(super) mod overlay;
mod path;
mod phases;
mod prediction;
mod saturation;
mod solver;
mod thrust;
mod tracking;
mod verdict;

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
        section("", verdict::html(flight, info)),
        section("Phases", phases::html(flight, info)),
        section("Events", events::html(flight)),
    ];
    if in_space {
        all.push(section("The whole flight", path::html(flight)));
    }
    all.push(section("Path, states and input", motion::html(flight)));
    if in_space {
        all.push(section("Wind, fins, roll and sensors", descent::html(flight)));
    }
    all.extend([
        section("Tracking error by phase", tracking::html(flight)),
        section("Gimbal and fin saturation", saturation::html(flight)),
        section("Solver", solver::html(flight, info)),
        section("Predicted against actual touchdown", prediction::html(flight)),
        section("Thrust expected against inferred", thrust::html(flight)),
        section("Estimator error", estimator::html(flight)),
        section("Link", link::html(flight, info)),
        section("Log", completeness::html(info)),
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
