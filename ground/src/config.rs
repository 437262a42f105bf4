//! The settings file (TOML). [`EXAMPLE`] documents every key. What changes from one start to the
//! next is a flag: its key has the flag's name and values, and the flag overrides it. What a person
//! or a place keeps stands in [`Config`] and has none.

use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::Context as _;
use clap::{ArgAction, ArgMatches, CommandFactory as _, FromArgMatches as _};
use serde::{Deserialize, Deserializer, de};
use strum::VariantArray as _;
use toml::{Table, Value};

use crate::cli::{Characters, Flags, LinkArgs, StationArgs, seconds};
use crate::model::{Amount, Degrees, Talk};
use crate::view::theme::Palette;

/// A file with every key, its meaning and its default; `ground config example` prints it.
pub const EXAMPLE: &str = include_str!("../config-example.toml");

/// The content of a settings file. A missing key leaves the default.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Config {
    /// The keys that are flags, too.
    #[serde(skip)]
    pub flags: Flags,
    #[serde(deserialize_with = "place")]
    pub here: Option<Degrees>,
    pub bell: Option<bool>,
    #[serde(deserialize_with = "command")]
    pub alarm_command: Option<String>,
    pub characters: Characters,
    /// `None` lets the environment decide.
    #[serde(deserialize_with = "palette")]
    pub theme: Option<Palette>,
    #[serde(deserialize_with = "command")]
    pub voice: Option<String>,
    pub talk: Amount,
    #[serde(deserialize_with = "every")]
    pub talk_every_s: Option<Duration>,
}

fn place<'de, D: Deserializer<'de>>(from: D) -> Result<Option<Degrees>, D::Error> {
    String::deserialize(from)?.parse().map(Some).map_err(de::Error::custom)
}

fn every<'de, D: Deserializer<'de>>(from: D) -> Result<Option<Duration>, D::Error> {
    seconds(&f64::deserialize(from)?.to_string()).map(Some).map_err(de::Error::custom)
}

fn palette<'de, D: Deserializer<'de>>(from: D) -> Result<Option<Palette>, D::Error> {
    let name = String::deserialize(from)?;
    let palette = Palette::VARIANTS.iter().find(|palette| format!("{palette:?}").eq_ignore_ascii_case(&name));
    let wrong = || de::Error::custom(format!("`{name}`; give auto, dark, light or none"));
    if name == "auto" { Ok(None) } else { palette.copied().map(Some).ok_or_else(wrong) }
}

fn command<'de, D: Deserializer<'de>>(from: D) -> Result<Option<String>, D::Error> {
    let command = String::deserialize(from)?;
    if command.trim().is_empty() {
        return Err(de::Error::custom("it is empty; give a command or \"none\""));
    }
    Ok(Some(command).filter(|command| command != "none"))
}

/// What clap says of a value, without its advice on command lines.
fn reason(error: &clap::Error) -> String {
    let text = error.to_string();
    let words = text.strip_prefix("error: ").unwrap_or(&text);
    words.split("\n\nFor more information").next().unwrap_or(words).trim().to_owned()
}

impl Config {
    /// Loads the named file, otherwise the usual one if it exists.
    ///
    /// # Errors
    /// The file cannot be read or is invalid, or a named file is missing.
    pub fn load(named: Option<&Path>) -> anyhow::Result<Self> {
        let path = match (named, usual_path()) {
            (Some(path), _) => path.to_owned(),
            (None, Some(path)) if path.exists() => path,
            (None, _) => return Ok(Self::default()),
        };
        let text = std::fs::read_to_string(&path);
        let text = text.with_context(|| format!("cannot read the settings {}", path.display()))?;
        Self::parse(&text).map_err(|reason| anyhow::anyhow!("{}: {reason}", path.display()))
    }

