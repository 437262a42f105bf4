//! The airframe without its landing motor and with another one, and the text of a mission with another motor, mass and
//! height of the start.
//!
//! A motor is a rod of even mass on the axis that begins at the nozzle: its casing stays, its propellant burns in its
//! middle. Ballast is a point on the axis. So a heavier or longer motor moves mass, centre of gravity and inertia together.

use flight::vehicle::airframe::{Airframe, BadValue, Mass, MassModel};
use flight::vehicle::mission::Mission;
use flight::vehicle::mission::StartPoint;
use flight::vehicle::thrust_curve::ThrustCurve;
use toml::{Table, Value};

/// Why a mission's airframe cannot be taken apart.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FrameError {
    /// The motor is heavier than the vehicle.
    #[error(
        "airframe.mass.loaded_kg is {loaded_kg}; more than the {motor_kg} kg of its motor {motor} is accepted"
    )]
    NothingLeft { loaded_kg: f64, motor: String, motor_kg: f64 },
    /// The motor has more inertia than the vehicle.
    #[error(
        "airframe.mass.loaded_pitch_inertia_kg_m2 is {found}; more than {motors:.5}, which the motor alone has about \
         the centre of gravity, is accepted"
    )]
    Inertia { found: f64, motors: f64 },
}

/// An airframe without its motor.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    loaded: Airframe,
    own_motor: ThrustCurve,
    mass_kg: f64,
    cg_station_m: f64,
    pitch_inertia_kg_m2: f64,
}

/// Mass that is added at a place on the axis; below zero it is taken out there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ballast {
    pub mass_kg: f64,
    /// Height above the nozzle, m.
    pub station_m: f64,
}

impl Frame {
    /// Takes the motor out of a mission's airframe.
    ///
    /// # Errors
    /// The motor is heavier than the vehicle, or has more inertia.
    pub fn of(mission: &Mission) -> Result<Self, FrameError> {
        let (mass, motor) = (&mission.airframe.mass, &mission.motor_curve);
        let motor_kg = motor.total_mass_kg();
        let mass_kg = mass.loaded_kg - motor_kg;
        if mass_kg <= 0.0 {
            let motor = motor.name().to_owned();
            return Err(FrameError::NothingLeft { loaded_kg: mass.loaded_kg, motor, motor_kg });
        }
        let (loaded_cg_m, motor_cg_m) = (mass.loaded_cg_station_m, mass.propellant_station_m);
        let cg_station_m = (mass.loaded_kg * loaded_cg_m - motor_kg * motor_cg_m) / mass_kg;
        // Parallel axes.
        let motors = rod_inertia_kg_m2(motor) + motor_kg * squared(motor_cg_m - loaded_cg_m);
        let left_kg_m2 =
            mass.loaded_pitch_inertia_kg_m2 - motors - mass_kg * squared(cg_station_m - loaded_cg_m);
        if left_kg_m2 <= 0.0 {
            return Err(FrameError::Inertia { found: mass.loaded_pitch_inertia_kg_m2, motors });
        }
        Ok(Self {
            loaded: mission.airframe.clone(),
            own_motor: motor.clone(),
            mass_kg,
            cg_station_m,
            pitch_inertia_kg_m2: left_kg_m2,
        })
    }

    /// Mass without the motor, kg.
    pub fn mass_kg(&self) -> f64 {
        self.mass_kg
    }

    /// Centre of gravity without the motor, m above the nozzle.
    pub fn cg_station_m(&self) -> f64 {
        self.cg_station_m
    }

    /// Diameter of the motor's tube, m: that of the mission's own motor. Thinner motors fit with an adapter, whose mass is
    /// not counted.
    pub fn tube_m(&self) -> f64 {
        self.own_motor.diameter_m()
    }

