//! The inputs and results of the evaluation of intervals, for several nodes at once.
#![expect(clippy::inline_always, reason = "inlined into one loop body over vector registers")]

use super::lanes::Lanes;
use crate::dynamics::{ModelKind, PlanarModel};

/// Directions of differentiation: theta, u, w, q, delta.
pub(super) const DIRECTIONS: usize = 5;
pub(super) const TH: usize = 0;
pub(super) const U: usize = 1;
pub(super) const W: usize = 2;
pub(super) const Q: usize = 3;
pub(super) const D: usize = 4;

/// Number of entries of a symmetric matrix over the directions.
pub(super) const PAIRS: usize = 15;

/// Position of each pair of directions in a packed upper triangle, row by row.
pub(super) const fn pair(row: usize, column: usize) -> usize {
    row * (9 - row) / 2 + column
}

/// Sign of `w sin(theta)` in the horizontal velocity, by which the printed equations differ.
pub(super) const fn lateral_sign(printed: bool) -> f64 {
    if printed { -1.0 } else { 1.0 }
}

/// The constants of an interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Constants {
    pub(super) step_s: f64,
    pub(super) mass_kg: f64,
    pub(super) arm_per_inertia: f64,
    /// These three at the model's own mass.
    pub(super) drag_per_m: f64,
    pub(super) lateral_drag_per_m: f64,
    pub(super) crossflow_per_m: f64,
    pub(super) gravity_m_s2: f64,
    pub(super) printed: bool,
}

impl Constants {
    pub(super) fn of(model: &PlanarModel, step_s: f64) -> Self {
        let params = &model.params;
        let printed = model.kind == ModelKind::AsPrinted;
        Self {
            step_s,
            mass_kg: params.mass_kg,
            arm_per_inertia: params.thrust_arm_m / params.pitch_inertia_kg_m2,
            drag_per_m: params.drag_per_m,
            lateral_drag_per_m: params.lateral_drag_per_m,
            crossflow_per_m: params.crossflow_per_m,
            gravity_m_s2: params.gravity_m_s2,
            printed,
        }
    }

    /// Whether there is an air force across the body; without it the equations are shorter.
    pub(super) fn pushed_across(&self) -> bool {
        !self.printed && (self.lateral_drag_per_m != 0.0 || self.crossflow_per_m != 0.0)
    }
}

/// The points of linearisation: state at the beginning of each interval, input, thrust, mass, and the costate of the
/// state after it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Points {
    pub(super) state: [Lanes; 6],
    pub(super) gimbal: Lanes,
    pub(super) thrust: Lanes,
    pub(super) inverse_mass: Lanes,
    /// The model's own mass divided by the mass in the interval.
    pub(super) lightness: Lanes,
    pub(super) costate: [Lanes; 6],
}

impl Points {
    /// At rest, at the model's own mass.
    pub(super) fn rest(c: &Constants) -> Self {
        Self {
            state: [Lanes::ZERO; 6],
            gimbal: Lanes::ZERO,
            thrust: Lanes::ZERO,
            inverse_mass: Lanes::splat(1.0 / c.mass_kg),
            lightness: Lanes::splat(1.0),
            costate: [Lanes::ZERO; 6],
        }
    }
}

/// Intervals and their derivatives.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Block {
    /// The state after the interval.
    pub(super) after: [Lanes; 6],
    /// Derivative of `lambda . step` by theta, u, w, q, delta; by x and z it is lambda's own.
    pub(super) pulled: [Lanes; DIRECTIONS],
    /// Derivatives of x, z, u and w after the interval by the directions.
    pub(super) tangent: [[Lanes; DIRECTIONS]; 4],
    /// Derivative of q after the interval by delta; that of theta is half a step times it.
    pub(super) turn: Lanes,
    /// Second derivative of `lambda . step` by the directions, packed.
    pub(super) curvature: [Lanes; PAIRS],
}

impl Block {
    pub(super) const EMPTY: Self = Self {
        after: [Lanes::ZERO; 6],
        pulled: [Lanes::ZERO; DIRECTIONS],
        tangent: [[Lanes::ZERO; DIRECTIONS]; 4],
        turn: Lanes::ZERO,
        curvature: [Lanes::ZERO; PAIRS],
    };
}

/// The values that are constant over the interval.
#[derive(Clone, Copy)]
pub(super) struct Held {
    /// Acceleration along the nose axis and along the second body axis, m/s^2. Except for the sign, each is the
    /// derivative of the other by the gimbal angle.
    pub(super) push: Lanes,
    pub(super) side: Lanes,
    /// Pitch acceleration, rad/s^2, and its derivative by the gimbal angle.
    pub(super) turn_acc: Lanes,
    pub(super) turn_acc_d: Lanes,
    /// Air forces per mass and squared speed, 1/m.
    pub(super) drag: Lanes,
    pub(super) lateral_drag: Lanes,
    pub(super) crossflow: Lanes,
}

impl Held {
    #[inline(always)]
    pub(super) fn of(c: &Constants, points: &Points) -> Self {
        let (sin, cos) = points.gimbal.sin_cos();
        let acceleration = points.thrust * points.inverse_mass;
        let torque = points.thrust * c.arm_per_inertia;
        Self {
            push: acceleration * cos,
            side: -(acceleration * sin),
            turn_acc: -(torque * sin),
            turn_acc_d: -(torque * cos),
            drag: points.lightness * c.drag_per_m,
            lateral_drag: points.lightness * c.lateral_drag_per_m,
            crossflow: points.lightness * c.crossflow_per_m,
        }
    }
}

/// The values of a stage that the derivatives need.
#[derive(Clone, Copy)]
pub(super) struct Stage {
    pub(super) sin: Lanes,
    pub(super) cos: Lanes,
    pub(super) u: Lanes,
    pub(super) w: Lanes,
    pub(super) q: Lanes,
    pub(super) x_dot: Lanes,
    pub(super) z_dot: Lanes,
    pub(super) u_dot: Lanes,
    pub(super) w_dot: Lanes,
    /// Derivative of the drag's acceleration by u and w.
    pub(super) drag_u: Lanes,
    pub(super) drag_w: Lanes,
    /// Derivative of the air's acceleration across the body by u and w.
    pub(super) across_u: Lanes,
    pub(super) across_w: Lanes,
    /// u and w over the speed.
    pub(super) along: Lanes,
    pub(super) across: Lanes,
}

pub(super) const WEIGHTS: [f64; 4] = [1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0];
/// The fraction of the step at which a stage lies, by which q and delta move its pitch and pitch rate.
pub(super) const AHEAD: [f64; 4] = [0.0, 0.5, 0.5, 1.0];
/// Fraction of half a squared step by which the pitch acceleration moves a stage's pitch.
pub(super) const TURNED: [f64; 4] = [0.0, 0.0, 0.5, 1.0];
