//! The settings file: one TOML, every key documented by [`EXAMPLE`], each overridden by its flag.

use std::path::{Path, PathBuf};

use clap::ValueEnum;
use protocol::transport::Endpoint;
use serde::Deserialize;

use crate::cli::{Cli, Command, LogChoice};

/// A file with every key, its meaning and its default; `ground config example` prints it.
pub const EXAMPLE: &str = r#"# Settings of `ground`. A flag of the same name overrides each of them.
# Looked for in $XDG_CONFIG_HOME/touchdown/ground.toml, else ~/.config/touchdown/ground.toml.

# Links to the vehicle, as for --connect, for `ground daemon`. A bare `ground` flies its demonstration.
#connect = ["udpin:0.0.0.0:14550"]

# MAVLink system ids of this station and of its vehicle, as for --sysid and --vehicle-sysid.
#sysid = 255
#vehicle_sysid = 1

# Signing key, as for --key. Default: nothing is signed.
#key = "touchdown.key"

# Log (MCAP), or "none". Default: touchdown-YYYYMMDD-HHMMSS.mcap in the current directory.
#log = "flight.mcap"

# Telemetry log (.tlog), or "none". Default with a link: the log's name with this ending.
#tlog = "flight.tlog"

# Socket between a station and its screens. Default: one of its own for each station.
#socket = "/run/user/1000/touchdown/field.sock"

# Ring the terminal's bell on an alarm.
#bell = true

# Run by `sh -c` when an alarm is raised, with its words in $TOUCHDOWN_ALARM; or "none", the default.
#alarm_command = "notify-send \"$TOUCHDOWN_ALARM\""

# Draw with "unicode", "ascii", or "auto": by LC_ALL, LC_CTYPE, LANG and TERM.
#characters = "auto"

# Use colours: "always", "never", or "auto": by NO_COLOR and TERM.
#colour = "auto"
"#;

/// What a settings file may say. A key that is absent leaves the default.
#[derive(Debug, Clone, Default, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// As `--connect`, each.
    #[serde(default)]
    pub connect: Vec<String>,
    /// As `--sysid`.
    pub sysid: Option<u8>,
    /// As `--vehicle-sysid`.
    pub vehicle_sysid: Option<u8>,
    /// As `--key`.
    pub key: Option<PathBuf>,
    /// As `--log`.
    pub log: Option<String>,
    /// As `--tlog`.
    pub tlog: Option<String>,
    /// As `--socket`.
    pub socket: Option<PathBuf>,
    /// As `--bell`.
    pub bell: Option<bool>,
    /// As `--alarm-command`.
    pub alarm_command: Option<String>,
    /// As `--characters`.
    #[serde(default)]
    pub characters: Characters,
    /// As `--colour`.
    #[serde(default)]
    pub colour: Colour,
}

/// What the terminal can show.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Characters {
    /// By the environment.
    #[default]
    Auto,
    /// Everything.
    Unicode,
    /// ASCII only.
    Ascii,
}

/// Whether colours may be used.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Colour {
    /// By the environment.
    #[default]
    Auto,
    /// Yes.
    Always,
    /// No.
    Never,
}

/// Why a settings file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// It cannot be read.
    #[error("cannot read the settings {}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// It is not understood; the reason names line and key.
    #[error("{}: {reason}", path.display())]
    Wrong {
        /// The file.
        path: PathBuf,
        /// Where, and what would be accepted.
        reason: String,
    },
}

impl Config {
    /// The file that was named; else the usual one, if there is one.
    ///
    /// # Errors
    /// The file cannot be read, or is wrong; or it was named and is missing.
    pub fn load(named: Option<&Path>) -> Result<Self, ConfigError> {
        let path = match (named, usual_path()) {
            (Some(path), _) => path.to_owned(),
            (None, Some(path)) if path.exists() => path,
            (None, _) => return Ok(Self::default()),
        };
        let text = std::fs::read_to_string(&path)
            .map_err(|source| ConfigError::Read { path: path.clone(), source })?;
        Self::parse(&text).map_err(|reason| ConfigError::Wrong { path, reason })
    }

    /// Understands a file's text, and every value in it.
    ///
    /// # Errors
    /// Where it is wrong, in words.
    pub fn parse(text: &str) -> Result<Self, String> {
        let config: Self = toml::from_str(text).map_err(|error| error.to_string())?;
        for link in &config.connect {
            link.parse::<Endpoint>().map_err(|error| format!("connect: {error}"))?;
        }
        for (key, value) in [("sysid", config.sysid), ("vehicle_sysid", config.vehicle_sysid)] {
            if value == Some(0) {
                return Err(format!("{key}: 0 addresses every system; give one from 1 to 255"));
            }
        }
        for (key, value) in [("log", &config.log), ("tlog", &config.tlog)] {
            if let Some(file) = value {
                file.parse::<LogChoice>().map_err(|error| format!("{key}: {error}"))?;
            }
        }
        if config.alarm_command.as_ref().is_some_and(|command| command.trim().is_empty()) {
            return Err("alarm_command: is empty; give a command or \"none\"".to_owned());
        }
        Ok(config)
    }

    /// Fills what the command line leaves open.
    pub fn fill(&self, cli: &mut Cli) {
        fn parsed<T: std::str::FromStr>(value: Option<&String>) -> Option<T> {
            value.and_then(|value| value.parse().ok())
        }
        // Without a command it is the link on the command line or the demonstration, whatever was written long ago.
        let is_daemon = matches!(cli.command, Some(Command::Daemon));
        if cli.connect.is_empty() && is_daemon && !cli.describes_demonstration() {
            cli.connect = self.connect.iter().filter_map(|link| link.parse().ok()).collect();
        }
        // A replay shows the vehicle that was heard, whatever is on the air now.
        if cli.replay.is_none() {
            cli.sysid = cli.sysid.or(self.sysid);
            cli.vehicle_sysid = cli.vehicle_sysid.or(self.vehicle_sysid);
        }
        if cli.key.is_none() && !cli.connect.is_empty() {
            cli.key.clone_from(&self.key);
        }
        if cli.log.is_none() {
            cli.log = parsed(self.log.as_ref());
        }
        if cli.tlog.is_none() {
            cli.tlog = parsed(self.tlog.as_ref());
        }
        if cli.socket.is_none() {
            cli.socket.clone_from(&self.socket);
        }
    }

    /// What the command line says about the screen and its alarms stands above the file.
    #[must_use]
    pub fn overridden_by(self, cli: &Cli) -> Self {
        let alarm_command = cli.alarm_command.clone().or(self.alarm_command);
        Self {
            bell: cli.bell.or(self.bell),
            alarm_command: alarm_command.filter(|command| command != "none"),
            characters: cli.characters.unwrap_or(self.characters),
            colour: cli.colour.unwrap_or(self.colour),
            ..self
        }
    }
}

/// Where settings usually are.
pub fn usual_path() -> Option<PathBuf> {
    let set = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty());
    let directory = match (set("XDG_CONFIG_HOME"), set("HOME")) {
        (Some(directory), _) => PathBuf::from(directory),
        (None, Some(home)) => PathBuf::from(home).join(".config"),
        (None, None) => return None,
    };
    Some(directory.join("touchdown").join("ground.toml"))
}

#[cfg(test)]
mod tests;
