//! Two flights in the same pictures.

use super::burn::paths;
use super::pictures;
use crate::info::Info;
use crate::report::chart::{Chart, Line};
use crate::report::html::{charts, paragraph, table};
use crate::report::track::Flight;

/// A flight and what its log says.
pub(in crate::report) type LogFacts<'a> = (&'a Flight, &'a Info);

/// The names of the two flights in the pictures, with their classes.
const NAMES: [(&str, &str); 2] = [("A", "a"), ("B", "b")];

pub(in crate::report) fn html(flights: [LogFacts<'_>; 2]) -> String {
    let rows = NAMES.iter().zip(flights).map(|((name, _), (flight, info))| {
        let ending = info.ending.clone().unwrap_or_else(|| "no verdict".to_owned());
        vec![(*name).to_owned(), flight.recording.name.clone(), ending]
    });
    let [a, b] = flights.map(|(flight, _)| flight);
    let axis = a.axis_name();
    let named = NAMES.into_iter().zip([a, b]).map(|((name, class), flight)| (name, class, flight));
    // What flew is the first line of a picture of the burn.
    let beside =
        pictures::all(a).into_iter().zip(pictures::all(b)).filter(|((section, _), _)| *section == "burn");
    let both = beside.map(|((_, a), (_, b))| {
        let flown = [a, b].map(|chart| (chart.title, chart.lines.into_iter().next()));
        let [(title, a), (_, b)] = flown;
        let lines = NAMES.into_iter().zip([a, b]);
        let lines =
            lines.filter_map(|((name, class), line)| Some(Line { name, class, points: line?.points }));
        let title = format!("Both: {title}");
        Chart { title, x_label: axis, lines: lines.collect(), ..Chart::default() }.svg()
    });
    table(&["", "log", "ending"], &rows.collect::<Vec<_>>())
        + &paragraph(&format!("Each flight has its own {axis}."))
        + &paths(&named.collect::<Vec<_>>())
        + &charts(&both.collect::<Vec<_>>())
}
