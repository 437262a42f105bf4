//! The settings file (TOML). [`EXAMPLE`] documents every key; the flag of the same name overrides it.

mod table;

use std::path::{Path, PathBuf};

use protocol::transport::LinkAddress;
use serde::Deserialize;

use crate::cli::{Characters, Cli, Command, LogChoice, Seconds, TalkAmount, ThemeChoice};
use crate::model::bindings::Bindings;
use crate::model::callouts::{Amount, Talk};

/// A file with every key, its meaning and its default; `ground config example` prints it.
pub const EXAMPLE: &str = r#"# Settings of `ground`. A flag of the same name overrides each of them.
# Its path is $XDG_CONFIG_HOME/touchdown/ground.toml, or ~/.config/touchdown/ground.toml.

# Links to the vehicle, as for --connect, for `ground daemon`. A bare `ground` flies its demonstration.
#connect = ["udpin:0.0.0.0:14550"]

# MAVLink system ids of this station and of its vehicle, as for --sysid and --vehicle-sysid.
#sysid = 255
#vehicle_sysid = 1

# Signing key, as for --key. Default: nothing is signed.
#key = "touchdown.key"

# Who may command, and who sits here, as for --crew and --operator. Default: nobody is named.
#crew = "crew.toml"
#operator = "Ann"

# The mission that the vehicle should fly, as for --mission. Default: any.
#mission = "mission.toml"

# Checklist, as for --checklist. Default: none.
#checklist = "checklist.toml"

# Log (MCAP), or "none". Default: touchdown-YYYYMMDD-HHMMSS.mcap in the current directory.
#log = "flight.mcap"

# Telemetry log (.tlog), or "none". Default with a link: the log's name with this ending.
#tlog = "flight.tlog"

# Socket between a station and its screens. Default: one socket per station.
#socket = "/run/user/1000/touchdown/field.sock"

# Ring the terminal's bell on an alarm.
#bell = true

# Run by `sh -c` when an alarm is raised, with its words in $TOUCHDOWN_ALARM; or "none", the default.
#alarm_command = "notify-send \"$TOUCHDOWN_ALARM\""

# Draw with "unicode", "ascii", or "auto": by LC_ALL, LC_CTYPE, LANG and TERM.
#characters = "auto"

# Colours: "dark", "light" (black on white, for sunlight), "16" (the terminal's own), "none", "contrast" (high
# contrast), or "auto": by NO_COLOR, TERM, COLORTERM and COLORFGBG. The key c changes them too.
#theme = "auto"

# Calls out the flight: a command that speaks each line of its standard input. Its words are split at spaces, without
# a shell. Linux: "espeak-ng -s 170" (words per minute; -a is the loudness) or "spd-say -e". macOS: "xargs -I{} say {}".
# Or "none", the default: then bells ring, one to three of them.
#voice = "espeak-ng -s 170"

# How much is called out: "nothing", "few", "normal" or "all", and the least time between two heights, s.
#talk = "normal"
#talk_every_s = 1.5

# Other keys for actions; the key : lists every action. The keys of the abort, Enter and Esc cannot be chosen.
# Actions that open a ladder (arm, start, disarm) need a capital letter.
#keys = { theme = "c", path = "p" }
"#;

/// The content of a settings file. A missing key leaves the default. Each field has the meaning of the flag of the
/// same name.
#[derive(Debug, Clone, Default, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    #[serde(default)]
    pub connect: Vec<String>,
    pub sysid: Option<u8>,
    pub vehicle_sysid: Option<u8>,
    pub key: Option<PathBuf>,
    pub crew: Option<PathBuf>,
    pub operator: Option<String>,
    pub mission: Option<String>,
    pub checklist: Option<PathBuf>,
    pub log: Option<String>,
    pub tlog: Option<String>,
    pub socket: Option<PathBuf>,
    pub bell: Option<bool>,
    pub alarm_command: Option<String>,
    #[serde(default)]
    pub characters: Characters,
    #[serde(default)]
    pub theme: ThemeChoice,
    #[serde(default)]
    pub keys: Bindings,
    pub voice: Option<String>,
    #[serde(default)]
    pub talk: TalkAmount,
    pub talk_every_s: Option<Seconds>,
}

