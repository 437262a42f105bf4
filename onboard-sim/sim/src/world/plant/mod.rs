//! All parts together, one millisecond at a time, or in the air five.
//!
//! In the air a step is one Runge-Kutta step; near the ground it is several. Far from the ground
//! five steps are one (a stride), unless the error of that is too large. Within a step wind,
//! servo angles and masses are constant (masses at mid-step), while thrust and air density follow
//! time and height. The centre of gravity moves through the body while propellant burns; that
//! relative motion (some mm/s) is neglected in the velocities. The exhaust takes angular momentum
//! with it (jet damping: W. T. Thomson, Introduction to Space Dynamics, section 7.7).

mod build;
mod riding;

use flight::computer::pad_check::surfaces_rad;
use flight::rules::verdict::Touchdown;
use flight::vehicle::airframe::{Airframe, MassModel, MassProperties};
use flight::vehicle::atmosphere::{Air, STANDARD_GRAVITY_M_S2};
use flight::vehicle::rigid::RigidState;
use flight::vehicle::site::Site;
use flight::vehicle::thrust_curve::ThrustCurve;
use nalgebra::{Rotation3, Vector3};

pub use self::build::WorldError;
use self::riding::Stack;
use crate::world::aero::{Configuration, Flow, Load, Parachute, Plume, Shape};
use crate::world::body::{Inertia, Loads};
use crate::world::ground::{FirstContact, Ground, Rest, RestOutcome};
use crate::world::hanging::Hanging;
use crate::world::motor::Motor;
use crate::world::servo::{Linkage, Servo};
use crate::world::truth::{Fault, Truth};
use crate::world::wind::Wind;
use crate::world::{STEP_S, body};

/// Below this clearance steps are divided, m. It is more than one step of fall at 40 m/s.
const NEAR_M: f64 = 0.1;
/// Steps of a stride, for which the wind is held constant. A vehicle moves by 0.2 m in it; the
/// shortest gusts are 3 m long.
const STRIDE: usize = 5;
/// Steps of a stride below an open parachute, in which the vehicle moves as far.
pub const LONG_STRIDE: usize = 25;
/// The density is taken as linear within this distance, m: it is wrong by a part in 10^9.
const AIR_M: f64 = 0.5;
/// Number of parts of a step near the ground, the time resolution of the first contact.
const PARTS: usize = 4;

/// The commands of the flight computer.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Actuators {
    /// Gimbal angles (pitch, yaw), rad.
    pub gimbal_rad: [f64; 2],
    /// Opening angles of the four fins, rad.
    pub fins_rad: [f64; 4],
    /// Current through the igniter. A motor switched off before ignition does not ignite.
    pub ignite: bool,
    /// Ejects the parachute; only the first time counts.
    pub parachute: bool,
    /// Current through the igniter of the ascent motor.
    pub ignite_booster: bool,
    /// Fires the charge that separates the booster; only the first time counts.
    pub separate: bool,
}

impl Actuators {
    /// Everything at zero and nothing fired.
    pub const NONE: Self = Self {
        gimbal_rad: [0.0; 2],
        fins_rad: [0.0; 4],
        ignite: false,
        parachute: false,
        ignite_booster: false,
        separate: false,
    };
}

/// One vehicle, its air and its ground.
#[derive(Debug, Clone)]
pub struct World {
    site: Site,
    airframe: Airframe,
    truth: Truth,
    shape: Shape,
    mass_model: MassModel,
    motor: Motor,
    gimbal: [Servo; 2],
    fins: [Servo; 4],
    gimbal_links: [Linkage; 2],
    /// Rates of the gimbal over the step before and the last one, rad/s.
    gimbal_rates_rad_s: [[f64; 2]; 2],
    /// The landing motor as certified: its size and its full mass.
    certified: ThrustCurve,
    fin_links: [Linkage; 4],
    /// The wire of each surface, gimbal first, and whether it is reversed.
    wires: [(usize, bool); 6],
    parachute: Parachute,
    wind: Wind,
    air: AirHere,
    ground: Ground,
    steps: u64,
    state: RigidState,
    /// Landing propellant burnt up to the middle of the last step, kg, and the remaining weight of
    /// the vehicle.
    burnt_kg: f64,
    mass: MassProperties,
    inertial: Inertial,
    touchdown: Option<FirstContact>,
    rest: Option<Rest>,
    /// The booster with all that belongs to it, until it is separated.
    stack: Option<Box<Stack>>,
    separated_s: Option<f64>,
    /// How it hangs, until it is let go.
    hanging: Option<Hanging>,
}

