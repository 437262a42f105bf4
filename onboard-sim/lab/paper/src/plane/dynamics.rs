//! The planar (longitudinal) equations of motion of the landing burn, their integrator and their derivatives.
//!
//! Frames: `x` horizontal, `z` altitude, up. Pitch `theta` from the horizontal, pi/2 upright. Body axes
//! `e_x = (cos theta, sin theta)`, towards the nose, and `e_z = (sin theta, -cos theta)`; `(u, w)` is the
//! velocity along them and `q = d(theta)/dt`. The gimbal angle `delta` is positive for a pitch-down manoeuvre.
//!
//! ```text
//! x'     = u cos(theta) + w sin(theta)
//! z'     = u sin(theta) - w cos(theta)
//! theta' = q
//! u'     = (T/m) cos(delta) - (rho S Cx / 2m) V u - g sin(theta) - q w
//! w'     = -(T/m) sin(delta) - k V w - c |w| w + g cos(theta) + q u
//! q'     = -T sin(delta) (X_CG - X_THR) / I_y
//! ```
//!
//! This is the landing paper (`EuroGNC`), Eq. 18-22, put into one frame and with forces divided by mass; see
//! [`ModelKind`] for the printed set. The paper has no air force across the body (`k = c = 0`). A vehicle at speed
//! has two: the drag of a body that is as wide as long (`k`), and the crossflow about a slender body, which depends
//! only on the velocity across it (`c`; Allen and Perkins, NACA Report 1048, 1951).
//!
//! In wind, let the frame move with the air: `(u, w)` and the positions are then relative to it.


/// The set of planar equations.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ModelKind {
    /// One frame throughout: energy is conserved without thrust and drag.
    Consistent,
    /// Eq. 18-22 of the landing paper with forces divided by mass and no other correction: the rotation and the gravity
    /// terms belong to different frames. For replication only.
    AsPrinted,
}

/// Planar state: position, pitch, body-axis velocity, pitch rate.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PlanarState {
    /// Horizontal position, m.
    pub x_m: f64,
    /// Altitude, m, up.
    pub z_m: f64,
    /// Pitch from the horizontal, rad; pi/2 is upright.
    pub theta_rad: f64,
    /// Velocity along the nose axis, m/s.
    pub u_m_s: f64,
    /// Velocity along the second body axis, m/s.
    pub w_m_s: f64,
    /// Pitch rate, rad/s.
    pub q_rad_s: f64,
}

impl PlanarState {
    /// The components in state order (x, z, theta, u, w, q), SI and radians.
    pub fn to_array(self) -> [f64; 6] {
        [self.x_m, self.z_m, self.theta_rad, self.u_m_s, self.w_m_s, self.q_rad_s]
    }

    /// The state of components in state order (x, z, theta, u, w, q), SI and radians.
    pub fn from_array([x_m, z_m, theta_rad, u_m_s, w_m_s, q_rad_s]: [f64; 6]) -> Self {
        Self { x_m, z_m, theta_rad, u_m_s, w_m_s, q_rad_s }
    }

    /// Whether every component is a finite number.
    pub fn is_finite(&self) -> bool {
        self.to_array().iter().all(|value| value.is_finite())
    }

    pub fn speed_m_s(&self) -> f64 {
        libm::sqrt(self.u_m_s * self.u_m_s + self.w_m_s * self.w_m_s)
    }

    /// Velocity over the ground `(horizontal, up)`, m/s, in the consistent frame.
    pub fn ground_velocity_m_s(&self) -> (f64, f64) {
        let (sin, cos) = libm::sincos(self.theta_rad);
        (self.u_m_s * cos + self.w_m_s * sin, self.u_m_s * sin - self.w_m_s * cos)
    }
}

/// The constants of the planar equations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlanarParams {
    pub mass_kg: f64,
    /// Moment of inertia about the pitch axis, kg m^2.
    pub pitch_inertia_kg_m2: f64,
    /// Distance from the nozzle pivot forward to the centre of gravity, m.
    pub thrust_arm_m: f64,
    /// `rho S Cx / 2m`: drag deceleration per squared speed, 1/m.
    pub drag_per_m: f64,
    /// `k`, deceleration across the body per speed and speed across, 1/m; the printed set has none.
    pub lateral_drag_per_m: f64,
    /// `c`, deceleration across the body per squared speed across, 1/m; the printed set has none.
    pub crossflow_per_m: f64,
    pub gravity_m_s2: f64,
}

