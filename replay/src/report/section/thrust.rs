//! The motor in three versions: in the profile, as estimated by the controller, and in truth.

use super::rms_and_max;
use crate::report::chart::{Chart, Line};
use crate::report::html::{charts, paragraph, table};
use crate::report::track::{Flight, InSpace};

pub(super) fn html(flight: &Flight) -> String {
    let (Some(vehicle), Some(ignition_s)) = (&flight.vehicle, flight.ignition_s) else {
        return paragraph("The log has no ignition, or no profile that says how strong the motor should be.");
    };
    let expected_n = |time_s: f64| (vehicle.expected_n)(time_s - ignition_s);
    let axis = |time_s| flight.axis_s(time_s);
    let shown = |time_s: f64| time_s >= ignition_s && flight.is_shown(time_s);
    let inferred: Vec<(f64, f64)> =
        flight.inferred_n.iter().filter(|(time_s, _)| shown(*time_s)).copied().collect();
    let truth: Vec<_> = flight.recording.truth.iter().filter(|truth| flight.is_shown(truth.time_s)).collect();
    let actual: Vec<(f64, f64)> = truth.iter().map(|truth| (axis(truth.time_s), truth.thrust_n)).collect();
    // The times of the flight computer's estimates, else those of the truth.
    let times: Vec<f64> = if inferred.is_empty() || flight.from_apogee.is_some() {
        truth.iter().map(|truth| truth.time_s).filter(|time_s| shown(*time_s)).collect()
    } else {
        inferred.iter().map(|(time_s, _)| *time_s).collect()
    };
    let expected = times.into_iter().map(|time_s| (axis(time_s), expected_n(time_s))).collect();
    let inferred = inferred.into_iter().map(|(time_s, thrust_n)| (axis(time_s), thrust_n)).collect();
    let rows = match &flight.from_apogee {
        Some(from_apogee) => scales(from_apogee),
        None => shares(flight, &expected_n, &shown),
    };
    let chart = Chart {
        title: "Thrust, N".to_owned(),
        x_label: flight.axis_name(),
        lines: vec![
            Line { name: "actual", class: "c", points: actual },
            Line { name: "expected", class: "b", points: expected },
            Line { name: "inferred", class: "a", points: inferred },
        ],
        limits: vec![vehicle.weight_n],
        marks: flight.marks(),
        full: true,
        ..Chart::default()
    };
    table(&["", "#"], &rows)
        + &charts(&[chart.svg()])
        + &paragraph("The dashed level is the vehicle's weight.")
}

/// Impulse and burn time of a motor with a thrust curve.
fn scales(from_apogee: &InSpace) -> Vec<Vec<String>> {
    let mut rows = Vec::new();
    if let Some((impulse, stretch)) = from_apogee.inferred_scales {
        rows.push(vec!["inferred impulse at the end, of certified".to_owned(), format!("{impulse:.4}")]);
        rows.push(vec!["inferred burn time at the end, of certified".to_owned(), format!("{stretch:.4}")]);
    }
    if let Some(scale) = from_apogee.true_impulse_scale {
        rows.push(vec!["actual impulse, of certified".to_owned(), format!("{scale:.4}")]);
    }
    rows
}

/// The thrust of a planar landing's motor over its nominal one.
fn shares(flight: &Flight, expected_n: &dyn Fn(f64) -> f64, shown: &dyn Fn(f64) -> bool) -> Vec<Vec<String>> {
    let ticks: Vec<_> = flight.recording.ticks.iter().filter(|tick| shown(tick.input.time_s)).collect();
    let mut rows = Vec::new();
    if let Some(last) = ticks.last() {
        rows.push(vec![
            "inferred at the end, of nominal".to_owned(),
            format!("{:.4}", last.input.thrust_scale),
        ]);
    }
    if let Some((_, max)) = rms_and_max(ticks.iter().map(|tick| tick.input.thrust_scale - 1.0)) {
        rows.push(vec![
            "largest inferred difference from nominal".to_owned(),
            format!("{:.2} %", 100.0 * max),
        ]);
    }
    let burning = flight.recording.truth.iter().filter(|truth| truth.thrust_n > 0.0);
    let ratios: Vec<f64> = burning
        .map(|truth| truth.thrust_n / expected_n(truth.time_s))
        .filter(|ratio| ratio.is_finite())
        .collect();
    if !ratios.is_empty() {
        let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
        rows.push(vec!["actual, of nominal, mean of the burn".to_owned(), format!("{mean:.4}")]);
    }
    rows
}