/// Means over the last stride in body axes, as measured by an ideal inertial unit at the centre of
/// gravity.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Inertial {
    /// Steps of the stride.
    pub steps: usize,
    /// Angular rate, rad/s.
    pub rate_rad_s: Vector3<f64>,
    /// Acceleration less gravity, m/s^2.
    pub specific_force_m_s2: Vector3<f64>,
    /// Angular acceleration, rad/s^2.
    pub angular_acceleration_rad_s2: Vector3<f64>,
}

/// The air's density near a height.
#[derive(Debug, Clone, Copy)]
struct AirHere {
    height_m: f64,
    at_height: Air,
}

impl AirHere {
    fn at(site: &Site, height_m: f64) -> Self {
        Self { height_m, at_height: site.air_at_m(height_m) }
    }

    fn follow(&mut self, site: &Site, height_m: f64) {
        if (height_m - self.height_m).abs() > AIR_M {
            *self = Self::at(site, height_m);
        }
    }

    fn density_kg_m3(&self, height_m: f64) -> f64 {
        let Air { density_kg_m3, density_gradient_kg_m4, .. } = self.at_height;
        density_kg_m3 + density_gradient_kg_m4 * (height_m - self.height_m)
    }
}

/// Everything that acts within one part of a step.
struct Acting<'a> {
    shape: &'a Shape,
    configuration: Configuration,
    /// The booster below it, and the body's area, m^2.
    stack: Option<(&'a Stack, f64)>,
    wind_m_s: Vector3<f64>,
    air: AirHere,
    /// Thrust in the middle, N.
    thrust_n: f64,
    thrust_direction: Vector3<f64>,
    thrust_place_m: Vector3<f64>,
    /// Damping of the cross rates per newton of thrust, m s/rad.
    jet_damping_m_s: f64,
    ground: Option<&'a Ground>,
}

impl Loads for Acting<'_> {
    fn load(&self, state: &RigidState, world_from_body: &Rotation3<f64>) -> Load {
        let flow = Flow {
            density_kg_m3: self.air.density_kg_m3(state.position_m.z),
            velocity_m_s: world_from_body.inverse_transform_vector(&(state.velocity_m_s - self.wind_m_s)),
            rate_rad_s: state.rate_rad_s,
        };
        let mut load = self.shape.load(&flow, &self.configuration);
        if let Some((stack, area_m2)) = self.stack {
            stack.add_air(&mut load, &flow, &self.configuration.cg_m, area_m2);
        }
        let thrust_n = self.thrust_n;
        if thrust_n > 0.0 {
            load.add_at(&self.thrust_place_m, &(self.thrust_direction * thrust_n));
            let damping_n_m_s = thrust_n * self.jet_damping_m_s;
            load.moment_n_m.y -= damping_n_m_s * state.rate_rad_s.y;
            load.moment_n_m.z -= damping_n_m_s * state.rate_rad_s.z;
        }
        if let Some(ground) = self.ground {
            ground.add_load(&mut load, state, world_from_body, &self.configuration.cg_m);
        }
        load
    }
}

/// What acts on a vehicle that stands or slides. It hardly moves: within a step the load of air and
/// thrust is constant.
struct OnGround<'a> {
    others: Load,
    ground: &'a Ground,
    cg_m: Vector3<f64>,
}

impl Loads for OnGround<'_> {
    fn load(&self, state: &RigidState, world_from_body: &Rotation3<f64>) -> Load {
        let mut load = self.others;
        self.ground.add_load(&mut load, state, world_from_body, &self.cg_m);
        load
    }
}

impl World {
    /// One step of a millisecond.
    pub fn step(&mut self, actuators: &Actuators) {
        self.stride(actuators, 1);
    }

    /// Advances by several steps with the same commands.
    pub fn advance(&mut self, actuators: &Actuators, steps: usize) {
        let mut left = steps;
        while left > 0 {
            left -= self.stride(actuators, left);
        }
    }

