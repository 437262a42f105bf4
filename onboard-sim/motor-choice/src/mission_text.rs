//! The text of a mission with another motor, mass and height of the start.

use flight::vehicle::airframe::Mass;
use flight::vehicle::mission::Mission;
use flight::vehicle::profile::StartPoint;
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

/// Height of the centre of gravity above the pad at which a mission's flight begins, m: at apogee, or where a drone lets go.
pub fn start_height_m(mission: &Mission) -> f64 {
    let dropped = mission.drop.filter(|_| mission.start.at == StartPoint::Drone);
    dropped.map_or(mission.start.height_m, |drop| drop.height_m)
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
    let at = mission.get("start").and_then(|start| start.get("at")).and_then(Value::as_str);
    let section = if at == Some(StartPoint::Drone.name()) { "drop" } else { "start" };
    let start = mission.get_mut(section).and_then(Value::as_table_mut);
    let start = start.ok_or(MissionTextError::Missing(section))?;
    start.insert("height_m".to_owned(), Value::Float(changes.start_height_m));
    Ok(toml::to_string_pretty(&mission)?)
}

/// A name for a mission of its parts: letters, digits, `.` and `-`.
pub fn name_of(mission: &str, motor: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() || c == '.' { c.to_ascii_lowercase() } else { '-' };
    format!("{mission} {motor}").chars().map(plain).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_with_the_same_values_is_the_same_mission() {
        for (name, text) in vehicles::mission::BUILTIN {
            let mission = vehicles::mission::from_toml(text, name).unwrap();
            let changes = Changes {
                name: &mission.name,
                summary: &mission.summary,
                motor: &mission.airframe.motor,
                mass: mission.airframe.mass,
                start_height_m: start_height_m(&mission),
            };
            let again = changed(text, &changes).unwrap();
            assert_eq!(vehicles::mission::from_toml(&again, name).unwrap(), mission);
            let moved = changed(&again, &Changes { start_height_m: 77.5, ..changes }).unwrap();
            let moved = vehicles::mission::from_toml(&moved, name).unwrap();
            assert!((start_height_m(&moved) - 77.5).abs() < 1e-12 && moved.airframe == mission.airframe);
        }
    }

    #[test]
    fn the_text_of_a_motor_file_stays_in_the_mission() {
        let (name, text) = vehicles::mission::BUILTIN[0];
        let mission = vehicles::mission::from_toml(text, name).unwrap();
        let motor = "; it's \"quoted\" \\ and 'so'\nX1 29 93 4-6-8 0.04 0.08 A B\n0.5 30\n2 0\n";
        let changes =
            Changes { name: "x", summary: "y", motor, mass: mission.airframe.mass, start_height_m: 100.0 };
        let again = vehicles::mission::from_toml(&changed(text, &changes).unwrap(), "x").unwrap();
        assert_eq!(again.airframe.motor, motor);
        assert_eq!(again.motor_curve, vehicles::motors::named(motor).unwrap());
        assert_eq!(name_of("mk2", "A B/3.5"), "mk2-a-b-3.5");
        assert!(changed("name = 3", &changes).unwrap_err().to_string().contains("no airframe"));
    }
}
