//! Compares missions: every setting that only one of two has, or that has another value, with the
//! airframe's.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use anyhow::{Result, ensure};
use flight::vehicles::mission::BUILTIN;
use protocol::program::Exit;
use serde::Serialize;

use crate::cli::{Answer, text_of};
use crate::print::{columns, counted};
use crate::settings::{SettingError, settings_of_mission};

/// A setting in which two missions differ; `None`: it is not in that text, and has its default or
/// means nothing there.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SettingDifference {
    pub setting: String,
    pub baseline: Option<String>,
    pub other: Option<String>,
}

/// One mission against another.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MissionComparison {
    pub baseline: String,
    pub other: String,
    /// Settings with the same value in both.
    pub same: usize,
    pub differences: Vec<SettingDifference>,
}

/// Whether an argument names a mission and no log: a built-in one, or a TOML file.
pub(super) fn is_mission(path: &Path) -> bool {
    let is_builtin = BUILTIN.iter().any(|(name, _)| path == Path::new(name));
    is_builtin || path.extension().is_some_and(|end| end == "toml")
}

/// Compares missions, each a built-in one or a file, with the first.
///
/// # Errors
/// One cannot be read, or is no TOML.
pub(super) fn compare_missions(baseline: &Path, others: &[&Path]) -> Result<Vec<MissionComparison>> {
    let read = |path: &Path| -> Result<(String, String)> {
        ensure!(is_mission(path), "{}: is no mission, and the other one is", path.display());
        let name = path.display().to_string();
        let text = text_of(&name, BUILTIN, "mission")?;
        Ok((name, text))
    };
    let baseline = read(baseline)?;
    others.iter().map(|other| Ok(compared(baseline.clone(), read(other)?)?)).collect()
}

/// Compares two missions, each a name and its text.
///
/// # Errors
/// A text is no TOML.
pub(crate) fn compared(
    (baseline, wanted): (String, String),
    (other, found): (String, String),
) -> Result<MissionComparison, SettingError> {
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
    let differences: Vec<SettingDifference> = keys
        .iter()
        .map(|setting| of(setting))
        .filter(|difference| difference.baseline != difference.other)
        .collect();
    Ok(MissionComparison { same: keys.len() - differences.len(), baseline, other, differences })
}

impl Answer for MissionComparison {
    fn sentences(&self) -> Vec<String> {
        let Self { baseline, other, same, differences } = self;
        if differences.is_empty() {
            return vec![format!("{other} is the same mission as {baseline}: {same} settings")];
        }
        let count = counted(differences.len() as u64, "setting");
        let mut lines = vec![format!("{other} differs from {baseline} in {count}; {same} are the same")];
        let value = |value: &Option<String>| value.clone().unwrap_or_else(|| "-".to_owned());
        lines.extend(columns(
            ['<', '<'],
            differences.iter().map(|SettingDifference { setting, baseline, other }| {
                [format!("  {setting}"), format!("{} -> {}", value(baseline), value(other))]
            }),
        ));
        lines
    }

    fn outcome(&self) -> Exit {
        Exit::of(self.differences.is_empty())
    }
}
