//! The touchdown predicted by each plan, against the actual touchdown.

use flight::rules::phase::Phase;

use super::COMPONENTS;
use crate::report::chart::{Chart, Line};
use crate::report::html::{charts, paragraph};
use crate::report::track::Flight;

pub(super) fn html(flight: &Flight) -> String {
    // Time of the plan, time to its touchdown and state there.
    let planned: Vec<(f64, f64, [f64; 6])> = flight
        .thoughts
        .iter()
        .filter(|thought| thought.sample.phase.is_some_and(Phase::is_landing))
        .filter_map(|thought| thought.touchdown.map(|(in_s, state)| (thought.sample.time_s, in_s, state)))
        .collect();
    if planned.is_empty() {
        return paragraph("The log has no predictions.");
    }
    let chart = |title: String, values: Vec<(f64, f64)>, actual: Option<f64>| {
        let mut lines = vec![Line { name: "predicted", class: "a", points: values.clone() }];
        if let (Some(actual), Some(first), Some(last)) = (actual, values.first(), values.last()) {
            lines.push(Line {
                name: "actual",
                class: "b",
                points: vec![(first.0, actual), (last.0, actual)],
            });
        }
        Chart { title, x_label: flight.axis_name(), lines, marks: flight.marks(), ..Chart::default() }.svg()
    };
    let over = |value: &dyn Fn(f64, f64, &[f64; 6]) -> f64| -> Vec<(f64, f64)> {
        let point =
            |(at_s, in_s, state): &(f64, f64, [f64; 6])| (flight.axis_s(*at_s), value(*at_s, *in_s, state));
        planned.iter().map(point).collect()
    };
    let mut pictures = vec![chart(
        format!("Touchdown, {}", flight.axis_name()),
        over(&|at_s, in_s, _| flight.axis_s(at_s + in_s)),
        flight.touchdown_s.map(|at_s| flight.axis_s(at_s)),
    )];
    for (component, (name, unit, factor)) in COMPONENTS.iter().enumerate() {
        if *name == "altitude" {
            continue;
        }
        pictures.push(chart(
            format!("{name} at touchdown, {unit}"),
            over(&|_, _, state| factor * state[component]),
            flight.contact.map(|state| factor * state[component]),
        ));
    }
    let contact = flight.in_space.as_ref().zip(flight.touchdown_s).and_then(|(in_space, contact_s)| {
        let before = in_space.across_m.iter().rfind(|(time_s, _)| *time_s <= contact_s)?;
        Some(paragraph(&format!("Contact was {:.3} m across the plane of the plans.", before.1.abs())))
    });
    paragraph("Each plan chooses its own final time.") + &contact.unwrap_or_default() + &charts(&pictures)
}
