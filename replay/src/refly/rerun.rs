//! A recorded flight, flown again frame by frame from the facts in its log.

use avionics::log::frame::accepts_abort;
use avionics::log::logged::{calibration_from_log, state_from_log};
use flight::computer::FRAME_S;
use protocol::log::computer_v1::{ComputerFrame, ComputerStart};
use protocol::log::record::Record;
use sim::fault::{Breakage, FaultError, TimedFault};
use sim::outside::Outside;
use sim::recipe::Recipe;
use sim::sortie::Sortie;
use sim::wire::record::{self as sortie_log, LastFrame};

use super::FaultChanges;
use crate::controller::AgainError;
use crate::log::{Head, Recording};
use crate::settings::Schedule;

/// Stands for every recorded fault.
const EVERY_FAULT: &str = "all";

/// A flight in progress, with all its records so far.
pub(super) struct Rerun {
    pub(super) recipe: Recipe,
    pub(super) number: u64,
    pub(super) flight: Sortie,
    /// Changes of the mission that are still to come.
    pub(super) schedule: Option<Schedule>,
    /// The frames in which the crew aborted.
    aborts: Vec<u64>,
    last: LastFrame,
    /// With vehicle times, s.
    pub(super) records: Vec<(f64, Record)>,
}

impl Rerun {
    /// A recorded flight at its start, with other faults.
    ///
    /// # Errors
    /// The log lacks a part of its recipe, or this build does not know it; a fault to leave out is
    /// not there, or a fault to add is unknown.
    pub(super) fn of(recording: &Recording, changes: &FaultChanges) -> Result<Self, AgainError> {
        let (start, frames) = recording.recorded_frames()?;
        let (mut recipe, number) =
            drawn_from(&recording.name, &recording.head, recording.profile_toml()?, start)?;
        let recorded = std::mem::take(&mut recipe.faults);
        recipe.faults = changed(recording, &recorded, changes)?;
        let flight = begun(&recipe, number, start)?;
        // An abort that no fault caused came from the crew.
        let by_fault = recorded.iter().any(|fault| matches!(fault.breakage, Breakage::Abort));
        let crews = frames.iter().filter(|frame| accepts_abort(frame) && !by_fault);
        let aborts = crews.map(|frame| frame.input.frame).collect();
        let ComputerStart { believed, calibration, .. } = sortie_log::start(flight.computer());
        let start = ComputerStart { believed, calibration, ..*start };
        let records = vec![(0.0, Record::ComputerStart(Box::new(start)))];
        Ok(Self { recipe, number, flight, schedule: None, aborts, last: LastFrame::default(), records })
    }

    /// Flies up to a frame, or to the end.
    pub(super) fn fly_before(mut self, frame: u64) -> Self {
        while self.flight.frame() + 1 < frame && self.step() {}
        self
    }

    /// Flies one frame and keeps it; `false` when the flight is over.
    fn step(&mut self) -> bool {
        let number = self.flight.frame() + 1;
        let (time_s, phase) = (number as f64 * FRAME_S, self.flight.computer().mode().phase);
        // The change is made before the frame in whose time it falls, as in a recorded flight.
        if let Some(mission) = self.schedule.as_mut().and_then(|schedule| schedule.due(time_s)) {
            self.flight.reconfigure(&mission);
        }
        if self.aborts.binary_search(&number).is_ok() {
            self.flight.abort();
        }
        self.flight.step_with(&Outside::NOBODY, &mut self.last);
        let records = sortie_log::frame_and_phase(&self.flight, &mut self.last, phase);
        self.records.extend(records.into_iter().map(|record| (time_s, record)));
        self.flight.goes_on()
    }

