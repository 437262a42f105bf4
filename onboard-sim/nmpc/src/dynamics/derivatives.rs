//! Exact first and second derivatives of the planar equations, written by hand.

use super::{ModelKind, PlanarModel, PlanarParams};

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
