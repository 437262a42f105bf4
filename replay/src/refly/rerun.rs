//! Sets up a recorded flight to be flown again, from the facts in its log.

use flight::computer::{Commands, FRAME_S};
use flight::vehicle::mission::Mission;
use flight_log::frame::accepts_abort;
use flight_log::logged::{state_from_log, vector_from_log};
use flight_log::sortie::{self as sortie_log, LastFrame};
use sim::dispersion::Dispersion;
use sim::fault::{Breakage, FaultError, TimedFault};
use sim::outside::Outside;
use sim::recipe::Recipe;
use sim::sortie::Sortie;

use super::{FaultChanges, ReflyError};
use crate::controller::LoggedComputer;
use crate::log::Recording;
use crate::settings::Schedule;

/// Stands for every recorded fault.
const EVERY_FAULT: &str = "all";

/// A flight in progress, with its faults and timed changes still to come.
#[derive(Debug, Clone)]
pub(super) struct Rerun {
    pub(super) flight: Sortie,
    pub(super) schedule: Option<Schedule<Mission>>,
    /// The frames in which the crew aborted.
    aborts: Vec<u64>,
    /// The flight computer's last frame.
    pub(super) last: LastFrame,
}

/// The recipe of a flight, and the flight at apogee.
pub(super) struct Recorded {
    pub(super) dispersion: Dispersion,
    pub(super) number: u64,
    pub(super) rerun: Rerun,
    /// The faults that it is flown with, as text.
    pub(super) faults: String,
}

impl Recorded {
    /// The recipe of a recorded flight.
    ///
    /// # Errors
    /// The log lacks a part of it, or this build does not know it.
    pub(super) fn of(recording: &Recording) -> Result<Self, ReflyError> {
        Self::with_faults(recording, &FaultChanges::default())
    }

    /// The recipe of a recorded flight, with other faults.
    ///
    /// # Errors
    /// As [`of`](Self::of); or a fault to leave out is not there, or a fault to add is unknown.
    pub(super) fn with_faults(recording: &Recording, changes: &FaultChanges) -> Result<Self, ReflyError> {
        let (start, frames) = recording.recorded_frames()?;
        let lacking = |reason: String| ReflyError::Recipe { name: recording.name.clone(), reason };
        let run = &recording.head.run;
        if let Some(original) = run.get("reflown_from") {
            return Err(lacking(format!("it was flown again from {original}; fly that one again")));
        }
        let number_of = |fact: &str| {
            let number = run.get(fact).and_then(|text| text.parse::<u64>().ok());
            number.ok_or_else(|| lacking(format!("its run facts have no number `{fact}`")))
        };
        let (seed, number) = (number_of("seed")?, number_of("flight")?);
        let dispersion = sortie_log::dispersion_of(run, recording.head.scenario_toml.as_deref())
            .map_err(|error| lacking(error.to_string()))?;
        let unknown = || lacking("it was flown by a controller that this build does not know".to_owned());
        let controller = sortie_log::controller_of(run).ok_or_else(unknown)?;
        let faults = run.get("faults").map_or("", String::as_str).split_whitespace();
        let recorded: Vec<TimedFault> = faults
            .map(str::parse)
            .collect::<Result<_, _>>()
            .map_err(|error: FaultError| lacking(error.to_string()))?;
        let faults = changed(recording, &recorded, changes)?;
        let mission = LoggedComputer::schedule(recording.profile_toml()?, start, &[])?.base().clone();
        let recipe = Recipe {
            mission,
            mission_toml: recording.profile_toml()?.to_owned(),
            dispersion,
            dispersion_name: run.get("dispersion").cloned().unwrap_or_default(),
            dispersion_toml: recording.head.scenario_toml.clone().unwrap_or_default(),
            seed,
            controller,
            faults,
        };
        let flight = Sortie::new(&recipe, number)?;
        let flight = match &start.gyro_bias_rad_s {
            Some(bias) => flight.standing(&state_from_log(&start.believed), vector_from_log(bias)),
            None => flight,
        };
        // An abort that no fault caused came from the crew.
        let by_fault = recorded.iter().any(|fault| matches!(fault.breakage, Breakage::Abort));
        let crews = frames.iter().filter(|frame| accepts_abort(frame) && !by_fault);
        let aborts = crews.map(|frame| frame.input.frame).collect();
        let rerun = Rerun { flight, schedule: None, aborts, last: LastFrame::default() };
        let faults = recipe.faults.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ");
        Ok(Self { dispersion, number, rerun, faults })
    }
}

impl Rerun {
    /// Flies one frame; `false` when the flight is over.
    pub(super) fn step(&mut self) -> bool {
        let time_s = (self.flight.frame() + 1) as f64 * FRAME_S;
        // The change is made before the frame in whose time it falls, as in a recorded flight.
        if let Some(mission) = self.schedule.as_mut().and_then(|schedule| schedule.due(time_s)) {
            self.flight.reconfigure(mission);
        }
        if self.aborts.binary_search(&(self.flight.frame() + 1)).is_ok() {
            self.flight.abort();
        }
        self.flight.step_with(&Outside::NOBODY, &mut self.last);
        self.flight.goes_on()
    }

    /// The commands of the last frame; `None` while the computer is dead.
    pub(super) fn commands(&self) -> Option<&Commands> {
        (!self.flight.computer_is_dead()).then(|| self.flight.computer().commands())
    }
}

/// The recorded faults with the changes.
fn changed(
    recording: &Recording,
    recorded: &[TimedFault],
    changes: &FaultChanges,
) -> Result<Vec<TimedFault>, ReflyError> {
    let refused = |reason: String| ReflyError::Fault { name: recording.name.clone(), reason };
    let mut faults = recorded.to_vec();
    for without in &changes.without {
        // `gnss-out` means every one of that name, `gnss-out@5` just that one.
        let meant = |fault: &TimedFault| {
            let given = fault.to_string();
            let name = given.split([':', '@']).next().unwrap_or_default();
            without == EVERY_FAULT || *without == given || without == name
        };
        let before = faults.len();
        faults.retain(|fault| !meant(fault));
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
