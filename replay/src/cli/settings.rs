//! Settings on a command line: one by one, and whole files.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result};
use clap::Args;
use replay::settings::{Setting, settings_of_file};

/// Other settings than the recorded ones.
#[derive(Debug, Args)]
pub(super) struct SettingArguments {
    /// Another setting, named as in the mission; with @SECONDS it applies from that vehicle time on. May be given more
    /// than once.
    #[arg(long = "set", value_name = "PATH=VALUE[@SECONDS]")]
    pub(super) set: Vec<Setting>,
    /// File of settings: a TOML file with the structure of the mission and the keys to change. --set overrides it.
    #[arg(long, value_name = "FILE")]
    pub(super) settings: Vec<PathBuf>,
}

impl SettingArguments {
    /// All settings, those from files first.
    pub(super) fn all(&self) -> Result<Vec<Setting>> {
        let mut all = Vec::new();
        for path in &self.settings {
            all.extend(read(path)?);
        }
        all.extend(self.set.iter().cloned());
        Ok(all)
    }
}

fn read(path: &Path) -> Result<Vec<Setting>> {
    let name = path.display().to_string();
    let text = std::fs::read_to_string(path).with_context(|| format!("{name}: cannot be read"))?;
    Ok(settings_of_file(&text, &name)?)
}
