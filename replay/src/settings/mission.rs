//! Settings of a flight from apogee: its mission, its airframe, and its random draw (the truth).
//!
//! A mission may name a built-in airframe. A setting inside the airframe replaces that name by the airframe's full
//! text.

use std::collections::BTreeSet;

use flight::vehicle::airframe::Airframe;
use flight::vehicle::mission::Mission;
use world::Truth;

use super::names::Names;
use super::other_release::explained;
use super::{Setting, SettingError, insert, listed, parsed_table, set, text_of, value_in};

/// The section of the airframe.
const AIRFRAME: &str = "airframe";
/// The section of the random draw.
const TRUTH: &str = "truth.";

/// Every key that a mission may have, as in `powered.weights.theta` and `airframe.mass.loaded_kg`.
pub fn known_mission_paths() -> BTreeSet<String> {
    names().paths
}

/// The keys that a mission and its airframe may have.
fn names() -> Names {
    Names::of::<Mission>("").and(Names::of::<Airframe>(AIRFRAME))
}

/// Whether a key of a mission, of its airframe or of the truth takes whole numbers only.
///
/// # Errors
/// The name is unknown, or the text is not TOML.
pub fn is_whole_in_mission(mission_toml: &str, path: &str) -> Result<bool, SettingError> {
    let names = if path.starts_with(TRUTH) {
        Names::of::<Truth>("truth")
    } else {
        let mut table = parsed_table(mission_toml, "profile.toml")?;
        expand_airframe(&mut table)?;
        names().with_those_in(&table)
    };
    names.check(path)?;
    Ok(names.is_whole(path))
}

/// The mission of this text with other settings; their times are ignored.
///
/// # Errors
/// A name is unknown, or the result is not a valid mission.
pub fn mission_with(mission_toml: &str, settings: &[Setting]) -> Result<Mission, SettingError> {
    let text = mission_toml_with(mission_toml, settings)?;
    vehicles::mission::from_toml(&text, "profile.toml").map_err(|error| {
        let reason = error.to_string();
        match settings {
            [] => SettingError::Toml { origin: "profile.toml".to_owned(), reason: explained(&reason) },
            _ => SettingError::Mission { settings: listed(settings), reason },
        }
    })
}

/// The text of a mission with other settings.
///
/// # Errors
/// A name is unknown, or the text is not TOML.
pub fn mission_toml_with(mission_toml: &str, settings: &[Setting]) -> Result<String, SettingError> {
    if settings.is_empty() {
        // Without settings the text stays the same, byte for byte.
        return Ok(mission_toml.to_owned());
    }
    let mut table = parsed_table(mission_toml, "profile.toml")?;
    if settings.iter().any(|setting| setting.path.starts_with("airframe.")) {
        expand_airframe(&mut table)?;
    }
    set(&mut table, settings, names())?;
    text_of(&table)
}

/// The random draw with other settings: those of the section `truth`. Other settings are ignored.
///
/// # Errors
/// A name is unknown, or the result is not a valid truth.
pub fn truth_with(truth: &Truth, settings: &[Setting]) -> Result<Truth, SettingError> {
    let wrong = |reason: String| SettingError::Mission { settings: listed(settings), reason };
    let mut table = toml::Table::try_from(truth).map_err(|error| wrong(error.to_string()))?;
    let known = Names::of::<Truth>("truth");
    for setting in settings {
        let Some(key) = setting.path.strip_prefix(TRUTH) else { continue };
        known.check(&setting.path)?;
        insert(&mut table, key, as_number(&setting.value));
    }
    table.try_into().map_err(|error: toml::de::Error| wrong(error.to_string()))
}

/// The value of a key of a mission's text, of its airframe or of the truth, if there is one.
pub fn mission_value_of(mission_toml: &str, truth: &Truth, path: &str) -> Option<toml::Value> {
    if let Some(key) = path.strip_prefix(TRUTH) {
        return value_in(toml::Table::try_from(truth).ok()?, key);
    }
    let mut table = mission_toml.parse::<toml::Table>().ok()?;
    if path.starts_with("airframe.") {
        expand_airframe(&mut table).ok()?;
    }
    value_in(table, path)
}

