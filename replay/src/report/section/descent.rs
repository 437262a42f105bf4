//! The way down of a rocket in space: wind, fins, roll and sensors.

use protocol::log::flight_v1::{PilotTick, TruthSample};

use super::DEGREES;
use crate::report::chart::{Chart, Line};
use crate::report::html::{charts, paragraph};
use crate::report::track::Flight;

/// The classes of lines, by number.
const CLASSES: [&str; 4] = ["a", "b", "c", "d"];

pub(super) fn html(flight: &Flight) -> String {
    let Some(in_space) = &flight.in_space else {
        return String::new();
    };
    let world: Vec<&TruthSample> =
        flight.recording.world.iter().filter(|sample| flight.is_before_contact(sample.time_s)).collect();
    let over = |value: &dyn Fn(&TruthSample) -> f64| -> Vec<(f64, f64)> {
        world.iter().map(|sample| (flight.axis_s(sample.time_s), value(sample))).collect()
    };
    let chart = |title: &str, lines: Vec<Line>| {
        let title = title.to_owned();
        Chart { title, x_label: flight.axis_name(), lines, marks: flight.marks(), ..Chart::default() }.svg()
    };
    let estimated = |place: usize| -> Vec<(f64, f64)> {
        let all = in_space.wind_m_s.iter().filter(|(time_s, _)| flight.is_before_contact(*time_s));
        all.map(|(time_s, wind_m_s)| (flight.axis_s(*time_s), wind_m_s[place])).collect()
    };
    let both = |truth, estimate| {
        vec![
            Line { name: "true", class: "c", points: truth },
            Line { name: "estimated", class: "a", points: estimate },
        ]
    };
    let fins = |angles: fn(&TruthSample) -> &Vec<f64>| -> Vec<Line> {
        let names = ["fin 1", "fin 2", "fin 3", "fin 4"];
        let line = |(fin, (name, class)): (usize, (&'static str, &'static str))| Line {
            name,
            class,
            points: over(&|sample| angles(sample).get(fin).map_or(f64::NAN, |rad| DEGREES * rad)),
        };
        names.into_iter().zip(CLASSES).enumerate().map(line).collect()
    };
    let pictures = [
        // East is against y.
        chart("Wind towards north, m/s", both(over(&|sample| sample.wind_m_s.x), estimated(0))),
        chart("Wind towards east, m/s", both(over(&|sample| -sample.wind_m_s.y), estimated(1))),
        chart("Fins, actual, deg", fins(|sample| &sample.fins_actual_rad)),
        chart(
            "Roll rate, deg/s",
            vec![Line { name: "", class: "a", points: over(&|sample| DEGREES * sample.state.rate_rad_s.x) }],
        ),
        chart(
            "Parachute, share open",
            vec![Line { name: "", class: "a", points: over(&|sample| sample.parachute_open_share) }],
        ),
        chart("Sensed height less true height, m", sensed_heights(flight, &world)),
        chart("Satellite position less true position, m", sensed_places(flight, &world)),
    ];
    if pictures.iter().all(String::is_empty) {
        return paragraph("The log has no simulated truth of the way down.");
    }
    paragraph("From the release to contact. The sensors are those that the flight computer was given.")
        + &charts(&pictures)
}

/// The frames with their truth.
fn with_truth<'a>(
    flight: &'a Flight,
    world: &'a [&TruthSample],
) -> impl Iterator<Item = (&'a PilotTick, &'a TruthSample)> {
    let frames = flight.recording.frames.iter().filter(|tick| flight.is_before_contact(tick.input.time_s));
    frames.filter_map(|tick| {
        let place = world.partition_point(|sample| sample.time_s < tick.input.time_s - 1e-4);
        Some((tick, *world.get(place)?))
    })
}

fn sensed_heights(flight: &Flight, world: &[&TruthSample]) -> Vec<Line> {
    let (mut barometer, mut lidar) = (Vec::new(), Vec::new());
    for (tick, truth) in with_truth(flight, world) {
        let Some(measured) = &tick.input.measured else { continue };
        let at_s = flight.axis_s(tick.input.time_s);
        barometer
            .extend(measured.pressure_altitude_m.map(|sensed_m| (at_s, sensed_m - truth.state.position_m.z)));
        lidar.extend(measured.lidar_range_m.map(|sensed_m| (at_s, sensed_m - truth.height_m)));
    }
    vec![
        Line { name: "barometer", class: "a", points: barometer },
        Line { name: "lidar range", class: "c", points: lidar },
    ]
}

fn sensed_places(flight: &Flight, world: &[&TruthSample]) -> Vec<Line> {
    let mut places = [Vec::new(), Vec::new(), Vec::new()];
    for (tick, truth) in with_truth(flight, world) {
        let Some(fix) = tick.input.measured.as_ref().and_then(|measured| measured.gnss.as_ref()) else {
            continue;
        };
        let at_s = flight.axis_s(tick.input.time_s);
        let (sensed, actual) = (&fix.position_m, &truth.state.position_m);
        places[0].push((at_s, sensed.x - actual.x));
        places[1].push((at_s, actual.y - sensed.y));
        places[2].push((at_s, sensed.z - actual.z));
    }
    let names = ["north", "east", "up"];
    names
        .into_iter()
        .zip(CLASSES)
        .zip(places)
        .map(|((name, class), points)| Line { name, class, points })
        .collect()
}