    /// One step, or as many as a stride has where that is possible and not more than allowed.
    /// Returns their number.
    pub fn stride(&mut self, actuators: &Actuators, most: usize) -> usize {
        let wind_changes = self.steps.is_multiple_of(STRIDE as u64);
        let long = most >= LONG_STRIDE && self.parachute.open_share() >= 1.0;
        let may_stride = most >= STRIDE && wind_changes && self.may_stride();
        self.inertial.steps = if !may_stride {
            1
        } else if long {
            LONG_STRIDE
        } else {
            STRIDE
        };
        let (from_s, over_s) = (self.time_s(), STEP_S * self.inertial.steps as f64);
        let airspeed_m_s = self.air_velocity_m_s().norm_squared().sqrt();
        let mut late_rad_s = Vector3::zeros();
        for step in 0..self.inertial.steps {
            let time_s = self.time_s();
            self.command(actuators, time_s);
            self.steps += 1;
            if self.rest.is_some() {
                break;
            }
            if let Some(hanging) = &self.hanging {
                (self.state, self.inertial.specific_force_m_s2) = hanging.at(time_s + STEP_S);
                self.inertial.angular_acceleration_rad_s2 = Vector3::zeros();
                break;
            }
            self.parachute.step(time_s, airspeed_m_s);
            if step == 0 {
                if wind_changes {
                    let over_s = over_s.max(STEP_S * STRIDE as f64);
                    self.wind.step(self.state.position_m.z, airspeed_m_s * over_s);
                }
                self.air.follow(&self.site, self.state.position_m.z);
                self.burnt_kg = self.motor.burnt_kg(from_s + 0.5 * over_s);
                self.mass = self.mass_model.at(self.burnt_kg * self.truth.mass_scale);
            }
            if self.stack.is_none() {
                // Earlier steps of the stride are without it.
                late_rad_s += self.turn_back() * (step as f64 / self.inertial.steps as f64);
            }
            // Servo angles and open parachute of a stride are those in its middle.
            if step == self.inertial.steps / 2 {
                self.move_on(from_s, over_s);
            }
        }
        let half_s = 0.5 * STEP_S * (self.inertial.steps - 1) as f64;
        self.inertial.rate_rad_s =
            self.state.rate_rad_s - self.inertial.angular_acceleration_rad_s2 * half_s - late_rad_s;
        self.inertial.steps
    }

    fn move_on(&mut self, from_s: f64, over_s: f64) {
        if let Some(stack) = self.stack.take() {
            self.ride(*stack, from_s, over_s, self.inertial.steps.min(STRIDE));
            return;
        }
        let near = || self.ground.clearance_m(&self.state, &self.cg_m()) < NEAR_M;
        if self.inertial.steps == 1 && (self.touchdown.is_some() || near()) {
            self.move_near_ground(from_s);
        } else {
            self.move_by(from_s, over_s, self.inertial.steps.min(STRIDE));
        }
    }

    /// Nothing but air is near for a stride, or the vehicle waits on its rail.
    fn may_stride(&self) -> bool {
        if self.rest.is_some() || self.hanging.is_some() || self.touchdown.is_some() {
            return false;
        }
        let speed_m_s = self.state.velocity_m_s.norm_squared().sqrt();
        let room_m = NEAR_M + 2.0 * STEP_S * LONG_STRIDE as f64 * speed_m_s;
        let cg_m = self.cg_m();
        match &self.stack {
            Some(stack) if stack.on_rail() => speed_m_s == 0.0 && !stack.lights(),
            Some(stack) => self.truth.over_ground_m(&stack.lower_end_m(&self.state, &cg_m)) > room_m,
            None => self.ground.clearance_m(&self.state, &cg_m) > room_m,
        }
    }

