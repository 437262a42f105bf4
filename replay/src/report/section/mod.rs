//! The sections of a report, in the order they are read.

mod burn;
mod estimate;
mod first;
pub(super) mod overlay;
mod pictures;
mod whole;

use super::html::{charts, paragraph};
use super::track::Flight;
use crate::info::Info;

/// A section: its name in links, its heading and its HTML.
pub(super) struct Section {
    pub(super) id: &'static str,
    pub(super) title: &'static str,
    pub(super) html: String,
}

/// Every section: its words and tables, then its pictures.
pub(super) fn all(flight: &Flight, info: &Info) -> Vec<Section> {
    let pictures = pictures::all(flight);
    let text = Option::unwrap_or_default;
    let sections = [
        ("first", "", first::html(flight, info, &pictures)),
        ("burn", "Path, states and input", burn::path(flight)),
        ("thrust", "Thrust expected against inferred", burn::thrust(flight)),
        ("touchdown", "Predicted against actual touchdown", String::new()),
        ("solver", "Plans", text(burn::plans(flight))),
        ("tracking", "Tracking error", text(burn::tracking(flight))),
        ("saturation", "Gimbal and fin saturation", text(burn::saturation(flight))),
        ("descent", "Wind, fins, roll and sensors", String::new()),
        ("sensors", "Sensors and estimator", text(estimate::aids(flight))),
        ("estimator", "Estimator error", text(estimate::errors(flight))),
        ("battery", "Battery and vibration", String::new()),
        ("whole", "The whole flight", whole::moments_and_views(flight)),
        ("events", "Events", text(whole::events(flight))),
        ("mission", "Mission against the built-in one", text(whole::mission(flight, info))),
        ("link", "Link", String::new()),
        ("log", "Log", whole::described(info)),
    ];
    let section = |(id, title, words): (&'static str, &'static str, String)| {
        let here = pictures.iter().filter(|picture| picture.section == id && id != "first");
        let drawn: Vec<String> = here.map(|picture| picture.chart.svg()).collect();
        let html = words + &charts(&drawn);
        let html = if html.is_empty() { paragraph("The log has no records for this.") } else { html };
        Section { id, title, html }
    };
    sections.into_iter().map(section).collect()
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

/// The components of a state: name, unit, and the factor to that unit.
const COMPONENTS: [(&str, &str, f64); 7] = [
    ("north", "m", 1.0),
    ("east", "m", 1.0),
    ("height", "m", 1.0),
    ("level speed", "m/s", 1.0),
    ("vertical speed", "m/s", 1.0),
    ("tilt", "deg", DEGREES),
    ("rotation rate", "deg/s", DEGREES),
];
/// Of [`COMPONENTS`] the height.
const HEIGHT: usize = 2;

const DEGREES: f64 = 180.0 / core::f64::consts::PI;
