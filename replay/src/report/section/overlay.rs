//! Two flights in the same pictures.

use super::burn::paths;
use super::pictures;
use crate::info::Info;
use crate::report::chart::{Chart, TIME, line};
use crate::report::html::{charts, escaped, paragraph, table};
use crate::report::track::Flight;

/// The names of the two flights in the pictures, with their classes.
const NAMES: [(&str, &str); 2] = [("A", "a"), ("B", "b")];

pub(in crate::report) fn html(flights: [(&Flight, &Info); 2]) -> String {
    let rows = NAMES.into_iter().zip(flights).map(|((name, _), (flight, info))| {
        let ending = info.ending.as_deref().unwrap_or("no verdict");
        [name, flight.recording.name.as_str(), ending].map(escaped)
    });
    let [a, b] = flights.map(|(flight, _)| flight);
    let axis = a.axis_name();
    let named = NAMES.into_iter().zip([a, b]).map(|((name, class), flight)| (name, class, flight));
    // What flew is the last line of a picture of the burn.
    let pairs = pictures::all(a).into_iter().zip(pictures::all(b));
    let both = pairs.filter(|(picture, _)| picture.section == "burn").map(|(a, b)| {
        let flown = NAMES.iter().zip([&a, &b]).filter_map(|((name, class), picture)| {
            Some(line(name, class, picture.chart.lines.last()?.points.clone()))
        });
        let (title, lines) = (format!("Both: {}", a.chart.title), flown.collect());
        Chart { title, axes: TIME, x_name: axis, lines, ..Chart::default() }.svg()
    });
    table(&["", "log", "ending"], rows)
        + &paragraph(&format!("Each flight has its own {axis}."))
        + &paths(&named.collect::<Vec<_>>())
        + &charts(&both.collect::<String>())
}
