//! The flight computer's estimate, against the simulated world; every direction has its row.

use super::rms_and_max;
use crate::report::html::{paragraph, table};
use crate::report::track::{EstimateError, Flight};

pub(super) fn html(flight: &Flight) -> String {
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
