//! The airframe without its landing motor, and with another one.
//!
//! A motor is a rod of even mass on the axis that begins at the nozzle: its casing stays, its propellant burns in its
//! middle. Ballast is a point on the axis. So a heavier or longer motor moves mass, centre of gravity and inertia together.

use flight::vehicle::airframe::{Airframe, BadValue, Mass, MassModel};
use flight::vehicle::mission::Mission;
use flight::vehicle::thrust_curve::ThrustCurve;

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

    /// The airframe with its own motor.
    pub fn loaded(&self) -> &Airframe {
        &self.loaded
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
        Airframe { mass, ..self.loaded.clone() }.validate()?;
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
    let (length_m, diameter_m) = (motor.length_m(), motor.diameter_m());
    motor.total_mass_kg() * (squared(length_m) / 12.0 + squared(diameter_m) / 16.0)
}

fn squared(value: f64) -> f64 {
    value * value
}
