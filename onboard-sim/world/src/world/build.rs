//! Builds a world from data, and refuses data that make no sense.

use core::f64::consts::FRAC_PI_2;

use flight::vehicle::airframe::BadValue;
use flight::vehicle::airframe::{Airframe, MassModel};
use flight::vehicle::atmosphere::STANDARD_GRAVITY_M_S2;
use flight::vehicle::launch::Launch;
use flight::vehicle::rigid::RigidState;
use flight::vehicle::thrust_curve::ThrustCurve;
use nalgebra::{UnitQuaternion, Vector3};

use super::World;
use crate::aero::Shape;
use crate::ground::Ground;
use crate::hanging::Hanging;
use crate::linkage::Linkage;
use crate::motor::Motor;
use crate::parachute::Parachute;
use crate::servo::Servo;
use crate::stack::Stack;
use crate::truth::{AscentTruth, SHAPE_MOST, Truth};
use crate::wind::Wind;

/// Why no world can be built from the data.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum WorldError {
    /// The airframe is not sound.
    #[error("airframe")]
    Airframe(#[from] BadValue),
    /// The motor does not fit the airframe.
    #[error(
        "motor {motor} has {propellant_kg} kg of propellant; with it the airframe's mass of {loaded_kg} kg and its inertia \
         leave nothing for the rest of the vehicle"
    )]
    Motor {
        /// The motor's name.
        motor: String,
        propellant_kg: f64,
        /// The airframe's loaded mass, kg.
        loaded_kg: f64,
    },
    /// A true parameter is outside its range.
    #[error("truth.{key} is {found}; {required} is accepted")]
    Truth {
        /// The parameter.
        key: &'static str,
        found: f64,
        required: &'static str,
    },
    /// The initial state is not finite, or its attitude is not a rotation.
    #[error("the initial state is {0}; finite numbers and a unit attitude are accepted")]
    State(String),
}

impl World {
    /// A world at the start of a flight: fins closed, gimbal centred, motor full, parachute stowed, gusts from a seed.
    ///
    /// # Errors
    ///
    /// [`WorldError`] names the value that is not accepted.
    pub fn new(
        airframe: &Airframe,
        motor: &ThrustCurve,
        truth: &Truth,
        initial: &RigidState,
        seed: u64,
    ) -> Result<Self, WorldError> {
        airframe.validate()?;
        check(truth)?;
        check_state(initial)?;
        let mass_model = MassModel::new(&airframe.mass, motor.propellant_mass_kg()).scaled(truth.mass_scale);
        let empty = mass_model.at(f64::INFINITY);
        if !(mass_model.dry_mass_kg() > 0.0 && empty.pitch_inertia_kg_m2 > 0.0) {
            return Err(WorldError::Motor {
                motor: motor.name().to_owned(),
                propellant_kg: motor.propellant_mass_kg(),
                loaded_kg: airframe.mass.loaded_kg,
            });
        }
        let limit_rad = airframe.gimbal.limit_rad();
        let gimbal = || Servo::new(&airframe.gimbal.servo, (-limit_rad, limit_rad), 0.0);
        let mut world = Self {
            shape: Shape::new(airframe, truth),
            motor: Motor::new(motor, truth),
            gimbal: [gimbal(), gimbal()],
            fins: fins_at(airframe, airframe.fins.closed_rad()),
            gimbal_links: core::array::from_fn(|_| {
                let far_rad = limit_rad * truth.gimbal_gain.max(1.0);
                Linkage::new(truth.gimbal_gain, 0.0, truth.gimbal_slop_rad, (-far_rad, far_rad), 0.0)
            }),
            fin_links: fin_links_at(airframe, truth, airframe.fins.closed_rad()),
            parachute: Parachute::new(&airframe.parachute),
            wind: Wind::new(truth.wind_m_s, truth.wind_towards_rad, truth.gust_scale, seed)
                .over_height(truth.wind_exponent, truth.wind_veer_rad_m),
            ground: Ground::new(airframe, truth.ground_rise),
            steps: 0,
            state: *initial,
            mass: mass_model.at(0.0),
            mass_model,
            specific_force_m_s2: Vector3::zeros(),
            angular_acceleration_rad_s2: Vector3::zeros(),
            touchdown: None,
            rest: None,
            stack: None,
            separated_s: None,
            hanging: None,
            airframe: airframe.clone(),
            truth: *truth,
        };
        world.wind.step(initial.position_m.z, 0.0);
        Ok(world)
    }

    /// The same world with the vehicle on its booster, at rest on the rail.
    #[must_use]
    pub fn on_rail(mut self, launch: &Launch, truth: &AscentTruth) -> Self {
        let [about_x, about_y] = truth.rail_lean_rad;
        let lean = UnitQuaternion::from_scaled_axis(Vector3::new(about_x, about_y, 0.0));
        let standing = launch.standing(self.cg_m().x);
        self.state = RigidState {
            position_m: lean * standing.position_m,
            world_from_body: lean * standing.world_from_body,
            ..standing
        };
        self.specific_force_m_s2 = self.state.world_from_body.inverse_transform_vector(&Vector3::new(
            0.0,
            0.0,
            STANDARD_GRAVITY_M_S2,
        ));
        self.stack = Some(Box::new(Stack::new(launch, truth)));
        self
    }