/// Why a settings file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    #[error("cannot read the settings {}", path.display())]
    Read { path: PathBuf, source: std::io::Error },
    /// It is not valid; the reason names line and key.
    #[error("{}: {reason}", path.display())]
    Wrong {
        path: PathBuf,
        /// Where it is wrong, and what would be accepted.
        reason: String,
    },
}

impl Config {
    /// Loads the named file, otherwise the usual one if it exists.
    ///
    /// # Errors
    /// The file cannot be read or is invalid, or a named file is missing.
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

    /// Parses the text of a file and checks every value.
    ///
    /// # Errors
    /// The text is invalid; the error says where.
    pub fn parse(text: &str) -> Result<Self, String> {
        let config: Self = toml::from_str(text).map_err(|error| error.to_string())?;
        for link in &config.connect {
            link.parse::<LinkAddress>().map_err(|error| format!("connect: {error}"))?;
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
            return Err("alarm_command is empty; give a command or \"none\"".to_owned());
        }
        if config.voice.as_ref().is_some_and(|command| command.trim().is_empty()) {
            return Err("voice is empty; give a command or \"none\"".to_owned());
        }
        Ok(config)
    }

    /// Fills in the flags that the command line does not give.
    pub fn fill(&self, cli: &mut Cli) {
        fn parsed<T: std::str::FromStr>(value: Option<&String>) -> Option<T> {
            value.and_then(|value| value.parse().ok())
        }
        // Only a daemon takes links from the settings: a bare `ground` must always be the demonstration.
        let is_daemon = matches!(cli.command, Some(Command::Daemon));
        if cli.connect.is_empty() && is_daemon && !cli.describes_demonstration() {
            cli.connect = self.connect.iter().filter_map(|link| link.parse().ok()).collect();
        }
        // A replay shows the vehicle in the log, whatever the settings say.
        if cli.replay.is_none() {
            cli.sysid = cli.sysid.or(self.sysid);
            cli.vehicle_sysid = cli.vehicle_sysid.or(self.vehicle_sysid);
        }
        if cli.key.is_none() && !cli.connect.is_empty() {
            cli.key.clone_from(&self.key);
        }
        if cli.crew.is_none() && !cli.connect.is_empty() {
            cli.crew.clone_from(&self.crew);
        }
        if cli.mission.is_none() && !cli.connect.is_empty() {
            cli.mission.clone_from(&self.mission);
        }
        if cli.checklist.is_none() && !cli.connect.is_empty() {
            cli.checklist.clone_from(&self.checklist);
        }
        if cli.operator.is_none() {
            cli.operator.clone_from(&self.operator);
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

    /// What is called out.
    pub fn talk(&self) -> Talk {
        let amount = match self.talk {
            TalkAmount::Nothing => Amount::Nothing,
            TalkAmount::Few => Amount::Few,
            TalkAmount::Normal => Amount::Normal,
            TalkAmount::All => Amount::All,
        };
        let usual = Talk::default();
        let height_every = self.talk_every_s.map_or(usual.height_every, |Seconds(every)| every);
        Talk { amount, height_every, has_voice: self.voice.is_some() }
    }

    /// The flags about the screen and its alarms override the file.
    #[must_use]
    pub fn overridden_by(self, cli: &Cli) -> Self {
        let alarm_command = cli.alarm_command.clone().or(self.alarm_command);
        Self {
            bell: cli.bell.or(self.bell),
            alarm_command: alarm_command.filter(|command| command != "none"),
            characters: cli.characters.unwrap_or(self.characters),
            theme: cli.theme.unwrap_or(self.theme),
            keys: cli.keys.clone().unwrap_or(self.keys),
            voice: cli.voice.clone().or(self.voice).filter(|command| command != "none"),
            talk: cli.talk.unwrap_or(self.talk),
            talk_every_s: cli.talk_every_s.or(self.talk_every_s),
            ..self
        }
    }
}

/// The usual path of the settings file.
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
