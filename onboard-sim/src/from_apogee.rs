//! A flight from apogee for whoever flies one, the campaign or a replay: the facts its log names, its records and its
//! verdict. `pilot_log` words the records.

use std::collections::BTreeMap;

use campaign::baseline::Controller;
use campaign::dispersion::{Dispersion, DispersionError};
use campaign::fly::Flight;
use campaign::order::Order;
use campaign::outcome::Failure;
use flight::phase::Phase;
use flight::powered::Plane;
use nalgebra::Vector3;
use protocol::log::record::{Event, EventLevel, Record};
use protocol::log::v1;
use protocol::log::writer::LogHeader;
use world::Touchdown;

use crate::pilot_log;

/// A flight of a campaign has no day: its log begins at the epoch, so that the same flight gives the same log.
pub fn header(order: &Order, number: u64) -> LogHeader {
    pilot_log::header("onboard-sim campaign", order, number, 0)
}

/// The dispersions of a log: by its scenario's text, or of a log without one the built-in that its run facts name.
///
/// # Errors
/// The text is no set of dispersions, or no built-in has the name.
pub fn dispersion_of(
    run: &BTreeMap<String, String>,
    scenario_toml: Option<&str>,
) -> Result<Dispersion, DispersionError> {
    let name = run.get("dispersion").map_or("", String::as_str);
    match scenario_toml {
        Some(text) => Dispersion::from_toml(text, name),
        None => Dispersion::builtin(name),
    }
}

/// Nanoseconds since apogee at the end of the last frame.
pub fn time_ns(flight: &Flight) -> u64 {
    flight.frame() * u64::from(world::sensors::FRAME_MS) * 1_000_000
}

/// The last frame's records, and a change of phase since `phase`.
pub fn frame(flight: &Flight, phase: Phase) -> Vec<Record> {
    let mut records = pilot_log::frame(flight);
    let now = flight.pilot().mode().phase;
    if now != phase {
        records.push(Record::Event(Event {
            level: EventLevel::Info,
            name: "vehicle".to_owned(),
            message: format!("phase {} to {}", phase.name(), now.name()),
        }));
    }
    records
}

/// The verdict on a flight that is over, by what its legs take; `None` if it did not come down. What else went wrong
/// (a parachute, a fall over) is a limit of its own that allows nothing.
pub fn verdict(flight: &Flight) -> Option<v1::LandingVerdict> {
    let outcome = flight.outcome();
    let touchdown = outcome.touchdown.as_ref()?;
    let legs = &flight.mission().leg_limits;
    let limit = |name: &str, value: f64, maximum: f64, lowest: f64, unit: &str| v1::LimitResult {
        name: name.to_owned(),
        value,
        minimum: lowest * maximum,
        maximum,
        unit: unit.to_owned(),
        passed: value.abs() <= maximum,
    };
    let (tilt_deg, rate_deg_s) = (touchdown.tilt_rad.to_degrees(), touchdown.rate_rad_s.to_degrees());
    let mut limits = vec![
        limit(Failure::Vertical.name(), touchdown.vertical_m_s, legs.vertical_m_s, -1.0, "m/s"),
        limit(Failure::Lateral.name(), touchdown.lateral_m_s, legs.lateral_m_s, -1.0, "m/s"),
        limit(Failure::Tilt.name(), tilt_deg, legs.tilt_deg, -1.0, "deg"),
        limit(Failure::Rate.name(), rate_deg_s, legs.rate_deg_s, -1.0, "deg/s"),
    ];
    let of_legs = [Failure::Vertical, Failure::Lateral, Failure::Tilt, Failure::Rate];
    if let Some(failure) = outcome.failure.filter(|failure| !of_legs.contains(failure)) {
        limits.push(limit(failure.name(), 1.0, 0.0, 0.0, ""));
    }
    Some(v1::LandingVerdict {
        time_s: touchdown.time_s,
        state: tick_log::state_to_log(&in_world_plane(flight, touchdown)),
        limits,
        landed: outcome.legs,
    })
}

/// The state at contact in the world's x-z plane.
fn in_world_plane(flight: &Flight, touchdown: &Touchdown) -> flight::dynamics::PlanarState {
    let nil = Vector3::zeros();
    let feet_below_cg_m = flight.world().cg_above_feet_m();
    Plane::choose(&nil, &nil, &nil).project(&touchdown.state, feet_below_cg_m, 0.0)
}

/// Who flew the landing burn of a recorded flight; the pilot itself if the log does not say.
pub fn controller_of(run: &BTreeMap<String, String>) -> Option<Controller> {
    run.get("controller").map_or(Some(Controller::Nmpc), |name| name.parse().ok())
}
