//! The rigid body: its equations of motion and their integrator.
//!
//! Newton's and Euler's equations with a quaternion (B. L. Stevens and F. L. Lewis, Aircraft
//! Control and Simulation, chapter 1), in classical Runge-Kutta steps (E. Hairer, S. P. Norsett and
//! G. Wanner, Solving Ordinary Differential Equations I, section II.1).

use flight::vehicle::rigid::RigidState;
use nalgebra::{Quaternion, Rotation3, UnitQuaternion, Vector3};

use crate::world::aero::Load;

/// Mass and inertia over one step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Inertia {
    pub(crate) mass_kg: f64,
    /// About pitch and about yaw.
    pub(crate) across_kg_m2: [f64; 2],
    pub(crate) roll_kg_m2: f64,
    /// Lean of the principal axis against the body's, about body y and z, rad.
    pub(crate) principal_rad: [f64; 2],
}

/// The force and moment on the body at a state.
pub(crate) trait Loads {
    /// Force without gravity, and moment about the centre of gravity, in body axes.
    fn load(&self, state: &RigidState, world_from_body: &Rotation3<f64>) -> Load;
}

/// Time derivative of the state.
#[derive(Clone, Copy)]
struct Rates {
    velocity: Vector3<f64>,
    acceleration: Vector3<f64>,
    attitude: Quaternion<f64>,
    rotation: Vector3<f64>,
    specific_force: Vector3<f64>,
}

/// Largest effect on the rotation rate, rad/s, of the difference between the two stages in the
/// middle of a step. It estimates the error of the second stage, which is of the third order in the
/// step; that of the step is two orders smaller (Hairer, Norsett and Wanner, section II.4).
const STAGES_APART_RAD_S: f64 = 2e-3;

/// One step, or this many shorter ones where the error of one would be too large: [`rk4_step`].
pub(crate) fn rk4_divided(
    state: &RigidState,
    inertia: &Inertia,
    loads: &(impl Loads + ?Sized),
    gravity_m_s2: f64,
    step_s: f64,
    parts: usize,
) -> (RigidState, Vector3<f64>) {
    let (after, force_m_s2, apart_rad_s) = rk4_step(state, inertia, loads, gravity_m_s2, step_s);
    if parts == 1 || apart_rad_s <= STAGES_APART_RAD_S {
        return (after, force_m_s2);
    }
    let part_s = step_s / parts as f64;
    let (mut state, mut sum_m_s2) = (*state, Vector3::zeros());
    for _ in 0..parts {
        let (after, force_m_s2, _) = rk4_step(&state, inertia, loads, gravity_m_s2, part_s);
        state = after;
        sum_m_s2 += force_m_s2;
    }
    (state, sum_m_s2 / parts as f64)
}

/// One classical Runge-Kutta step of a length, s, under gravity, m/s^2. Returns the state after the
/// step, the mean specific force over it in body axes, m/s^2, which is what an ideal accelerometer
/// at the centre of gravity measures, and how far its stages in the middle are apart, rad/s.
pub(crate) fn rk4_step(
    state: &RigidState,
    inertia: &Inertia,
    loads: &(impl Loads + ?Sized),
    gravity_m_s2: f64,
    step_s: f64,
) -> (RigidState, Vector3<f64>, f64) {
    let rates = |state: &RigidState| {
        let world_from_body = state.world_from_body.to_rotation_matrix();
        let load = loads.load(state, &world_from_body);
        let specific_force = load.force_n / inertia.mass_kg;
        let mut acceleration = world_from_body * specific_force;
        acceleration.z -= gravity_m_s2;
        Rates {
            velocity: state.velocity_m_s,
            acceleration,
            attitude: state.world_from_body.quaternion() * Quaternion::from_imag(0.5 * state.rate_rad_s),
            rotation: angular_acceleration(inertia, &state.rate_rad_s, &load.moment_n_m),
            specific_force,
        }
    };
    let first = rates(state);
    let second = rates(&moved(state, &first, 0.5 * step_s));
    let third = rates(&moved(state, &second, 0.5 * step_s));
    let fourth = rates(&moved(state, &third, step_s));
    let weigh =
        |of: fn(&Rates) -> Vector3<f64>| (of(&first) + (of(&second) + of(&third)) * 2.0 + of(&fourth)) / 6.0;
    let mean = Rates {
        velocity: weigh(|rates| rates.velocity),
        acceleration: weigh(|rates| rates.acceleration),
        attitude: (first.attitude + (second.attitude + third.attitude) * 2.0 + fourth.attitude) / 6.0,
        rotation: weigh(|rates| rates.rotation),
        specific_force: weigh(|rates| rates.specific_force),
    };
    let apart_rad_s = step_s * (third.rotation - second.rotation).norm_squared().sqrt();
    (moved(state, &mean, step_s), mean.specific_force, apart_rad_s)
}

fn moved(state: &RigidState, rates: &Rates, step_s: f64) -> RigidState {
    let attitude = state.world_from_body.quaternion() + rates.attitude * step_s;
    let length = attitude.norm_squared().sqrt();
    RigidState {
        position_m: state.position_m + rates.velocity * step_s,
        velocity_m_s: state.velocity_m_s + rates.acceleration * step_s,
        world_from_body: UnitQuaternion::new_unchecked(attitude / length),
        rate_rad_s: state.rate_rad_s + rates.rotation * step_s,
    }
}

/// Euler's equations.
fn angular_acceleration(inertia: &Inertia, rate: &Vector3<f64>, moment: &Vector3<f64>) -> Vector3<f64> {
    if inertia.principal_rad.iter().all(|lean| *lean == 0.0) {
        return about_principal_axis(inertia, rate, moment);
    }
    let [about_y, about_z] = inertia.principal_rad;
    let body_from_principal = Rotation3::from_scaled_axis(Vector3::new(0.0, about_y, about_z));
    let [rate, moment] = [rate, moment].map(|vector| body_from_principal.inverse_transform_vector(vector));
    body_from_principal * about_principal_axis(inertia, &rate, &moment)
}

