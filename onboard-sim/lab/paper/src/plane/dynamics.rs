//! The planar (longitudinal) equations of motion of the landing burn, their integrator and their
//! derivatives.
//!
//! Frames: `x` horizontal, `z` altitude, up. Pitch `theta` from the horizontal, pi/2 upright. Body
//! axes `e_x = (cos theta, sin theta)`, towards the nose, and `e_z = (sin theta, -cos theta)`; `(u,
//! w)` is the velocity along them and `q = d(theta)/dt`. The gimbal angle `delta` is positive for a
//! pitch-down manoeuvre.
//!
//! ```text
//! x'     = u cos(theta) + w sin(theta)
//! z'     = u sin(theta) - w cos(theta)
//! theta' = q
//! u'     = (T/m) cos(delta) - (rho S Cx / 2m) V u - g sin(theta) - q w
//! w'     = -(T/m) sin(delta) + g cos(theta) + q u
//! q'     = -T sin(delta) (X_CG - X_THR) / I_y
//! ```
//!
//! This is the landing paper (`EuroGNC`), Eq. 18-22, put into one frame and with forces divided by
//! mass; see [`ModelKind`] for the printed set.

/// The set of planar equations.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ModelKind {
    /// One frame throughout: energy is conserved without thrust and drag.
    Consistent,
    /// Eq. 18-22 of the landing paper with forces divided by mass and no other correction: the
    /// rotation and the gravity terms belong to different frames. For replication only.
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

    /// Velocity over the ground `(horizontal, up)`, m/s, in the consistent frame.
    pub fn ground_velocity_m_s(&self) -> (f64, f64) {
        let (sin, cos) = libm::sincos(self.theta_rad);
        (self.u_m_s * cos + self.w_m_s * sin, self.u_m_s * sin - self.w_m_s * cos)
    }
}

/// The planar equations of motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlanarModel {
    /// Which set of equations.
    pub kind: ModelKind,
    pub mass_kg: f64,
    /// Moment of inertia about the pitch axis, kg m^2.
    pub pitch_inertia_kg_m2: f64,
    /// Distance from the nozzle pivot forward to the centre of gravity, m.
    pub thrust_arm_m: f64,
    /// `rho S Cx / 2m`: drag deceleration per squared speed, 1/m.
    pub drag_per_m: f64,
    pub gravity_m_s2: f64,
}

impl PlanarModel {
    /// Time derivative of the state (x, z, theta, u, w, q), SI and radians.
    pub fn derivative(&self, state: &[f64; 6], gimbal_rad: f64, thrust_n: f64) -> [f64; 6] {
        Motion::of(self, state, gimbal_rad, thrust_n).rates()
    }

    /// One classical fourth-order Runge-Kutta step of `step_s` with input and thrust held.
    pub fn rk4_step(&self, state: &PlanarState, gimbal_rad: f64, thrust_n: f64, step_s: f64) -> PlanarState {
        let state = state.to_array();
        PlanarState::from_array(end(&state, &self.stages(&state, gimbal_rad, thrust_n, step_s), step_s))
    }

    /// The stages of that step.
    pub(super) fn stages(
        &self,
        state: &[f64; 6],
        gimbal_rad: f64,
        thrust_n: f64,
        step_s: f64,
    ) -> [Motion; 4] {
        let mut slope = [0.0; 6];
        AHEAD.map(|ahead| {
            let stage = Motion::of(self, &along(state, &slope, ahead * step_s), gimbal_rad, thrust_n);
            slope = stage.rates();
            stage
        })
    }

    /// Kinetic plus potential energy of translation, per kilogram, J/kg.
    pub fn specific_energy_j_kg(&self, state: &PlanarState) -> f64 {
        0.5 * (state.u_m_s * state.u_m_s + state.w_m_s * state.w_m_s) + self.gravity_m_s2 * state.z_m
    }
}

