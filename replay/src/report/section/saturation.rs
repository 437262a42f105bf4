//! How long gimbal and fins were at their stops or at their maximum slew rate.

use crate::report::html::{paragraph, table};
use crate::report::track::{Flight, Plant};

/// A value within this fraction of a stop or of the maximum slew rate counts as saturated.
const AT_LIMIT: f64 = 0.995;

pub(super) fn html(flight: &Flight) -> String {
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
