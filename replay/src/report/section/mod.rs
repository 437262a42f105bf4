//! The sections of a report, in the order they are read.

mod control;
mod first;
mod motion;
mod outcome;
pub(super) mod overlay;
mod sensors;

use super::track::Flight;
use crate::info::Info;

/// A section: its name in links, its heading and its HTML.
pub(super) struct Section {
    pub(super) id: &'static str,
    pub(super) title: &'static str,
    pub(super) html: String,
}

/// Every section.
pub(super) fn all(flight: &Flight, info: &Info) -> Vec<Section> {
    let section = |id, title, html| Section { id, title, html };
    let mut all = vec![
        section("first", "", first::html(flight, info)),
        section("burn", "Path, states and input", motion::motion(flight)),
        section("thrust", "Thrust expected against inferred", control::thrust(flight)),
        section("touchdown", "Predicted against actual touchdown", control::prediction(flight)),
    ];
    if flight.in_space.is_some() {
        all.push(section("descent", "Wind, fins, roll and sensors", motion::descent(flight)));
    }
    all.extend([
        section("sensors", "Sensors and estimator", sensors::sensors(flight)),
        section("estimator", "Estimator error", control::estimator(flight)),
        section("battery", "Battery and vibration", sensors::battery_and_vibration(flight)),
        section("tracking", "Tracking error by phase", control::tracking(flight)),
        section("saturation", "Gimbal and fin saturation", control::saturation(flight)),
        section("solver", "Solver", control::solver(flight, info)),
    ]);
    if flight.in_space.is_some() {
        all.push(section("whole", "The whole flight", motion::whole_flight(flight)));
    }
    all.extend([
        section("phases", "Phases", outcome::phases(flight, info)),
        section("events", "Events", outcome::events(flight)),
        section("mission", "Mission against the built-in one", sensors::mission(flight, info)),
        section("link", "Link", outcome::link(flight)),
        section("log", "Log", outcome::described(info)),
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