    /// Injects a fault.
    pub fn inject(&mut self, fault: &Fault) {
        match *fault {
            Fault::NoLight
            | Fault::LateLight { .. }
            | Fault::WeakMotor { .. }
            | Fault::EarlyBurnout { .. } => self.motor.break_down(fault),
            Fault::GimbalStuck => self.gimbal.iter_mut().for_each(Servo::stick),
            Fault::BrownOut { lasts_s } => {
                let steps = libm::round(lasts_s / STEP_S) as u64;
                self.gimbal.iter_mut().chain(&mut self.fins).for_each(|servo| servo.rest(steps));
            }
            Fault::GimbalJams { deg } => self.gimbal[0].jam(deg.to_radians()),
            Fault::GimbalSlow { scale } => self.gimbal.iter_mut().for_each(|servo| servo.slow(scale)),
            Fault::FinStuck { fin } => {
                if let Some(servo) = self.fins.get_mut(fin) {
                    servo.stick();
                }
            }
            Fault::Reversed { surface } => self.wires[surface].1 ^= true,
            Fault::Swapped { surfaces: [one, other] } => self.wires.swap(one, other),
            Fault::AscentNoLight
            | Fault::AscentSelfLights
            | Fault::AscentWeak { .. }
            | Fault::SeparationFails => {
                if let Some(stack) = &mut self.stack {
                    stack.break_down(fault);
                }
            }
            Fault::ParachuteFails => self.parachute.break_down(),
        }
    }

    /// Commands that arrive at the servos, over possibly wrong wires: gimbal (pitch, yaw), fins 1
    /// to 4, rad.
    fn wired_rad(&self, actuators: &Actuators) -> [f64; 6] {
        let told_rad = surfaces_rad(actuators.gimbal_rad, actuators.fins_rad);
        let both_stops_rad = self.airframe.fins.closed_rad() + self.airframe.fins.open_rad();
        core::array::from_fn(|surface| {
            let (wire, reversed) = self.wires[surface];
            let told_rad = told_rad[wire];
            if reversed { if surface < 2 { -told_rad } else { both_stops_rad - told_rad } } else { told_rad }
        })
    }

    fn command(&mut self, actuators: &Actuators, time_s: f64) {
        let before_rad = self.gimbal_rad();
        let powered = self.gimbal.iter().all(Servo::has_power);
        let wired_rad = self.wired_rad(actuators);
        let gimbal = self.gimbal.iter_mut().zip(&mut self.gimbal_links);
        let surfaces = gimbal.chain(self.fins.iter_mut().zip(&mut self.fin_links));
        for ((servo, link), command_rad) in surfaces.zip(wired_rad) {
            servo.step(command_rad);
            link.step(servo.load_rad());
        }
        let now_rad = self.gimbal_rad();
        let rates_rad_s = [0, 1].map(|axis: usize| (now_rad[axis] - before_rad[axis]) / STEP_S);
        self.gimbal_rates_rad_s = [self.gimbal_rates_rad_s[1], rates_rad_s];
        self.motor.current(actuators.ignite && powered, time_s);
        if actuators.parachute && powered {
            self.parachute.eject(time_s);
        }
        if let Some(stack) = &mut self.stack {
            let Actuators { ignite_booster, separate, .. } = *actuators;
            stack.command(ignite_booster && powered, separate && powered, time_s);
        }
    }

    /// Centre of gravity: x its station, y and z its distance from the axis, m. A swinging motor
    /// takes it to the side.
    pub fn cg_m(&self) -> Vector3<f64> {
        let below_pivot_m = self.airframe.gimbal.pivot_station_m - self.airframe.mass.propellant_station_m;
        let aside_m = below_pivot_m * self.motor_kg() / self.mass.mass_kg;
        let [pitch_rad, yaw_rad] = self.gimbal_rad();
        let aside = Vector3::new(0.0, -aside_m * libm::sin(yaw_rad), aside_m * libm::sin(pitch_rad));
        Vector3::new(self.mass.cg_station_m, 0.0, 0.0) + aside + Vector3::from(self.truth.cg_offset_m)
    }

    /// Mass of the landing motor, kg.
    fn motor_kg(&self) -> f64 {
        self.certified.total_mass_kg() - self.burnt_kg
    }

    /// The body turns the other way when the motor begins to swing and when it stops: their common
    /// angular momentum is conserved. Returns the change of the rate, rad/s.
    fn turn_back(&mut self) -> Vector3<f64> {
        let [before_rad_s, now_rad_s] = self.gimbal_rates_rad_s;
        let swinging_kg_m2 =
            self.airframe.swinging_kg_m2(&self.certified, self.motor_kg(), self.mass.cg_station_m);
        let share = swinging_kg_m2 / (self.mass.pitch_inertia_kg_m2 * self.truth.inertia_scale);
        let change = [0, 1].map(|axis: usize| share * (before_rad_s[axis] - now_rad_s[axis]));
        let change_rad_s = Vector3::new(0.0, change[0], change[1]);
        self.state.rate_rad_s += change_rad_s;
        change_rad_s
    }

