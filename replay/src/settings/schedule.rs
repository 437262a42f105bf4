//! The settings over the time of a flight.

use super::{Setting, SettingError};

/// A controller's settings over a flight: those of the beginning, and changes at given times.
#[derive(Debug, Clone)]
pub struct Schedule<T> {
    base: T,
    /// By time; each stage includes all earlier changes.
    changes: Vec<(f64, T)>,
    next: usize,
}

impl<T> Schedule<T> {
    /// Calls `build` for the settings from the beginning, then again with each timed one from its time.
    ///
    /// # Errors
    /// Those of `build`.
    pub fn of(
        settings: &[Setting],
        build: impl Fn(&[Setting]) -> Result<T, SettingError>,
    ) -> Result<Self, SettingError> {
        let mut timed: Vec<&Setting> = settings.iter().filter(|setting| setting.at_s.is_some()).collect();
        timed.sort_by(|a, b| a.at_s.unwrap_or(0.0).total_cmp(&b.at_s.unwrap_or(0.0)));
        let mut so_far: Vec<Setting> =
            settings.iter().filter(|setting| setting.at_s.is_none()).cloned().collect();
        let base = build(&so_far)?;
        let mut changes: Vec<(f64, T)> = Vec::new();
        for setting in timed {
            so_far.push(setting.clone());
            let at_s = setting.at_s.unwrap_or(0.0);
            let stage = build(&so_far)?;
            match changes.last_mut() {
                // Changes at the same moment are one change.
                Some((before_s, before)) if before_s.to_bits() == at_s.to_bits() => *before = stage,
                _ => changes.push((at_s, stage)),
            }
        }
        Ok(Self { base, changes, next: 0 })
    }

    /// The settings of the beginning.
    pub fn base(&self) -> &T {
        &self.base
    }

    /// The settings that take effect at this vehicle time, s, if any; times must not decrease.
    pub fn due(&mut self, time_s: f64) -> Option<&T> {
        let due = self.changes.iter().skip(self.next).take_while(|(at_s, _)| *at_s <= time_s).count();
        self.next += due;
        if due == 0 { None } else { self.changes.get(self.next - 1).map(|(_, stage)| stage) }
    }
}