    /// Masses with a motor and ballast.
    ///
    /// # Errors
    /// The vehicle would not be sound: its centre of gravity below its propellant, say.
    pub fn with(&self, motor: &ThrustCurve, ballast: Ballast) -> Result<Mass, BadValue> {
        if *motor == self.own_motor && ballast.mass_kg == 0.0 {
            // To the bit.
            return Ok(self.loaded.mass);
        }
        let motor_cg_m = if *motor == self.own_motor {
            self.loaded.mass.propellant_station_m
        } else {
            0.5 * motor.length_m()
        };
        let parts = [
            (self.mass_kg, self.cg_station_m, self.pitch_inertia_kg_m2),
            (motor.total_mass_kg(), motor_cg_m, rod_inertia_kg_m2(motor)),
            (ballast.mass_kg, ballast.station_m, 0.0),
        ];
        let loaded_kg: f64 = parts.iter().map(|(mass_kg, ..)| mass_kg).sum();
        let cg_m = parts.iter().map(|(mass_kg, at_m, _)| mass_kg * at_m).sum::<f64>() / loaded_kg;
        let inertia_kg_m2 =
            parts.iter().map(|(mass_kg, at_m, own)| own + mass_kg * squared(at_m - cg_m)).sum();
        let mass = Mass {
            loaded_kg,
            loaded_cg_station_m: cg_m,
            loaded_pitch_inertia_kg_m2: inertia_kg_m2,
            roll_inertia_kg_m2: self.loaded.mass.roll_inertia_kg_m2,
            propellant_station_m: motor_cg_m,
        };
        let mut airframe = Airframe { mass, ..self.loaded.clone() };
        // The ring is moved with the motor's middle.
        airframe.gimbal.pivot_station_m += motor_cg_m - self.loaded.mass.propellant_station_m;
        airframe.validate()?;
        if airframe.gimbal.limit_rad() > airframe.gimbal_clearance_rad(motor) {
            let required = "less, or the motor touches the tube: a shorter or thinner motor";
            return Err(BadValue { key: "gimbal.limit_deg", found: airframe.gimbal.limit_deg, required });
        }
        let propellant_kg = motor.propellant_mass_kg();
        let burnt_out = MassModel::new(&mass, propellant_kg).at(propellant_kg);
        if burnt_out.pitch_inertia_kg_m2 <= 0.0 || burnt_out.mass_kg <= 0.0 {
            return Err(BadValue {
                key: "pitch inertia without propellant, kg m2,",
                found: burnt_out.pitch_inertia_kg_m2,
                required: "above 0",
            });
        }
        Ok(mass)
    }
}

/// About its middle, across the axis, kg m^2.
fn rod_inertia_kg_m2(motor: &ThrustCurve) -> f64 {
    motor.total_mass_kg() * motor.gyration_m2()
}

fn squared(value: f64) -> f64 {
    value * value
}