    /// The exhaust's effect on the drag.
    fn plume(&self, thrust_n: f64, density_kg_m3: f64) -> Plume {
        let pressure_pa = 0.5 * density_kg_m3 * self.air_velocity_m_s().norm_squared();
        Plume::new(&self.truth, thrust_n, pressure_pa * self.airframe.body.reference_area_m2)
    }

    /// Everything that acts in free flight.
    fn acting(&self, from_s: f64, step_s: f64, parts: usize) -> Acting<'_> {
        let cg_m = self.cg_m();
        let [pitch_rad, yaw_rad] = [0, 1]
            .map(|axis: usize| self.gimbal_links[axis].rad() + self.truth.thrust_misalignment_rad[axis]);
        let ((sin_pitch, cos_pitch), (sin_yaw, cos_yaw)) = (libm::sincos(pitch_rad), libm::sincos(yaw_rad));
        let thrust_n = self.motor.mean_thrust_n(from_s, step_s, parts);
        Acting {
            shape: &self.shape,
            configuration: Configuration {
                fin_sines: [0, 1, 2, 3].map(|fin: usize| libm::sin(self.fin_links[fin].rad())),
                legs_out: true,
                parachute_area_m2: self.parachute.drag_area_m2(),
                plume: self.plume(thrust_n, self.air.at_height.density_kg_m3),
                cg_m,
            },
            stack: None,
            wind_m_s: self.wind.now_m_s(),
            air: self.air,
            thrust_n,
            thrust_direction: Vector3::new(cos_pitch * cos_yaw, sin_yaw, -sin_pitch * cos_yaw),
            thrust_place_m: Vector3::new(
                self.airframe.gimbal.pivot_station_m,
                self.truth.thrust_offset_m[0],
                self.truth.thrust_offset_m[1],
            ) - cg_m,
            // The gas leaves at the nozzle, wherever the pivot is.
            jet_damping_m_s: self.motor.flow_kg_n_s() * (cg_m.x * cg_m.x + self.mass.pitch_inertia_slope_m2),
            ground: None,
        }
    }

    fn inertia(&self) -> Inertia {
        Inertia {
            mass_kg: self.mass.mass_kg,
            across_kg_m2: [1.0 + self.truth.inertia_split, 1.0 - self.truth.inertia_split]
                .map(|share| self.mass.pitch_inertia_kg_m2 * self.truth.inertia_scale * share),
            roll_kg_m2: self.mass.roll_inertia_kg_m2 * self.truth.inertia_scale,
            principal_rad: self.truth.principal_axis_rad,
        }
    }

    fn move_by(&mut self, from_s: f64, step_s: f64, parts: usize) {
        let (inertia, acting) = (self.inertia(), self.acting(from_s, step_s, parts));
        let moved = body::rk4_divided(&self.state, &inertia, &acting, STANDARD_GRAVITY_M_S2, step_s, parts);
        self.set_moved(moved, step_s);
    }

    fn set_moved(&mut self, (state, specific_force_m_s2): (RigidState, Vector3<f64>), step_s: f64) {
        self.inertial.angular_acceleration_rad_s2 = (state.rate_rad_s - self.state.rate_rad_s) / step_s;
        self.inertial.specific_force_m_s2 = specific_force_m_s2;
        self.state = state;
    }

    fn move_near_ground(&mut self, from_s: f64) {
        let roll_kg_m2 = self.mass.roll_inertia_kg_m2 * self.truth.inertia_scale;
        let parts = match self.touchdown {
            Some(_) => self.ground.parts(&self.state, roll_kg_m2, STEP_S),
            None => PARTS,
        };
        let part_s = STEP_S / parts as f64;
        let inertia = self.inertia();
        let others = self.touchdown.is_some().then(|| {
            self.acting(from_s, STEP_S, 1).load(&self.state, &self.state.world_from_body.to_rotation_matrix())
        });
        let (mut specific_force, mut angular_acceleration) = (Vector3::zeros(), Vector3::zeros());
        for part in 0..parts {
            let time_s = from_s + part_s * part as f64;
            let before = self.state;
            let ground = &self.ground;
            let step = |acting: &dyn Loads| {
                body::rk4_divided(&before, &inertia, acting, STANDARD_GRAVITY_M_S2, part_s, 1)
            };
            let moved = match others {
                Some(others) => step(&OnGround { others, ground, cg_m: self.cg_m() }),
                None => step(&Acting { ground: Some(ground), ..self.acting(time_s, part_s, 1) }),
            };
            self.set_moved(moved, part_s);
            specific_force += self.inertial.specific_force_m_s2;
            angular_acceleration += self.inertial.angular_acceleration_rad_s2;
            let contact = self.ground.contact(&self.state, &self.cg_m());
            if self.touchdown.is_none() && (contact.feet > 0 || contact.hull) {
                // The last state before contact: within this part the feet have already pushed.
                self.touchdown = Some(self.touchdown_at(time_s, &before));
            }
            if self.touchdown.is_some() {
                self.ground.give_way(&self.state, &self.cg_m());
                let thrust_over_weight = self.motor.thrust_n(time_s) / self.weight_n();
                let outcome = self.ground.outcome(&self.state, contact, thrust_over_weight, part_s);
                if let Some(outcome) = outcome {
                    self.come_to_rest(time_s + part_s, outcome);
                    return;
                }
            }
        }
        self.inertial.specific_force_m_s2 = specific_force / parts as f64;
        self.inertial.angular_acceleration_rad_s2 = angular_acceleration / parts as f64;
    }

    fn touchdown_at(&self, time_s: f64, state: &RigidState) -> FirstContact {
        FirstContact {
            time_s,
            state: *state,
            // The foot that touches the ground has no height.
            over_ground: Touchdown::over_ground(state, 0.0),
            thrust_n: self.motor.thrust_n(time_s),
            weight_n: self.weight_n(),
        }
    }

    /// The vehicle does not move from now on.
    fn come_to_rest(&mut self, time_s: f64, outcome: RestOutcome) {
        let (tilt_rad, strain) = (self.state.tilt_rad(), self.ground.strain());
        self.rest = Some(Rest { time_s, outcome, tilt_rad, strain });
        self.state.velocity_m_s = Vector3::zeros();
        self.state.rate_rad_s = Vector3::zeros();
        self.inertial.angular_acceleration_rad_s2 = Vector3::zeros();
        self.inertial.specific_force_m_s2 = force_at_rest_m_s2(&self.state);
    }
}

