//! A simulated flight as log records: the flight computer's frames, its estimates, and the truth. A
//! replay runs the flight computer again from the frames.

use std::collections::BTreeMap;

use crate::dispersion::{Dispersion, DispersionError};
use crate::outcome::{by_envelope, by_table_2};
use crate::outside::Watch;
use crate::recipe::Recipe;
use crate::sortie::Sortie;
use crate::wire::field::RUN_FACT;
use crate::world::Strain;
use flight::computer::messages::{CrewMessage, Severity};
use flight::computer::pilot::Pilot;
use flight::computer::{Computer, Input, Output};
use flight::rules::phase::Phase;
use flight::rules::verdict::{Landing, LandingVerdict};
use protocol::log::computer_v1::ComputerFrame;
use protocol::log::flight_v1::TruthSample;
use protocol::log::record::{Event, EventLevel, Record};
use protocol::log::v1;
use protocol::log::writer::LogHeader;

pub use avionics::log::frame::start_to_log as start;
use avionics::log::frame::{estimate_to_log, frame_to_log};
use avionics::log::logged::Logged as _;

/// The header of the log of a simulated flight.
pub fn header(writer: &str, recipe: &Recipe, number: u64, start_unix_ns: u64) -> LogHeader {
    let faults = recipe.faults.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ");
    let run = [
        ("profile", recipe.mission.name.clone()),
        ("dispersion", recipe.dispersion_name.clone()),
        ("seed", recipe.seed.to_string()),
        ("flight", number.to_string()),
        ("faults", faults),
        ("start_unix_ns", start_unix_ns.to_string()),
    ];
    let field = recipe.field.clone().map(|text| (RUN_FACT, text));
    LogHeader {
        writer: writer.to_owned(),
        start_unix_ns,
        run: run
            .into_iter()
            .chain(field)
            .map(|(key, value)| (key.to_owned(), value))
            .collect::<BTreeMap<_, _>>(),
        profile_toml: Some(recipe.mission_toml.clone()),
        scenario_toml: Some(recipe.dispersion_toml.clone()),
        live: None,
    }
}

/// Stores the flight computer's last frame as its record.
#[derive(Debug, Clone, Default)]
pub struct LastFrame {
    /// `None` while the computer is dead.
    frame: Option<Box<ComputerFrame>>,
    /// The result of the rehearsal is already in a recorded frame.
    rehearsed: bool,
    /// The number of the next frame of a computer that lives.
    next: u64,
}

impl LastFrame {
    /// The frame, once.
    pub fn take(&mut self) -> Option<Box<ComputerFrame>> {
        self.frame.take()
    }
}

impl Watch for LastFrame {
    fn decided(&mut self, input: &Input<'_>, output: &Output, computer: &Computer) {
        // A computer that has restarted takes the rehearsal again.
        let rehearsed_before = self.rehearsed && input.frame == self.next;
        let record = frame_to_log(input, output, computer, rehearsed_before, ComputerFrame::default());
        self.frame = Some(Box::new(record));
        (self.rehearsed, self.next) = (computer.rehearsed().is_some(), input.frame + 1);
    }
}

/// The pilot's estimate after the frame that was just flown.
pub fn estimate(pilot: &Pilot) -> Option<Record> {
    estimate_to_log(pilot).map(|estimate| Record::Estimate(Box::new(estimate)))
}

/// The flight computer's estimate in the frame just flown, and the truth.
pub fn estimate_and_truth(flight: &Sortie) -> Vec<Record> {
    let estimate = estimate(flight.pilot()).filter(|_| !flight.computer_is_dead());
    estimate.into_iter().chain([Record::TruthSample(Box::new(truth(flight)))]).collect()
}

