//! The landing, drawn as in the paper (Figs. 6 to 9): path in the pitch plane, states, input.

use super::{COMPONENTS, DEGREES};
use crate::report::chart::{Chart, Line};
use crate::report::html::{charts, paragraph, put};
use crate::report::track::{Flight, GimbalAxis, Teller};

pub(super) fn html(flight: &Flight) -> String {
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
    Chart {
        title: format!("{name}, {unit}"),
        x_label: flight.axis_name(),
        lines,
        marks: flight.marks(),
        ..Chart::default()
    }
    .svg()
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
    Chart {
        title: format!("{}, deg", axis.name),
        x_label: flight.axis_name(),
        lines: vec![line("actual", "a", &axis.actual), line("commanded", "b", &axis.commanded)],
        limits: limit.into_iter().flat_map(|limit| [-limit, limit]).collect(),
        marks: flight.marks(),
        ..Chart::default()
    }
    .svg()
}
