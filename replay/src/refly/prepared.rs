//! Prepares a recorded flight to be flown again many times from the same moment.

use super::{From, ReflownFlight, ReflyError, ReflyOptions, ReflyReport, apogee, planar};
use crate::log::{FlightKind, Recording};
use crate::settings::{is_whole, is_whole_in_mission, mission_value_of, value_of};

/// A recorded flight at the moment it is flown again from.
#[derive(Debug)]
pub struct Prepared<'a> {
    recording: &'a Recording,
    /// For a flight from apogee: already flown to the start.
    at_start: Option<Box<apogee::AtStart<'a>>>,
}

impl<'a> Prepared<'a> {
    /// Prepares a flight; only the start is taken from the options.
    ///
    /// # Errors
    /// See [`ReflyError`].
    pub fn new(recording: &'a Recording, options: &ReflyOptions) -> Result<Self, ReflyError> {
        let at_start = match recording.kind() {
            FlightKind::InSpace => Some(Box::new(apogee::AtStart::new(recording, options)?)),
            FlightKind::Planar => {
                recording.replayable_ticks()?;
                None
            }
        };
        Ok(Self { recording, at_start })
    }

    /// The flight.
    pub fn recording(&self) -> &'a Recording {
        self.recording
    }

    /// Flies the flight again from the start it was prepared for; `options` must have the same start.
    ///
    /// # Errors
    /// See [`ReflyError`].
    pub fn fly(&self, options: &ReflyOptions) -> Result<ReflyReport, ReflyError> {
        match &self.at_start {
            Some(at_start) => Ok(at_start.fly(options, None)?.0),
            None => Ok(planar::fly(self.recording, options)?.0),
        }
    }

    /// Flies it again and keeps the flight itself.
    ///
    /// # Errors
    /// See [`ReflyError`].
    pub fn fly_kept(&self, options: &ReflyOptions) -> Result<(ReflyReport, ReflownFlight), ReflyError> {
        match &self.at_start {
            Some(at_start) => at_start.fly_kept(options),
            None => planar::fly(self.recording, options),
        }
    }

    /// Whether this build, with nothing changed, flies it as recorded: up to the start, and also after it if the start
    /// is the true state. This takes the time of one flight. The start must be the one the flight was prepared for.
    ///
    /// # Errors
    /// See [`ReflyError`].
    pub fn is_reproduced(&self, options: &ReflyOptions) -> Result<bool, ReflyError> {
        if self.at_start.as_ref().is_some_and(|at_start| at_start.reached().first_different.is_some()) {
            return Ok(false);
        }
        if options.from == From::Estimate {
            return Ok(true);
        }
        let unchanged = ReflyOptions { start: options.start.clone(), ..ReflyOptions::default() };
        let report = self.fly(&unchanged)?;
        Ok(report.commands_identical == report.commands_recorded)
    }

    /// Whether a setting takes whole numbers only.
    ///
    /// # Errors
    /// The flight has no setting of this name.
    pub fn is_whole(&self, path: &str) -> Result<bool, ReflyError> {
        let toml = self.recording.profile_toml()?;
        Ok(if self.at_start.is_some() { is_whole_in_mission(toml, path)? } else { is_whole(toml, path)? })
    }

    /// The number that a setting has in the recorded flight.
    pub fn number_of(&self, path: &str) -> Option<f64> {
        let toml = self.recording.profile_toml().ok()?;
        let value = match &self.at_start {
            Some(at_start) => mission_value_of(toml, at_start.truth(), path)?,
            None => value_of(toml, path)?,
        };
        value.as_float().or_else(|| value.as_integer().map(|number| number as f64))
    }
}
