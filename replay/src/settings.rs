//! Other settings for a recorded flight, named as in its mission and checked against the known
//! names.
//!
//! A setting is `path=value` or, to change it in flight, `path=value@seconds` of vehicle time. A
//! file of settings is a TOML file with the structure of the mission and only the keys to change.
//! An unknown name is refused, and the most similar known name is suggested.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::str::FromStr;

use avionics::log::again::mission_flown;
use flight::vehicle::mission::Mission;
use protocol::log::computer_v1::ComputerStart;
use sim::recipe::nearest;
use sim::world::Truth;

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
    /// Not of the form `path=value`.
    #[error(
        "setting `{given}`: must be path=value or path=value@seconds, as in powered.weights.theta=90@6.5"
    )]
    Form { given: String },
    /// The key is unknown.
    #[error("no setting `{given}`: did you mean `{nearest}`?")]
    Unknown { given: String, nearest: String },
    /// The log's mission or a settings file is not TOML.
    #[error("{origin}: {reason}")]
    Toml { origin: String, reason: String },
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
    text.parse().unwrap_or_else(|_| toml::Value::String(text.to_owned()))
}

impl fmt::Display for Setting {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}={}", self.path, self.value)?;
        self.at_s.map_or(Ok(()), |at_s| write!(formatter, "@{at_s}"))
    }
}

/// Every setting that a mission's text states; `None` if it is not TOML. A whole number is the same
/// as with a decimal point.
pub(crate) fn settings_of_mission(text: &str) -> Option<BTreeMap<String, String>> {
    let mut settings = BTreeMap::new();
    collect_leaves("", &text.parse().ok()?, &mut |path, value| {
        settings.insert(path, as_integer(value).to_string());
    });
    Some(settings)
}

