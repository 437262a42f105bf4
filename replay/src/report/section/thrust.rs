//! The motor in three versions: in the profile, as estimated by the controller, and in truth.

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
    let truth = || flight.plant.iter().filter(|plant| flight.is_shown(plant.sample.time_s));
    let actual: Vec<(f64, f64)> = truth().map(|plant| (axis(plant.sample.time_s), plant.thrust_n)).collect();
    let times = truth().map(|plant| plant.sample.time_s).filter(|time_s| shown(*time_s));
    let expected = times.map(|time_s| (axis(time_s), expected_n(time_s))).collect();
    let inferred = inferred.into_iter().map(|(time_s, thrust_n)| (axis(time_s), thrust_n)).collect();
    let rows = flight.in_space.as_ref().map(scales).unwrap_or_default();
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

/// Impulse and burn time of the motor.
fn scales(in_space: &InSpace) -> Vec<Vec<String>> {
    let mut rows = Vec::new();
    if let Some((impulse, stretch)) = in_space.inferred_scales {
        rows.push(vec!["inferred impulse at the end, of certified".to_owned(), format!("{impulse:.4}")]);
        rows.push(vec!["inferred burn time at the end, of certified".to_owned(), format!("{stretch:.4}")]);
    }
    if let Some(scale) = in_space.true_impulse_scale {
        rows.push(vec!["actual impulse, of certified".to_owned(), format!("{scale:.4}")]);
    }
    rows
}