impl PlanarParams {
    /// The same vehicle at another mass. The air forces, the inertia and the centre of gravity do not change.
    #[must_use]
    pub fn with_mass(self, mass_kg: f64) -> Self {
        let lightness = self.mass_kg / mass_kg;
        Self {
            mass_kg,
            drag_per_m: self.drag_per_m * lightness,
            lateral_drag_per_m: self.lateral_drag_per_m * lightness,
            crossflow_per_m: self.crossflow_per_m * lightness,
            ..self
        }
    }
}

/// The planar equations of motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlanarModel {
    /// The constants.
    pub params: PlanarParams,
    /// Which set of equations.
    pub kind: ModelKind,
}

impl PlanarModel {
    /// The same model of the vehicle at another mass.
    #[must_use]
    pub fn with_mass(self, mass_kg: f64) -> Self {
        Self { params: self.params.with_mass(mass_kg), ..self }
    }

    /// Time derivative of the state (x, z, theta, u, w, q), SI and radians.
    pub fn derivative(&self, state: &[f64; 6], gimbal_rad: f64, thrust_n: f64) -> [f64; 6] {
        let [_, _, theta, u, w, q] = *state;
        let (sin_theta, cos_theta) = libm::sincos(theta);
        let (sin_delta, cos_delta) = libm::sincos(gimbal_rad);
        let PlanarParams { mass_kg, pitch_inertia_kg_m2, thrust_arm_m, drag_per_m, gravity_m_s2, .. } =
            self.params;
        let thrust_m_s2 = thrust_n / mass_kg;
        let speed = libm::sqrt(u * u + w * w);
        let (x_dot, z_dot, drag_m_s2, across_m_s2) = match self.kind {
            ModelKind::Consistent => (
                u * cos_theta + w * sin_theta,
                u * sin_theta - w * cos_theta,
                -drag_per_m * speed * u,
                -(self.params.lateral_drag_per_m * speed + self.params.crossflow_per_m * w.abs()) * w,
            ),
            // The rotation of Eq. 22, and the drag of Eq. 18, which always acts towards the nose.
            ModelKind::AsPrinted => (
                u * cos_theta - w * sin_theta,
                u * sin_theta + w * cos_theta,
                drag_per_m * speed * speed,
                0.0,
            ),
        };
        [
            x_dot,
            z_dot,
            q,
            thrust_m_s2 * cos_delta + drag_m_s2 - gravity_m_s2 * sin_theta - q * w,
            -thrust_m_s2 * sin_delta + gravity_m_s2 * cos_theta + q * u + across_m_s2,
            -thrust_n * sin_delta * thrust_arm_m / pitch_inertia_kg_m2,
        ]
    }

    /// One classical fourth-order Runge-Kutta step of `step_s` with input and thrust held.
    pub fn rk4_step(&self, state: &PlanarState, gimbal_rad: f64, thrust_n: f64, step_s: f64) -> PlanarState {
        let x = state.to_array();
        let k1 = self.derivative(&x, gimbal_rad, thrust_n);
        let k2 = self.derivative(&along(&x, &k1, 0.5 * step_s), gimbal_rad, thrust_n);
        let k3 = self.derivative(&along(&x, &k2, 0.5 * step_s), gimbal_rad, thrust_n);
        let k4 = self.derivative(&along(&x, &k3, step_s), gimbal_rad, thrust_n);
        PlanarState::from_array(core::array::from_fn(|i| {
            x[i] + step_s / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i])
        }))
    }

    /// Kinetic plus potential energy of translation, per kilogram, J/kg.
    pub fn specific_energy_j_kg(&self, state: &PlanarState) -> f64 {
        0.5 * (state.u_m_s * state.u_m_s + state.w_m_s * state.w_m_s) + self.params.gravity_m_s2 * state.z_m
    }
}

/// `x + step * slope`.
pub(crate) fn along(x: &[f64; 6], slope: &[f64; 6], step: f64) -> [f64; 6] {
    core::array::from_fn(|i| x[i] + step * slope[i])
}

// Exact first and second derivatives of the planar equations, written by hand.

/// Index of the gimbal angle after the six states in a stage's variables.
pub const INPUT_INDEX: usize = 6;

/// Derivative of the six rates by the six states and the gimbal angle.
pub type StageJacobian = [[f64; 7]; 6];

/// Second derivative of a scalar by the six states and the gimbal angle; symmetric.
pub type StageHessian = [[f64; 7]; 7];

const THETA: usize = 2;
const U: usize = 3;
const W: usize = 4;
const Q: usize = 5;
const DELTA: usize = INPUT_INDEX;

/// Below this speed (m/s) the drag's second derivatives count as zero, because they have no limit at rest.
const REST_SPEED_M_S: f64 = 1e-9;