fn listed(settings: &[Setting]) -> String {
    settings.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ")
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

/// The section of the random draw.
const TRUTH: &str = "truth.";

/// The mission of this text with other settings; their times are ignored.
///
/// # Errors
/// A name is unknown, or the result is not a valid mission.
pub fn mission_with(mission_toml: &str, settings: &[Setting]) -> Result<Mission, SettingError> {
    let text = mission_toml_with(mission_toml, settings)?;
    flight::vehicles::mission::from_toml(&text, "the mission").map_err(|error| {
        let reason = error.to_string();
        if settings.is_empty() {
            return SettingError::Toml { origin: "the mission".to_owned(), reason };
        }
        let recorded = mission_toml.parse().unwrap_or_default();
        refusal(&reason, settings, &valid_keys(&recorded))
    })
}

/// The text of a mission with other settings, whose names are not checked; comments and order stay.
///
/// # Errors
/// The text is not TOML.
pub fn mission_toml_with(mission_toml: &str, settings: &[Setting]) -> Result<String, SettingError> {
    let settings: Vec<_> = settings.iter().map(|setting| (setting.clone(), String::new())).collect();
    mission_toml_with_reasons(mission_toml, &settings)
}

/// As [`mission_toml_with`], with a comment behind each line that is changed.
pub(crate) fn mission_toml_with_reasons(
    mission_toml: &str,
    settings: &[(Setting, String)],
) -> Result<String, SettingError> {
    let wrong = |reason| SettingError::Toml { origin: "the mission".to_owned(), reason };
    let not_toml = |error: toml_edit::TomlError| wrong(error.to_string());
    let mut document: toml_edit::DocumentMut = mission_toml.parse().map_err(not_toml)?;
    for (Setting { path, value, .. }, comment) in settings {
        let mut value: toml_edit::Value = as_integer(value).to_string().parse().map_err(not_toml)?;
        if !comment.is_empty() {
            value.decor_mut().set_suffix(format!(" # {comment}"));
        }
        let (sections, key) = path.rsplit_once('.').unwrap_or(("", path));
        let mut table: &mut dyn toml_edit::TableLike = document.as_table_mut();
        for section in sections.split('.').filter(|section| !section.is_empty()) {
            let inner = table.entry(section).or_insert_with(toml_edit::table);
            let no_section = || wrong(format!("{path}: {section} is no section"));
            table = inner.as_table_like_mut().ok_or_else(no_section)?;
        }
        *table.entry(key).or_insert(toml_edit::Item::None) = value.into();
    }
    Ok(document.to_string())
}

/// The random draw with other settings: those of the section `truth`. Other settings are ignored.
///
/// # Errors
/// A name is unknown, or the result is not a valid truth.
pub fn truth_with(truth: &Truth, settings: &[Setting]) -> Result<Truth, SettingError> {
    let wrong = |reason: String| SettingError::Mission { settings: listed(settings), reason };
    let recorded = toml::Table::try_from(truth).map_err(|error| wrong(error.to_string()))?;
    let mut table = recorded.clone();
    let of_truth =
        settings.iter().filter_map(|setting| Some((setting.path.strip_prefix(TRUTH)?, &setting.value)));
    for (key, value) in of_truth {
        table.insert(key.to_owned(), value.clone());
    }
    table.try_into().map_err(|error: toml::de::Error| {
        let known = recorded.keys().map(|key| format!("{TRUTH}{key}")).collect();
        let of_truth = settings.iter().filter(|setting| setting.path.starts_with(TRUTH)).cloned();
        refusal(&error.to_string(), &of_truth.collect::<Vec<_>>(), &known)
    })
}

/// A whole number of a range, `10.0`, as `10`: a key that takes whole numbers takes it, and so does
/// one that takes all.
fn as_integer(value: &toml::Value) -> toml::Value {
    let integer = value.as_float().map(|number| (number, libm::trunc(number) as i64));
    let same = integer.filter(|(number, integer)| (*integer as f64).to_bits() == number.to_bits());
    same.map_or_else(|| value.clone(), |(_, integer)| toml::Value::Integer(integer))
}

/// Every key of the built-in missions and their controller, and of this table.
fn valid_keys(table: &toml::Table) -> BTreeSet<String> {
    let built_in = flight::vehicles::mission::BUILTIN.iter().filter_map(|(name, text)| {
        let mission = flight::vehicles::mission::from_toml(text, name).ok()?;
        toml::Table::try_from(mission).ok()
    });
    let mut known = BTreeSet::new();
    for table in built_in.chain([table.clone()]) {
        collect_leaves("", &table, &mut |path, _| _ = known.insert(path));
    }
    known
}

/// What is wrong with settings: if a name is unknown, the most similar one.
fn refusal(reason: &str, settings: &[Setting], known: &BTreeSet<String>) -> SettingError {
    let unknown = settings.iter().find(|setting| !known.contains(&setting.path));
    let (true, Some(Setting { path: given, .. })) = (reason.contains("unknown field"), unknown) else {
        return SettingError::Mission { settings: listed(settings), reason: reason.to_owned() };
    };
    let nearest = nearest(given, known).map_or_else(String::new, |(name, _)| name);
    SettingError::Unknown { given: given.clone(), nearest }
}

/// The missions of a flight: that of its beginning, and those of changes at given times.
#[derive(Debug, Clone)]
pub struct Schedule {
    pub(crate) base: Mission,
    /// Still to come, by time; each includes all earlier changes.
    changes: Vec<(f64, Mission)>,
}

impl Schedule {
    /// The mission as at the release with the settings from the beginning, then again with each
    /// timed one from its time.
    ///
    /// # Errors
    /// A name is unknown, or a mission is not valid.
    pub(crate) fn of(
        mission_toml: &str,
        start: &ComputerStart,
        settings: &[Setting],
    ) -> Result<Self, SettingError> {
        let build = |so_far: &[Setting]| -> Result<Mission, SettingError> {
            let set = |path: &str| so_far.iter().any(|setting| setting.path == path);
            Ok(mission_flown(mission_with(mission_toml, so_far)?, start, set))
        };
        let mut so_far: Vec<Setting> =
            settings.iter().filter(|setting| setting.at_s.is_none()).cloned().collect();
        let mut timed: Vec<(f64, &Setting)> =
            settings.iter().filter_map(|setting| Some((setting.at_s?, setting))).collect();
        timed.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (base, mut changes) = (build(&so_far)?, Vec::new());
        for (at_s, setting) in timed {
            so_far.push(setting.clone());
            changes.push((at_s, build(&so_far)?));
        }
        Ok(Self { base, changes })
    }

    /// The mission that takes effect at this vehicle time, s, if any; times must not decrease.
    pub(crate) fn due(&mut self, time_s: f64) -> Option<Mission> {
        let due = self.changes.partition_point(|(at_s, _)| *at_s <= time_s);
        self.changes.drain(..due).next_back().map(|(_, mission)| mission)
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

    fn toml() -> &'static str {
        flight::vehicles::mission::BUILTIN.iter().find(|(name, _)| *name == "mk2").unwrap().1
    }

    fn with(given: &[&str]) -> Result<Mission, SettingError> {
        let settings: Vec<Setting> = given.iter().map(|text| text.parse().unwrap()).collect();
        mission_with(toml(), &settings)
    }

    #[test]
    fn a_set_value_reaches_mission_and_airframe_and_only_what_follows_from_it_changes() {
        let mut expected = with(&[]).unwrap();
        expected.powered.weights.theta = 150.0;
        expected.airframe.legs.friction_coefficient = 0.5;
        expected.ignition.fixed_height_m = Some(31.0);
        expected.changed = vec!["powered.weights.theta".to_owned()];
        let given = [
            "powered.weights.theta=150",
            "airframe.legs.friction_coefficient=0.5",
            "ignition.fixed_height_m=31.0",
        ];
        assert_eq!(with(&given).unwrap(), expected);
        // The controller is that of the vehicle.
        let lighter = with(&["airframe.mass.loaded_kg=2.9"]).unwrap();
        assert!((lighter.airframe.mass.loaded_kg - 2.9).abs() < 1e-12);
        assert!(lighter.soft_tilt_deg > expected.soft_tilt_deg && lighter.changed.is_empty());
    }

    #[test]
    fn an_unknown_name_is_refused_with_the_nearest() {
        let refusal = |given: &str| with(&[given]).unwrap_err().to_string();
        assert_eq!(
            refusal("powered.wieghts.theta=1"),
            "no setting `powered.wieghts.theta`: did you mean `powered.weights.theta`?"
        );
        assert!(refusal("airframe.mass.loaded=1").contains("`airframe.mass.loaded_kg`"));
        assert!(refusal("airframe.motor=X1").contains("X1"));
    }

    #[test]
    fn an_integer_may_be_written_as_a_real_number_and_a_fraction_is_refused() {
        assert_eq!(with(&["powered.solver.max_iterations=12.0"]).unwrap().powered.solver.max_iterations, 12);
        let refusal = with(&["powered.solver.max_iterations=12.5"]).unwrap_err().to_string();
        assert!(refusal.contains("max_iterations=12.5") && refusal.contains("12.5"), "{refusal}");
    }

    #[test]
    fn the_truth_is_set_by_the_names_of_its_section() {
        let set = |given: &str| truth_with(&Truth::default(), &[given.parse().unwrap()]);
        let expected = Truth { wind_m_s: 4.0, ..Truth::default() };
        assert_eq!(set("truth.wind_m_s=4").unwrap(), expected);
        assert_eq!(set("powered.gimbal_deg=4").unwrap(), Truth::default());
        assert!(set("truth.wind=4").unwrap_err().to_string().contains("`truth.wind_m_s`"));
        assert!(set("truth.wind_m_s=much").unwrap_err().to_string().contains("truth.wind_m_s"));
    }
}
