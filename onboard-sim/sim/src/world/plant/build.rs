//! Builds a world from data, refuses data that make no sense, and changes the vehicle or the
//! weather in the middle of a flight.

use core::f64::consts::FRAC_PI_2;

use flight::vehicle::airframe::{Airframe, BadValue, MassModel, Servo as ServoData};
use flight::vehicle::launch::Launch;
use flight::vehicle::rigid::RigidState;
use flight::vehicle::site::Site;
use flight::vehicle::thrust_curve::ThrustCurve;
use nalgebra::{UnitQuaternion, Vector3};

use super::riding::Stack;
use super::{AirHere, Inertial, World, force_at_rest_m_s2};
use crate::world::aero::{Parachute, Shape};
use crate::world::ground::Ground;
use crate::world::hanging::Hanging;
use crate::world::motor::Motor;
use crate::world::numbers;
use crate::world::servo::{Linkage, Servo};
use crate::world::truth::{AscentTruth, SHAPE_MOST, Truth};
use crate::world::wind::Wind;
use crate::world::wind::aloft::WindsAloft;

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
        key: String,
        found: f64,
        required: String,
    },
    /// The initial state is not finite, or its attitude is not a rotation.
    #[error("the initial state is {0}; finite numbers and a unit attitude are accepted")]
    State(String),
}