fn truth(flight: &Sortie) -> TruthSample {
    let world = flight.world();
    let commanded = flight.computer().commands();
    TruthSample {
        time_s: world.time_s(),
        state: world.state().to_log(),
        height_m: world.height_m(),
        thrust_n: world.thrust_n(),
        mass_kg: world.mass().mass_kg,
        wind_m_s: world.wind_m_s().to_log(),
        gimbal_commanded_rad: commanded.gimbal_rad.to_vec(),
        gimbal_actual_rad: world.gimbal_rad().to_vec(),
        fins_commanded_rad: commanded.fins_rad.to_vec(),
        fins_actual_rad: world.fins_rad().to_vec(),
        parachute_open_share: world.parachute_open_share(),
        in_contact: world.touchdown().is_some(),
        nees_of_motion: flight.nees_of_motion(),
        booster_thrust_n: world.booster_attached().then(|| world.booster_thrust_n()),
    }
}

/// The header for a flight of a campaign. It has no date: its log begins at the epoch, so that the
/// same flight always gives the same log.
pub fn campaign_header(recipe: &Recipe, number: u64) -> LogHeader {
    header("onboard-sim campaign", recipe, number, 0)
}

/// The dispersions of a log: from the text of its scenario, or else the built-in set that its run
/// facts name.
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
pub fn frame_and_phase(flight: &Sortie, last: &mut LastFrame, phase: Phase) -> Vec<Record> {
    let mut records: Vec<Record> = last.take().map(Record::ComputerFrame).into_iter().collect();
    records.extend(estimate_and_truth(flight));
    let now = flight.computer().mode().phase;
    if now != phase {
        records.push(message_event(&CrewMessage::PhaseChanged { from: phase, to: now }));
    }
    records
}

/// A message of the vehicle.
pub fn text_event(severity: Severity, words: &str) -> Record {
    let level = match severity {
        Severity::Info | Severity::Notice => EventLevel::Info,
        Severity::Warning => EventLevel::Warning,
        Severity::Error => EventLevel::Error,
        Severity::Critical => EventLevel::Fatal,
    };
    Record::Event(Event { level, name: "vehicle".to_owned(), message: words.to_owned() })
}

/// A message of the computer.
pub fn message_event(message: &CrewMessage) -> Record {
    match message {
        CrewMessage::Text { severity, text } => text_event(*severity, text),
        CrewMessage::PhaseChanged { from, to } => {
            text_event(Severity::Info, &format!("phase {} to {}", from.name(), to.name()))
        }
    }
}

/// The verdict on a finished flight; `None` if the vehicle did not reach the ground.
pub fn verdict(flight: &Sortie) -> Option<v1::LandingVerdict> {
    let outcome = flight.outcome();
    let touchdown = outcome.touchdown.as_ref()?;
    let one = |name: &str, value, maximum, passed| v1::LimitResult {
        name: name.to_owned(),
        value,
        minimum: 0.0,
        maximum,
        unit: String::new(),
        passed,
    };
    let mut borne = Vec::new();
    if let Some(Strain { stroke_used, strength_used, .. }) = outcome.rest.and_then(|rest| rest.strain) {
        borne.push(one("stroke used", stroke_used, 1.0, stroke_used < 1.0));
        borne.push(one("leg load", strength_used, 1.0, strength_used <= 1.0));
    }
    if let Some(failure) = outcome.failure.filter(|failure| !failure.is_of_a_limit()) {
        borne.push(one(failure.name(), 1.0, 0.0, false));
    }
    let Landing { stands, upright, envelope, table_2 } = outcome.landing;
    let aborted = flight.mode().interlocks.abort_latched;
    Some(v1::LandingVerdict {
        time_s: touchdown.time_s,
        table_2: limits_to_log(&by_table_2(touchdown)),
        ending: Some(outcome.ending(aborted).to_string()),
        landing: v1::Landing { stands, upright, envelope, table_2 },
        envelope: limits_to_log(&by_envelope(&flight.mission().leg_limits, touchdown)),
        borne,
    })
}

/// Each limit with its result, as records; unlimited quantities have none.
pub fn limits_to_log(verdict: &LandingVerdict) -> Vec<v1::LimitResult> {
    let limits = verdict.results.iter().filter(|result| !result.highest.is_infinite());
    let limits = limits.map(|result| v1::LimitResult {
        name: result.name.to_owned(),
        value: result.value,
        minimum: result.lowest,
        maximum: result.highest,
        unit: result.unit.to_owned(),
        passed: result.passed,
    });
    limits.collect()
}
