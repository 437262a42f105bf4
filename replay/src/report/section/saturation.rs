//! How long gimbal and fins were at their stops, or slewed as fast as they can.

use protocol::log::v1::PlantTruth;

use crate::report::page::{paragraph, table};
use crate::report::track::{Flight, phase_of};

/// Closer to a stop, or to the fastest slew, than this fraction counts as there.
const AT_LIMIT: f64 = 0.995;

pub(super) fn html(flight: &Flight) -> String {
    let Some(profile) = &flight.profile else {
        return paragraph("The log has no profile that says where the stops are.");
    };
    let moving: Vec<&PlantTruth> = flight
        .recording
        .truth
        .iter()
        .filter(|truth| phase_of(truth.phase).is_some_and(|phase| !phase.on_pad()) && !truth.in_contact)
        .collect();
    if moving.len() < 2 {
        return paragraph("The log has no record of the actuators in flight.");
    }
    let stop_rad = profile.gimbal.limit_rad();
    let gimbal_rate = profile.gimbal.rate_limit_rad_s();
    let fin_rate = profile.fins.rate_limit_rad_s();
    let total_s: f64 = intervals(&moving).map(|(_, _, dt_s)| dt_s).sum();
    let time = |holds: &dyn Fn(&PlantTruth, &PlantTruth, f64) -> bool| -> f64 {
        intervals(&moving).filter(|(a, b, dt_s)| holds(a, b, *dt_s)).map(|(_, _, dt_s)| dt_s).sum()
    };
    let slewing = |a: f64, b: f64, dt_s: f64, rate: f64| (b - a).abs() >= AT_LIMIT * rate * dt_s;
    let mut rows = vec![(
        format!("gimbal at its stop of {:.1} deg", profile.gimbal.limit_deg),
        Some(time(&|_, b, _| b.gimbal_actual_rad.abs() >= AT_LIMIT * stop_rad)),
    )];
    rows.push((
        "gimbal at its fastest slew".to_owned(),
        gimbal_rate
            .map(|rate| time(&|a, b, dt_s| slewing(a.gimbal_actual_rad, b.gimbal_actual_rad, dt_s, rate))),
    ));
    let fins = moving.iter().map(|truth| truth.fin_actual_rad.len()).max().unwrap_or(0);
    for fin in 0..fins {
        let angle = |truth: &PlantTruth| truth.fin_actual_rad.get(fin).copied().unwrap_or(f64::NAN);
        rows.push((
            format!("fin {} at its fastest slew of {:.0} deg/s", fin + 1, profile.fins.rate_limit_deg_s),
            Some(time(&|a, b, dt_s| slewing(angle(a), angle(b), dt_s, fin_rate))),
        ));
    }
    let cells: Vec<Vec<String>> = rows
        .into_iter()
        .map(|(what, found)| match found {
            None => vec![what, "no limit: an ideal servo".to_owned(), String::new()],
            Some(found_s) => {
                vec![what, format!("{found_s:.2} s"), format!("{:.1} %", 100.0 * found_s / total_s)]
            }
        })
        .collect();
    paragraph(&format!("Of {total_s:.2} s in the air.")) + &table(&["actuator", "#time", "#share"], &cells)
}

/// Neighbouring records and the time between them, s.
fn intervals<'a>(
    moving: &'a [&PlantTruth],
) -> impl Iterator<Item = (&'a PlantTruth, &'a PlantTruth, f64)> + 'a {
    moving.windows(2).filter_map(|pair| match pair {
        [a, b] => Some((*a, *b, b.time_s - a.time_s)),
        _ => None,
    })
}
