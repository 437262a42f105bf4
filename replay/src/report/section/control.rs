//! How it was controlled: tracking, prediction, saturation, solver, estimator and thrust.

use std::collections::BTreeMap;

use flight::guidance::powered::ControlLevel;
use flight::rules::phase::Phase;

use super::{COMPONENTS, rms_and_max};
use crate::info::{Info, solve_time_text};
use crate::report::chart::{Chart, Line};
use crate::report::html::{charts, paragraph, table};
use crate::report::track::{AHEAD_S, Decision, EstimateError, Flight, InSpace, Plant};

pub(super) fn tracking(flight: &Flight) -> String {
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
    let mut all = vec!["phase", "predicted ahead", "#frames"];
    all.extend(heads.iter().map(String::as_str));
    let [near, far] = distance;
    let lines = vec![
        Line { name: "0.5 s ahead", class: "b", points: far },
        Line { name: "0.1 s ahead", class: "a", points: near },
    ];
    let title = "Distance between the planned and the actual position, m";
    let chart = Chart { full: true, ..flight.over_time(title, lines) };
    paragraph("Actual state minus the state planned at each frame, root mean square / largest.")
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

pub(super) fn prediction(flight: &Flight) -> String {
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
        flight.over_time(&title, lines).svg()
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
            flight.contact().map(|state| factor * state[component]),
        ));
    }
    let contact = flight.in_space.as_ref().zip(flight.touchdown_s).and_then(|(in_space, contact_s)| {
        let before = in_space.across_m.iter().rfind(|(time_s, _)| *time_s <= contact_s)?;
        Some(paragraph(&format!("Contact was {:.3} m across the plane of the plans.", before.1.abs())))
    });
    paragraph("Each plan chooses its own final time.") + &contact.unwrap_or_default() + &charts(&pictures)
}

/// A value within this fraction of a stop or of the maximum slew rate counts as saturated.
const AT_LIMIT: f64 = 0.995;

pub(super) fn saturation(flight: &Flight) -> String {
    let Some(vehicle) = &flight.vehicle else {
        return paragraph("The log has no profile that says where the stops are.");
    };
    let moving: Vec<&Plant> = flight
        .plant
        .iter()
        .filter(|plant| plant.sample.phase.is_some_and(|phase| !phase.on_pad()) && !plant.in_contact)
        .collect();
    if moving.len() < 2 {
        return paragraph("The log has no record of the actuators in flight.");
    }
    let stop_rad = vehicle.gimbal_limit_deg.to_radians();
    let fin_rate = vehicle.fin_rate_deg_s.to_radians();
    let total_s: f64 = intervals(&moving).map(|(_, _, dt_s)| dt_s).sum();
    let time = |holds: &dyn Fn(&Plant, &Plant, f64) -> bool| -> f64 {
        intervals(&moving).filter(|(a, b, dt_s)| holds(a, b, *dt_s)).fold(0.0, |sum, (_, _, dt_s)| sum + dt_s)
    };
    let slewing = |a: f64, b: f64, dt_s: f64, rate: f64| (b - a).abs() >= AT_LIMIT * rate * dt_s;
    let in_air = |time_s: f64| {
        moving.first().is_some_and(|first| first.sample.time_s <= time_s)
            && moving.last().is_some_and(|last| time_s <= last.sample.time_s)
    };
    let mut rows = Vec::new();
    for axis in &flight.gimbal {
        let name = axis.name.to_lowercase().replace(" angle", "");
        let angles: Vec<(f64, f64)> =
            axis.actual.iter().copied().filter(|(time_s, _)| in_air(*time_s)).collect();
        let time = |holds: &dyn Fn(f64, f64, f64) -> bool| -> f64 {
            let pairs = angles.windows(2).map(|pair| (pair[0].1, pair[1].1, pair[1].0 - pair[0].0));
            // Start from positive zero, because an empty sum is negative zero.
            pairs.filter(|(a, b, dt_s)| holds(*a, *b, *dt_s)).fold(0.0, |sum, (_, _, dt_s)| sum + dt_s)
        };
        rows.push((
            format!("{name} at its stop of {:.1} deg", vehicle.gimbal_limit_deg),
            time(&|_, b, _| b.abs() >= AT_LIMIT * stop_rad),
        ));
        rows.push((
            format!("{name} at its fastest slew"),
            time(&|a, b, dt_s| slewing(a, b, dt_s, vehicle.gimbal_rate_rad_s)),
        ));
    }
    let fins = moving.iter().map(|plant| plant.fins_rad.len()).max().unwrap_or(0);
    for fin in 0..fins {
        let angle = |plant: &Plant| plant.fins_rad.get(fin).copied().unwrap_or(f64::NAN);
        rows.push((
            format!("fin {} at its fastest slew of {:.0} deg/s", fin + 1, vehicle.fin_rate_deg_s),
            time(&|a, b, dt_s| slewing(angle(a), angle(b), dt_s, fin_rate)),
        ));
    }
    let cells: Vec<Vec<String>> = rows
        .into_iter()
        .map(|(what, found_s)| {
            vec![what, format!("{found_s:.2} s"), format!("{:.1} %", 100.0 * found_s / total_s)]
        })
        .collect();
    paragraph(&format!("Of {total_s:.2} s in the air.")) + &table(&["actuator", "#time", "#share"], &cells)
}

