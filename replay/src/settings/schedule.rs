//! Which profile holds when.

use flight::controller::{ControllerConfig, ControllerState};
use flight::profile::Profile;

use super::{Setting, SettingError, profile_with};

/// A controller's settings over a flight: those of the beginning, and changes at given times.
#[derive(Debug, Clone)]
pub struct Schedule {
    base: Profile,
    /// By time, each with everything that came before it.
    changes: Vec<(f64, Profile)>,
    next: usize,
}

impl Schedule {
    /// The settings that hold from the beginning, then each timed one from its time on.
    ///
    /// # Errors
    /// A name is unknown, or some stage is no profile.
    pub fn new(profile_toml: &str, settings: &[Setting]) -> Result<Self, SettingError> {
        let mut timed: Vec<&Setting> = settings.iter().filter(|setting| setting.at_s.is_some()).collect();
        timed.sort_by(|a, b| a.at_s.unwrap_or(0.0).total_cmp(&b.at_s.unwrap_or(0.0)));
        let mut so_far: Vec<Setting> =
            settings.iter().filter(|setting| setting.at_s.is_none()).cloned().collect();
        let base = profile_with(profile_toml, &so_far)?;
        let mut changes = Vec::new();
        for setting in timed {
            so_far.push(setting.clone());
            changes.push((setting.at_s.unwrap_or(0.0), profile_with(profile_toml, &so_far)?));
        }
        Ok(Self { base, changes, next: 0 })
    }

    /// The settings of the beginning.
    pub fn base(&self) -> &Profile {
        &self.base
    }

    /// Whether anything changes in flight.
    pub fn is_timed(&self) -> bool {
        !self.changes.is_empty()
    }

    /// Changes the controller's settings if a change is due at this vehicle time, s; times must not fall.
    pub fn apply(&mut self, controller: &mut ControllerState, time_s: f64) {
        while let Some((at_s, profile)) = self.changes.get(self.next)
            && *at_s <= time_s
        {
            *controller = controller.reconfigured(&ControllerConfig::from_profile(profile));
            self.next += 1;
        }
    }
}
