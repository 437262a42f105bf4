//! A simulated flight as log records: the flight computer's input, estimate and output in every frame, and
//! the truth. A replay runs the flight computer again from these records.

use std::collections::BTreeMap;

use flight::guidance::baseline::Controller;
use flight::guidance::powered::Plane;
use flight::rules::phase::Phase;
use flight::rules::verdict::LandingVerdict;
use flight::vehicle::dynamics::PlanarState;
use flight::vehicle::mission::StartPoint;
use nalgebra::Vector3;
use protocol::log::flight_v1::{Estimate, PilotStart, TruthSample};
use protocol::log::record::{Event, EventLevel, Record};
use protocol::log::v1;
use protocol::log::writer::LogHeader;
use sim::dispersion::{Dispersion, DispersionError};
use sim::limits::Limits;
use sim::outcome::Failure;
use sim::recipe::Recipe;
use sim::sortie::Sortie;
use world::Touchdown;

use crate::pilot::{estimate_to_log, motor_to_log, state_to_log, tick_to_log, vector_to_log};

/// The header of the log of a simulated flight.
pub fn header(writer: &str, recipe: &Recipe, number: u64, start_unix_ns: u64) -> LogHeader {
    let faults = recipe.faults.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ");
    let run = [
        ("profile", recipe.mission.name.clone()),
        ("dispersion", recipe.dispersion_name.clone()),
        ("seed", recipe.seed.to_string()),
        ("flight", number.to_string()),
        ("controller", recipe.controller.name().to_owned()),
        ("faults", faults),
        ("start_unix_ns", start_unix_ns.to_string()),
    ];
    LogHeader {
        writer: writer.to_owned(),
        start_unix_ns,
        run: run.into_iter().map(|(key, value)| (key.to_owned(), value)).collect::<BTreeMap<_, _>>(),
        profile_toml: Some(recipe.mission_toml.clone()),
        scenario_toml: Some(recipe.dispersion_toml.clone()),
    }
}

/// The record before the first frame. Times in the records count from the start of the flight.
pub fn start(flight: &Sortie) -> Record {
    Record::PilotStart(Box::new(pilot_start(flight)))
}

/// The flight computer's estimate before its first frame, and its settings that the text of its mission does not contain.
pub fn pilot_start(flight: &Sortie) -> PilotStart {
    let mission = flight.mission();
    let estimate = flight.pilot().estimator().estimate();
    let stood = mission.start.at == StartPoint::Pad;
    PilotStart {
        time_s: 0.0,
        believed: state_to_log(&estimate.state),
        gyro_bias_rad_s: stood.then(|| vector_to_log(&estimate.gyro_bias_rad_s)),
        steered: mission.steered,
        fixed_ignition_height_m: mission.ignition.fixed_height_m,
    }
}

/// The records of the frame that was just flown; only the truth while the flight computer is dead.
pub fn frame(flight: &Sortie) -> Vec<Record> {
    let mut records = Vec::with_capacity(3);
    if let Some((input, output)) = flight.computer().piloted().filter(|_| !flight.computer_is_dead()) {
        let tick = tick_to_log(input, output, flight.computer().flight_digest());
        records.push(Record::PilotTick(Box::new(tick)));
        if let Some(estimate) = flight.pilot().estimate() {
            let motor = motor_to_log(flight.pilot().motor());
            records.push(Record::Estimate(Box::new(Estimate { motor, ..estimate_to_log(estimate) })));
        }
    }
    records.push(Record::TruthSample(Box::new(truth(flight))));
    records
}

