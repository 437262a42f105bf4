//! A flight from apogee as log records: what the flight computer was given, believed and decided in every frame, and
//! the truth beside it. A replay flies the flight computer again from these.

use std::collections::BTreeMap;

use campaign::fly::Flight;
use campaign::order::Order;
use protocol::log::flight_v1::{PilotStart, TruthSample};
use protocol::log::record::Record;
use protocol::log::writer::LogHeader;
use tick_log::pilot::{estimate_to_log, state_to_log, tick_to_log, vector_to_log};

/// The header of such a log.
pub fn header(writer: &str, order: &Order, number: u64, start_unix_ns: u64) -> LogHeader {
    let faults = order.faults.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ");
    let run = [
        ("profile", order.mission.name.clone()),
        ("dispersion", order.dispersion_name.clone()),
        ("seed", order.seed.to_string()),
        ("flight", number.to_string()),
        ("controller", order.controller.name().to_owned()),
        ("faults", faults),
        ("start_unix_ns", start_unix_ns.to_string()),
    ];
    LogHeader {
        writer: writer.to_owned(),
        start_unix_ns,
        run: run.into_iter().map(|(key, value)| (key.to_owned(), value)).collect::<BTreeMap<_, _>>(),
        profile_toml: Some(order.mission_toml.clone()),
        scenario_toml: Some(order.dispersion_toml.clone()),
    }
}

/// What comes before the first frame. Times in the records count from apogee.
pub fn start(flight: &Flight) -> Record {
    let mission = flight.mission();
    Record::PilotStart(Box::new(PilotStart {
        time_s: 0.0,
        believed: state_to_log(flight.believed_at_apogee()),
        steered: mission.steered,
        fixed_ignition_height_m: mission.ignition.fixed_height_m,
    }))
}

/// The frame that was just flown; the truth alone while the flight computer is dead.
pub fn frame(flight: &Flight) -> Vec<Record> {
    let mut records = Vec::with_capacity(3);
    if let (Some(input), Some(piloted)) = (flight.input(), flight.piloted()) {
        let tick = tick_to_log(input, piloted, flight.pilot().digest());
        records.push(Record::PilotTick(Box::new(tick)));
        if let Some(estimate) = flight.pilot().estimate() {
            records.push(Record::Estimate(Box::new(estimate_to_log(estimate))));
        }
    }
    records.push(Record::TruthSample(Box::new(truth(flight))));
    records
}

fn truth(flight: &Flight) -> TruthSample {
    let world = flight.world();
    let commanded = flight.output();
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
    }
}
