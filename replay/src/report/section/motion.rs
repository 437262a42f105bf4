//! How the vehicle moved: path, states, inputs, wind, fins and sensors.

use flight::rules::phase::Phase;
use protocol::log::computer_v1::ComputerFrame;
use protocol::log::flight_v1::TruthSample;

use super::{COMPONENTS, DEGREES};
use crate::report::chart::{Chart, Line};
use crate::report::html::{charts, paragraph, put, table};
use crate::report::track::{Flight, GimbalAxis, Teller};

pub(super) fn motion(flight: &Flight) -> String {
    let who = match flight.teller {
        Teller::Plant => "From the simulated plant.",
        Teller::Estimate => "From the flight computer's estimate; the log has no truth.",
        Teller::Telemetry => "From the telemetry of a ground station; the log has no frames.",
        Teller::Nobody => return paragraph("The log has no positions of the vehicle."),
    };
    // Without a landing, the pictures of the whole flight show all there is of its path.
    let lands = flight.in_space.is_none() || !flight.plans.is_empty();
    let mut pictures = Vec::new();
    if lands {
        pictures.push(path(flight));
    }
    pictures.extend((0..COMPONENTS.len()).map(|component| state(flight, component)));
    pictures.extend(flight.gimbal.iter().map(|axis| input(flight, axis)));
    let mut words = who.to_owned();
    if let Some(in_space) = &flight.in_space {
        put(&mut words, format_args!(" Seen in {}.", in_space.plane));
        if lands {
            words.push_str(" The plans were made in air that moves over the ground.");
        }
    }
    paragraph(&words) + &charts(&pictures)
}

fn path(flight: &Flight) -> String {
    let shown = flight.track.iter().filter(|sample| flight.is_shown(sample.time_s));
    let shown = shown.filter(|sample| flight.is_before_contact(sample.time_s));
    let flown = shown.map(|sample| (sample.state[0], sample.state[1])).collect();
    let mut lines: Vec<Line> = flight
        .plans
        .iter()
        .filter(|plan| !plan.path.is_empty())
        .enumerate()
        .map(|(place, plan)| Line {
            name: if place == 0 { "planned" } else { "" },
            class: "thin",
            points: plan.path.clone(),
        })
        .collect();
    lines.push(Line { name: "flown", class: "a", points: flown });
    Chart {
        title: match &flight.in_space {
            None => "Path in the pitch plane".to_owned(),
            Some(_) => "Path of the landing in its plane".to_owned(),
        },
        x_label: "x, m",
        y_label: "altitude, m",
        lines,
        equal_scales: true,
        full: true,
        ..Chart::default()
    }
    .svg()
}

fn state(flight: &Flight, component: usize) -> String {
    let Some((name, unit, factor)) = COMPONENTS.get(component).copied() else {
        return String::new();
    };
    let shown = flight.track.iter().filter(|sample| flight.is_shown(sample.time_s));
    let points: Vec<(f64, f64)> =
        shown.map(|sample| (flight.axis_s(sample.time_s), factor * sample.state[component])).collect();
    let thoughts = flight.thoughts.iter().map(|thought| &thought.sample);
    let estimate: Vec<(f64, f64)> = thoughts
        .filter(|sample| flight.is_shown(sample.time_s))
        .map(|sample| (flight.axis_s(sample.time_s), factor * sample.state[component]))
        .collect();
    let mut lines = vec![Line { name: "flown", class: "a", points }];
    if flight.teller == Teller::Plant {
        lines.push(Line { name: "estimate", class: "b", points: estimate });
    }
    flight.over_time(&format!("{name}, {unit}"), lines).svg()
}

fn input(flight: &Flight, axis: &GimbalAxis) -> String {
    let line = |name, class, angles: &[(f64, f64)]| {
        let shown = angles.iter().filter(|(time_s, _)| flight.is_shown(*time_s));
        Line {
            name,
            class,
            points: shown.map(|(time_s, rad)| (flight.axis_s(*time_s), DEGREES * rad)).collect(),
        }
    };
    let limit = flight.vehicle.as_ref().map(|vehicle| vehicle.gimbal_limit_deg);
    let lines = vec![line("actual", "a", &axis.actual), line("commanded", "b", &axis.commanded)];
    let limits = limit.into_iter().flat_map(|limit| [-limit, limit]).collect();
    Chart { limits, ..flight.over_time(&format!("{}, deg", axis.name), lines) }.svg()
}

/// A part of the flight: its name, its class, and whether a phase belongs to it.
type Part = (&'static str, &'static str, fn(Phase) -> bool);