/// The motion at a state, for its rates and their derivatives by pitch, `u`, `w`, pitch rate and
/// gimbal angle.
pub(super) struct Motion {
    state: [f64; 6],
    /// Sine and cosine of the pitch.
    turned: (f64, f64),
    gravity_m_s2: f64,
    /// 1, or -1 where the printed rotation (Eq. 22) turns `w` the other way.
    lateral: f64,
    /// Accelerations by the thrust: along the axis, across it (its derivative by the gimbal angle),
    /// and of the pitch, with its derivative by that angle.
    push: f64,
    side: f64,
    turn: f64,
    turn_by_gimbal: f64,
    /// The drag's acceleration along the axis, its derivatives by `u` and `w`, and those of second
    /// order: by `u` twice, by both, by `w` twice.
    drag: f64,
    drag_by: [f64; 2],
    drag_bent: [f64; 3],
}

impl Motion {
    pub(super) fn of(model: &PlanarModel, state: &[f64; 6], gimbal_rad: f64, thrust_n: f64) -> Self {
        /// Below it the direction of the drag, which is nothing then, is left out.
        const REST_SPEED_M_S: f64 = 1e-9;
        let [_, _, theta, u, w, _] = *state;
        let (sin, cos) = libm::sincos(gimbal_rad);
        let thrust_m_s2 = thrust_n / model.mass_kg;
        let turn_rad_s2 = thrust_n * model.thrust_arm_m / model.pitch_inertia_kg_m2;
        let (drag_per_m, speed) = (model.drag_per_m, libm::sqrt(u * u + w * w));
        let (lateral, drag, drag_by, drag_bent) = match model.kind {
            ModelKind::Consistent => {
                let [along, across] = if speed > REST_SPEED_M_S { [u / speed, w / speed] } else { [0.0; 2] };
                let by = [speed + u * along, u * across];
                let of_along = 1.0 - along * along;
                let bent = [along * (2.0 + of_along), across * of_along, along * (1.0 - across * across)];
                (1.0, speed * u, by, bent)
            }
            // The drag of Eq. 18, which always acts towards the nose.
            ModelKind::AsPrinted => (-1.0, -speed * speed, [-2.0 * u, -2.0 * w], [-2.0, 0.0, -2.0]),
        };
        Self {
            state: *state,
            turned: libm::sincos(theta),
            gravity_m_s2: model.gravity_m_s2,
            lateral,
            push: thrust_m_s2 * cos,
            side: -thrust_m_s2 * sin,
            turn: -turn_rad_s2 * sin,
            turn_by_gimbal: -turn_rad_s2 * cos,
            drag: -drag_per_m * drag,
            drag_by: drag_by.map(|by| -drag_per_m * by),
            drag_bent: drag_bent.map(|bent| -drag_per_m * bent),
        }
    }

    /// Time derivative of the state.
    pub(super) fn rates(&self) -> [f64; 6] {
        let ([_, _, _, u, w, q], (sin, cos), g) = (self.state, self.turned, self.gravity_m_s2);
        let w_level = self.lateral * w;
        [
            u * cos + w_level * sin,
            u * sin - w_level * cos,
            q,
            self.push + self.drag - g * sin - q * w,
            self.side + g * cos + q * u,
            self.turn,
        ]
    }

    /// Derivatives of the rates.
    pub(super) fn by_directions(&self) -> [[f64; 5]; 6] {
        let ([_, _, _, u, w, q], (sin, cos), g) = (self.state, self.turned, self.gravity_m_s2);
        let ([x_dot, z_dot, ..], [drag_u, drag_w]) = (self.rates(), self.drag_by);
        [
            [-z_dot, cos, self.lateral * sin, 0.0, 0.0],
            [x_dot, sin, -self.lateral * cos, 0.0, 0.0],
            [0.0, 0.0, 0.0, 1.0, 0.0],
            [-g * cos, drag_u, drag_w - q, -w, self.side],
            [-g * sin, q, 0.0, u, -self.push],
            [0.0, 0.0, 0.0, 0.0, self.turn_by_gimbal],
        ]
    }