    /// Its frames beside the recorded ones of the same numbers; a log may have lost some.
    pub(super) fn beside<'a>(
        &'a self,
        recorded: &'a [ComputerFrame],
    ) -> impl Iterator<Item = (&'a ComputerFrame, &'a ComputerFrame)> {
        self.frames().filter_map(|now| {
            let place = recorded.binary_search_by_key(&now.input.frame, |then| then.input.frame).ok()?;
            Some((now, &recorded[place]))
        })
    }

    pub(super) fn frames(&self) -> impl Iterator<Item = &ComputerFrame> {
        self.records.iter().filter_map(|(_, record)| match record {
            Record::ComputerFrame(frame) => Some(frame.as_ref()),
            _ => None,
        })
    }
}

/// What a log says that its flight was drawn from, and the flight's number in it.
///
/// # Errors
/// The log lacks a part of its recipe, or this build does not know it.
pub(crate) fn drawn_from(
    name: &str,
    head: &Head,
    toml: &str,
    start: &ComputerStart,
) -> Result<(Recipe, u64), AgainError> {
    let lacking = |reason: String| AgainError::Refused {
        of: name.to_owned(),
        reason: format!("cannot be flown again from its start: {reason}"),
    };
    let run = &head.run;
    if let Some(original) = run.get("reflown_from") {
        return Err(lacking(format!("it was flown again from {original}; fly that one again")));
    }
    let number_of = |fact: &str| {
        let number = run.get(fact).and_then(|text| text.parse::<u64>().ok());
        number.ok_or_else(|| lacking(format!("its run facts have no number `{fact}`")))
    };
    let (seed, number) = (number_of("seed")?, number_of("flight")?);
    let dispersion = sortie_log::dispersion_of(run, head.scenario_toml.as_deref())
        .map_err(|error| lacking(error.to_string()))?;
    let faults = run.get("faults").map_or("", String::as_str).split_whitespace();
    let faults: Result<Vec<TimedFault>, FaultError> = faults.map(str::parse).collect();
    let recipe = Recipe {
        field: run.get(sim::wire::field::RUN_FACT).cloned(),
        mission: Schedule::of(toml, start, &[])?.base,
        mission_toml: toml.to_owned(),
        dispersion,
        dispersion_name: run.get("dispersion").cloned().unwrap_or_default(),
        dispersion_toml: head.scenario_toml.clone().unwrap_or_default(),
        seed,
        faults: faults.map_err(|error| lacking(error.to_string()))?,
    };
    Ok((recipe, number))
}

/// A flight at its release, with the recorded estimate.
///
/// # Errors
/// It cannot be set up.
pub(crate) fn begun(recipe: &Recipe, number: u64, start: &ComputerStart) -> Result<Sortie, AgainError> {
    let flight = Sortie::new(recipe, number)?;
    Ok(match &start.calibration {
        Some(calibration) => {
            flight.standing(&state_from_log(&start.believed), &calibration_from_log(calibration))
        }
        None => flight,
    })
}

/// The recorded faults with the changes.
fn changed(
    recording: &Recording,
    recorded: &[TimedFault],
    changes: &FaultChanges,
) -> Result<Vec<TimedFault>, AgainError> {
    let refused = |reason| AgainError::Refused { of: recording.name.clone(), reason };
    let mut faults = recorded.to_vec();
    for without in &changes.without {
        // `gnss-out` means every one of that name, `gnss-out@5` just that one.
        let is_named = |fault: &TimedFault| {
            let given = fault.to_string();
            let name = given.split([':', '@']).next().unwrap_or_default();
            without == EVERY_FAULT || *without == given || without == name
        };
        let before = faults.len();
        faults.retain(|fault| !is_named(fault));
        if faults.len() == before {
            let listed: Vec<String> = recorded.iter().map(ToString::to_string).collect();
            let listed = if listed.is_empty() { "no faults".to_owned() } else { listed.join(" ") };
            return Err(refused(format!("no fault `{without}` to leave out; it was flown with {listed}")));
        }
    }
    for with in &changes.with {
        faults.push(with.parse().map_err(|error: FaultError| refused(error.to_string()))?);
    }
    Ok(faults)
}
