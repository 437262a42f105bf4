//! The text of a mission with another motor, mass and height of the start.

use flight::vehicle::airframe::Mass;
use toml::{Table, Value};

/// What is different.
#[derive(Debug, Clone, PartialEq)]
pub struct Changes<'a> {
    /// Name of the new mission.
    pub name: &'a str,
    /// Its description in one line.
    pub summary: &'a str,
    /// Name of a built-in motor, or the text of a motor file.
    pub motor: &'a str,
    pub mass: Mass,
    /// Height of the centre of gravity above the pad at which the flight begins, m.
    pub start_height_m: f64,
}

/// Why a text cannot be changed.
#[derive(Debug, thiserror::Error)]
pub enum MissionTextError {
    #[error("the mission is not TOML")]
    Parse(#[from] toml::de::Error),
    #[error("the mission has no {0}; a text that is flown has one")]
    Missing(&'static str),
    #[error("the mission cannot be written")]
    Write(#[from] toml::ser::Error),
}

/// The changed text of a mission. Its airframe is a table in it, and its motor a text, so it needs no other file.
/// Comments are lost.
///
/// # Errors
/// The text is no mission.
pub fn changed(mission_toml: &str, changes: &Changes<'_>) -> Result<String, MissionTextError> {
    let mut mission: Table = mission_toml.parse()?;
    let mut airframe: Table = match mission.remove("airframe") {
        Some(Value::Table(table)) => table,
        Some(Value::String(name)) => vehicles::airframe::builtin_toml(&name)
            .ok_or(MissionTextError::Missing("airframe of that name"))?
            .parse()?,
        _ => return Err(MissionTextError::Missing("airframe")),
    };
    let Mass {
        loaded_kg,
        loaded_cg_station_m,
        loaded_pitch_inertia_kg_m2,
        roll_inertia_kg_m2,
        propellant_station_m,
    } = changes.mass;
    let mass = [
        ("loaded_kg", loaded_kg),
        ("loaded_cg_station_m", loaded_cg_station_m),
        ("loaded_pitch_inertia_kg_m2", loaded_pitch_inertia_kg_m2),
        ("roll_inertia_kg_m2", roll_inertia_kg_m2),
        ("propellant_station_m", propellant_station_m),
    ];
    let mass: Table = mass.into_iter().map(|(key, value)| (key.to_owned(), Value::Float(value))).collect();
    airframe.insert("mass".to_owned(), Value::Table(mass));
    airframe.insert("motor".to_owned(), Value::String(changes.motor.to_owned()));
    mission.insert("airframe".to_owned(), Value::Table(airframe));
    mission.insert("name".to_owned(), Value::String(changes.name.to_owned()));
    mission.insert("summary".to_owned(), Value::String(changes.summary.to_owned()));
    let start = mission.get_mut("start").and_then(Value::as_table_mut);
    let start = start.ok_or(MissionTextError::Missing("start"))?;
    start.insert("height_m".to_owned(), Value::Float(changes.start_height_m));
    Ok(toml::to_string_pretty(&mission)?)
}

/// A name for a mission of its parts: letters, digits, `.` and `-`.
pub fn name_of(mission: &str, motor: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() || c == '.' { c.to_ascii_lowercase() } else { '-' };
    format!("{mission} {motor}").chars().map(plain).collect()
}