/// Neighbouring records and the time between them, s.
fn intervals<'a>(moving: &'a [&Plant]) -> impl Iterator<Item = (&'a Plant, &'a Plant, f64)> + 'a {
    moving.windows(2).filter_map(|pair| match pair {
        [a, b] => Some((*a, *b, b.sample.time_s - a.sample.time_s)),
        _ => None,
    })
}

pub(super) fn solver(flight: &Flight, info: &Info) -> String {
    let idle = u32::from(ControlLevel::Idle.index());
    let plans: Vec<&Decision> = flight.thoughts.iter().filter(|thought| thought.level != idle).collect();
    if plans.is_empty() {
        return paragraph("The flight computer planned no landing.");
    }
    let count = |level: ControlLevel| {
        plans.iter().filter(|thought| thought.level == u32::from(level.index())).count()
    };
    let mut rows = vec![vec!["plans".to_owned(), plans.len().to_string()]];
    for level in ControlLevel::ALL {
        if count(level) > 0 {
            rows.push(vec![format!("decided by {}", level.name()), count(level).to_string()]);
        }
    }
    let most = plans.iter().map(|plan| plan.iterations).max().unwrap_or(0);
    rows.push(vec!["most iterations of a plan".to_owned(), most.to_string()]);
    let chart = |title: &str, points: Vec<(f64, f64)>, limits: Vec<f64>| Chart {
        limits,
        ..flight.over_time(title, vec![Line { name: "", class: "a", points }])
    };
    let point = |plan: &&Decision| (flight.axis_s(plan.sample.time_s), plan.iterations as f64);
    let points = plans.iter().map(point).collect();
    let mut pictures = vec![chart("Newton iterations of each plan", points, Vec::new()).svg()];
    let Some(times) = info.frames.and_then(|frames| frames.solve_time) else {
        return table(&["", "#"], &rows)
            + &charts(&pictures)
            + &paragraph(
                "This flight was simulated without a clock: solve times and deadlines are not in its log.",
            );
    };
    rows.push(vec!["solve time".to_owned(), solve_time_text(&times)]);
    let timings = flight.recording.timings.iter();
    let points = timings.map(|timing| (flight.axis_s(timing.time_s), 1e3 * timing.solve_time_s)).collect();
    pictures
        .push(chart("Duration of each frame with a plan, ms", points, vec![1e3 * times.deadline_s]).svg());
    table(&["", "#"], &rows) + &charts(&pictures)
}

pub(super) fn estimator(flight: &Flight) -> String {
    let errors = flight.in_space.as_ref().map_or(&[][..], |in_space| &in_space.errors);
    if errors.is_empty() {
        return paragraph("The log has no truth to compare the estimate with.");
    }
    let mut rows = Vec::new();
    let mut row = |name: &str, values: &dyn Fn(&EstimateError) -> f64| {
        if let Some((rms, max)) = rms_and_max(errors.iter().map(values)) {
            rows.push(vec![name.to_owned(), figure(rms), figure(max)]);
        }
    };
    for (place, direction) in ["north", "east", "up"].into_iter().enumerate() {
        row(&format!("position {direction}, m"), &|error| error.position_m[place]);
    }
    row("position, distance, m", &|error| length(error.position_m));
    for (place, direction) in ["north", "east", "up"].into_iter().enumerate() {
        row(&format!("velocity {direction}, m/s"), &|error| error.velocity_m_s[place]);
    }
    row("velocity, size, m/s", &|error| length(error.velocity_m_s));
    row("direction of the nose, deg", &|error| error.nose_rad.to_degrees());
    table(&["estimate less truth", "#root mean square", "#largest"], &rows)
        + &paragraph(&format!("At {} planning frames from the release to contact.", errors.len()))
}

fn length([x, y, z]: [f64; 3]) -> f64 {
    libm::sqrt(x * x + y * y + z * z)
}

/// Three digits or more, without an exponent.
fn figure(value: f64) -> String {
    let decimals = if value == 0.0 { 3.0 } else { (3.0 - libm::log10(value.abs())).ceil().clamp(3.0, 9.0) };
    format!("{value:.*}", decimals as usize)
}

