//! The controller's estimate, against the simulated plant.

use super::{COMPONENTS, rms_and_max};
use crate::report::html::{paragraph, table};
use crate::report::track::{Flight, Teller, phase_of, state_of};

pub(super) fn html(flight: &Flight) -> String {
    if flight.teller != Teller::Plant || flight.recording.ticks.is_empty() {
        return paragraph("The log has no truth to compare the estimate with.");
    }
    let errors: Vec<[f64; 6]> = flight
        .recording
        .ticks
        .iter()
        .filter(|tick| phase_of(tick.input.phase).is_some_and(|phase| !phase.on_pad()))
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
            Some(vec![format!("{name}, {unit}"), format!("{rms:.3e}"), format!("{max:.3e}")])
        })
        .collect();
    let mut html = table(&["estimate less truth", "#root mean square", "#largest"], &rows);
    if errors.iter().flatten().all(|error| error.abs() < 1e-12) {
        html.push_str(&paragraph("This flight's estimate is the truth: it was simulated without sensors."));
    }
    let ticks = if flight.from_apogee.is_some() { "frames from apogee on" } else { "ticks off the pad" };
    html + &paragraph(&format!("At {} {ticks}.", errors.len()))
}

/// The plant at the exact time of a tick; nothing is interpolated.
fn nearby(flight: &Flight, time_s: f64) -> Option<[f64; 6]> {
    const SAME_S: f64 = 1e-4;
    let found = flight.recording.truth.iter().find(|truth| (truth.time_s - time_s).abs() < SAME_S)?;
    // The rig's record at the instant of the release shows the moment before it.
    phase_of(found.phase).filter(|phase| !phase.on_pad())?;
    Some(state_of(&found.state))
}
