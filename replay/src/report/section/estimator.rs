//! The controller's estimate, against the simulated plant.

use super::{COMPONENTS, rms_and_max};
use crate::report::html::{paragraph, table};
use crate::report::track::{EstimateError, Flight, Teller, phase_of, state_of};

pub(super) fn html(flight: &Flight) -> String {
    if flight.teller != Teller::Plant || flight.recording.ticks.is_empty() {
        return paragraph("The log has no truth to compare the estimate with.");
    }
    if let Some(in_space) = &flight.from_apogee {
        return errors_in_space(&in_space.errors);
    }
    let errors: Vec<[f64; 6]> = flight
        .recording
        .ticks
        .iter()
        .filter(|tick| phase_of(tick.input.phase).is_some_and(|phase| !phase.on_pad()))
        .filter(|tick| flight.is_before_contact(tick.input.time_s))
        .filter_map(|tick| {
            let truth = nearby(flight, tick.input.time_s)?;
            let estimate = state_of(&tick.input.state);
            Some(core::array::from_fn(|i| estimate[i] - truth[i]))
        })
        .collect();
    if errors.is_empty() {
        return paragraph("No tick of the flight has a record of the plant at the same time.");
    }
    let rows: Vec<Vec<String>> = COMPONENTS
        .iter()
        .enumerate()
        .filter_map(|(component, (name, unit, factor))| {
            let (rms, max) = rms_and_max(errors.iter().map(|error| factor * error[component]))?;
            Some(vec![format!("{name}, {unit}"), figure(rms), figure(max)])
        })
        .collect();
    let mut html = table(&["estimate less truth", "#root mean square", "#largest"], &rows);
    if errors.iter().flatten().all(|error| error.abs() < 1e-12) {
        html.push_str(&paragraph("This flight's estimate is the truth: it was simulated without sensors."));
    }
    html + &paragraph(&format!("At {} ticks off the pad, up to contact.", errors.len()))
}

/// The errors of a rocket in space: every direction has its row.
fn errors_in_space(errors: &[EstimateError]) -> String {
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

/// The plant at the exact time of a tick; nothing is interpolated.
fn nearby(flight: &Flight, time_s: f64) -> Option<[f64; 6]> {
    const SAME_S: f64 = 1e-4;
    let found = flight.recording.truth.iter().find(|truth| (truth.time_s - time_s).abs() < SAME_S)?;
    // The rig's record at the instant of the release shows the moment before it.
    phase_of(found.phase).filter(|phase| !phase.on_pad())?;
    Some(state_of(&found.state))
}
