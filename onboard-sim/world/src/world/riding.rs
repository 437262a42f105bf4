//! The way up: on the rail, under the ascent motor, and coasting until the booster is separated.
//!
//! The state of the world is always the vehicle's own. In each step the motion of the stack's centre of gravity follows
//! from it, and it from that motion. The centre moves through the body while propellant burns; that relative motion (some
//! cm/s) is neglected.

use flight::vehicle::atmosphere::{Air, STANDARD_GRAVITY_M_S2};
use flight::vehicle::rigid::RigidState;
use nalgebra::{Rotation3, Vector3};

use super::World;
use crate::STEP_S;
use crate::aero::{Configuration, Flow, Load, Plume, Shape};
use crate::body::{self, Loads};
use crate::ground::RestOutcome;
use crate::stack::{Stack, StackMass};

/// Everything that acts on a stack within a step.
struct Acting<'a> {
    shape: &'a Shape,
    configuration: Configuration,
    stack: &'a Stack,
    area_m2: f64,
    wind_m_s: Vector3<f64>,
    density_kg_m3: f64,
    density_gradient_kg_m4: f64,
    density_height_m: f64,
    /// Thrust at the start, middle and end, N.
    thrust_n: [f64; 3],
    thrust_place_m: Vector3<f64>,
    /// Damping of the cross rates per newton of thrust, m s/rad.
    jet_damping_m_s: f64,
}

impl Loads for Acting<'_> {
    fn load(&self, state: &RigidState, world_from_body: &Rotation3<f64>, share: f64) -> Load {
        let above_m = state.position_m.z - self.density_height_m;
        let flow = Flow {
            density_kg_m3: self.density_kg_m3 + self.density_gradient_kg_m4 * above_m,
            velocity_m_s: world_from_body.inverse_transform_vector(&(state.velocity_m_s - self.wind_m_s)),
            rate_rad_s: state.rate_rad_s,
        };
        let mut load = self.shape.load(&flow, &self.configuration);
        self.stack.add_air(&mut load, &flow, &self.configuration.cg_m, self.area_m2);
        let thrust_n = self.thrust_n[(2.0 * share) as usize];
        if thrust_n > 0.0 {
            load.add_at(&self.thrust_place_m, &Vector3::new(thrust_n, 0.0, 0.0));
            let damping_n_m_s = thrust_n * self.jet_damping_m_s;
            load.moment_n_m.y -= damping_n_m_s * state.rate_rad_s.y;
            load.moment_n_m.z -= damping_n_m_s * state.rate_rad_s.z;
        }
        load
    }
}

/// The state of another point of the body, at an offset in body axes, m.
fn at_offset(state: &RigidState, offset_m: &Vector3<f64>) -> RigidState {
    RigidState {
        position_m: state.position_m + state.world_from_body * offset_m,
        velocity_m_s: state.velocity_m_s + state.world_from_body * state.rate_rad_s.cross(offset_m),
        ..*state
    }
}

/// A step along the rail: the state afterwards and the specific force, body axes, m/s^2.
fn guided(stack: &mut Stack, before: &RigidState, load: &Load, mass_kg: f64) -> (RigidState, Vector3<f64>) {
    let along = before.nose_in_world();
    let pushed_m_s2 = load.force_n.x / mass_kg - STANDARD_GRAVITY_M_S2 * along.z;
    let speed_m_s = before.velocity_m_s.dot(&along);
    let next_m_s = stack.slide(speed_m_s, pushed_m_s2, STEP_S);
    let after = RigidState {
        position_m: before.position_m + along * (0.5 * (speed_m_s + next_m_s) * STEP_S),
        velocity_m_s: along * next_m_s,
        ..*before
    };
    let acceleration_m_s2 = along * ((next_m_s - speed_m_s) / STEP_S);
    let felt_m_s2 = acceleration_m_s2 + Vector3::z() * STANDARD_GRAVITY_M_S2;
    (after, before.world_from_body.inverse_transform_vector(&felt_m_s2))
}

impl World {
    /// One step with the booster. `stack` is the world's own, taken out of it.
    pub(super) fn ride(&mut self, mut stack: Stack, time_s: f64) {
        let cg_m = self.cg_m();
        let mass = stack.mass(&self.mass, &cg_m, time_s + 0.5 * STEP_S);
        let from_stack_m = cg_m - mass.cg_m;
        let before = at_offset(&self.state, &-from_stack_m);
        let acting = self.acting_on(&stack, &mass, time_s);
        let (after, felt_m_s2) = if stack.on_rail() {
            let load = acting.load(&before, &before.world_from_body.to_rotation_matrix(), 0.5);
            guided(&mut stack, &before, &load, mass.inertia.mass_kg)
        } else {
            body::rk4_step(&before, &mass.inertia, &acting, STANDARD_GRAVITY_M_S2, STEP_S)
        };
        self.angular_acceleration_rad_s2 = (after.rate_rad_s - before.rate_rad_s) / STEP_S;
        let rate = after.rate_rad_s;
        self.specific_force_m_s2 = felt_m_s2
            + self.angular_acceleration_rad_s2.cross(&from_stack_m)
            + rate.cross(&rate.cross(&from_stack_m));
        self.state = at_offset(&after, &from_stack_m);
        let now_s = time_s + STEP_S;
        if !stack.on_rail() && stack.lower_end_m(&self.state, &cg_m) < 0.0 {
            self.touchdown = Some(self.touchdown_at(now_s, &self.state.clone()));
            self.come_to_rest(now_s, RestOutcome::BodyStrike);
        } else if stack.parts(now_s) {
            self.part(&stack, now_s);
            return;
        }
        self.stack = Some(Box::new(stack));
    }

    /// The forces of a step.
    fn acting_on<'a>(&'a self, stack: &'a Stack, mass: &StackMass, time_s: f64) -> Acting<'a> {
        let air = Air::at_height_m(self.state.position_m.z);
        let body = &self.airframe.body;
        let cg_m = mass.cg_m;
        Acting {
            shape: &self.shape,
            configuration: Configuration {
                fin_sines: [0, 1, 2, 3].map(|fin: usize| libm::sin(self.fin_links[fin].rad())),
                parachute_area_m2: self.parachute.drag_area_m2(),
                plume: Plume { body: stack.drag_over(body.axial_drag_coefficient), fins: 1.0 },
                cg_m,
            },
            stack,
            area_m2: body.reference_area_m2,
            wind_m_s: self.wind.now_m_s(),
            density_kg_m3: air.density_kg_m3,
            density_gradient_kg_m4: air.density_gradient_kg_m4(),
            density_height_m: self.state.position_m.z,
            thrust_n: [0.0, 0.5, 1.0].map(|share| stack.thrust_n(time_s + share * STEP_S)),
            thrust_place_m: stack.nozzle_m() - cg_m,
            jet_damping_m_s: stack.jet_damping_m_s(cg_m.x),
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