    /// Second derivatives of the sum of the rates, each times its worth.
    pub(super) fn bent(&self, [kx, kz, _, ku, kw, kq]: &[f64; 6]) -> [[f64; 5]; 5] {
        let ((sin, cos), g, [x_dot, z_dot, ..]) = (self.turned, self.gravity_m_s2, self.rates());
        let pitch = g * (ku * sin - kw * cos) - kx * x_dot - kz * z_dot;
        let [pitch_u, pitch_w] = [kz * cos - kx * sin, self.lateral * (kx * cos + kz * sin)];
        let [uu, uw, ww] = self.drag_bent.map(|bent| ku * bent);
        let gimbal = -kw * self.side - ku * self.push - kq * self.turn;
        [
            [pitch, pitch_u, pitch_w, 0.0, 0.0],
            [pitch_u, uu, uw, *kw, 0.0],
            [pitch_w, uw, ww, -ku, 0.0],
            [0.0, *kw, -ku, 0.0, 0.0],
            [0.0, 0.0, 0.0, 0.0, gimbal],
        ]
    }
}

/// Of each stage of a Runge-Kutta step: its weight, and the part of the step after which it is.
pub(super) const WEIGHTS: [f64; 4] = [1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0];
pub(super) const AHEAD: [f64; 4] = [0.0, 0.5, 0.5, 1.0];

/// The state after a Runge-Kutta step of these stages.
pub(super) fn end(state: &[f64; 6], stages: &[Motion; 4], step_s: f64) -> [f64; 6] {
    let weighed = stages.iter().zip(WEIGHTS);
    weighed.fold(*state, |end, (stage, weight)| along(&end, &stage.rates(), weight * step_s))
}

/// `x + step * slope`.
fn along(x: &[f64; 6], slope: &[f64; 6], step: f64) -> [f64; 6] {
    core::array::from_fn(|i| x[i] + step * slope[i])
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::{FRAC_PI_2, FRAC_PI_3};

    use crate::problem;

    fn model(kind: ModelKind) -> PlanarModel {
        PlanarModel { kind, ..problem::model() }
    }

    /// Energy gained over one second of coasting without drag, J/kg, from 30 deg off the vertical
    /// with sideways speed.
    fn coasting_energy_gain_j_kg(kind: ModelKind) -> f64 {
        let mut model = model(kind);
        model.drag_per_m = 0.0;
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

    /// The printed rotation and the printed gravity belong to different frames: with 147 J/kg of
    /// height, 12.5 J/kg appear without a source within a second.
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
            model.drag_per_m = 0.0;
            let rest = PlanarState { theta_rad: FRAC_PI_2 - 30.0_f64.to_radians(), ..PlanarState::default() };
            let step_s = 1e-3;
            let fallen = model.rk4_step(&rest, 0.0, 0.0, step_s);
            let acceleration = 2.0 * fallen.z_m / (step_s * step_s);
            assert!((acceleration - expected).abs() < 1e-6, "{kind:?}: {acceleration}");
        }
    }

    /// Upright flight without drag has the closed form z = z0 + v t + (T/m - g) t^2 / 2, which the
    /// integrator must give.
    #[test]
    fn val_closed_form_upright_burn() {
        let mut model = model(ModelKind::Consistent);
        model.drag_per_m = 0.0;
        let mut state =
            PlanarState { z_m: 15.0, theta_rad: FRAC_PI_2, u_m_s: -5.0, ..PlanarState::default() };
        for _ in 0..20 {
            state = model.rk4_step(&state, 0.0, 30.0, 0.1);
        }
        let expected = 15.0 - 10.0 + 0.5 * (10.0 - 9.81) * 4.0;
        assert!((state.z_m - expected).abs() < 1e-12, "{}", state.z_m);
    }
}