impl PlanarModel {
    /// Derivative of [`derivative`](Self::derivative) by the states and the gimbal angle.
    pub fn jacobian(&self, state: &[f64; 6], gimbal_rad: f64, thrust_n: f64) -> StageJacobian {
        let [_, _, theta, u, w, q] = *state;
        let (st, ct) = libm::sincos(theta);
        let (sd, cd) = libm::sincos(gimbal_rad);
        let PlanarParams { mass_kg, pitch_inertia_kg_m2, thrust_arm_m, drag_per_m, gravity_m_s2, .. } =
            self.params;
        let thrust_m_s2 = thrust_n / mass_kg;
        let mut jacobian = [[0.0; 7]; 6];
        let sign = self.lateral_sign();

        jacobian[0][THETA] = -u * st + sign * w * ct;
        jacobian[0][U] = ct;
        jacobian[0][W] = sign * st;
        jacobian[1][THETA] = u * ct + sign * w * st;
        jacobian[1][U] = st;
        jacobian[1][W] = -sign * ct;
        jacobian[2][Q] = 1.0;

        let PlanarParams { lateral_drag_per_m, crossflow_per_m, .. } = self.params;
        let (drag_u, drag_w, across_u, across_w) = match self.kind {
            ModelKind::Consistent => {
                let speed = libm::sqrt(u * u + w * w);
                if speed > REST_SPEED_M_S {
                    (
                        -drag_per_m * (speed + u * u / speed),
                        -drag_per_m * u * w / speed,
                        -lateral_drag_per_m * u * w / speed,
                        -lateral_drag_per_m * (speed + w * w / speed) - 2.0 * crossflow_per_m * w.abs(),
                    )
                } else {
                    (0.0, 0.0, 0.0, 0.0)
                }
            }
            ModelKind::AsPrinted => (2.0 * drag_per_m * u, 2.0 * drag_per_m * w, 0.0, 0.0),
        };
        jacobian[3][THETA] = -gravity_m_s2 * ct;
        jacobian[3][U] = drag_u;
        jacobian[3][W] = drag_w - q;
        jacobian[3][Q] = -w;
        jacobian[3][DELTA] = -thrust_m_s2 * sd;

        jacobian[4][THETA] = -gravity_m_s2 * st;
        jacobian[4][U] = q + across_u;
        jacobian[4][W] = across_w;
        jacobian[4][Q] = u;
        jacobian[4][DELTA] = -thrust_m_s2 * cd;

        jacobian[5][DELTA] = -thrust_n * cd * thrust_arm_m / pitch_inertia_kg_m2;
        jacobian
    }

    /// Second derivative of `weights . derivative` by the states and the gimbal angle.
    pub fn weighted_hessian(
        &self,
        state: &[f64; 6],
        gimbal_rad: f64,
        thrust_n: f64,
        weights: &[f64; 6],
    ) -> StageHessian {
        let [_, _, theta, u, w, _] = *state;
        let [wx, wz, _, wu, ww, wq] = *weights;
        let (st, ct) = libm::sincos(theta);
        let (sd, cd) = libm::sincos(gimbal_rad);
        let PlanarParams { mass_kg, pitch_inertia_kg_m2, thrust_arm_m, drag_per_m, gravity_m_s2, .. } =
            self.params;
        let thrust_m_s2 = thrust_n / mass_kg;
        let sign = self.lateral_sign();
        let mut hessian = [[0.0; 7]; 7];

        hessian[THETA][THETA] =
            wx * (-u * ct - sign * w * st) + wz * (-u * st + sign * w * ct) + wu * gravity_m_s2 * st
                - ww * gravity_m_s2 * ct;
        set(&mut hessian, THETA, U, -wx * st + wz * ct);
        set(&mut hessian, THETA, W, sign * (wx * ct + wz * st));
        set(&mut hessian, W, Q, -wu);
        set(&mut hessian, U, Q, ww);
        hessian[DELTA][DELTA] = -wu * thrust_m_s2 * cd
            + ww * thrust_m_s2 * sd
            + wq * thrust_n * sd * thrust_arm_m / pitch_inertia_kg_m2;

        let scale = wu * drag_per_m;
        match self.kind {
            ModelKind::Consistent => {
                let speed = libm::sqrt(u * u + w * w);
                if speed > REST_SPEED_M_S {
                    let (a, b) = (u / speed, w / speed);
                    hessian[U][U] -= scale * a * (3.0 - a * a);
                    hessian[W][W] -= scale * a * (1.0 - b * b);
                    let across = ww * self.params.lateral_drag_per_m;
                    hessian[U][U] -= across * b * (1.0 - a * a);
                    hessian[W][W] -= across * b * (3.0 - b * b);
                    set(&mut hessian, U, W, -scale * b * (1.0 - a * a) - across * a * (1.0 - b * b));
                    // The crossflow's second derivative changes sign with w.
                    hessian[W][W] -= ww * 2.0 * self.params.crossflow_per_m * w.signum();
                }
            }
            ModelKind::AsPrinted => {
                hessian[U][U] += 2.0 * scale;
                hessian[W][W] += 2.0 * scale;
            }
        }
        hessian
    }

