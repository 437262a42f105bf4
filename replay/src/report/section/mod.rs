//! The sections of a report, in the order they are read.

mod burn;
mod first;
mod log;
pub(super) mod motion;
mod pictures;
mod place;

use super::html::{charts, paragraph};
use super::track::Flight;
use crate::info::Info;

/// A section: its name in links, its heading and its HTML.
pub(super) struct Section {
    pub(super) id: &'static str,
    pub(super) title: &'static str,
    pub(super) html: String,
}

/// A drawn picture: its section, its place on the page, and its HTML.
type Drawn = (&'static str, String, String);

/// Every section of which the log has something: its words and tables, then its pictures.
pub(super) fn all(flight: &Flight, info: &Info) -> Vec<Section> {
    let pictures = pictures::all(flight).into_iter();
    let drawn: Vec<Drawn> =
        pictures.map(|picture| (picture.section, picture.chart.id(), picture.chart.svg())).collect();
    let text = Option::unwrap_or_default;
    let sections = [
        ("first", "", first::html(flight, info, &drawn)),
        ("burn", if flight.is_ignited() { "Burn" } else { "Flight" }, burn::words(flight)),
        ("fall", "Fall", String::new()),
        ("sensors", "Sensors and estimator", String::new()),
        ("solver", "Solver", text(burn::plans(flight))),
        ("battery", "Battery", String::new()),
        ("link", "Link", String::new()),
        ("mission", "Mission against the built-in one", text(log::mission(flight, info))),
        ("events", "Events", text(log::events(flight))),
        ("log", "Log", log::described(info)),
    ];
    let mut missing = Vec::new();
    let mut all: Vec<Section> = Vec::new();
    for (id, title, words) in sections {
        let here = drawn.iter().filter(|(section, ..)| *section == id && id != "first");
        let html = words + &charts(&here.map(|(.., svg)| svg.as_str()).collect::<String>());
        if html.is_empty() {
            missing.push(title);
        } else {
            all.push(Section { id, title, html });
        }
    }
    if let Some(last) = all.last_mut().filter(|_| !missing.is_empty()) {
        last.html += &paragraph(&format!("The log has nothing of: {}.", missing.join(", ")));
    }
    all
}

/// The components of a state: name, unit, and the factor to that unit.
const COMPONENTS: [(&str, &str, f64); 7] = [
    ("North", "m", 1.0),
    ("East", "m", 1.0),
    ("Height", "m", 1.0),
    ("Level speed", "m/s", 1.0),
    ("Vertical speed", "m/s", 1.0),
    ("Tilt", "deg", DEGREES),
    ("Rotation rate", "deg/s", DEGREES),
];
/// Of [`COMPONENTS`] the height.
const HEIGHT: usize = 2;

const DEGREES: f64 = 180.0 / core::f64::consts::PI;