fn truth(flight: &Sortie) -> TruthSample {
    let world = flight.world();
    let commanded = flight.computer().piloted().map(|(_, output)| output);
    TruthSample {
        time_s: world.time_s(),
        state: state_to_log(world.state()),
        height_m: world.height_m(),
        thrust_n: world.thrust_n(),
        mass_kg: world.mass().mass_kg,
        wind_m_s: vector_to_log(&world.wind_m_s()),
        gimbal_commanded_rad: commanded.map_or_else(Vec::new, |output| output.gimbal_rad.to_vec()),
        gimbal_actual_rad: world.gimbal_rad().to_vec(),
        fins_commanded_rad: commanded.map_or_else(Vec::new, |output| output.fins_rad.to_vec()),
        fins_actual_rad: world.fins_rad().to_vec(),
        parachute_open_share: world.parachute_open_share(),
        in_contact: world.touchdown().is_some(),
        nees_of_motion: flight.nees_of_motion(),
        booster_thrust_n: world.booster_attached().then(|| world.booster_thrust_n()),
    }
}

/// The header for a flight of a campaign. It has no date: its log begins at the epoch, so that the same flight always
/// gives the same log.
pub fn campaign_header(recipe: &Recipe, number: u64) -> LogHeader {
    header("onboard-sim campaign", recipe, number, 0)
}

/// The dispersions of a log: from the text of its scenario, or else the built-in set that its run facts name.
///
/// # Errors
/// The text is not a set of dispersions, or no built-in set has the name.
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

/// Nanoseconds since the start at the end of the last frame.
pub fn time_ns(flight: &Sortie) -> u64 {
    flight.frame() * u64::from(flight::computer::FRAME_MS) * 1_000_000
}

/// The last frame's records, and a change of phase since `phase`.
pub fn frame_and_phase(flight: &Sortie, phase: Phase) -> Vec<Record> {
    let mut records = frame(flight);
    let now = flight.computer().mode().phase;
    if now != phase {
        records.push(Record::Event(Event {
            level: EventLevel::Info,
            name: "vehicle".to_owned(),
            message: format!("phase {} to {}", phase.name(), now.name()),
        }));
    }
    records
}

/// The verdict on a finished flight, by the limits of its legs and by the landing paper's Table 2; `None` if it did not
/// come down. Any other failure (a parachute, tipping over) is an additional limit that allows nothing.
pub fn verdict(flight: &Sortie) -> Option<v1::LandingVerdict> {
    let outcome = flight.outcome();
    let touchdown = outcome.touchdown.as_ref()?;
    let both = Limits::of(flight.mission());
    let mut limits = limits_to_log(&both.by_legs(touchdown).1);
    let of_legs = [Failure::Vertical, Failure::Lateral, Failure::Tilt, Failure::Rate];
    if let Some(failure) = outcome.failure.filter(|failure| !of_legs.contains(failure)) {
        limits.push(v1::LimitResult {
            name: failure.name().to_owned(),
            value: 1.0,
            minimum: 0.0,
            maximum: 0.0,
            unit: String::new(),
            passed: false,
        });
    }
    let aborted = flight.computer().mode().interlocks.abort_latched;
    Some(v1::LandingVerdict {
        time_s: touchdown.time_s,
        state: in_world_plane(flight, touchdown),
        limits,
        landed: outcome.legs,
        table_2: limits_to_log(&both.by_table_2(touchdown).1),
        ending: Some(outcome.ending(aborted).to_string()),
    })
}

/// The state at contact in the world's x-z plane.
fn in_world_plane(flight: &Sortie, touchdown: &Touchdown) -> v1::PlanarState {
    let nil = Vector3::zeros();
    let feet_below_cg_m = flight.world().cg_above_feet_m();
    let PlanarState { x_m, z_m, theta_rad, u_m_s, w_m_s, q_rad_s } =
        Plane::choose(&nil, &nil, &nil).project(&touchdown.state, feet_below_cg_m, 0.0);
    v1::PlanarState { x_m, z_m, theta_rad, u_m_s, w_m_s, q_rad_s }
}

/// Each limit with its result, as records.
fn limits_to_log(verdict: &LandingVerdict) -> Vec<v1::LimitResult> {
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

/// The controller that flew the landing burn of a recorded flight; the pilot itself if the log does not say.
pub fn controller_of(run: &BTreeMap<String, String>) -> Option<Controller> {
    run.get("controller").map_or(Some(Controller::Nmpc), |name| name.parse().ok())
}