fn about_principal_axis(inertia: &Inertia, rate: &Vector3<f64>, moment: &Vector3<f64>) -> Vector3<f64> {
    let ([pitch, yaw], roll) = (inertia.across_kg_m2, inertia.roll_kg_m2);
    Vector3::new(
        (moment.x + (pitch - yaw) * rate.y * rate.z) / roll,
        (moment.y + (yaw - roll) * rate.x * rate.z) / pitch,
        (moment.z - (pitch - roll) * rate.x * rate.y) / yaw,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Nothing;

    impl Loads for Nothing {
        fn load(&self, _: &RigidState, _: &Rotation3<f64>) -> Load {
            Load::none()
        }
    }

    /// A torque-free symmetric top: the spin about its axis is constant, and the cross rates rotate
    /// at (1 - I_x/I) p.
    #[test]
    fn val_euler_torque_free_precession() {
        let inertia =
            Inertia { mass_kg: 2.0, across_kg_m2: [0.12; 2], roll_kg_m2: 0.02, principal_rad: [0.0; 2] };
        let mut state = RigidState::upright(50.0);
        state.rate_rad_s = Vector3::new(6.0, 0.4, 0.0);
        let momentum = |state: &RigidState| {
            let rate = state.rate_rad_s;
            state.world_from_body * Vector3::new(0.02 * rate.x, 0.12 * rate.y, 0.12 * rate.z)
        };
        let before = momentum(&state);
        for _ in 0..2000 {
            state = rk4_step(&state, &inertia, &Nothing, 0.0, 1e-3).0;
        }
        let angle_rad = 6.0 * (1.0 - 0.02 / 0.12) * 2.0;
        let expected = Vector3::new(6.0, 0.4 * libm::cos(angle_rad), -0.4 * libm::sin(angle_rad));
        assert!((state.rate_rad_s - expected).norm() < 1e-9, "{} {expected}", state.rate_rad_s);
        assert!((momentum(&state) - before).norm() < 1e-10, "angular momentum in the world");
    }

    /// The same top, built in askew: it turns as one that is aligned and seen from axes askew.
    #[test]
    fn val_euler_a_skewed_body_conserves_momentum_and_energy() {
        let askew = [0.05, -0.03];
        let inertia =
            Inertia { mass_kg: 2.0, across_kg_m2: [0.12; 2], roll_kg_m2: 0.02, principal_rad: askew };
        let body_from_principal = Rotation3::from_scaled_axis(Vector3::new(0.0, askew[0], askew[1]));
        let diagonal = Vector3::new(0.02, 0.12, 0.12);
        let momentum = |rate: &Vector3<f64>| {
            body_from_principal * (body_from_principal.inverse() * rate).component_mul(&diagonal)
        };
        let mut state = RigidState::upright(50.0);
        state.rate_rad_s = Vector3::new(6.0, 0.4, 0.0);
        let before = state.world_from_body * momentum(&state.rate_rad_s);
        let energy_j = 0.5 * state.rate_rad_s.dot(&momentum(&state.rate_rad_s));
        for _ in 0..2000 {
            state = rk4_step(&state, &inertia, &Nothing, 0.0, 1e-3).0;
        }
        assert!((state.world_from_body * momentum(&state.rate_rad_s) - before).norm() < 1e-9);
        assert!((0.5 * state.rate_rad_s.dot(&momentum(&state.rate_rad_s)) - energy_j).abs() < 1e-9);
        // Its spin is not constant, as that of an aligned top is.
        assert!((state.rate_rad_s.x - 6.0).abs() > 1e-3, "{}", state.rate_rad_s);
    }

    /// A body with three inertias that spins about the middle one turns over and back, and
    /// conserves momentum and energy.
    #[test]
    fn val_euler_three_inertias_conserve_momentum_and_energy() {
        let inertia =
            Inertia { mass_kg: 2.0, across_kg_m2: [0.13, 0.11], roll_kg_m2: 0.02, principal_rad: [0.0; 2] };
        let diagonal = Vector3::new(0.02, 0.13, 0.11);
        let mut state = RigidState::upright(50.0);
        state.rate_rad_s = Vector3::new(0.05, 0.02, 5.0);
        let momentum = |state: &RigidState| state.world_from_body * state.rate_rad_s.component_mul(&diagonal);
        let energy_j = |state: &RigidState| state.rate_rad_s.dot(&state.rate_rad_s.component_mul(&diagonal));
        let before = (momentum(&state), energy_j(&state));
        let mut turned_over = false;
        for _ in 0..4000 {
            state = rk4_step(&state, &inertia, &Nothing, 0.0, 1e-3).0;
            turned_over |= state.rate_rad_s.z < -4.9;
        }
        assert!(turned_over && (momentum(&state) - before.0).norm() < 1e-8);
        assert!((energy_j(&state) - before.1).abs() < 1e-8);
    }

    #[test]
    fn val_galilei_free_fall() {
        let inertia =
            Inertia { mass_kg: 2.0, across_kg_m2: [0.12; 2], roll_kg_m2: 0.02, principal_rad: [0.0; 2] };
        let mut state = RigidState::upright(50.0);
        state.velocity_m_s.x = 3.0;
        for _ in 0..1000 {
            state = rk4_step(&state, &inertia, &Nothing, 9.8, 1e-3).0;
        }
        assert!((state.position_m - Vector3::new(3.0, 0.0, 50.0 - 4.9)).norm() < 1e-10);
    }
}