const PARTS: [Part; 4] = [
    ("ascent", "c", |phase| phase.before_apogee()),
    ("descent", "a", |phase| phase.in_descent()),
    ("burn", "b", |phase| phase.in_landing_burn() || phase == Phase::Touchdown),
    ("parachute", "d", |phase| phase == Phase::Chute),
];

/// A view of the flown path: its title, its axes, what it shows of a sample, and whether it is a map.
type View = (&'static str, [&'static str; 2], fn(&TruthSample) -> (f64, f64), bool);

// East is against y.
const FROM_ABOVE: View = (
    "Seen from above: ground track",
    ["east, m", "north, m"],
    |sample| (-sample.state.position_m.y, sample.state.position_m.x),
    true,
);
const FROM_WEST: View = (
    "Seen from the west: north and height",
    ["north, m", "height of the feet, m"],
    |sample| (sample.state.position_m.x, sample.height_m),
    false,
);
const FROM_SOUTH: View = (
    "Seen from the south: east and height",
    ["east, m", "height of the feet, m"],
    |sample| (-sample.state.position_m.y, sample.height_m),
    false,
);

fn view(flight: &Flight, flown: &[&TruthSample], (title, [x_label, y_label], see, map): View) -> String {
    let lines = PARTS.iter().map(|(name, class, belongs)| Line {
        name,
        class,
        points: flown
            .iter()
            .map(|sample| if phase_at(flight, sample).is_some_and(belongs) { see(sample) } else { GAP })
            .collect(),
    });
    let lines: Vec<Line> = lines.filter(|line| line.points.iter().any(|point| point.0.is_finite())).collect();
    let moments = moments(flight, flown);
    Chart {
        title: title.to_owned(),
        x_label,
        y_label,
        lines,
        places: moments.iter().map(|(name, sample)| (see(sample).0, see(sample).1, *name)).collect(),
        own_x: true,
        equal_scales: map,
        ..Chart::default()
    }
    .svg()
}

fn in_the_air(flight: &Flight) -> Vec<&TruthSample> {
    flight.recording.world.iter().filter(|sample| flight.is_before_contact(sample.time_s)).collect()
}

/// The ground track.
pub(super) fn from_above(flight: &Flight) -> String {
    view(flight, &in_the_air(flight), FROM_ABOVE)
}

pub(super) fn whole_flight(flight: &Flight) -> String {
    let flown = in_the_air(flight);
    if flown.is_empty() {
        return paragraph("The log has no simulated truth to draw the flight from.");
    }
    let moments = moments(flight, &flown);
    let pictures = [FROM_WEST, FROM_SOUTH].map(|seen| view(flight, &flown, seen));
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
    paragraph("From the simulated truth, up to contact. Each axis has its own scale.")
        + &table(&["moment", "#T+, s", "#height, m", "#north, m", "#east, m", "#up, m/s"], &rows)
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

/// The classes of lines, by number.
const CLASSES: [&str; 4] = ["a", "b", "c", "d"];

pub(super) fn descent(flight: &Flight) -> String {
    let Some(in_space) = &flight.in_space else {
        return String::new();
    };
    let world: Vec<&TruthSample> =
        flight.recording.world.iter().filter(|sample| flight.is_before_contact(sample.time_s)).collect();
    let over = |value: &dyn Fn(&TruthSample) -> f64| -> Vec<(f64, f64)> {
        world.iter().map(|sample| (flight.axis_s(sample.time_s), value(sample))).collect()
    };
    let chart = |title: &str, lines: Vec<Line>| flight.over_time(title, lines).svg();
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
) -> impl Iterator<Item = (&'a ComputerFrame, &'a TruthSample)> {
    let frames = flight.recording.frames.iter().filter(|frame| flight.is_before_contact(frame.input.time_s));
    frames.filter_map(|frame| {
        let place = world.partition_point(|sample| sample.time_s < frame.input.time_s - 1e-4);
        Some((frame, *world.get(place)?))
    })
}

fn sensed_heights(flight: &Flight, world: &[&TruthSample]) -> Vec<Line> {
    let (mut barometer, mut lidar) = (Vec::new(), Vec::new());
    for (frame, truth) in with_truth(flight, world) {
        let measured = &frame.input.measured;
        let at_s = flight.axis_s(frame.input.time_s);
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
    for (frame, truth) in with_truth(flight, world) {
        let Some(fix) = &frame.input.measured.gnss else { continue };
        let at_s = flight.axis_s(frame.input.time_s);
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
