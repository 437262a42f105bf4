//! The ascent: on the rail, under the ascent motor, and coasting until the booster is separated.
//!
//! The state of the world is always the vehicle's. In each step the motion of the stack's centre of
//! gravity follows from it, and it from that motion. The centre moves through the body while
//! propellant burns; that relative motion (some cm/s) is neglected.

use flight::vehicle::airframe::MassProperties;
use flight::vehicle::atmosphere::STANDARD_GRAVITY_M_S2;
use flight::vehicle::launch::{Booster, Launch, NormalForce};
use flight::vehicle::rigid::RigidState;
use nalgebra::Vector3;

use super::{Acting, World};
use crate::world::aero::{Configuration, Flow, Load, Plume};
use crate::world::body::{self, Inertia, Loads as _};
use crate::world::ground::RestOutcome;
use crate::world::motor::Motor;
use crate::world::truth::{AscentTruth, Fault, Truth};

/// The state of another point of the body, at an offset in body axes, m.
fn at_offset(state: &RigidState, offset_m: &Vector3<f64>) -> RigidState {
    RigidState {
        position_m: state.position_m + state.world_from_body * offset_m,
        velocity_m_s: state.velocity_m_s + state.world_from_body * state.rate_rad_s.cross(offset_m),
        ..*state
    }
}

/// A step along the rail: the state afterwards and the specific force, body axes, m/s^2.
fn guided(
    stack: &mut Stack,
    before: &RigidState,
    load: &Load,
    mass_kg: f64,
    step_s: f64,
) -> (RigidState, Vector3<f64>) {
    let along = before.nose_in_world();
    let pushed_m_s2 = load.force_n.x / mass_kg - STANDARD_GRAVITY_M_S2 * along.z;
    let speed_m_s = before.velocity_m_s.dot(&along);
    let next_m_s = stack.slide(speed_m_s, pushed_m_s2, step_s);
    let after = RigidState {
        position_m: before.position_m + along * (0.5 * (speed_m_s + next_m_s) * step_s),
        velocity_m_s: along * next_m_s,
        ..*before
    };
    let acceleration_m_s2 = along * ((next_m_s - speed_m_s) / step_s);
    let felt_m_s2 = acceleration_m_s2 + Vector3::z() * STANDARD_GRAVITY_M_S2;
    (after, before.world_from_body.inverse_transform_vector(&felt_m_s2))
}

impl World {
    /// One step with the booster. `stack` is taken out of the world.
    pub(super) fn ride(&mut self, mut stack: Stack, time_s: f64, step_s: f64, parts: usize) {
        let cg_m = self.cg_m();
        let mass = stack.mass(&self.mass, &cg_m, time_s + 0.5 * step_s);
        let from_stack_m = cg_m - mass.cg_m;
        let before = at_offset(&self.state, &-from_stack_m);
        let acting = self.acting_on(&stack, &mass, stack.motor.mean_thrust_n(time_s, step_s, parts));
        let (after, felt_m_s2) = if stack.on_rail() {
            let load = acting.load(&before, &before.world_from_body.to_rotation_matrix());
            guided(&mut stack, &before, &load, mass.inertia.mass_kg, step_s)
        } else {
            body::rk4_divided(&before, &mass.inertia, &acting, STANDARD_GRAVITY_M_S2, step_s, parts)
        };
        self.inertial.angular_acceleration_rad_s2 = (after.rate_rad_s - before.rate_rad_s) / step_s;
        let rate = after.rate_rad_s;
        self.inertial.specific_force_m_s2 = felt_m_s2
            + self.inertial.angular_acceleration_rad_s2.cross(&from_stack_m)
            + rate.cross(&rate.cross(&from_stack_m));
        self.state = at_offset(&after, &from_stack_m);
        let now_s = time_s + step_s;
        if !stack.on_rail() && self.truth.over_ground_m(&stack.lower_end_m(&self.state, &cg_m)) < 0.0 {
            self.touchdown = Some(self.touchdown_at(now_s, &self.state.clone()));
            self.come_to_rest(now_s, RestOutcome::BodyStrike);
        } else if stack.parts(now_s) {
            self.part(&stack, now_s);
            return;
        }
        self.stack = Some(Box::new(stack));
    }

    /// The forces of a step.
    fn acting_on<'a>(&'a self, stack: &'a Stack, mass: &StackMass, thrust_n: f64) -> Acting<'a> {
        let body = &self.airframe.body;
        let cg_m = mass.cg_m;
        Acting {
            shape: &self.shape,
            configuration: Configuration {
                fin_sines: [0, 1, 2, 3].map(|fin: usize| libm::sin(self.fin_links[fin].rad())),
                legs_out: false,
                parachute_area_m2: self.parachute.drag_area_m2(),
                plume: Plume { body: stack.drag_over(body.axial_drag_coefficient), fins: 1.0 },
                cg_m,
            },
            stack: Some((stack, body.reference_area_m2)),
            wind_m_s: self.wind.now_m_s(),
            air: self.air,
            thrust_n,
            thrust_direction: Vector3::x(),
            thrust_place_m: stack.nozzle_m() - cg_m,
            jet_damping_m_s: stack.jet_damping_m_s(cg_m.x),
            ground: None,
        }
    }