impl World {
    /// A world at the start of a flight: fins closed, gimbal centred, motor full, parachute stowed,
    /// gusts from a seed.
    ///
    /// # Errors
    ///
    /// [`WorldError`] names the value that is not accepted.
    pub fn new(
        site: &Site,
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
            site: *site,
            shape: Shape::new(airframe, truth),
            motor: Motor::new(motor, truth),
            gimbal: [gimbal(), gimbal()],
            fins: fins_at(airframe, airframe.fins.closed_rad()),
            gimbal_links: core::array::from_fn(|_| {
                let far_rad = limit_rad * truth.gimbal_gain.max(1.0);
                Linkage::new(truth.gimbal_gain, 0.0, truth.gimbal_slop_rad, (-far_rad, far_rad), 0.0)
            }),
            fin_links: fin_links_at(airframe, truth, airframe.fins.closed_rad()),
            gimbal_rates_rad_s: [[0.0; 2]; 2],
            certified: motor.clone(),
            wires: core::array::from_fn(|surface| (surface, false)),
            parachute: Parachute::new(&airframe.parachute),
            air: AirHere::at(site, initial.position_m.z),
            wind: Wind::new(truth.wind_m_s, truth.wind_towards_rad, truth.gust_scale, seed)
                .over_height(truth.wind_exponent, truth.wind_veer_rad_m),
            ground: Ground::new(airframe, truth.ground_rise),
            steps: 0,
            state: *initial,
            burnt_kg: 0.0,
            mass: mass_model.at(0.0),
            mass_model,
            inertial: Inertial { steps: 1, ..Inertial::default() },
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

    /// The same world with a mean wind from a table over height, if there is one.
    #[must_use]
    pub fn with_winds_aloft(mut self, winds: Option<&WindsAloft>) -> Self {
        if winds.is_some() {
            self.wind = self.wind.with_aloft(winds);
            self.wind.step(self.state.position_m.z, 0.0);
        }
        self
    }

    /// The same world with the vehicle on its booster, at rest on the rail, whose foot is on the
    /// ground.
    #[must_use]
    pub fn on_rail(mut self, launch: &Launch, truth: &AscentTruth) -> Self {
        let [about_x, about_y] = truth.rail_lean_rad;
        let lean = UnitQuaternion::from_scaled_axis(Vector3::new(about_x, about_y, 0.0));
        let (standing, foot_m) = (launch.standing(self.cg_m().x), launch.rail.foot_m());
        let ground_m = Vector3::z() * self.truth.ground_m(foot_m.x, foot_m.y);
        self.state = RigidState {
            position_m: foot_m + ground_m + lean * (standing.position_m - foot_m),
            world_from_body: lean * standing.world_from_body,
            ..standing
        };
        self.inertial.specific_force_m_s2 = force_at_rest_m_s2(&self.state);
        self.stack = Some(Box::new(Stack::new(launch, truth)));
        self
    }

    /// The same world with the vehicle below a drone.
    #[must_use]
    pub fn hanging(mut self, hanging: Hanging) -> Self {
        (self.state, self.inertial.specific_force_m_s2) = hanging.at(0.0);
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

/// Accepted values of a truth; any finite number for the others.
const ACCEPTED: [([f64; 2], &[&str]); 12] = [
    ([0.1, 10.0], &["impulse_scale", "burn_time_scale", "mass_scale", "inertia_scale", "gimbal_gain"]),
    ([0.0, 10.0], &["drag_scale", "gust_scale", "body_drag_scale", "fin_drag_scale", "crossflow_scale"]),
    ([0.0, 60.0], &["ignition_delay_s", "wind_m_s"]),
    ([0.0, 5.0], &["chuff_s", "thrust_rise_s"]),
    ([0.0, 1.0], &["wind_exponent"]),
    ([0.0, 0.5], &["gimbal_slop_rad", "fin_slop_rad"]),
    ([-0.05, 0.05], &["wind_veer_rad_m"]),
    ([-0.1, 0.1], &["thrust_offset_m", "cg_offset_m"]),
    ([-SHAPE_MOST, SHAPE_MOST], &["thrust_shape"]),
    ([-0.3, 0.3], &["ground_rise"]),
    ([-0.5, 0.5], &["fin_offset_rad", "principal_axis_rad", "thrust_misalignment_rad"]),
    ([-1.0, 1.0], &["plume_body_loss", "plume_fin_loss"]),
];

fn check(truth: &Truth) -> Result<(), WorldError> {
    for (key, found) in numbers(truth) {
        let range = ACCEPTED.iter().find(|(_, keys)| keys.contains(&key.as_str()));
        let [least, most] = range.map_or([f64::MIN, f64::MAX], |(range, _)| *range);
        if !(least..=most).contains(&found) {
            let required = range.map_or("a finite number".into(), |_| format!("{least} to {most}"));
            return Err(WorldError::Truth { key, found, required });
        }
    }
    Ok(())
}

// Changes in the middle of a flight.

impl World {
    /// The same moment of the same flight, with another airframe, motor or truth from now on.
    ///
    /// State, time, servo angles, past commands and faults stay. The gusts continue with the new
    /// strength, and a burning motor continues on the new curve at the same time. If nothing
    /// changes, the flight continues with the same bits.
    ///
    /// # Errors
    /// As [`World::new`].
    pub fn changed(
        &self,
        airframe: &Airframe,
        motor: &ThrustCurve,
        truth: &Truth,
    ) -> Result<Self, WorldError> {
        let other = Self::new(&self.site, airframe, motor, truth, &self.state, 0)?;
        let servo = |here: &Servo, before: &ServoData, after: &Servo| here.changed(before, after);
        let gimbal_data = &self.airframe.gimbal.servo;
        let fin_data = &self.airframe.fins.servo;
        Ok(Self {
            motor: self.motor.changed(&other.motor, &self.truth),
            gimbal: core::array::from_fn(|axis| servo(&self.gimbal[axis], gimbal_data, &other.gimbal[axis])),
            fins: core::array::from_fn(|fin| servo(&self.fins[fin], fin_data, &other.fins[fin])),
            gimbal_links: core::array::from_fn(|axis| {
                self.gimbal_links[axis].changed(&other.gimbal_links[axis])
            }),
            fin_links: core::array::from_fn(|fin| self.fin_links[fin].changed(&other.fin_links[fin])),
            wind: self.wind.changed(&other.wind),
            mass: other.mass_model.at(self.burnt_kg * truth.mass_scale),
            airframe: other.airframe,
            truth: other.truth,
            shape: other.shape,
            mass_model: other.mass_model,
            certified: other.certified,
            ground: other.ground,
            ..self.clone()
        })
    }
}

#[cfg(test)]
mod tests {
    use flight::vehicles::motors;

    use super::*;
    use crate::world::{Actuators, Fault};

    const IGNITED: Actuators =
        Actuators { gimbal_rad: [0.02, -0.01], fins_rad: [0.4; 4], ignite: true, ..Actuators::NONE };

    /// A key that no truth has would accept anything.
    #[test]
    fn every_key_with_a_range_is_one_of_a_truth() {
        let known = numbers(&Truth::default());
        for key in ACCEPTED.iter().flat_map(|(_, keys)| keys.iter()) {
            assert!(known.iter().any(|(name, _)| name == key), "{key}");
        }
    }

    fn airframe() -> Airframe {
        flight::vehicles::mission::builtin_airframe("mk2").unwrap()
    }

    /// Half a second into its burn, with a weakened motor and a slow gimbal, in wind.
    fn burning() -> World {
        let airframe = airframe();
        let motor = motors::builtin(&airframe.motor).unwrap();
        let truth = Truth { wind_m_s: 4.0, impulse_scale: 1.03, ..Truth::default() };
        let mut world =
            World::new(&Site::default(), &airframe, &motor, &truth, &RigidState::upright(80.0), 7).unwrap();
        world.inject(&Fault::WeakMotor { scale: 0.9 });
        world.inject(&Fault::LateLight { delay_s: 0.05 });
        world.inject(&Fault::GimbalSlow { scale: 0.3 });
        world.advance(&IGNITED, 700);
        world
    }

    #[test]
    fn a_change_that_does_not_act_continues_the_flight_bit_for_bit() {
        // Legs act on the ground only. The gimbal swings at the change.
        let mut slippery = airframe();
        slippery.legs.friction_coefficient *= 0.5;
        let swung = Actuators { gimbal_rad: [-0.06, 0.05], ..IGNITED };
        for airframe in [airframe(), slippery] {
            let mut world = burning();
            (0..25).for_each(|_| world.step(&swung));
            let motor = motors::builtin(&airframe.motor).unwrap();
            let mut same = world.changed(&airframe, &motor, world.truth()).unwrap();
            assert_eq!(same.thrust_n().to_bits(), world.thrust_n().to_bits());
            for _ in 0..300 {
                world.step(&swung);
                same.step(&swung);
                assert_eq!(format!("{:?}", same.state()), format!("{:?}", world.state()));
            }
            assert_eq!(same.time_s().to_bits(), world.time_s().to_bits());
        }
    }

    #[test]
    fn another_motor_and_another_wind_act_at_once() {
        let world = burning();
        let motor = motors::builtin(&world.airframe().motor).unwrap();
        let weaker = Truth { impulse_scale: 0.5 * world.truth().impulse_scale, ..*world.truth() };
        let changed = world.changed(world.airframe(), &motor, &weaker).unwrap();
        assert_eq!(changed.state(), world.state());
        assert!((changed.thrust_n() / world.thrust_n() - 0.5).abs() < 1e-12, "the fault counts as before");
        let calm = Truth { wind_m_s: 0.0, ..*world.truth() };
        let mut changed = world.changed(world.airframe(), &motor, &calm).unwrap();
        changed.step(&IGNITED);
        assert!(changed.wind_m_s().norm() < 1e-300);
        let other = motors::builtin("G33").unwrap();
        let changed = world.changed(world.airframe(), &other, world.truth()).unwrap();
        let since_s = world.time_s() - world.thrust_begins_s().unwrap();
        assert!((changed.thrust_n() - 0.9 * 1.03 * other.thrust_at_n(since_s)).abs() < 1e-9);
        for wrong in [
            Truth { wind_m_s: -1.0, ..weaker },
            Truth { thrust_rise_s: -1.0, ..weaker },
            Truth { chuff_s: [0.1, f64::NAN], ..weaker },
            Truth { principal_axis_rad: [0.0, 2.0], ..weaker },
        ] {
            assert!(world.changed(world.airframe(), &motor, &wrong).is_err(), "{wrong:?}");
        }
    }
}
