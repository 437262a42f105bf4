//! Other settings for a recorded flight, named as in its mission and checked against the known names.
//!
//! A setting is `path=value` or, to change it in flight, `path=value@seconds` of vehicle time. A file of settings is a
//! TOML file with the structure of the mission and only the keys to change. An unknown name is refused, and the most
//! similar known name is suggested.

mod mission;
mod names;
mod other_release;
mod schedule;

pub use mission::{
    is_whole_in_mission, known_mission_paths, mission_toml_with, mission_value_of, mission_with, truth_with,
};
pub(crate) use other_release::explained;
pub use schedule::Schedule;

use std::fmt;
use std::str::FromStr;

use flight::guidance::baseline::UnknownController;

use self::names::Names;

/// A value for one key of the mission.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// The key, as in `powered.weights.theta`.
    pub path: String,
    pub value: toml::Value,
    /// Vehicle time from which it applies, s; `None`: from the beginning.
    pub at_s: Option<f64>,
}

/// Why a setting cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SettingError {
    /// The log names a controller of the landing burn that this build does not have.
    #[error(transparent)]
    Law(#[from] UnknownController),
    /// Not of the form `path=value`.
    #[error(
        "setting `{given}`: must be path=value or path=value@seconds, as in powered.weights.theta=90@6.5"
    )]
    Form { given: String },
    /// The key is unknown.
    #[error("no setting `{given}`: did you mean `{nearest}`?")]
    Unknown {
        given: String,
        /// The most similar known name.
        nearest: String,
    },
    /// The path names a section, not a key.
    #[error("`{given}` is a section; its settings are {}", keys.join(", "))]
    Section { given: String, keys: Vec<String> },
    /// A fraction for a key that takes whole numbers.
    #[error("setting `{given}`: must be a whole number")]
    NotWhole { given: String },
    /// The log's mission or a settings file is not TOML.
    #[error("{origin}: {reason}")]
    Toml {
        /// Which text.
        origin: String,
        /// The parser's message.
        reason: String,
    },
    /// The mission or the truth is invalid with the settings.
    #[error("with {settings}: {reason}")]
    Mission { settings: String, reason: String },
}

impl FromStr for Setting {
    type Err = SettingError;

    fn from_str(given: &str) -> Result<Self, SettingError> {
        let form = || SettingError::Form { given: given.to_owned() };
        let (path, text) = given.split_once('=').ok_or_else(form)?;
        let (path, text) = (path.trim(), text.trim());
        if path.is_empty() || text.is_empty() {
            return Err(form());
        }
        let timed = text.rsplit_once('@').and_then(|(value, at)| {
            let at_s = at.trim_end_matches('s').trim().parse::<f64>().ok()?;
            Some((value.trim(), at_s))
        });
        let (text, at_s) = match timed {
            Some((value, at_s)) if at_s.is_finite() && !value.is_empty() => (value, Some(at_s)),
            Some(_) => return Err(form()),
            None => (text, None),
        };
        Ok(Self { path: path.to_owned(), value: parsed_value(text), at_s })
    }
}

/// Parses a TOML value, or else takes the text: `consistent` needs no quotes on a command line.
fn parsed_value(text: &str) -> toml::Value {
    let table = format!("value = {text}").parse::<toml::Table>();
    let value = table.ok().filter(|table| table.len() == 1).and_then(|mut table| table.remove("value"));
    value.unwrap_or_else(|| toml::Value::String(text.to_owned()))
}

impl fmt::Display for Setting {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}={}", self.path, self.value)?;
        self.at_s.map_or(Ok(()), |at_s| write!(formatter, "@{at_s}"))
    }
}

/// Every key of a settings file, as settings. `origin` is used in messages only.
///
/// # Errors
/// The text is not TOML.
pub fn settings_of_file(text: &str, origin: &str) -> Result<Vec<Setting>, SettingError> {
    let table = parsed_table(text, origin)?;
    let mut settings = Vec::new();
    collect_leaves("", &table, &mut |path, value| {
        settings.push(Setting { path, value: value.clone(), at_s: None });
    });
    Ok(settings)
}

/// Puts settings into a table, if each is a known name or in it already.
fn set(table: &mut toml::Table, settings: &[Setting], names: Names) -> Result<(), SettingError> {
    let names = names.with_those_in(table);
    for setting in settings {
        names.check(&setting.path)?;
        insert(table, &setting.path, names.value_of(setting)?);
    }
    Ok(())
}

fn text_of(table: &toml::Table) -> Result<String, SettingError> {
    toml::to_string(table)
        .map_err(|error| SettingError::Toml { origin: "profile.toml".to_owned(), reason: error.to_string() })
}

fn listed(settings: &[Setting]) -> String {
    settings.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ")
}

fn value_in(table: toml::Table, path: &str) -> Option<toml::Value> {
    let mut value = toml::Value::Table(table);
    for key in path.split('.') {
        value = value.as_table_mut()?.remove(key)?;
    }
    Some(value)
}

fn parsed_table(text: &str, origin: &str) -> Result<toml::Table, SettingError> {
    text.parse::<toml::Table>()
        .map_err(|error| SettingError::Toml { origin: origin.to_owned(), reason: error.to_string() })
}

fn collect_leaves(prefix: &str, table: &toml::Table, take: &mut impl FnMut(String, &toml::Value)) {
    for (key, value) in table {
        let path = if prefix.is_empty() { key.clone() } else { format!("{prefix}.{key}") };
        match value {
            toml::Value::Table(inner) => collect_leaves(&path, inner, take),
            value => take(path, value),
        }
    }
}

/// Puts a value at a path and creates the sections on the way.
fn insert(table: &mut toml::Table, path: &str, value: toml::Value) {
    match path.split_once('.') {
        None => {
            table.insert(path.to_owned(), value);
        }
        Some((section, rest)) => {
            let inner = table.entry(section).or_insert_with(|| toml::Value::Table(toml::Table::new()));
            if let toml::Value::Table(inner) = inner {
                insert(inner, rest, value);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_setting_is_a_path_a_value_and_perhaps_a_time() {
        let setting: Setting = "powered.weights.theta=90".parse().unwrap();
        assert_eq!((setting.path.as_str(), setting.at_s), ("powered.weights.theta", None));
        assert_eq!(setting.value, toml::Value::Integer(90));
        let timed: Setting = "powered.weights.theta = 9.5e1 @ 6.5s".parse().unwrap();
        assert_eq!((timed.value, timed.at_s), (toml::Value::Float(95.0), Some(6.5)));
        let word: Setting = "airframe.motor=as-printed".parse().unwrap();
        assert_eq!(word.value, toml::Value::String("as-printed".to_owned()));
        for bad in ["powered.weights.theta", "=3", "a=", "a=3@nan", "a=@3"] {
            assert!(bad.parse::<Setting>().is_err(), "{bad}");
        }
    }

    #[test]
    fn a_file_of_settings_has_the_missions_shape() {
        let settings =
            settings_of_file("powered.weights.theta = 90\n[ignition]\ndelay_s = 0.2\n", "x.toml").unwrap();
        let shown: Vec<String> = settings.iter().map(ToString::to_string).collect();
        assert_eq!(shown, ["ignition.delay_s=0.2", "powered.weights.theta=90"]);
        assert!(settings_of_file("= 3", "x.toml").unwrap_err().to_string().starts_with("x.toml: "));
    }
}