/// Replaces the name of a built-in airframe by its text.
fn expand_airframe(table: &mut toml::Table) -> Result<(), SettingError> {
    if let Some(name) = table.get(AIRFRAME).and_then(toml::Value::as_str)
        && let Some(text) = vehicles::airframe::builtin_toml(name)
    {
        let airframe = parsed_table(text, name)?;
        table.insert(AIRFRAME.to_owned(), toml::Value::Table(airframe));
    }
    Ok(())
}

/// Every number of the truth is a real number: `4` means `4.0`.
fn as_number(value: &toml::Value) -> toml::Value {
    value.as_integer().map_or_else(|| value.clone(), |whole| toml::Value::Float(whole as f64))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn toml() -> &'static str {
        vehicles::mission::BUILTIN.iter().find(|(name, _)| *name == "mk2").unwrap().1
    }

    fn with(given: &[&str]) -> Result<Mission, SettingError> {
        let settings: Vec<Setting> = given.iter().map(|text| text.parse().unwrap()).collect();
        mission_with(toml(), &settings)
    }

    #[test]
    fn a_set_value_reaches_mission_and_airframe_and_nothing_else_changes() {
        let mut expected = with(&[]).unwrap();
        expected.powered.weights.theta = 150.0;
        expected.airframe.mass.loaded_kg = 2.5;
        expected.ignition.fixed_height_m = Some(31.0);
        let given =
            ["powered.weights.theta=150", "airframe.mass.loaded_kg=2.5", "ignition.fixed_height_m=31.0"];
        assert_eq!(with(&given).unwrap(), expected);
        assert_eq!(
            with(&["airframe=mk2-h53"]).unwrap().airframe,
            vehicles::airframe::builtin("mk2-h53").unwrap()
        );
    }

    #[test]
    fn every_key_of_the_built_in_missions_is_known_and_others_are_refused_with_the_nearest() {
        let known = known_mission_paths();
        for (name, text) in vehicles::mission::BUILTIN {
            let mut table = text.parse::<toml::Table>().unwrap();
            expand_airframe(&mut table).unwrap();
            super::super::collect_leaves("", &table, &mut |path, _| {
                assert!(known.contains(&path), "{name}: {path}");
            });
        }
        assert!(known.contains("estimator.frame_s") && known.contains("ignition.fixed_height_m"));
        let refusal = |given: &str| with(&[given]).unwrap_err().to_string();
        assert_eq!(
            refusal("powered.wieghts.theta=1"),
            "no setting `powered.wieghts.theta`: did you mean `powered.weights.theta`?"
        );
        assert!(refusal("airframe.mass.loaded=1").contains("`airframe.mass.loaded_kg`"));
        assert!(refusal("airframe.motor=X1").contains("X1"));
    }

    #[test]
    fn a_whole_number_may_be_written_as_a_real_one_and_a_fraction_is_refused() {
        assert_eq!(with(&["powered.solver.max_iterations=12.0"]).unwrap().powered.solver.max_iterations, 12);
        let refusal = with(&["powered.solver.max_iterations=12.5"]).unwrap_err().to_string();
        assert_eq!(refusal, "setting `powered.solver.max_iterations=12.5`: must be a whole number");
        assert!(is_whole_in_mission(toml(), "powered.solver.max_iterations").unwrap());
        assert!(!is_whole_in_mission(toml(), "powered.weights.theta").unwrap());
        assert!(is_whole_in_mission(toml(), "powered.solver.max_iteration").is_err());
    }

    #[test]
    fn the_truth_is_set_by_its_own_names() {
        let set = |given: &str| truth_with(&Truth::default(), &[given.parse().unwrap()]);
        let expected = Truth { wind_m_s: 4.0, ..Truth::default() };
        assert_eq!(set("truth.wind_m_s=4").unwrap(), expected);
        assert_eq!(set("powered.gimbal_deg=4").unwrap(), Truth::default());
        assert!(set("truth.wind=4").unwrap_err().to_string().contains("`truth.wind_m_s`"));
        assert!(set("truth.wind_m_s=much").unwrap_err().to_string().contains("truth.wind_m_s"));
        let value = |path| mission_value_of(toml(), &expected, path).and_then(|value| value.as_float());
        assert_eq!(value("truth.wind_m_s"), Some(4.0));
        assert_eq!(value("powered.gimbal_deg"), Some(5.0));
        assert!(value("airframe.mass.loaded_kg").is_some() && value("airframe.nothing").is_none());
    }
}