/// Accelerometer reading of a vehicle at rest, body axes, m/s^2.
fn force_at_rest_m_s2(state: &RigidState) -> Vector3<f64> {
    state.world_from_body.inverse_transform_vector(&Vector3::new(0.0, 0.0, STANDARD_GRAVITY_M_S2))
}

// Read access to the world.

impl World {
    /// Time since the start, s.
    pub fn time_s(&self) -> f64 {
        self.steps as f64 * STEP_S
    }

    /// Steps since the start.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// The vehicle's state; its position is that of the centre of gravity.
    pub fn state(&self) -> &RigidState {
        &self.state
    }

    /// Height of the feet above the ground as if the vehicle were upright, m; zero at touchdown.
    pub fn height_m(&self) -> f64 {
        self.truth.over_ground_m(&self.state.position_m) - self.cg_above_feet_m()
    }

    /// Distance from the feet up to the centre of gravity, along the axis, m.
    pub fn cg_above_feet_m(&self) -> f64 {
        self.airframe.above_feet_m(self.cg_m().x)
    }

    /// The last stride.
    pub fn inertial(&self) -> &Inertial {
        &self.inertial
    }

    /// Mass, centre of gravity and inertia now.
    pub fn mass(&self) -> &MassProperties {
        &self.mass
    }

    /// Weight now, N.
    pub fn weight_n(&self) -> f64 {
        self.mass.mass_kg * STANDARD_GRAVITY_M_S2
    }

    /// Thrust now, N.
    pub fn thrust_n(&self) -> f64 {
        self.motor.thrust_n(self.time_s())
    }