    /// The stages part: from now on the vehicle flies alone.
    fn part(&mut self, stack: &Stack, now_s: f64) {
        let (push_m_s, [pitch_rad_s, yaw_rad_s]) = stack.parting(self.mass.mass_kg);
        self.state.velocity_m_s += self.state.nose_in_world() * push_m_s;
        self.state.rate_rad_s += Vector3::new(0.0, pitch_rad_s, yaw_rad_s);
        self.separated_s = Some(now_s);
    }
}

// The vehicle on its booster: masses, thrust and aerodynamics of the complete stack.
//
// Forces across the axis in proportion to the angle of attack act at the nose and at the booster's
// fins (J. S. Barrowman and J. A. Barrowman, "The Theoretical Prediction of the Center of
// Pressure", 1966), each from the wind where it acts, so that turning is damped. The crossflow of
// the vehicle's body is that of `aero`.

/// Time from the current through the separation charge to the separation, s.
const CHARGE_DELAY_S: f64 = 0.02;

/// The booster with the vehicle on it.
#[derive(Debug, Clone)]
pub(crate) struct Stack {
    booster: Booster,
    truth: AscentTruth,
    motor: Motor,
    charge_fired_s: Option<f64>,
    stuck: bool,
    /// The ascent motor ignites without a command.
    lights_itself: bool,
    rail: Option<OnRail>,
}

/// The part of the ascent that the rail guides.
#[derive(Debug, Clone, Copy)]
struct OnRail {
    length_m: f64,
    travelled_m: f64,
}

/// Masses of the stack, without the vehicle's transverse offsets of the centre of gravity.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StackMass {
    pub(crate) inertia: Inertia,
    /// Centre of gravity: x its station, y and z its distance from the axis, m.
    pub(crate) cg_m: Vector3<f64>,
}

impl Stack {
    pub(crate) fn new(launch: &Launch, truth: &AscentTruth) -> Self {
        let of_motor = Truth {
            impulse_scale: truth.impulse_scale,
            burn_time_scale: truth.burn_time_scale,
            ignition_delay_s: truth.ignition_delay_s,
            ..Truth::default()
        };
        Self {
            booster: launch.booster.clone(),
            truth: *truth,
            motor: Motor::new(&launch.booster.motor_curve, &of_motor),
            charge_fired_s: None,
            stuck: false,
            lights_itself: false,
            rail: Some(OnRail { length_m: launch.rail.length_m, travelled_m: 0.0 }),
        }
    }

    pub(crate) fn break_down(&mut self, fault: &Fault) {
        match *fault {
            Fault::AscentNoLight => self.motor.break_down(&Fault::NoLight),
            Fault::AscentSelfLights => self.lights_itself = true,
            Fault::AscentWeak { scale } => self.motor.break_down(&Fault::WeakMotor { scale }),
            Fault::SeparationFails => self.stuck = true,
            _ => {}
        }
    }

    pub(crate) fn command(&mut self, ignite: bool, separate: bool, time_s: f64) {
        self.motor.current(ignite || self.lights_itself, time_s);
        if separate {
            self.charge_fired_s.get_or_insert(time_s);
        }
    }

    /// Whether the stages part at this time.
    pub(crate) fn parts(&self, time_s: f64) -> bool {
        !self.stuck && self.charge_fired_s.is_some_and(|fired_s| time_s >= fired_s + CHARGE_DELAY_S)
    }

    /// When the separation charge was fired, s.
    pub(crate) fn charge_fired_s(&self) -> Option<f64> {
        self.charge_fired_s
    }

    /// Speed that the charge gives a vehicle of a mass along its axis, m/s, and the rotation rate
    /// across it, rad/s.
    pub(crate) fn parting(&self, mass_kg: f64) -> (f64, [f64; 2]) {
        (self.booster.separation_impulse_n_s / mass_kg, self.truth.tip_off_rad_s)
    }

    /// The motor burns or has burnt, or will light if the current stays on.
    pub(crate) fn lights(&self) -> bool {
        self.motor.thrust_begins_s().is_some()
    }

    pub(crate) fn thrust_n(&self, time_s: f64) -> f64 {
        self.motor.thrust_n(time_s)
    }

    /// Damping of the cross rates per newton of thrust, m s/rad: the gas leaves with the angular
    /// momentum that it has at the nozzle, and it had that of its place in the motor (W. T.
    /// Thomson, Introduction to Space Dynamics, section 7.7).
    pub(crate) fn jet_damping_m_s(&self, cg_station_m: f64) -> f64 {
        let [nozzle_m, propellant_m] =
            [self.nozzle_m().x, self.booster.propellant_station_m].map(|station_m| station_m - cg_station_m);
        self.motor.flow_kg_n_s() * (nozzle_m * nozzle_m - propellant_m * propellant_m)
    }