pub(super) fn thrust(flight: &Flight) -> String {
    let (Some(vehicle), Some(ignition_s)) = (&flight.vehicle, flight.ignition_s) else {
        return paragraph("The log has no ignition, or no profile that says how strong the motor should be.");
    };
    let expected_n = |time_s: f64| (vehicle.expected_n)(time_s - ignition_s);
    let axis = |time_s| flight.axis_s(time_s);
    let shown = |time_s: f64| time_s >= ignition_s && flight.is_shown(time_s);
    let inferred: Vec<(f64, f64)> =
        flight.inferred_n.iter().filter(|(time_s, _)| shown(*time_s)).copied().collect();
    let truth = || flight.plant.iter().filter(|plant| flight.is_shown(plant.sample.time_s));
    let actual: Vec<(f64, f64)> = truth().map(|plant| (axis(plant.sample.time_s), plant.thrust_n)).collect();
    let times = truth().map(|plant| plant.sample.time_s).filter(|time_s| shown(*time_s));
    let expected = times.map(|time_s| (axis(time_s), expected_n(time_s))).collect();
    let inferred = inferred.into_iter().map(|(time_s, thrust_n)| (axis(time_s), thrust_n)).collect();
    let rows = flight.in_space.as_ref().map(scales).unwrap_or_default();
    let lines = vec![
        Line { name: "actual", class: "c", points: actual },
        Line { name: "expected", class: "b", points: expected },
        Line { name: "inferred", class: "a", points: inferred },
    ];
    let chart = Chart { limits: vec![vehicle.weight_n], full: true, ..flight.over_time("Thrust, N", lines) };
    let another = flight.in_space.as_ref().and_then(another_curve);
    another.map_or_else(String::new, |words| paragraph(&words))
        + &table(&["", "#"], &rows)
        + &charts(&[chart.svg()])
        + &paragraph("The dashed level is the vehicle's weight.")
}

/// A motor that is further off than this was another one than the mission expected: one of twenty of its own lot is.
const ANOTHER_SIGMAS: f64 = 2.0;

/// That the motor flew another curve than expected, if it did, and what had confirmed that curve.
fn another_curve(in_space: &InSpace) -> Option<String> {
    let (impulse, burn_time) = in_space.inferred_scales?;
    let (impulse_sigma, burn_time_sigma) = in_space.expected_sigmas;
    let off: Vec<String> = [("impulse", impulse, impulse_sigma), ("burn time", burn_time, burn_time_sigma)]
        .into_iter()
        .filter(|(_, scale, sigma)| (scale - 1.0).abs() > ANOTHER_SIGMAS * sigma)
        .map(|(name, scale, sigma)| {
            format!("{name} {:+.1} %, {:.1} deviations", 100.0 * (scale - 1.0), (scale - 1.0).abs() / sigma)
        })
        .collect();
    let confirmed = match in_space.motor_burns {
        0 => "No burn of its lot had confirmed the certified curve.".to_owned(),
        burns => format!("Burns of its lot that had confirmed the curve: {burns}."),
    };
    let nearest = in_space.other_curve.as_ref().map_or_else(String::new, |name| {
        format!(" Half a second after its ignition the flight computer took it for {name}.")
    });
    let off = off.join("; ");
    let words = || format!("The motor flew another curve than expected: {off}.{nearest} {confirmed}");
    (!off.is_empty()).then(words)
}

/// Impulse and burn time of the motor.
fn scales(in_space: &InSpace) -> Vec<Vec<String>> {
    let mut rows = Vec::new();
    if let Some((impulse, stretch)) = in_space.inferred_scales {
        rows.push(vec!["inferred impulse at the end, of expected".to_owned(), format!("{impulse:.4}")]);
        rows.push(vec!["inferred burn time at the end, of expected".to_owned(), format!("{stretch:.4}")]);
    }
    if let Some(scale) = in_space.true_impulse_scale {
        rows.push(vec!["actual impulse, of expected".to_owned(), format!("{scale:.4}")]);
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_motor_two_deviations_off_flew_another_curve() {
        let of = |scales, motor_burns| {
            let expected_sigmas = (0.0125, 0.02);
            another_curve(&InSpace {
                inferred_scales: Some(scales),
                expected_sigmas,
                motor_burns,
                ..InSpace::default()
            })
        };
        assert_eq!(of((1.02, 0.97), 4), None);
        assert_eq!(
            of((0.95, 1.01), 0).as_deref(),
            Some(
                "The motor flew another curve than expected: impulse -5.0 %, 4.0 deviations. No burn of its lot had confirmed the \
                 certified curve."
            )
        );
        let known = another_curve(&InSpace {
            inferred_scales: Some((1.11, 0.85)),
            expected_sigmas: (0.027, 0.04),
            other_curve: Some("HP-H45W".to_owned()),
            ..InSpace::default()
        });
        let words =
            "deviations. Half a second after its ignition the flight computer took it for HP-H45W. No burn";
        assert!(known.as_ref().is_some_and(|known| known.contains(words)), "{known:?}");
        assert!(
            of((0.95, 1.05), 4)
                .is_some_and(|words| words.contains("; burn time +5.0 %, 2.5 deviations. Burns"))
        );
    }
}
