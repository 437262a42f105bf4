//! How far the vehicle was from its planned path.

use std::collections::BTreeMap;

use super::{COMPONENTS, rms_and_max};
use crate::report::chart::{Chart, Line};
use crate::report::html::{charts, paragraph, table};
use crate::report::track::{AHEAD_S, Flight};

pub(super) fn html(flight: &Flight) -> String {
    // By phase, in the order flown: phase index, then actual minus planned state for each prediction time.
    let mut errors: BTreeMap<u8, [Vec<[f64; 6]>; 2]> = BTreeMap::new();
    let mut names = BTreeMap::new();
    let mut distance: [Vec<(f64, f64)>; 2] = Default::default();
    for plan in &flight.plans {
        for (k, (ahead_s, planned)) in AHEAD_S.iter().zip(plan.ahead).enumerate() {
            let then_s = plan.time_s + ahead_s;
            // After contact the ground determines the motion.
            let in_air = flight.touchdown_s.is_none_or(|touchdown_s| then_s <= touchdown_s);
            let (Some(planned), Some(came)) = (planned, flight.state_at(then_s).filter(|_| in_air)) else {
                continue;
            };
            let phase = flight.track.iter().rev().find(|sample| sample.time_s <= then_s);
            let Some(phase) = phase.and_then(|sample| sample.phase) else {
                continue;
            };
            let error: [f64; 6] = core::array::from_fn(|i| came[i] - planned[i]);
            names.insert(phase.index(), phase.name());
            errors.entry(phase.index()).or_default()[k].push(error);
            distance[k].push((flight.axis_s(then_s), libm::hypot(error[0], error[1])));
        }
    }
    if errors.is_empty() {
        return paragraph("The log has no plans to compare the flight with.");
    }
    let mut rows = Vec::new();
    for (phase, by_distance) in &errors {
        for (ahead_s, errors) in AHEAD_S.iter().zip(by_distance) {
            if errors.is_empty() {
                continue;
            }
            let mut row = vec![
                names.get(phase).copied().unwrap_or_default().to_owned(),
                format!("{ahead_s} s"),
                errors.len().to_string(),
            ];
            for (component, (_, _, factor)) in COMPONENTS.iter().enumerate() {
                let found = rms_and_max(errors.iter().map(|error| factor * error[component]));
                row.push(found.map_or_else(String::new, |(rms, max)| format!("{rms:.4} / {max:.4}")));
            }
            rows.push(row);
        }
    }
    let heads: Vec<String> = COMPONENTS.iter().map(|(name, unit, _)| format!("#{name}, {unit}")).collect();
    let mut all = vec!["phase", "predicted ahead", "#ticks"];
    all.extend(heads.iter().map(String::as_str));
    let [near, far] = distance;
    let chart = Chart {
        title: "Distance between the planned and the actual position, m".to_owned(),
        x_label: flight.axis_name(),
        lines: vec![
            Line { name: "0.5 s ahead", class: "b", points: far },
            Line { name: "0.1 s ahead", class: "a", points: near },
        ],
        marks: flight.marks(),
        full: true,
        ..Chart::default()
    };
    paragraph("Actual state minus the state planned at each tick, root mean square / largest.")
        + &across(flight)
        + &table(&all, &rows)
        + &charts(&[chart.svg()])
}

/// A plan lies in a plane; what the vehicle moved across it is no part of the table.
fn across(flight: &Flight) -> String {
    let Some(in_space) = &flight.in_space else {
        return String::new();
    };
    let at = |time_s: f64| {
        let place = in_space.across_m.partition_point(|(sample_s, _)| *sample_s < time_s - 1e-4);
        in_space.across_m.get(place).map(|(_, across_m)| *across_m)
    };
    let moved = AHEAD_S.map(|ahead_s| {
        let plans = flight.plans.iter().filter(|plan| flight.is_before_contact(plan.time_s + ahead_s));
        rms_and_max(plans.filter_map(|plan| Some(at(plan.time_s + ahead_s)? - at(plan.time_s)?)))
    });
    let words: Vec<String> = AHEAD_S
        .iter()
        .zip(moved)
        .filter_map(|(ahead_s, moved)| {
            let (rms, max) = moved?;
            Some(format!("{rms:.3} / {max:.3} m in {ahead_s} s"))
        })
        .collect();
    if words.is_empty() {
        return String::new();
    }
    paragraph(&format!(
        "The plans lie in one plane. Across it, where nothing is planned, the vehicle moved {}.",
        words.join(" and ")
    ))
}