    /// The same world with the vehicle below a drone.
    #[must_use]
    pub fn hanging(mut self, hanging: Hanging) -> Self {
        (self.state, self.specific_force_m_s2) = hanging.at(0.0);
        self.hanging = Some(hanging);
        self
    }

    /// The same world with the fins already at an opening angle, rad, held between their stops.
    #[must_use]
    pub fn with_fins_at(mut self, opening_rad: f64) -> Self {
        self.fins = fins_at(&self.airframe, opening_rad);
        self.fin_links = fin_links_at(&self.airframe, &self.truth, opening_rad);
        self
    }
}

fn fin_links_at(airframe: &Airframe, truth: &Truth, opening_rad: f64) -> [Linkage; 4] {
    let stops_rad = (airframe.fins.closed_rad(), FRAC_PI_2.max(airframe.fins.open_rad()));
    let at_rad = opening_rad.clamp(airframe.fins.closed_rad(), airframe.fins.open_rad());
    truth
        .fin_offset_rad
        .map(|offset_rad| Linkage::new(1.0, offset_rad, truth.fin_slop_rad, stops_rad, at_rad))
}

fn fins_at(airframe: &Airframe, opening_rad: f64) -> [Servo; 4] {
    let stops_rad = (airframe.fins.closed_rad(), airframe.fins.open_rad());
    core::array::from_fn(|_| Servo::new(&airframe.fins.servo, stops_rad, opening_rad))
}

/// Checks that a state is finite and its attitude a rotation.
pub(super) fn check_state(state: &RigidState) -> Result<(), WorldError> {
    if !state.is_finite() || (state.world_from_body.coords.norm_squared() - 1.0).abs() > 1e-6 {
        return Err(WorldError::State(format!("{state:?}")));
    }
    Ok(())
}

fn check(truth: &Truth) -> Result<(), WorldError> {
    let refuse = |key, found, required| Err(WorldError::Truth { key, found, required });
    for (key, value) in [
        ("impulse_scale", truth.impulse_scale),
        ("burn_time_scale", truth.burn_time_scale),
        ("mass_scale", truth.mass_scale),
        ("inertia_scale", truth.inertia_scale),
        ("gimbal_gain", truth.gimbal_gain),
    ] {
        if !(0.1..=10.0).contains(&value) {
            return refuse(key, value, "0.1 to 10");
        }
    }
    for (key, value) in [
        ("drag_scale", truth.drag_scale),
        ("gust_scale", truth.gust_scale),
        ("body_drag_scale", truth.body_drag_scale),
        ("fin_drag_scale", truth.fin_drag_scale),
        ("crossflow_scale", truth.crossflow_scale),
    ] {
        if !(0.0..=10.0).contains(&value) {
            return refuse(key, value, "0 to 10");
        }
    }
    if !(0.0..=60.0).contains(&truth.ignition_delay_s) {
        return refuse("ignition_delay_s", truth.ignition_delay_s, "0 to 60");
    }
    if !(0.0..=60.0).contains(&truth.wind_m_s) {
        return refuse("wind_m_s", truth.wind_m_s, "0 to 60");
    }
    if !truth.wind_towards_rad.is_finite() {
        return refuse("wind_towards_rad", truth.wind_towards_rad, "a finite number");
    }
    for (key, value) in [("plume_body_loss", truth.plume_body_loss), ("plume_fin_loss", truth.plume_fin_loss)]
    {
        if !(-1.0..=1.0).contains(&value) {
            return refuse(key, value, "-1 to 1");
        }
    }
    for (key, value) in [("gimbal_slop_rad", truth.gimbal_slop_rad), ("fin_slop_rad", truth.fin_slop_rad)] {
        if !(0.0..=0.5).contains(&value) {
            return refuse(key, value, "0 to 0.5");
        }
    }
    if !(0.0..=1.0).contains(&truth.wind_exponent) {
        return refuse("wind_exponent", truth.wind_exponent, "0 to 1");
    }
    if !(-0.05..=0.05).contains(&truth.wind_veer_rad_m) {
        return refuse("wind_veer_rad_m", truth.wind_veer_rad_m, "-0.05 to 0.05");
    }
    for value in truth.thrust_shape {
        if value.is_nan() || value.abs() > SHAPE_MOST {
            return refuse("thrust_shape", value, "-0.19 to 0.19");
        }
    }
    for value in truth.fin_offset_rad {
        if !(-0.5..=0.5).contains(&value) {
            return refuse("fin_offset_rad", value, "-0.5 to 0.5");
        }
    }
    for value in truth.ground_rise {
        if !(-0.3..=0.3).contains(&value) {
            return refuse("ground_rise", value, "-0.3 to 0.3");
        }
    }
    for value in truth.thrust_misalignment_rad {
        if !(-0.5..=0.5).contains(&value) {
            return refuse("thrust_misalignment_rad", value, "-0.5 to 0.5");
        }
    }
    for (key, value) in truth
        .thrust_offset_m
        .iter()
        .map(|value| ("thrust_offset_m", *value))
        .chain(truth.cg_offset_m.iter().map(|value| ("cg_offset_m", *value)))
    {
        if !(-0.1..=0.1).contains(&value) {
            return refuse(key, value, "-0.1 to 0.1");
        }
    }
    Ok(())
}
