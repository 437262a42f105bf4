//! The airframe without its landing motor, and a mission with another motor or mass.
//!
//! A motor is a rod of even mass on the axis that begins at the nozzle: its casing stays, its
//! propellant burns in its middle. Ballast is a point at the centre of gravity of the rest. So a
//! heavier or longer motor moves mass, centre of gravity and inertia together.

use flight::vehicle::airframe::Mass;
use flight::vehicle::mission::Mission;
use flight::vehicle::thrust_curve::ThrustCurve;
use flight::vehicles::mission::MissionError;
use sim::recipe::Recipe;
use toml_edit::{DocumentMut, Item, TomlError, value};

/// Why a mission's airframe cannot be taken apart, or put together with other parts.
#[derive(Debug, thiserror::Error)]
pub enum FrameError {
    /// The motor has more of it than the vehicle.
    #[error("airframe.mass.{key} is {found}; more than the {motors} of its motor {motor} alone is accepted")]
    NothingLeft { key: &'static str, found: f64, motor: String, motors: f64 },
    #[error("the mission is not TOML")]
    Text(#[from] TomlError),
    /// The vehicle would not be sound.
    #[error(transparent)]
    Mission(#[from] MissionError),
}

/// An airframe without its motor.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    loaded: Mass,
    flown_motor: ThrustCurve,
    mass_kg: f64,
    cg_station_m: f64,
    pitch_inertia_kg_m2: f64,
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
        let refused = |key, found, motors| {
            Err(FrameError::NothingLeft { key, found, motor: motor.name().to_owned(), motors })
        };
        if mass_kg <= 0.0 {
            return refused("loaded_kg", mass.loaded_kg, motor_kg);
        }
        let (loaded_cg_m, motor_cg_m) = (mass.loaded_cg_station_m, mass.propellant_station_m);
        let cg_station_m = (mass.loaded_kg * loaded_cg_m - motor_kg * motor_cg_m) / mass_kg;
        // Parallel axes.
        let motors = rod_inertia_kg_m2(motor) + motor_kg * squared(motor_cg_m - loaded_cg_m);
        let left_kg_m2 =
            mass.loaded_pitch_inertia_kg_m2 - motors - mass_kg * squared(cg_station_m - loaded_cg_m);
        if left_kg_m2 <= 0.0 {
            let motors = libm::round(1e5 * motors) / 1e5;
            return refused("loaded_pitch_inertia_kg_m2", mass.loaded_pitch_inertia_kg_m2, motors);
        }
        let (loaded, flown_motor) = (*mass, motor.clone());
        Ok(Self { loaded, flown_motor, mass_kg, cg_station_m, pitch_inertia_kg_m2: left_kg_m2 })
    }

    /// Masses with a motor and so much ballast, kg; below zero it is taken out.
    pub fn with(&self, motor: &ThrustCurve, ballast_kg: f64) -> Mass {
        let is_same = *motor == self.flown_motor;
        if is_same && ballast_kg == 0.0 {
            // To the bit.
            return self.loaded;
        }
        let motor_cg_m = if is_same { self.loaded.propellant_station_m } else { 0.5 * motor.length_m() };
        let parts = [
            (self.mass_kg + ballast_kg, self.cg_station_m, self.pitch_inertia_kg_m2),
            (motor.total_mass_kg(), motor_cg_m, rod_inertia_kg_m2(motor)),
        ];
        let loaded_kg: f64 = parts.iter().map(|(mass_kg, ..)| mass_kg).sum();
        let cg_m = parts.iter().map(|(mass_kg, at_m, _)| mass_kg * at_m).sum::<f64>() / loaded_kg;
        let inertia_kg_m2 =
            parts.iter().map(|(mass_kg, at_m, own)| own + mass_kg * squared(at_m - cg_m)).sum();
        Mass {
            loaded_kg,
            loaded_cg_station_m: cg_m,
            loaded_pitch_inertia_kg_m2: inertia_kg_m2,
            propellant_station_m: motor_cg_m,
            ..self.loaded
        }
    }
}

/// About its middle, across the axis, kg m^2.
fn rod_inertia_kg_m2(motor: &ThrustCurve) -> f64 {
    motor.total_mass_kg() * motor.gyration_m2()
}

fn squared(value: f64) -> f64 {
    value * value
}

/// A recipe with another mass, and with another motor if `motor`, a built-in name or the text of a
/// motor file, is not the mission's.
///
/// # Errors
/// The reader of missions refuses the vehicle.
pub fn changed(recipe: &Recipe, motor: &str, mass: &Mass) -> Result<Recipe, FrameError> {
    let mut text: DocumentMut = recipe.mission_toml.parse()?;
    let airframe = &mut text["airframe"];
    for (key, found) in [
        ("loaded_kg", mass.loaded_kg),
        ("loaded_cg_station_m", mass.loaded_cg_station_m),
        ("loaded_pitch_inertia_kg_m2", mass.loaded_pitch_inertia_kg_m2),
    ] {
        airframe["mass"][key] = value(found);
    }
    let take = |item: Option<&mut Item>, key| {
        item.and_then(Item::as_table_like_mut).and_then(|table| table.remove(key))
    };
    if motor == recipe.mission.airframe.motor {
        // A weight of the day would replace the mass above.
        take(text.get_mut("lot").and_then(|lot| lot.get_mut("weighed")), "vehicle_kg");
    } else {
        airframe["motor"] = value(motor);
        // It follows from the motor's length.
        take(airframe.get_mut("mass"), "propellant_station_m");
        text.remove("lot");
        text.remove("other_motor");
    }
    Ok(recipe.clone().with_mission(text.to_string())?)
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

    /// 0.5 kg of motor at 0.1 m leave 2.5 kg at (1.5 - 0.05) / 2.5 m with 0.2 - 0.5 (0.04 / 12 +
    /// 0.0016 / 16) - 0.5 * 0.16
    /// - 2.5 * 0.0064 kg m2. A motor of 1 kg and 0.4 m and 0.5 kg at 0.58 m make 4 kg at (1.45 +
    ///   0.2 + 0.29) / 4 m.
    #[test]
    fn val_hand_another_motor_moves_mass_centre_of_gravity_and_inertia() {
        let frame = Frame::of(&mission()).unwrap();
        assert!((frame.mass_kg - 2.5).abs() < 1e-12 && (frame.cg_station_m - 0.58).abs() < 1e-12);
        assert!((frame.pitch_inertia_kg_m2 - 0.102_283_333).abs() < 1e-8, "{frame:?}");
        let mass = frame.with(&motor(1.0, 0.4), 0.5);
        assert!((mass.loaded_kg - 4.0).abs() < 1e-12 && (mass.loaded_cg_station_m - 0.485).abs() < 1e-12);
        // 0.102283 + 3 * 0.009025 + (0.16 / 12 + 0.0001) + 0.081225
        assert!((mass.loaded_pitch_inertia_kg_m2 - 0.224_016_667).abs() < 1e-8, "{mass:?}");
        assert!((mass.propellant_station_m - 0.2).abs() < 1e-15);
    }

    #[test]
    fn the_flown_motor_restores_the_airframe_to_the_bit() {
        for (name, _) in flight::vehicles::mission::BUILTIN {
            let mission = flight::vehicles::mission::builtin(name).unwrap().unwrap();
            let frame = Frame::of(&mission).unwrap();
            assert_eq!(frame.with(&mission.motor_curve, 0.0), mission.airframe.mass, "{name}");
            let nearly = frame.with(&mission.motor_curve, 1e-9);
            let apart = nearly.loaded_pitch_inertia_kg_m2 - mission.airframe.mass.loaded_pitch_inertia_kg_m2;
            assert!(apart.abs() < 1e-8, "{name}: {apart}");
        }
    }

    #[test]
    fn a_vehicle_that_cannot_be_is_refused_with_its_value() {
        let mut light = mission();
        light.airframe.mass.loaded_kg = 0.4;
        let error = Frame::of(&light).unwrap_err().to_string();
        assert_eq!(
            error,
            "airframe.mass.loaded_kg is 0.4; more than the 0.5 of its motor T alone is accepted"
        );
        let mut thin = mission();
        thin.airframe.mass.loaded_pitch_inertia_kg_m2 = 0.01;
        assert!(Frame::of(&thin).unwrap_err().to_string().contains("kg_m2 is 0.01; more than the 0.0817"));
    }

    fn recipe(name: &str, more: &str) -> Recipe {
        let recipe = Recipe::built_in(name, "none").unwrap();
        let text = recipe.mission_toml.clone() + more;
        Recipe::from_texts((name, &text), ("none", &recipe.dispersion_toml)).unwrap()
    }

    #[test]
    fn a_text_with_the_same_values_is_the_same_mission() {
        for (name, _) in flight::vehicles::mission::BUILTIN {
            let recipe = recipe(name, "");
            let airframe = &recipe.mission.airframe;
            let again = changed(&recipe, &airframe.motor, &airframe.mass).unwrap();
            assert_eq!(again.mission, recipe.mission);
        }
    }

    /// With the flown motor a mission retains the lot's measurements, but not the weight of another
    /// ballast; with another motor neither.
    #[test]
    fn a_lot_and_the_other_motor_of_its_name_stay_with_a_motor() {
        let lot = "name = \"2609\"\nburns = 3\nimpulse = { mean = 1.02 }\nweighed = { vehicle_kg = 3.65 }";
        let recipe = recipe("mk3", &format!("\n[lot]\n{lot}\n"));
        let mass = Mass { loaded_kg: 3.75, ..recipe.mission.airframe.mass };
        let read = |motor: &str| changed(&recipe, motor, &mass).unwrap().mission;
        let same = read(&recipe.mission.airframe.motor);
        assert_eq!((&same.motor_curve, same.airframe.mass), (&recipe.mission.motor_curve, mass));
        let other = read("G33");
        assert!(other.lot.is_none() && other.motor_burns() == 0);
        assert!(same.other_motor.as_deref() == Some("H45W") && other.other_curve.is_none());
        assert_eq!(other.motor_curve, flight::vehicles::motors::named("G33").unwrap());
    }

    #[test]
    fn the_text_of_a_motor_file_stays_in_the_mission_and_what_is_not_sound_is_refused() {
        let recipe = recipe("mk3", "");
        let motor = "; it's \"quoted\" \\ and 'so'\nX1 29 93 4-6-8 0.04 0.08 A B\n0.5 30\n2 0\n";
        let mass = recipe.mission.airframe.mass;
        let again = changed(&recipe, motor, &mass).unwrap().mission;
        assert_eq!(again.airframe.motor, motor);
        assert_eq!(again.motor_curve, flight::vehicles::motors::named(motor).unwrap());
        let long = motor.replace("29 93", "38 900");
        let error = changed(&recipe, &long, &mass).unwrap_err().to_string();
        assert!(error.contains("airframe.mass.propellant_station_m = 0.45"), "{error}");
    }
}
