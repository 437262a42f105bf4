//! Two flights in the same pictures.

use super::{COMPONENTS, DEGREES};
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
    let flights = flights.map(|(flight, _)| flight);
    let mut words = format!("Each flight has its own {}.", flights[0].axis_name());
    if flights.iter().any(|flight| flight.in_space.is_some()) {
        words.push_str(" x is the distance in the plane of each landing.");
    }
    let mut pictures = vec![path(flights)];
    pictures.extend((0..COMPONENTS.len()).map(|component| state(flights, component)));
    pictures.extend((0..2).map(|axis| gimbal(flights, axis)));
    table(&["", "log", "ending"], &rows.collect::<Vec<_>>()) + &paragraph(&words) + &charts(&pictures)
}

/// A line for each flight.
fn lines(flights: [&Flight; 2], points: impl Fn(&Flight) -> Vec<(f64, f64)>) -> Vec<Line> {
    let line = |((name, class), flight)| Line { name, class, points: points(flight) };
    NAMES.into_iter().zip(flights).map(line).collect()
}

fn path(flights: [&Flight; 2]) -> String {
    let flown = |flight: &Flight| {
        let shown = flight.track.iter().filter(|sample| flight.is_shown(sample.time_s));
        let shown = shown.filter(|sample| flight.is_before_contact(sample.time_s));
        shown.map(|sample| (sample.state[0], sample.state[1])).collect()
    };
    Chart {
        title: "Both paths of the landing".to_owned(),
        x_label: "x, m",
        y_label: "altitude, m",
        lines: lines(flights, flown),
        equal_scales: true,
        full: true,
        ..Chart::default()
    }
    .svg()
}

fn state(flights: [&Flight; 2], component: usize) -> String {
    let (name, unit, factor) = COMPONENTS[component];
    let shown = |flight: &Flight| {
        let shown = flight.track.iter().filter(|sample| flight.is_shown(sample.time_s));
        shown.map(|sample| (flight.axis_s(sample.time_s), factor * sample.state[component])).collect()
    };
    over_time(flights, format!("{name} of both, {unit}"), lines(flights, shown))
}

fn gimbal(flights: [&Flight; 2], axis: usize) -> String {
    let name = flights.iter().find_map(|flight| flight.gimbal.get(axis)).map(|axis| axis.name);
    let Some(name) = name else { return String::new() };
    let commanded = |flight: &Flight| {
        let angles = flight.gimbal.get(axis).into_iter().flat_map(|axis| &axis.commanded);
        let shown = angles.filter(|(time_s, _)| flight.is_shown(*time_s));
        shown.map(|(time_s, rad)| (flight.axis_s(*time_s), DEGREES * rad)).collect()
    };
    over_time(flights, format!("{name} of both, commanded, deg"), lines(flights, commanded))
}

fn over_time(flights: [&Flight; 2], title: String, lines: Vec<Line>) -> String {
    Chart { title, x_label: flights[0].axis_name(), lines, ..Chart::default() }.svg()
}