    /// Where the thrust acts: the lower end of the axis, m.
    pub(crate) fn nozzle_m(&self) -> Vector3<f64> {
        Vector3::new(-self.booster.length_m, 0.0, 0.0)
    }

    /// Ratio of the complete stack's drag coefficient to a vehicle's.
    pub(crate) fn drag_over(&self, vehicle_coefficient: f64) -> f64 {
        self.truth.drag_scale * self.booster.stack_drag_coefficient / vehicle_coefficient
    }

    /// The masses at a time, with a vehicle of these masses and centre of gravity on top (parallel
    /// axes).
    pub(crate) fn mass(
        &self,
        vehicle: &MassProperties,
        vehicle_cg_m: &Vector3<f64>,
        time_s: f64,
    ) -> StackMass {
        let booster = &self.booster;
        let propellant_kg = (booster.motor_curve.propellant_mass_kg() - self.motor.burnt_kg(time_s)).max(0.0);
        let parts = [
            (vehicle.mass_kg, *vehicle_cg_m, vehicle.pitch_inertia_kg_m2),
            (booster.dry_kg, Vector3::new(booster.cg_station_m, 0.0, 0.0), booster.pitch_inertia_kg_m2),
            (propellant_kg, Vector3::new(booster.propellant_station_m, 0.0, 0.0), 0.0),
        ];
        let mass_kg: f64 = parts.iter().map(|(part_kg, _, _)| part_kg).sum();
        let cg_m = parts.iter().map(|(part_kg, at_m, _)| at_m * *part_kg).sum::<Vector3<f64>>() / mass_kg;
        let pitch_kg_m2 = parts
            .iter()
            .map(|(part_kg, at_m, own_kg_m2)| own_kg_m2 + part_kg * (at_m.x - cg_m.x) * (at_m.x - cg_m.x))
            .sum();
        let roll_kg_m2 = vehicle.roll_inertia_kg_m2 + booster.roll_inertia_kg_m2;
        StackMass {
            inertia: Inertia { mass_kg, across_kg_m2: [pitch_kg_m2; 2], roll_kg_m2, principal_rad: [0.0; 2] },
            cg_m,
        }
    }

    /// Adds the forces of nose and fins.
    pub(crate) fn add_air(&self, load: &mut Load, flow: &Flow, cg_m: &Vector3<f64>, area_m2: f64) {
        let Booster { nose, fin_force: fins, fin_radius_m, .. } = &self.booster;
        for NormalForce { slope_per_rad, station_m } in [nose, fins] {
            let place_m = Vector3::new(*station_m, 0.0, 0.0) - cg_m;
            let local = flow.velocity_m_s + flow.rate_rad_s.cross(&place_m);
            let speed = local.norm_squared().sqrt();
            // Linear in the angle of attack while that is small: the ratio of sideways to total
            // speed.
            let across = Vector3::new(0.0, local.y, local.z);
            load.add_at(&place_m, &(across * (-0.5 * flow.density_kg_m3 * speed * area_m2 * slope_per_rad)));
        }
        // Fins canted the same way roll the stack, and rolling turns their local wind back. Of n
        // fins n/2 lift in one plane, but all n roll.
        let axial_m_s = flow.velocity_m_s.x;
        let angle_speed = self.truth.fin_cant_rad * axial_m_s - flow.rate_rad_s.x * fin_radius_m;
        load.moment_n_m.x +=
            flow.density_kg_m3 * axial_m_s * area_m2 * fins.slope_per_rad * fin_radius_m * angle_speed;
    }

    /// Whether the rail still guides the stack.
    pub(crate) fn on_rail(&self) -> bool {
        self.rail.is_some()
    }

    /// A step, s, along the rail with an acceleration along it, m/s^2: the speed afterwards, m/s.
    /// Nothing holds the stack down, and the rail's foot holds it up.
    pub(crate) fn slide(&mut self, speed_m_s: f64, acceleration_m_s2: f64, step_s: f64) -> f64 {
        let Some(rail) = &mut self.rail else { return speed_m_s };
        let next_m_s = (speed_m_s + acceleration_m_s2 * step_s).max(0.0);
        rail.travelled_m += 0.5 * (speed_m_s + next_m_s) * step_s;
        if rail.travelled_m >= rail.length_m {
            self.rail = None;
        }
        next_m_s
    }

    /// Lowest point of the axis, world axes, m.
    pub(crate) fn lower_end_m(&self, vehicle: &RigidState, vehicle_cg_m: &Vector3<f64>) -> Vector3<f64> {
        vehicle.position_m + vehicle.world_from_body * (self.nozzle_m() - vehicle_cg_m)
    }
}
