//! The planar vehicle's simulated plant, and the verdict on its landing, as records.

use flight::rules::verdict::LandingVerdict;
use flight::vehicle::dynamics::PlanarState;
use log_records::v1;
use sim::ending::FlightEnding;
use sim::plane::PlanarFlight;

use crate::state_to_log;

/// A landing verdict as a record: the state at contact, and each limit with its result.
pub fn verdict_to_log(time_s: f64, state: &PlanarState, verdict: &LandingVerdict) -> v1::LandingVerdict {
    v1::LandingVerdict {
        time_s,
        state: state_to_log(state),
        limits: limits_to_log(verdict),
        landed: verdict.landed(),
        table_2: Vec::new(),
        ending: Some(ending_in_plane(verdict, false).to_string()),
    }
}

/// How a planar landing ended: its limits are Table 2.
pub fn ending_in_plane(verdict: &LandingVerdict, aborted: bool) -> FlightEnding<'static> {
    let failure = verdict.failures().next().map(|limit| limit.name);
    FlightEnding { aborted, landed: verdict.landed(), table_2: Some(verdict.landed()), failure }
}

/// Each limit with its result, as records.
pub(crate) fn limits_to_log(verdict: &LandingVerdict) -> Vec<v1::LimitResult> {
    let limits = verdict.results.iter().map(|result| v1::LimitResult {
        name: result.name.to_owned(),
        value: result.value,
        minimum: result.lowest,
        maximum: result.highest,
        unit: result.unit.to_owned(),
        passed: result.passed,
    });
    limits.collect()
}

/// The true planar vehicle after a frame, as a record.
pub fn plant_truth(flight: &PlanarFlight) -> v1::PlantTruth {
    let plant = flight.plant();
    let (gimbal_rad, fins_rad) = (plant.gimbal_rad(), plant.fins_rad());
    v1::PlantTruth {
        time_s: flight.time_s(),
        phase: u32::from(flight.computer().mode().phase.index()),
        state: state_to_log(&plant.state()),
        gimbal_commanded_rad: gimbal_rad.0,
        gimbal_actual_rad: gimbal_rad.1,
        fin_commanded_rad: fins_rad.0.to_vec(),
        fin_actual_rad: fins_rad.1.to_vec(),
        thrust_n: plant.thrust_n(),
        mass_kg: plant.mass_kg(),
        in_contact: plant.in_contact(),
    }
}