    /// Parses the text of a file and checks every value.
    ///
    /// # Errors
    /// The text is invalid; the error says where.
    pub fn parse(text: &str) -> Result<Self, String> {
        let mut table: Table = toml::from_str(text).map_err(|error| error.to_string())?;
        let mut flags = Flags::default();
        for argument in Flags::command().get_arguments() {
            let (key, flag) = (argument.get_id().as_str(), argument.get_long().unwrap_or_default());
            let values = match table.remove(key) {
                None => continue,
                Some(Value::Array(values)) if matches!(argument.get_action(), ArgAction::Append) => values,
                Some(value) => vec![value],
            };
            let as_flag = |value| match value {
                Value::String(text) => Ok(format!("--{flag}={text}")),
                Value::Integer(number) => Ok(format!("--{flag}={number}")),
                other => Err(format!("{key}: `{other}` is neither a text nor a number")),
            };
            let words = values.into_iter().map(as_flag).collect::<Result<Vec<_>, _>>()?;
            let given = Flags::command().no_binary_name(true).try_get_matches_from(words);
            let filled = given.and_then(|given| flags.update_from_arg_matches(&given));
            filled.map_err(|error| format!("{key}: {}", reason(&error)))?;
        }
        let config = table.try_into().map_err(|error: toml::de::Error| error.to_string())?;
        Ok(Self { flags, ..config })
    }

    /// Puts the file under the flags of a station that the command line gives. A bare `ground`
    /// takes no link from the file: it must always be the demonstration.
    ///
    /// # Errors
    /// The flags are of another command.
    pub fn fill(&self, station: &mut StationArgs, given: &ArgMatches, is_daemon: bool) -> anyhow::Result<()> {
        let flags = self.flags.clone();
        let takes_links = is_daemon && !station.describes_demonstration() && !flags.link.connect.is_empty();
        station.flags = if takes_links || !station.flags.link.connect.is_empty() {
            flags
        } else {
            let link = LinkArgs { connect: Vec::new(), key: None, crew: None, ..flags.link };
            Flags {
                link,
                mission: None,
                checklist: None,
                position: None,
                foxglove: None,
                forward: Vec::new(),
                ..flags
            }
        };
        Ok(station.flags.update_from_arg_matches(given)?)
    }