    /// The sign of `w sin(theta)` in the horizontal velocity, in which the two rotations differ.
    fn lateral_sign(&self) -> f64 {
        match self.kind {
            ModelKind::Consistent => 1.0,
            ModelKind::AsPrinted => -1.0,
        }
    }
}

fn set(hessian: &mut StageHessian, row: usize, column: usize, value: f64) {
    hessian[row][column] = value;
    hessian[column][row] = value;
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::{FRAC_PI_2, FRAC_PI_3};
    use proptest::prelude::*;

    use crate::problem;

    const KINDS: [ModelKind; 2] = [ModelKind::Consistent, ModelKind::AsPrinted];

    fn model(kind: ModelKind) -> PlanarModel {
        PlanarModel { kind, ..paper::model() }
    }

    /// Both kinds, each with all its air forces.
    fn models_in_air() -> [PlanarModel; 2] {
        KINDS.map(|kind| {
            let mut model = model(kind);
            model.params.lateral_drag_per_m = 0.07;
            model.params.crossflow_per_m = 0.04;
            model
        })
    }

    /// One axis at a time: 3 m/s across are slowed by (0.07 + 0.04) 9 m/s^2. With 5 m/s along, the drag across grows with
    /// the total speed, but the crossflow does not.
    #[test]
    fn val_closed_form_air_forces_across() {
        let [model, _] = models_in_air();
        for (u, w, expected) in
            [(0.0, 3.0, -0.99), (0.0, -3.0, 0.99), (-4.0, 3.0, -0.07 * 15.0 - 0.36), (-4.0, 0.0, 0.0)]
        {
            let slope = model.derivative(&[0.0, 0.0, FRAC_PI_2, u, w, 0.0], 0.0, 0.0);
            assert!((slope[4] - expected).abs() < 1e-12, "{u} {w}: {}", slope[4]);
        }
    }

    #[test]
    fn a_lighter_vehicle_feels_the_same_air_force() {
        let [model, _] = models_in_air();
        let light = model.with_mass(0.5 * model.params.mass_kg);
        let state = [0.0, 0.0, FRAC_PI_2, -8.0, 3.0, 0.0];
        let (heavy, light) = (model.derivative(&state, 0.1, 20.0), light.derivative(&state, 0.1, 20.0));
        assert!((light[3] + 9.81 - 2.0 * (heavy[3] + 9.81)).abs() < 1e-12, "{light:?}");
        assert!((light[4] - 2.0 * heavy[4]).abs() < 1e-12, "{light:?}");
        assert!((light[5] - heavy[5]).abs() < 1e-15, "{light:?}");
    }

    /// Energy gained over one second of coasting without drag, J/kg, from 30 deg off the vertical with sideways speed.
    fn coasting_energy_gain_j_kg(kind: ModelKind) -> f64 {
        let mut model = model(kind);
        model.params.drag_per_m = 0.0;
        let mut state =
            PlanarState { z_m: 15.0, theta_rad: FRAC_PI_3, u_m_s: -5.0, w_m_s: 1.0, q_rad_s: 0.3, x_m: 0.0 };
        let before = model.specific_energy_j_kg(&state);
        for _ in 0..1000 {
            state = model.rk4_step(&state, 0.1, 0.0, 1e-3);
        }
        model.specific_energy_j_kg(&state) - before
    }

    #[test]
    fn val_energy_conservation_consistent_model_coasts_without_gain() {
        assert!(coasting_energy_gain_j_kg(ModelKind::Consistent).abs() < 1e-10);
    }

    /// The printed rotation and the printed gravity belong to different frames: with 147 J/kg of height, 12.5 J/kg appear
    /// without a source within a second.
    #[test]
    fn val_energy_conservation_printed_model_breaks_it() {
        let gain = coasting_energy_gain_j_kg(ModelKind::AsPrinted);
        println!("energy error of Eq. 18-22 as printed: {gain:.2} J/kg in 1 s");
        assert!(gain.abs() > 10.0, "{gain}");
    }

    /// Tilted by phi, the printed set makes gravity act as g cos(2 phi) on the height instead of g.
    #[test]
    fn val_printed_model_halves_gravity_at_30_degrees() {
        for (kind, expected) in [(ModelKind::Consistent, -9.81), (ModelKind::AsPrinted, -9.81 * 0.5)] {
            let mut model = model(kind);
            model.params.drag_per_m = 0.0;
            let rest = PlanarState { theta_rad: FRAC_PI_2 - 30.0_f64.to_radians(), ..PlanarState::default() };
            let step_s = 1e-3;
            let fallen = model.rk4_step(&rest, 0.0, 0.0, step_s);
            let acceleration = 2.0 * fallen.z_m / (step_s * step_s);
            assert!((acceleration - expected).abs() < 1e-6, "{kind:?}: {acceleration}");
        }
    }

    /// Upright flight without drag has the closed form z = z0 + v t + (T/m - g) t^2 / 2, which the integrator must give.
    #[test]
    fn val_closed_form_upright_burn() {
        let mut model = model(ModelKind::Consistent);
        model.params.drag_per_m = 0.0;
        let mut state =
            PlanarState { z_m: 15.0, theta_rad: FRAC_PI_2, u_m_s: -5.0, ..PlanarState::default() };
        for _ in 0..20 {
            state = model.rk4_step(&state, 0.0, 30.0, 0.1);
        }
        let expected = 15.0 - 10.0 + 0.5 * (10.0 - 9.81) * 4.0;
        assert!((state.z_m - expected).abs() < 1e-12, "{}", state.z_m);
    }

    fn stage() -> impl Strategy<Value = ([f64; 6], f64)> {
        let range = |limit: f64| -limit..limit;
        (range(20.0), 0.0..20.0, 0.2..2.9, range(8.0), range(8.0), range(3.0), range(0.35))
            .prop_map(|(x, z, theta, u, w, q, delta)| ([x, z, theta, u, w, q], delta))
            .prop_filter("drag is not twice differentiable at rest", |(state, _)| {
                // The crossflow's second derivative jumps at w = 0, too.
                state[U_INDEX].abs() + state[W_INDEX].abs() > 0.1 && state[W_INDEX].abs() > 1e-3
            })
    }

    const U_INDEX: usize = 3;
    const W_INDEX: usize = 4;

    /// Central difference of a vector function of the seven stage variables.
    fn difference<const N: usize>(
        function: impl Fn(&[f64; 6], f64) -> [f64; N],
        (state, delta): ([f64; 6], f64),
        variable: usize,
    ) -> [f64; N] {
        let step = 1e-5;
        let at = |side: f64| {
            let (mut state, mut delta) = (state, delta);
            match state.get_mut(variable) {
                Some(component) => *component += side * step,
                None => delta += side * step,
            }
            function(&state, delta)
        };
        let (ahead, behind) = (at(1.0), at(-1.0));
        core::array::from_fn(|i| (ahead[i] - behind[i]) / (2.0 * step))
    }

    proptest! {
        #[test]
        fn val_finite_differences_jacobian(point in stage()) {
            for model in models_in_air() {
                let kind = model.kind;
                let jacobian = model.jacobian(&point.0, point.1, 33.3);
                for variable in 0..7 {
                    let column = difference(|x, d| model.derivative(x, d, 33.3), point, variable);
                    for (row, (line, expected)) in jacobian.iter().zip(column).enumerate() {
                        let error = (line[variable] - expected).abs();
                        prop_assert!(error < 1e-7 * (1.0 + expected.abs()), "{kind:?} [{row}][{variable}]: {error}");
                    }
                }
            }
        }

        #[test]
        fn val_finite_differences_weighted_hessian(
            point in stage(),
            weights in prop::array::uniform6(-3.0..3.0_f64),
        ) {
            for model in models_in_air() {
                let kind = model.kind;
                let hessian = model.weighted_hessian(&point.0, point.1, 33.3, &weights);
                let gradient = |x: &[f64; 6], d: f64| -> [f64; 7] {
                    let jacobian = model.jacobian(x, d, 33.3);
                    core::array::from_fn(|j| (0..6).map(|i| weights[i] * jacobian[i][j]).sum())
                };
                for variable in 0..7 {
                    let column = difference(gradient, point, variable);
                    for (row, (line, expected)) in hessian.iter().zip(column).enumerate() {
                        let error = (line[variable] - expected).abs();
                        prop_assert!(error < 1e-6 * (1.0 + expected.abs()), "{kind:?} [{row}][{variable}]: {error}");
                    }
                }
            }
        }
    }
}