/// What is different.
#[derive(Debug, Clone, PartialEq)]
pub struct Changes<'a> {
    /// Name of the new mission.
    pub name: &'a str,
    /// Its description in one line.
    pub summary: &'a str,
    /// Name of a built-in motor, or the text of a motor file.
    pub motor: &'a str,
    /// Whether the motor is the one whose lot, and other motors of that name, the mission may know.
    pub keeps_lot: bool,
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
    let airframe = mission.get_mut("airframe").and_then(Value::as_table_mut);
    let airframe = airframe.ok_or(MissionTextError::Missing("airframe"))?;
    let was = airframe.insert("motor".to_owned(), Value::String(changes.motor.to_owned()));
    let mass = airframe.get_mut("mass").and_then(Value::as_table_mut);
    let mass = mass.ok_or(MissionTextError::Missing("airframe.mass"))?;
    if was.as_ref().and_then(Value::as_str) != Some(changes.motor) {
        // It follows from the motor's length.
        mass.remove("propellant_station_m");
    }
    let Mass { loaded_kg, loaded_cg_station_m, loaded_pitch_inertia_kg_m2, .. } = changes.mass;
    for (key, value) in [
        ("loaded_kg", loaded_kg),
        ("loaded_cg_station_m", loaded_cg_station_m),
        ("loaded_pitch_inertia_kg_m2", loaded_pitch_inertia_kg_m2),
    ] {
        mass.insert(key.to_owned(), Value::Float(value));
    }
    mission.insert("name".to_owned(), Value::String(changes.name.to_owned()));
    mission.insert("summary".to_owned(), Value::String(changes.summary.to_owned()));
    if changes.keeps_lot {
        // A weight of the day would replace the mass above.
        let lot = mission.get_mut("lot").and_then(Value::as_table_mut);
        let weighed = lot.and_then(|lot| lot.get_mut("weighed")).and_then(Value::as_table_mut);
        weighed.and_then(|weighed| weighed.remove("vehicle_kg"));
    } else {
        mission.remove("lot");
        mission.remove("other_motors");
    }
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
    use flight::vehicle::thrust_curve::{MotorData, ThrustPoint};

    use super::*;

    fn motor(total_mass_kg: f64, length_m: f64) -> ThrustCurve {
        let points = [(0.0, 0.0), (1.0, 40.0), (2.0, 0.0)];
        ThrustCurve::new(MotorData {
            name: "T".to_owned(),
            manufacturer: String::new(),
            diameter_m: 0.04,
            length_m,
            propellant_mass_kg: 0.1,
            total_mass_kg,
            points: points.map(|(time_s, thrust_n)| ThrustPoint { time_s, thrust_n }).to_vec(),
        })
        .unwrap()
    }

    fn mission() -> Mission {
        let mut mission = flight::vehicles::mission::builtin("mk2").unwrap().unwrap();
        mission.airframe.mass = Mass {
            loaded_kg: 3.0,
            loaded_cg_station_m: 0.5,
            loaded_pitch_inertia_kg_m2: 0.2,
            roll_inertia_kg_m2: 0.006,
            propellant_station_m: 0.1,
        };
        mission.motor_curve = motor(0.5, 0.2);
        // Long motors have room for little, and springs bear any mass.
        mission.airframe.gimbal.limit_deg = 2.0;
        mission.airframe.legs.crush = None;
        mission
    }

    /// 0.5 kg of motor at 0.1 m leave 2.5 kg at (1.5 - 0.05) / 2.5 m with 0.2 - 0.5 (0.04 / 12 + 0.0016 / 16) - 0.5 * 0.16
    /// - 2.5 * 0.0064 kg m2. A motor of 1 kg and 0.4 m and 0.5 kg at 0.7 m make 4 kg at (1.45 + 0.2 + 0.35) / 4 m.
    #[test]
    fn val_hand_another_motor_moves_mass_centre_of_gravity_and_inertia() {
        let frame = Frame::of(&mission()).unwrap();
        assert!((frame.mass_kg() - 2.5).abs() < 1e-12 && (frame.cg_station_m() - 0.58).abs() < 1e-12);
        assert!((frame.pitch_inertia_kg_m2 - 0.102_283_333).abs() < 1e-8, "{frame:?}");
        let mass = frame.with(&motor(1.0, 0.4), Ballast { mass_kg: 0.5, station_m: 0.7 }).unwrap();
        assert!((mass.loaded_kg - 4.0).abs() < 1e-12 && (mass.loaded_cg_station_m - 0.5).abs() < 1e-12);
        // 0.102283 + 2.5 * 0.0064 + (0.16 / 12 + 0.0001) + 0.09 + 0.5 * 0.04
        assert!((mass.loaded_pitch_inertia_kg_m2 - 0.241_716_667).abs() < 1e-8, "{mass:?}");
        assert!((mass.propellant_station_m - 0.2).abs() < 1e-15);
    }

    #[test]
    fn its_own_motor_gives_the_airframe_back_to_the_bit() {
        for (name, _) in flight::vehicles::mission::BUILTIN {
            let mission = flight::vehicles::mission::builtin(name).unwrap().unwrap();
            let frame = Frame::of(&mission).unwrap();
            let none = Ballast { mass_kg: 0.0, station_m: 0.4 };
            assert_eq!(frame.with(&mission.motor_curve, none).unwrap(), mission.airframe.mass, "{name}");
            let some = Ballast { mass_kg: 1e-9, station_m: frame.cg_station_m() };
            let nearly = frame.with(&mission.motor_curve, some).unwrap();
            let apart = nearly.loaded_pitch_inertia_kg_m2 - mission.airframe.mass.loaded_pitch_inertia_kg_m2;
            assert!(apart.abs() < 1e-8, "{name}: {apart}");
        }
    }

    #[test]
    fn a_vehicle_that_cannot_be_is_refused_with_its_value() {
        let mut light = mission();
        light.airframe.mass.loaded_kg = 0.4;
        let error = Frame::of(&light).unwrap_err().to_string();
        assert_eq!(error, "airframe.mass.loaded_kg is 0.4; more than the 0.5 kg of its motor T is accepted");
        let mut thin = mission();
        thin.airframe.mass.loaded_pitch_inertia_kg_m2 = 0.01;
        assert!(Frame::of(&thin).unwrap_err().to_string().contains("kg_m2 is 0.01; more than 0.0817"));
        let frame = Frame::of(&mission()).unwrap();
        let heavy = frame.with(&motor(30.0, 0.6), Ballast { mass_kg: 0.0, station_m: 0.4 });
        assert!(heavy.is_ok_and(|mass| mass.loaded_cg_station_m < 0.33), "nearly all of it is motor");
        let wide = frame.with(&motor(0.5, 1.0), Ballast { mass_kg: 0.0, station_m: 0.4 });
        assert_eq!(wide.unwrap_err().key, "gimbal.limit_deg");
        let tail = frame.with(&motor(0.5, 0.2), Ballast { mass_kg: 40.0, station_m: 0.0 });
        assert_eq!(tail.unwrap_err().key, "mass.propellant_station_m");
    }

    #[test]
    fn a_text_with_the_same_values_is_the_same_mission() {
        for (name, text) in flight::vehicles::mission::BUILTIN {
            let mission = flight::vehicles::mission::from_toml(text, name).unwrap();
            let changes = Changes {
                name: &mission.name,
                summary: &mission.summary,
                motor: &mission.airframe.motor,
                keeps_lot: true,
                mass: mission.airframe.mass,
                start_height_m: mission.start_height_m(),
            };
            let again = changed(text, &changes).unwrap();
            assert_eq!(flight::vehicles::mission::from_toml(&again, name).unwrap(), mission);
            let moved = changed(&again, &Changes { start_height_m: 77.5, ..changes }).unwrap();
            let moved = flight::vehicles::mission::from_toml(&moved, name).unwrap();
            assert!((moved.start_height_m() - 77.5).abs() < 1e-12 && moved.airframe == mission.airframe);
        }
    }

    /// With its own motor a mission keeps what is known of the lot, but not the weight of another ballast; with another one
    /// nothing of it.
    #[test]
    fn a_lot_and_the_other_motors_of_its_name_stay_with_a_motor() {
        let (name, text) = flight::vehicles::mission::BUILTIN[1];
        let lot = "name = \"2609\"\nburns = 3\nimpulse = { mean = 1.02 }\nweighed = { vehicle_kg = 3.65 }";
        let text = format!("{text}\n[lot]\n{lot}\n");
        let mission = flight::vehicles::mission::from_toml(&text, name).unwrap();
        let mass = Mass { loaded_kg: 3.75, ..mission.airframe.mass };
        let changes = Changes {
            name: "x",
            summary: "y",
            motor: &mission.airframe.motor,
            keeps_lot: true,
            mass,
            start_height_m: 300.0,
        };
        let read =
            |changes| flight::vehicles::mission::from_toml(&changed(&text, changes).unwrap(), "x").unwrap();
        let kept = read(&changes);
        assert_eq!((&kept.motor_curve, kept.airframe.mass), (&mission.motor_curve, mass));
        let other = read(&Changes { motor: "G33", keeps_lot: false, ..changes });
        assert!(other.lot.is_none() && other.motor_burns() == 0);
        assert!(kept.other_motors == ["H45W"] && other.other_curves.is_empty());
        assert_eq!(other.motor_curve, flight::vehicles::motors::named("G33").unwrap());
    }

    #[test]
    fn the_text_of_a_motor_file_stays_in_the_mission() {
        let (name, text) = flight::vehicles::mission::BUILTIN[0];
        let mission = flight::vehicles::mission::from_toml(text, name).unwrap();
        let motor = "; it's \"quoted\" \\ and 'so'\nX1 29 93 4-6-8 0.04 0.08 A B\n0.5 30\n2 0\n";
        let changes = Changes {
            name: "x",
            summary: "y",
            motor,
            keeps_lot: false,
            mass: mission.airframe.mass,
            start_height_m: 100.0,
        };
        let again = flight::vehicles::mission::from_toml(&changed(text, &changes).unwrap(), "x").unwrap();
        assert_eq!(again.airframe.motor, motor);
        assert_eq!(again.motor_curve, flight::vehicles::motors::named(motor).unwrap());
        assert_eq!(name_of("mk2", "A B/3.5"), "mk2-a-b-3.5");
        assert!(changed("name = 3", &changes).unwrap_err().to_string().contains("no airframe"));
    }
}