    /// What is called out.
    pub fn talk(&self) -> Talk {
        let height_every = self.talk_every_s.unwrap_or(Talk::default().height_every);
        Talk { amount: self.talk, height_every, has_voice: self.voice.is_some() }
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
mod tests {
    use super::*;
    use crate::cli::{Cli, Command};

    /// The keys of the example with their values.
    fn example_keys() -> Vec<(&'static str, &'static str)> {
        let lines = EXAMPLE.lines().filter_map(|line| line.strip_prefix('#')?.split_once(" = "));
        lines.filter(|(key, _)| !key.contains(' ')).collect()
    }

    /// Every key of the example is valid without its comment mark, and the example names every key.
    #[test]
    fn the_example_contains_every_key() {
        let keys = example_keys();
        let lines: Vec<String> = keys.iter().map(|(key, value)| format!("{key} = {value}")).collect();
        let uncommented = lines.join("\n");
        let mut config = Config::parse(&uncommented).unwrap();
        assert!(!config.flags.link.connect.is_empty() && config.alarm_command.is_some());
        assert_eq!(Config::parse(EXAMPLE), Ok(Config::default()));
        let known = Config::parse("nothing = 1").unwrap_err();
        let flags = Flags::command();
        let flags = flags.get_arguments().map(|argument| argument.get_id().as_str());
        for key in flags.chain(known.split('`').skip(3).step_by(2)) {
            assert!(keys.iter().any(|(named, _)| *named == key), "{key} is not in the example");
        }
        config.flags = Flags::default();
        assert_ne!(config, Config::default());
    }

    #[test]
    fn an_error_names_the_wrong_key_and_what_would_do() {
        for (text, key, accepted) in [
            ("belll = true", "belll", "bell"),
            ("connect = [\"tcp\"]", "connect", "udpin:ADDRESS:PORT"),
            ("theme = \"blue\"", "theme", "light"),
            ("sysid = 0", "sysid", "from 1 to 255"),
            ("vehicle_sysid = 256", "vehicle_sysid", "from 1 to 255"),
            ("key = []", "key", "a text"),
            ("log = true", "log", "a text"),
            ("connect = [1.5]", "connect", "a text"),
            ("log = \"\"", "log", "give a file or `none`"),
            ("here = \"home\"", "here", "`home` is no place"),
            ("voice = \"\"", "voice", "\"none\""),
            ("talk = \"loud\"", "talk", "few"),
            ("talk_every_s = 0.0", "talk_every_s", "from 0.1 to 86400"),
            ("alarm_command = \" \"", "alarm_command", "empty"),
        ] {
            let wrong = Config::parse(text).unwrap_err();
            assert!(wrong.contains(key) && wrong.contains(accepted), "{text}: {wrong}");
        }
    }

    /// Combines settings and command line as a run does.
    fn together(file: &str, flags: &[&str]) -> StationArgs {
        let config = Config::parse(file).unwrap();
        let matches = Cli::command().get_matches_from([&["ground"], flags].concat());
        let cli = Cli::from_arg_matches(&matches).unwrap();
        let given = matches.subcommand().map_or(&matches, |(_, given)| given);
        let (mut station, is_daemon) = match cli.command {
            Some(Command::Daemon { station }) => (*station, true),
            _ => (cli.station, false),
        };
        config.fill(&mut station, given, is_daemon).unwrap();
        station
    }

    /// Each flag that is a key: the file counts without the flag, and the flag counts over it.
    #[test]
    fn a_flag_overrides_the_key_of_its_name() {
        let (connect, forward) = ("udpin:0.0.0.0:2", "udpout:10.0.0.9:3");
        let others = [
            ("connect", connect),
            ("forward", forward),
            ("foxglove", "127.0.0.1:9"),
            ("sysid", "4"),
            ("vehicle_sysid", "5"),
            ("position", "serial:/dev/ttyACM0:9600"),
        ];
        for argument in Flags::command().get_arguments() {
            let (key, flag) = (argument.get_id().as_str(), format!("--{}", argument.get_long().unwrap()));
            let other = others.iter().find(|(name, _)| *name == key).map_or("other", |(_, other)| other);
            let value = example_keys().into_iter().find(|(name, _)| *name == key).unwrap().1;
            let file = format!("{key} = {value}");
            // A demonstration has no keys, mission or checklist.
            let link = if key == "connect" { &[][..] } else { &["--connect", "udpin:0.0.0.0:3"] };
            let [usual, in_file, over] = [("", &[][..]), (&file, &[]), (&file, &[&flag, other])]
                .map(|(file, more)| together(file, &[&["daemon"], link, more].concat()).flags);
            let alone = together("", &[&["daemon"], link, &[&flag, other]].concat()).flags;
            assert_eq!(over, alone, "{key}: the flag counts");
            assert!(![&usual, &alone].contains(&&in_file), "{key}: without the flag the file counts");
        }
    }

    /// A bare `ground` flies the demonstration; it must not command a real vehicle over a link in
    /// the settings.
    #[test]
    fn a_demonstration_takes_no_link_and_no_key_from_the_settings() {
        let file = "connect = [\"udpin:0.0.0.0:14550\"]\nkey = \"a\"\ncrew = \"b\"\nmission = \"c\"\nchecklist = \"d\"";
        for demonstration in
            [&[][..], &["--auto"], &["--headless"], &["--log", "none"], &["daemon", "--seed", "2"]]
        {
            let Flags { link, mission, checklist, .. } = together(file, demonstration).flags;
            assert_eq!((link.connect, link.key, link.crew), (vec![], None, None), "{demonstration:?}");
            assert_eq!((mission, checklist), (None, None), "{demonstration:?}");
        }
        assert_eq!(together(file, &["daemon"]).flags.link.connect.len(), 1);
    }
}