    /// Time of thrust onset, past or future, s; `None` without current before ignition, and for a
    /// motor that does not ignite.
    pub fn thrust_begins_s(&self) -> Option<f64> {
        self.motor.thrust_begins_s()
    }

    /// Gimbal angles of the nozzle (pitch, yaw) without the thrust's misalignment, rad.
    pub fn gimbal_rad(&self) -> [f64; 2] {
        [0, 1].map(|axis: usize| self.gimbal_links[axis].rad())
    }

    /// Gimbal angles (pitch, yaw) in the servo feedback, rad.
    pub fn gimbal_feedback_rad(&self) -> [f64; 2] {
        [0, 1].map(|axis: usize| self.gimbal[axis].load_rad())
    }

    /// Opening angles of the fins, rad.
    pub fn fins_rad(&self) -> [f64; 4] {
        [0, 1, 2, 3].map(|fin: usize| self.fin_links[fin].rad())
    }

    /// Opening angles of the fins in the servo feedback, rad.
    pub fn fins_feedback_rad(&self) -> [f64; 4] {
        [0, 1, 2, 3].map(|fin: usize| self.fins[fin].load_rad())
    }

    /// The wind of the flight.
    pub fn wind(&self) -> &Wind {
        &self.wind
    }

    /// Wind at the vehicle, gusts included, in the world, m/s.
    pub fn wind_m_s(&self) -> Vector3<f64> {
        self.wind.now_m_s()
    }

    /// Velocity of the centre of gravity through the air, in the world, m/s.
    pub fn air_velocity_m_s(&self) -> Vector3<f64> {
        self.state.velocity_m_s - self.wind.now_m_s()
    }

    /// The air at the vehicle.
    pub fn air(&self) -> Air {
        self.site.air_at_m(self.state.position_m.z)
    }

    /// Whether the wire between booster and vehicle is intact.
    pub fn booster_attached(&self) -> bool {
        self.stack.is_some()
    }

    /// Thrust of the ascent motor now, N.
    pub fn booster_thrust_n(&self) -> f64 {
        self.stack.as_ref().map_or(0.0, |stack| stack.thrust_n(self.time_s()))
    }

    /// The vehicle is without a booster, or the ascent motor burns or has burnt, or will ignite if
    /// the current stays on.
    pub fn leaves_pad(&self) -> bool {
        self.stack.as_ref().is_none_or(|stack| stack.lights())
    }

    /// When the separation charge was fired, s.
    pub fn charge_fired_s(&self) -> Option<f64> {
        self.stack.as_ref().map_or(self.separated_s, |stack| stack.charge_fired_s())
    }

    /// The vehicle hangs below its drone.
    pub fn hangs(&self) -> bool {
        self.hanging.is_some()
    }

    /// The drone lets the vehicle go.
    pub fn release(&mut self) {
        self.hanging = None;
    }

    /// When the parachute was ejected, s.
    pub fn parachute_ejected_s(&self) -> Option<f64> {
        self.parachute.ejected_s()
    }

    /// Height of the ground where a beam backwards along the axis meets it, m; the slope is taken
    /// as small.
    pub fn ground_under_beam_m(&self) -> f64 {
        let (place_m, nose) = (&self.state.position_m, self.state.nose_in_world());
        let per_m = place_m.z / nose.z.max(0.1);
        self.truth.ground_m(place_m.x - nose.x * per_m, place_m.y - nose.y * per_m)
    }

    /// Fraction of the parachute that is open, 0 to 1.
    pub fn parachute_open_share(&self) -> f64 {
        self.parachute.open_share()
    }

    /// The first contact with the ground, if there was one.
    pub fn touchdown(&self) -> Option<&FirstContact> {
        self.touchdown.as_ref()
    }

    /// The rest state, once the vehicle is at rest. From then on only time changes.
    pub fn rest(&self) -> Option<&Rest> {
        self.rest.as_ref()
    }

    /// The vehicle's data.
    pub fn airframe(&self) -> &Airframe {
        &self.airframe
    }

    /// How the true vehicle and the weather differ from the nominal data.
    pub fn truth(&self) -> &Truth {
        &self.truth
    }
}

#[cfg(test)]
mod tests;
