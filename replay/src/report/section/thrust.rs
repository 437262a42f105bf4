//! The motor as the profile has it, as the controller weighed it, and as it was.

use super::rms_and_max;
use crate::report::chart::{Chart, Line};
use crate::report::page::{charts, paragraph, table};
use crate::report::track::Flight;

pub(super) fn html(flight: &Flight) -> String {
    let (Some(profile), Some(ignition_s)) = (&flight.profile, flight.ignition_s) else {
        return paragraph("The log has no ignition, or no profile that says how strong the motor should be.");
    };
    let expected_n = |time_s: f64| profile.motor.thrust_at_n(time_s - ignition_s);
    let ticks: Vec<_> = flight
        .recording
        .ticks
        .iter()
        .filter(|tick| tick.input.time_s >= ignition_s && flight.is_shown(tick.input.time_s))
        .collect();
    let axis = |time_s| flight.axis_s(time_s);
    let expected =
        ticks.iter().map(|tick| (axis(tick.input.time_s), expected_n(tick.input.time_s))).collect();
    let inferred = ticks
        .iter()
        .map(|tick| (axis(tick.input.time_s), tick.input.thrust_scale * expected_n(tick.input.time_s)))
        .collect();
    let truth = flight.recording.truth.iter().filter(|truth| flight.is_shown(truth.time_s));
    let actual: Vec<(f64, f64)> = truth.map(|truth| (axis(truth.time_s), truth.thrust_n)).collect();
    let scales = ticks.iter().map(|tick| tick.input.thrust_scale - 1.0);
    let mut rows = Vec::new();
    if let Some(last) = ticks.last() {
        rows.push(vec![
            "inferred at the end, of nominal".to_owned(),
            format!("{:.4}", last.input.thrust_scale),
        ]);
    }
    if let Some((_, max)) = rms_and_max(scales) {
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
    let chart = Chart {
        title: "Thrust, N".to_owned(),
        x_label: flight.axis_name(),
        lines: vec![
            Line { name: "actual", class: "c", points: actual },
            Line { name: "expected", class: "b", points: expected },
            Line { name: "inferred", class: "a", points: inferred },
        ],
        limits: vec![profile.vehicle.mass_kg * profile.environment.gravity_m_s2],
        marks: flight.marks(),
        full: true,
        ..Chart::default()
    };
    table(&["", "#"], &rows)
        + &charts(&[chart.svg()])
        + &paragraph("The dashed level is the vehicle's weight.")
}
