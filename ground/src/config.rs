//! The settings file (TOML). [`EXAMPLE`] documents every key. What changes from one start to the next has a flag of the same
//! name, which overrides the key; what a person or a place keeps has none.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use clap::ValueEnum;
use protocol::identity::{GROUND, VEHICLE};
use protocol::transport::LinkAddress;
use serde::Deserialize;

use crate::cli::{Characters, LinkArgs, LogChoice, Seconds, StationArgs, ThemeChoice};
use crate::model::{Amount, Bindings, DEFINITIONS, Degrees, Talk};

/// A file with every key, its meaning and its default; `ground config example` prints it.
pub const EXAMPLE: &str = include_str!("../config-example.toml");

/// The content of a settings file. A missing key leaves the default.
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
    pub pad: Option<String>,
    pub here: Option<String>,
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
    pub talk: Amount,
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
        let mut config: Self = toml::from_str(text).map_err(|error| error.to_string())?;
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
        for (key, command) in [("alarm_command", &config.alarm_command), ("voice", &config.voice)] {
            if command.as_ref().is_some_and(|command| command.trim().is_empty()) {
                return Err(format!("{key} is empty; give a command or \"none\""));
            }
        }
        for (key, place) in [("pad", &config.pad), ("here", &config.here)] {
            if let Some(place) = place {
                place.parse::<Degrees>().map_err(|error| format!("{key}: {error}"))?;
            }
        }
        config.voice.take_if(|command| command == "none");
        config.alarm_command.take_if(|command| command == "none");
        Ok(config)
    }

    /// Fills in the links of a daemon. A bare `ground` takes none: it must always be the demonstration.
    pub fn fill_connect(&self, station: &mut StationArgs) {
        let connect = &mut station.link.connect;
        if connect.is_empty() && !station.describes_demonstration() {
            station.link.connect = self.connect.iter().filter_map(|link| link.parse().ok()).collect();
        }
    }

    /// Fills in the flags of a station that the command line does not give.
    pub fn fill(&self, station: &mut StationArgs) {
        fn parsed<T: std::str::FromStr>(value: Option<&String>) -> Option<T> {
            value.and_then(|value| value.parse().ok())
        }
        self.fill_link(&mut station.link);
        if !station.link.connect.is_empty() {
            fill(&mut station.mission, self.mission.clone());
            fill(&mut station.checklist, self.checklist.clone());
        }
        fill(&mut station.log, parsed(self.log.as_ref()));
        fill(&mut station.tlog, parsed(self.tlog.as_ref()));
        fill(&mut station.socket.socket, self.socket.clone());
    }

    /// Where the pad is, and where this station is.
    pub fn places(&self) -> [Option<Degrees>; 2] {
        [&self.pad, &self.here].map(|place| place.as_ref().and_then(|place| place.parse().ok()))
    }

    /// Fills in the flags of a link that the command line does not give.
    pub fn fill_link(&self, link: &mut LinkArgs) {
        fill(&mut link.sysid, self.sysid);
        fill(&mut link.vehicle_sysid, self.vehicle_sysid);
        if !link.connect.is_empty() {
            fill(&mut link.key, self.key.clone());
            fill(&mut link.crew, self.crew.clone());
        }
        fill(&mut link.operator.operator, self.operator.clone());
    }

    /// What is called out.
    pub fn talk(&self) -> Talk {
        let usual = Talk::default();
        let height_every = self.talk_every_s.map_or(usual.height_every, |Seconds(every)| every);
        Talk { amount: self.talk, height_every, has_voice: self.voice.is_some() }
    }
}

