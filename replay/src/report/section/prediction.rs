//! The touchdown predicted at each tick, against the actual touchdown.

use flight::guidance::controller::ControlLevel;
use flight::rules::phase::Phase;
use protocol::log::v1::ControllerTick;

use super::COMPONENTS;
use crate::report::chart::{Chart, Line};
use crate::report::html::{charts, paragraph};
use crate::report::track::{Flight, phase_of, state_of};

pub(super) fn html(flight: &Flight) -> String {
    let planned: Vec<&ControllerTick> = flight
        .recording
        .ticks
        .iter()
        .filter(|tick| phase_of(tick.input.phase).is_some_and(Phase::is_landing))
        .filter(|tick| tick.output.level != u32::from(ControlLevel::Idle.index()))
        .collect();
    if planned.is_empty() {
        return paragraph("The log has no predictions.");
    }
    let verdict = flight.recording.verdict.as_ref();
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
    let over = |value: &dyn Fn(&ControllerTick) -> f64| -> Vec<(f64, f64)> {
        planned.iter().map(|tick| (flight.axis_s(tick.input.time_s), value(tick))).collect()
    };
    let mut pictures = vec![chart(
        format!("Touchdown, {}", flight.axis_name()),
        over(&|tick| flight.axis_s(tick.input.time_s + tick.output.predicted_touchdown.time_from_now_s)),
        flight.touchdown_s.map(|at_s| flight.axis_s(at_s)),
    )];
    for (component, (name, unit, factor)) in COMPONENTS.iter().enumerate() {
        if *name == "altitude" {
            continue;
        }
        pictures.push(chart(
            format!("{name} at touchdown, {unit}"),
            over(&|tick| factor * state_of(&tick.output.predicted_touchdown.state)[component]),
            verdict.map(|verdict| factor * state_of(&verdict.state)[component]),
        ));
    }
    let words = if flight.from_apogee.is_some() {
        "Each plan chooses its own final time."
    } else {
        "A plan ends with its horizon; a vehicle that comes down earlier ends its burn on the ground."
    };
    let contact = flight.from_apogee.as_ref().zip(flight.touchdown_s).and_then(|(in_space, contact_s)| {
        let before = in_space.across_m.iter().rfind(|(time_s, _)| *time_s <= contact_s)?;
        Some(paragraph(&format!("Contact was {:.3} m across the plane of the plans.", before.1.abs())))
    });
    paragraph(words) + &contact.unwrap_or_default() + &charts(&pictures)
}
