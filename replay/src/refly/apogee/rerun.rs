//! A recorded flight about to be flown again, by what its log says of how it was flown.

use campaign::baseline::Baseline;
use campaign::dispersion::Dispersion;
use campaign::draw::draw;
use campaign::fault::{Breakage, FaultError, Injector, TimedFault};
use campaign::fly::Flight;
use flight::mission::Mission;
use onboard_sim::from_apogee;
use world::sensors::FRAME_S;

use crate::controller::LoggedPilot;
use crate::log::Recording;
use crate::refly::ReflyError;
use crate::settings::Schedule;

/// A flight on its way, with what still breaks and changes in it.
#[derive(Debug, Clone)]
pub(super) struct Rerun {
    pub(super) flight: Flight,
    injector: Injector,
    pub(super) schedule: Option<Schedule<Mission>>,
    /// The frames in which the crew aborted.
    aborts: Vec<u64>,
}

/// What a flight was drawn from, and the flight at apogee.
pub(super) struct Recipe {
    pub(super) dispersion: Dispersion,
    pub(super) number: u64,
    pub(super) rerun: Rerun,
}

impl Recipe {
    /// The recipe of a recorded flight.
    ///
    /// # Errors
    /// The log does not say all of it, or this build does not know it.
    pub(super) fn of(recording: &Recording) -> Result<Self, ReflyError> {
        let (pilot_start, frames) = recording.recorded_frames()?;
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
        let dispersion = from_apogee::dispersion_of(run, recording.head.scenario_toml.as_deref())
            .map_err(|error| lacking(error.to_string()))?;
        let unknown = || lacking("it was flown by a controller that this build does not know".to_owned());
        let controller = from_apogee::controller_of(run).ok_or_else(unknown)?;
        let faults = run.get("faults").map_or("", String::as_str).split_whitespace();
        let faults: Vec<TimedFault> = faults
            .map(str::parse)
            .collect::<Result<_, _>>()
            .map_err(|error: FaultError| lacking(error.to_string()))?;
        let mission = LoggedPilot::schedule(recording.profile_toml()?, pilot_start, &[])?.base().clone();
        let drawn = draw(&mission, &dispersion, seed, number);
        let flight =
            Flight::new(&mission, &dispersion, &drawn)?.with_baseline(Baseline::new(controller, &mission)?);
        // An abort that no fault asked for was the crew's.
        let by_fault = faults.iter().any(|fault| matches!(fault.breakage, Breakage::Abort));
        let crews = frames.iter().filter(|tick| tick.input.abort && !by_fault);
        let aborts = crews.map(|tick| tick.input.frame).collect();
        let rerun = Rerun { flight, injector: Injector::new(&faults, seed, number), schedule: None, aborts };
        Ok(Self { dispersion, number, rerun })
    }
}

impl Rerun {
    /// `false` when there is no more to fly.
    pub(super) fn step(&mut self) -> Result<bool, ReflyError> {
        let time_s = (self.flight.frame() + 1) as f64 * FRAME_S;
        // As the flight computer of a log is changed: before the frame in whose time the change falls.
        if let Some(mission) = self.schedule.as_mut().and_then(|schedule| schedule.due(time_s)) {
            self.flight.reconfigure(mission)?;
        }
        self.injector.step(&mut self.flight);
        if self.aborts.binary_search(&(self.flight.frame() + 1)).is_ok() {
            self.flight.abort();
        }
        Ok(self.flight.step())
    }
}
