//! The changes that a test requests.

use replay::refly::ReflyOptions;
use replay::settings::Setting;

pub(crate) fn settings(given: &[&str]) -> Vec<Setting> {
    given.iter().map(|text| text.parse().unwrap()).collect()
}

/// The settings changed for the controller and the plant alike.
pub(crate) fn with(given: &[&str]) -> ReflyOptions {
    ReflyOptions { settings: settings(given), ..ReflyOptions::default() }
}

/// The settings of the plant only.
pub(crate) fn with_plant(given: &[&str]) -> ReflyOptions {
    ReflyOptions { plant_settings: settings(given), ..ReflyOptions::default() }
}
