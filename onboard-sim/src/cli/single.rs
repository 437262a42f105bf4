//! One flight of a campaign, by its number, and its log.

use std::collections::BTreeMap;
use std::io::Write as _;
use std::path::Path;
use std::process::ExitCode;

use anyhow::Context as _;
use campaign::fault::Expected;
use campaign::fly::Flight;
use campaign::order::Order;
use campaign::row::{COLUMNS, Row, Value};
use campaign::sortie::Sortie;
use protocol::log::flight_v1::{PilotStart, TruthSample};
use protocol::log::record::{Event, EventLevel, Record};
use protocol::log::recorder::Recorder;
use protocol::log::writer::LogHeader;
use tick_log::pilot::{estimate_to_log, state_to_log, tick_to_log, vector_to_log};

/// Flies it and prints its row, a column a line.
///
/// Exit code 0 if it did what the scenario expects, or without one if it landed within what the legs take; else 3.
pub(super) fn fly(
    order: &Order,
    number: u64,
    expected: Option<Expected>,
    log: Option<&Path>,
) -> anyhow::Result<ExitCode> {
    let mut sortie = Sortie::new(order, number)?;
    match log {
        None => while sortie.step() {},
        Some(path) => fly_logged(order, number, &mut sortie, path)?,
    }
    let row = sortie.row();
    let mut stdout = std::io::stdout().lock();
    print_row(&row, &mut stdout)?;
    let met = expected.unwrap_or(Expected::Land).met(&row);
    if let Some(expected) = expected {
        writeln!(stdout, "expected to {}: {}", expected.name(), if met { "it did" } else { "IT DID NOT" })?;
    }
    if let Some(path) = log {
        writeln!(stdout, "log {}", path.display())?;
    }
    Ok(ExitCode::from(if met { 0 } else { 3 }))
}

fn print_row(row: &Row, out: &mut impl std::io::Write) -> std::io::Result<()> {
    for column in COLUMNS {
        let name = column.name;
        match (column.value)(row) {
            Value::Maybe(None) => writeln!(out, "{name:<32}-")?,
            Value::Count(count) => writeln!(out, "{name:<32}{count}")?,
            Value::Real(real) | Value::Maybe(Some(real)) => writeln!(out, "{name:<32}{real:.4}")?,
            Value::Flag(flag) => writeln!(out, "{name:<32}{flag}")?,
            Value::Word(word) => writeln!(out, "{name:<32}{word}")?,
        }
    }
    Ok(())
}

fn fly_logged(order: &Order, number: u64, sortie: &mut Sortie, path: &Path) -> anyhow::Result<()> {
    let recorder = Recorder::create(path, &header(order, number))?;
    let mission = sortie.flight().mission();
    let start = PilotStart {
        time_s: 0.0,
        believed: state_to_log(sortie.flight().believed_at_apogee()),
        steered: mission.steered,
        fixed_ignition_height_m: mission.ignition.fixed_height_m,
    };
    recorder.record(Record::PilotStart(Box::new(start)), 0);
    let mut phase = sortie.flight().pilot().mode().phase;
    loop {
        let goes_on = sortie.step();
        let flight = sortie.flight();
        let time_ns = flight.frame() * u64::from(world::sensors::FRAME_MS) * 1_000_000;
        if let (Some(input), Some(piloted)) = (flight.input(), flight.piloted()) {
            let tick = tick_to_log(input, piloted, flight.pilot().digest());
            recorder.record(Record::PilotTick(Box::new(tick)), time_ns);
            if let Some(estimate) = flight.pilot().estimate() {
                recorder.record(Record::Estimate(Box::new(estimate_to_log(estimate))), time_ns);
            }
        }
        recorder.record(Record::TruthSample(Box::new(truth(flight))), time_ns);
        let now = flight.pilot().mode().phase;
        if now != phase {
            let event = Event {
                level: EventLevel::Info,
                name: "vehicle".to_owned(),
                message: format!("phase {} to {}", phase.name(), now.name()),
            };
            recorder.record(Record::Event(event), time_ns);
            phase = now;
        }
        if !goes_on {
            break;
        }
    }
    recorder.finish().context("the flight is over, but its log is not whole")?;
    Ok(())
}

/// A flight of a campaign has no day: its log begins at the epoch, so that the same flight gives the same log.
fn header(order: &Order, number: u64) -> LogHeader {
    let faults = order.faults.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ");
    let run = [
        ("profile", order.mission.name.clone()),
        ("dispersion", order.dispersion_name.clone()),
        ("seed", order.seed.to_string()),
        ("flight", number.to_string()),
        ("controller", order.controller.name().to_owned()),
        ("faults", faults),
        ("start_unix_ns", "0".to_owned()),
    ];
    LogHeader {
        writer: "onboard-sim campaign".to_owned(),
        start_unix_ns: 0,
        run: run.into_iter().map(|(key, value)| (key.to_owned(), value)).collect::<BTreeMap<_, _>>(),
        profile_toml: Some(order.mission_toml.clone()),
    }
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
    }
}