fn fill<T>(flag: &mut Option<T>, set: Option<T>) {
    *flag = flag.take().or(set);
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

// The settings as a table, for `ground config check`.

/// Values begin in this column.
const VALUES: usize = 15;

impl Config {
    /// One line for each key: its value, or in parentheses what holds without one.
    pub fn table(&self) -> String {
        // Named one by one, so that a new key does not compile without its line.
        let Self {
            connect,
            sysid,
            vehicle_sysid,
            key,
            crew,
            operator,
            mission,
            checklist,
            log,
            tlog,
            socket,
            pad,
            here,
            bell,
            alarm_command,
            characters,
            theme,
            keys,
            voice,
            talk,
            talk_every_s,
        } = self;
        let usual = Self::default();
        let seconds = |time: std::time::Duration| time.as_secs_f64().to_string();
        let given =
            |value: Option<String>, otherwise: &str| value.unwrap_or_else(|| format!("({otherwise})"));
        let chosen = |name: String, is_usual: bool| if is_usual { format!("({name})") } else { name };
        let path = |path: &Option<std::path::PathBuf>| path.as_ref().map(|path| path.display().to_string());
        let other_keys: Vec<String> = DEFINITIONS
            .iter()
            .filter(|definition| keys.key(definition.act) != Some(definition.usual))
            .map(|definition| format!("{}={}", definition.name, keys.name(definition.act)))
            .collect();
        let rows = [
            ("connect", given((!connect.is_empty()).then(|| connect.join(" ")), "the demonstration")),
            ("sysid", given(sysid.map(|id| id.to_string()), &GROUND.system_id.to_string())),
            ("vehicle_sysid", given(vehicle_sysid.map(|id| id.to_string()), &VEHICLE.system_id.to_string())),
            ("key", given(path(key), "nothing is signed")),
            ("crew", given(path(crew), "nobody is named")),
            ("operator", given(operator.clone(), "the user and the terminal, or the SSH client")),
            ("mission", given(mission.clone(), "any")),
            ("checklist", given(path(checklist), "none")),
            ("log", given(log.clone(), "touchdown-YYYYMMDD-HHMMSS.mcap in the current directory")),
            ("tlog", given(tlog.clone(), "with a link: beside the log")),
            ("socket", given(path(socket), "one for each station")),
            ("pad", given(pad.clone(), "not known")),
            ("here", given(here.clone(), "not known")),
            ("bell", given(bell.map(|bell| bell.to_string()), "true")),
            ("alarm_command", given(alarm_command.clone(), "none")),
            ("characters", chosen(value_name(characters), *characters == usual.characters)),
            ("theme", chosen(value_name(theme), *theme == usual.theme)),
            ("voice", given(voice.clone(), "none")),
            ("talk", chosen(value_name(talk), *talk == usual.talk)),
            (
                "talk_every_s",
                given(
                    talk_every_s.map(|Seconds(every)| seconds(every)),
                    &seconds(Talk::default().height_every),
                ),
            ),
            ("keys", given((!other_keys.is_empty()).then(|| other_keys.join(" ")), "the usual ones")),
        ];
        let mut table = String::new();
        for (key, value) in rows {
            // Writing to a string cannot fail.
            let _ = writeln!(table, "{key:VALUES$}{value}");
        }
        table
    }
}

/// The name of a value, as in the file.
fn value_name(value: &impl ValueEnum) -> String {
    value.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::{CommandFactory as _, Parser as _};

    use crate::cli::{Cli, Command};

    // Tests of the settings file, its example and the flags.

    /// Every key of the example is valid without its comment mark, and the example names every key.
    #[test]
    fn the_example_contains_every_key() {
        let keys =
            EXAMPLE.lines().filter_map(|line| line.strip_prefix('#')).filter(|line| !line.starts_with(' '));
        let uncommented = keys.collect::<Vec<_>>().join("\n");
        let config = Config::parse(&uncommented).unwrap();
        assert!(
            !config.connect.is_empty()
                && config.key.is_some()
                && config.log.is_some()
                && config.tlog.is_some()
        );
        assert!(config.socket.is_some() && config.bell == Some(true) && config.alarm_command.is_some());
        assert_eq!(uncommented.lines().count(), 21, "one line a key: {uncommented}");
        assert_eq!(Config::parse(EXAMPLE), Ok(Config::default()));
    }

    #[test]
    fn an_error_names_the_wrong_key() {
        let wrong = |text: &str| Config::parse(text).unwrap_err();
        assert!(wrong("belll = true").contains("belll"));
        assert!(wrong("connect = [\"tcp\"]").contains("udpin:ADDRESS:PORT"));
        assert!(wrong("theme = \"blue\"").contains("light"));
        assert!(wrong("sysid = 0").contains("sysid: 0 addresses every system"));
        assert!(wrong("vehicle_sysid = 256").contains("vehicle_sysid"));
        assert!(wrong("log = \"\"").contains("log: "));
        assert!(wrong("pad = \"here\"").contains("pad: `here` is no place"));
        assert!(wrong("voice = \"\"").contains("voice is empty"));
        assert!(wrong("talk = \"loud\"").contains("few"));
        assert!(wrong("talk_every_s = 0.0").contains("from 0.1 to 86400"));
        assert!(wrong("keys = { arm = \"a\" }").contains("capital letter"));
        assert!(wrong("alarm_command = \" \"").contains("empty"));
    }

    /// A key, its value in a file, its flags, and a check that the value of the flag is used.
    type Override = (&'static str, &'static str, &'static [&'static str], fn(&StationArgs) -> bool);

    const OVERRIDES: [Override; 11] = [
        ("connect", "[\"udpin:0.0.0.0:1\"]", &["--connect", "udpin:0.0.0.0:2"], |station| {
            station.link.connect == [LinkAddress::UdpIn("0.0.0.0:2".to_owned())]
        }),
        ("sysid", "3", &["--sysid", "4"], |station| station.link.us().system_id == 4),
        ("vehicle_sysid", "3", &["--vehicle-sysid", "4"], |station| station.link.vehicle().system_id == 4),
        ("key", "\"a\"", &["--connect", "udpin:0.0.0.0:2", "--key", "b"], |station| {
            station.link.key == Some("b".into())
        }),
        ("crew", "\"a\"", &["--connect", "udpin:0.0.0.0:2", "--crew", "b"], |station| {
            station.link.crew == Some("b".into())
        }),
        ("operator", "\"Ann\"", &["--operator", "Bob"], |station| {
            station.link.operator.operator.as_deref() == Some("Bob")
        }),
        ("mission", "\"mk2\"", &["--connect", "udpin:0.0.0.0:2", "--mission", "mk3"], |station| {
            station.mission.as_deref() == Some("mk3")
        }),
        ("checklist", "\"a\"", &["--connect", "udpin:0.0.0.0:2", "--checklist", "b"], |station| {
            station.checklist.as_deref() == Some(Path::new("b"))
        }),
        ("log", "\"a.mcap\"", &["--log", "b.mcap"], |station| {
            station.log == Some(LogChoice::File("b.mcap".into()))
        }),
        ("tlog", "\"a.tlog\"", &["--tlog", "none"], |station| station.tlog == Some(LogChoice::None)),
        ("socket", "\"/a\"", &["--socket", "/b"], |station| station.socket.socket == Some("/b".into())),
    ];

    /// The keys without a flag, with a value.
    const ONLY_HERE: [(&str, &str); 10] = [
        ("pad", "\"35.347,-117.809\""),
        ("here", "\"35.348,-117.808\""),
        ("bell", "true"),
        ("alarm_command", "\"a\""),
        ("characters", "\"unicode\""),
        ("theme", "\"dark\""),
        ("voice", "\"a\""),
        ("talk", "\"few\""),
        ("talk_every_s", "3"),
        ("keys", "{ theme = \"w\" }"),
    ];

    fn keys_with_values() -> impl Iterator<Item = (&'static str, &'static str)> {
        OVERRIDES.into_iter().map(|(key, value, ..)| (key, value)).chain(ONLY_HERE)
    }

    /// Combines settings and command line as a run does.
    fn together(file: &str, flags: &[&str]) -> StationArgs {
        let config = Config::parse(file).unwrap();
        let cli = Cli::try_parse_from([&["ground"], flags].concat()).unwrap();
        let mut station = match cli.command {
            Some(Command::Daemon { mut station }) => {
                config.fill_connect(&mut station);
                *station
            }
            _ => cli.station,
        };
        config.fill(&mut station);
        station
    }

    #[test]
    fn a_flag_overrides_the_key_of_its_name() {
        let keys: Vec<&str> = EXAMPLE
            .lines()
            .filter_map(|line| line.strip_prefix('#')?.split_once(" = "))
            .map(|(key, _)| key)
            .filter(|key| !key.contains(' '))
            .collect();
        assert_eq!(keys_with_values().map(|(key, _)| key).collect::<Vec<_>>(), keys);
        for (key, in_file, flags, holds) in OVERRIDES {
            let file = format!("{key} = {in_file}");
            assert!(flags.contains(&format!("--{}", key.replace('_', "-")).as_str()), "{key}: its own name");
            assert!(holds(&together(&file, flags)), "{key}: the flag counts");
            assert!(!holds(&together(&file, &[])), "{key}: without the flag the file counts");
        }
    }

    #[test]
    fn completions_and_manual_page_have_the_flag_of_every_key() {
        let (mut script, mut page) = (Vec::new(), Vec::new());
        clap_complete::generate(clap_complete::Shell::Bash, &mut Cli::command(), "ground", &mut script);
        clap_mangen::Man::new(Cli::command()).render(&mut page).unwrap();
        let (script, page) = (String::from_utf8(script).unwrap(), String::from_utf8(page).unwrap());
        for (key, ..) in OVERRIDES {
            let flag = format!("--{}", key.replace('_', "-"));
            assert!(script.contains(&flag), "{flag}");
            // A hyphen is escaped in roff.
            assert!(page.contains(&flag.replace('-', "\\-")), "{flag}");
        }
    }

    /// A bare `ground` flies the demonstration; it must not command a real vehicle over a link in the settings.
    #[test]
    fn a_bare_ground_takes_no_link_from_the_settings() {
        for bare in [&[][..], &["--auto"], &["--headless"], &["--log", "none"]] {
            assert_eq!(together("connect = [\"udpin:0.0.0.0:14550\"]", bare).link.connect, [], "{bare:?}");
        }
    }

    #[test]
    fn flags_for_the_demonstration_override_the_file() {
        let file = "connect = [\"udpin:0.0.0.0:14550\"]";
        for demonstration in [&["daemon", "--profile", "mk2"][..], &["daemon", "--seed", "2"]] {
            assert_eq!(together(file, demonstration).link.connect, []);
        }
        assert_eq!(together(file, &["daemon"]).link.connect.len(), 1);
    }

    /// The table has a line for every key; what the file does not give is in parentheses.
    #[test]
    fn the_table_shows_every_key() {
        let usual = Config::default().table();
        assert_eq!(usual.lines().count(), keys_with_values().count());
        for (key, in_file) in keys_with_values() {
            let line = |table: &str| {
                let found = table.lines().find(|line| line.split(' ').next() == Some(key));
                found.unwrap_or_else(|| panic!("no line for {key} in {table}")).to_owned()
            };
            assert!(line(&usual).ends_with(')'), "{}", line(&usual));
            let given = line(&Config::parse(&format!("{key} = {in_file}")).unwrap().table());
            assert!(!given.ends_with(')'), "{given}");
            if key != "keys" {
                let value = in_file.trim_matches(['[', ']']).trim_matches('"');
                assert!(given.ends_with(value), "{given}: {value}");
            }
        }
        let keys = Config::parse("keys = { theme = \"w\", plot = \"m\" }").unwrap().table();
        assert!(keys.contains("theme=w") && keys.contains("plot=m"), "{keys}");
    }
}
