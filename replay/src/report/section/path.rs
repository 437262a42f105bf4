//! The whole flight of a rocket in space, seen from two sides and from above, ascent included.

use flight::rules::phase::Phase;
use protocol::log::flight_v1::TruthSample;

use crate::report::chart::{Chart, Line};
use crate::report::html::{charts, paragraph, table};
use crate::report::track::Flight;

/// A part of the flight: its name, its class, and whether a phase belongs to it.
type Part = (&'static str, &'static str, fn(Phase) -> bool);

const PARTS: [Part; 4] = [
    ("ascent", "c", |phase| phase.before_apogee()),
    ("descent", "a", |phase| phase.in_descent()),
    ("burn", "b", |phase| phase.in_landing_burn() || phase == Phase::Touchdown),
    ("parachute", "d", |phase| phase == Phase::Chute),
];

pub(super) fn html(flight: &Flight) -> String {
    let flown: Vec<&TruthSample> =
        flight.recording.world.iter().filter(|sample| flight.is_before_contact(sample.time_s)).collect();
    if flown.is_empty() {
        return paragraph("The log has no simulated truth to draw the flight from.");
    }
    let moments = moments(flight, &flown);
    // East is against y.
    let view = |title: &str,
                labels: (&'static str, &'static str),
                see: fn(&TruthSample) -> (f64, f64),
                map: bool| {
        let lines = PARTS.iter().map(|(name, class, belongs)| Line {
            name,
            class,
            points: flown
                .iter()
                .map(|sample| if phase_at(flight, sample).is_some_and(belongs) { see(sample) } else { GAP })
                .collect(),
        });
        let lines: Vec<Line> =
            lines.filter(|line| line.points.iter().any(|point| point.0.is_finite())).collect();
        Chart {
            title: title.to_owned(),
            x_label: labels.0,
            y_label: labels.1,
            lines,
            places: moments.iter().map(|(name, sample)| (see(sample).0, see(sample).1, *name)).collect(),
            own_x: true,
            equal_scales: map,
            ..Chart::default()
        }
        .svg()
    };
    let north = |sample: &TruthSample| (sample.state.position_m.x, sample.height_m);
    let east = |sample: &TruthSample| (-sample.state.position_m.y, sample.height_m);
    let above = |sample: &TruthSample| (-sample.state.position_m.y, sample.state.position_m.x);
    let pictures = [
        view("Seen from above: ground track", ("east, m", "north, m"), above, true),
        view("Seen from the west: north and height", ("north, m", "height of the feet, m"), north, false),
        view("Seen from the south: east and height", ("east, m", "height of the feet, m"), east, false),
    ];
    let rows: Vec<Vec<String>> = moments
        .iter()
        .map(|(name, sample)| {
            let place = &sample.state.position_m;
            vec![
                (*name).to_owned(),
                format!("{:.3}", sample.time_s),
                format!("{:.1}", sample.height_m + 0.0),
                format!("{:.1}", place.x + 0.0),
                format!("{:.1}", -place.y + 0.0),
                format!("{:.1}", sample.state.velocity_m_s.z + 0.0),
            ]
        })
        .collect();
    paragraph(
        "From the simulated truth, up to contact. The pictures with a height have their own scale on each axis.",
    ) + &table(&["moment", "#T+, s", "#height, m", "#north, m", "#east, m", "#up, m/s"], &rows)
        + &charts(&pictures)
}

/// A point that ends a line.
const GAP: (f64, f64) = (f64::NAN, f64::NAN);

fn phase_at(flight: &Flight, sample: &TruthSample) -> Option<Phase> {
    let place = flight.plant.partition_point(|plant| plant.sample.time_s < sample.time_s);
    flight.plant.get(place)?.sample.phase
}

/// What happened when, as far as it did.
fn moments<'a>(flight: &Flight, flown: &[&'a TruthSample]) -> Vec<(&'static str, &'a TruthSample)> {
    let enters =
        |wanted: Phase| flown.iter().find(|sample| phase_at(flight, sample) == Some(wanted)).copied();
    let highest = flown.iter().max_by(|a, b| a.height_m.total_cmp(&b.height_m)).copied();
    let rises = flown.iter().any(|sample| phase_at(flight, sample).is_some_and(Phase::before_apogee));
    let separated = flown
        .windows(2)
        .find(|pair| pair[0].booster_thrust_n.is_some() && pair[1].booster_thrust_n.is_none());
    let at = |time_s: Option<f64>| {
        let time_s = time_s?;
        flown.get(flown.partition_point(|sample| sample.time_s < time_s)).copied()
    };
    let mut moments = vec![
        ("lift-off", enters(Phase::Boost)),
        ("burn-out", enters(Phase::Coast)),
        ("separation", separated.map(|pair| pair[1])),
        ("apogee", highest.filter(|_| rises)),
        ("parachute", enters(Phase::Chute)),
        ("ignition", at(flight.ignition_s)),
        ("contact", flown.last().copied().filter(|_| flight.touchdown_s.is_some())),
    ];
    moments.sort_by(|a, b| {
        let time_s = |moment: &(&str, Option<&TruthSample>)| moment.1.map_or(0.0, |sample| sample.time_s);
        time_s(a).total_cmp(&time_s(b))
    });
    moments.into_iter().filter_map(|(name, sample)| Some((name, sample?))).collect()
}
