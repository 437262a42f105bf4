//! Compares the texts of two missions: every setting that only one has, or that has another value.

use std::collections::{BTreeMap, BTreeSet};

use crate::settings::{SettingError, settings_of_mission};

/// A setting in which two missions differ; `None`: it is not in that text, and has its default or
/// has no meaning there.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SettingDifference {
    pub(crate) setting: String,
    pub(crate) baseline: Option<String>,
    pub(crate) other: Option<String>,
}

/// Compares two missions, each a name and its text.
///
/// # Errors
/// A text is no TOML.
pub(crate) fn compared(
    (baseline, wanted): (String, String),
    (other, found): (String, String),
) -> Result<Vec<SettingDifference>, SettingError> {
    let values = |text: &str, origin: &str| -> Result<BTreeMap<String, String>, SettingError> {
        let settings = settings_of_mission(text, origin)?;
        Ok(settings.into_iter().map(|setting| (setting.path, setting.value.to_string())).collect())
    };
    let (wanted, found) = (values(&wanted, &baseline)?, values(&found, &other)?);
    let keys: BTreeSet<&String> = wanted.keys().chain(found.keys()).collect();
    let of = |setting: &String| SettingDifference {
        setting: setting.clone(),
        baseline: wanted.get(setting).cloned(),
        other: found.get(setting).cloned(),
    };
    let differences = keys.iter().map(|setting| of(setting));
    Ok(differences.filter(|difference| difference.baseline != difference.other).collect())
}
