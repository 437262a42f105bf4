//! The planar (longitudinal) equations of motion of the landing burn, and their integrator.
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

mod derivatives;

pub use derivatives::{INPUT_INDEX, StageHessian, StageJacobian};

use serde::Deserialize;

/// The set of planar equations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
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

#[cfg(test)]
mod tests;
