//! One interval's RK4 step with its adjoint, tangent and adjoint-weighted curvature, for several nodes at once.
//!
//! Notation as in the step itself: `X_1..X_4` the stage states, `k_i = f(X_i, delta)`, `f` the planar equations of
//! [`crate::dynamics`]. What the equations make simple is used:
//!
//! * Nothing depends on `x` and `z`: they are integrals, and no direction of differentiation.
//! * `q'` depends on `delta` alone, so `q` and `theta` of every stage are known in closed form, and of the tangents
//!   only those of `u` and `w` are propagated.
//!
//! The directions of differentiation are (theta, u, w, q, delta). The second derivative of `lambda . step` is the sum
//! over the stages of (tangent)^T (second derivative of the slope weighted by its adjoint) (tangent): the step is a
//! composition in which only `f` is nonlinear.

use super::lanes::{LANES, Lanes};
use crate::dynamics::{ModelKind, PlanarModel};

/// Directions of differentiation: theta, u, w, q, delta.
pub(super) const DIRECTIONS: usize = 5;
const TH: usize = 0;
const U: usize = 1;
const W: usize = 2;
const Q: usize = 3;
const D: usize = 4;

/// Number of entries of a symmetric matrix over the directions.
pub(super) const PAIRS: usize = 15;

/// Position of each pair of directions in a packed upper triangle, row by row.
pub(super) const fn pair(row: usize, column: usize) -> usize {
    row * (9 - row) / 2 + column
}

/// Below this speed (m/s) the drag's derivatives, which have no limit at rest, count as zero.
const REST_SPEED_M_S: f64 = 1e-9;

/// The constants of an interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Constants {
    pub(super) step_s: f64,
    inverse_mass: f64,
    arm_per_inertia: f64,
    drag_per_m: f64,
    gravity_m_s2: f64,
    /// Sign of `w sin(theta)` in the horizontal velocity; -1 in the printed equations.
    lateral: f64,
    printed: bool,
}

impl Constants {
    pub(super) fn of(model: &PlanarModel, step_s: f64) -> Self {
        let params = &model.params;
        let printed = model.kind == ModelKind::AsPrinted;
        Self {
            step_s,
            inverse_mass: 1.0 / params.mass_kg,
            arm_per_inertia: params.thrust_arm_m / params.pitch_inertia_kg_m2,
            drag_per_m: params.drag_per_m,
            gravity_m_s2: params.gravity_m_s2,
            lateral: if printed { -1.0 } else { 1.0 },
            printed,
        }
    }
}

/// Where intervals are linearised: state at their beginning, input, thrust, and the costate of the state after them.
#[derive(Debug, Clone, Copy)]
pub(super) struct Points {
    pub(super) state: [Lanes; 6],
    pub(super) gimbal: Lanes,
    pub(super) thrust: Lanes,
    pub(super) costate: [Lanes; 6],
}

impl Points {
    pub(super) const REST: Self =
        Self { state: [Lanes::ZERO; 6], gimbal: Lanes::ZERO, thrust: Lanes::ZERO, costate: [Lanes::ZERO; 6] };
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

/// What the derivatives need of a stage.
#[derive(Clone, Copy)]
struct Stage {
    sin: Lanes,
    cos: Lanes,
    u: Lanes,
    w: Lanes,
    q: Lanes,
    x_dot: Lanes,
    z_dot: Lanes,
    /// Derivative of the drag's acceleration by u and w.
    drag_u: Lanes,
    drag_w: Lanes,
    /// u and w over the speed.
    along: Lanes,
    across: Lanes,
}

const WEIGHTS: [f64; 4] = [1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0];
/// How far along the step a stage lies, by which q and delta move its pitch and pitch rate.
const AHEAD: [f64; 4] = [0.0, 0.5, 0.5, 1.0];
/// Share of half a squared step by which the pitch acceleration moves a stage's pitch.
const TURNED: [f64; 4] = [0.0, 0.0, 0.5, 1.0];

/// Evaluates intervals; with `DERIVATIVES`, tangent and curvature too, without only `after` and `pulled`.
#[inline(always)]
#[expect(clippy::too_many_lines, reason = "one straight line of arithmetic, in the order of the equations")]
pub(super) fn evaluate<const DERIVATIVES: bool>(c: &Constants, points: &Points, block: &mut Block) {
    let h = c.step_s;
    let [x0, z0, th0, u0, w0, q0] = points.state;
    let (sin_d, cos_d) = points.gimbal.sin_cos();
    let thrust_acc = points.thrust * c.inverse_mass;
    let push = thrust_acc * cos_d;
    let side = -(thrust_acc * sin_d);
    let torque = points.thrust * c.arm_per_inertia;
    let turn_acc = -(torque * sin_d);
    let turn_acc_d = -(torque * cos_d);

    // The four stages.
    let mut stages = [Stage {
        sin: Lanes::ZERO,
        cos: Lanes::ZERO,
        u: u0,
        w: w0,
        q: q0,
        x_dot: Lanes::ZERO,
        z_dot: Lanes::ZERO,
        drag_u: Lanes::ZERO,
        drag_w: Lanes::ZERO,
        along: Lanes::ZERO,
        across: Lanes::ZERO,
    }; 4];
    let (mut x_sum, mut z_sum, mut u_sum, mut w_sum) = (Lanes::ZERO, Lanes::ZERO, Lanes::ZERO, Lanes::ZERO);
    let (mut u, mut w) = (u0, w0);
    for i in 0..4 {
        let theta = th0 + (q0 * AHEAD[i] + turn_acc * (0.5 * h * TURNED[i])) * h;
        let q = q0 + turn_acc * (h * AHEAD[i]);
        let (sin, cos) = theta.sin_cos();
        let squared = u * u + w * w;
        let (drag, drag_u, drag_w, along, across);
        if c.printed {
            drag = squared * c.drag_per_m;
            drag_u = u * (2.0 * c.drag_per_m);
            drag_w = w * (2.0 * c.drag_per_m);
            (along, across) = (Lanes::ZERO, Lanes::ZERO);
        } else {
            let speed = squared.sqrt();
            let inverse = speed.reciprocal_above(REST_SPEED_M_S);
            along = u * inverse;
            across = w * inverse;
            drag = speed * u * -c.drag_per_m;
            drag_u = (speed + u * along) * -c.drag_per_m;
            drag_w = u * across * -c.drag_per_m;
        }
        let lateral = w * c.lateral;
        let x_dot = u * cos + lateral * sin;
        let z_dot = u * sin - lateral * cos;
        let u_dot = push + drag - sin * c.gravity_m_s2 - q * w;
        let w_dot = side + cos * c.gravity_m_s2 + q * u;
        x_sum += x_dot * WEIGHTS[i];
        z_sum += z_dot * WEIGHTS[i];
        u_sum += u_dot * WEIGHTS[i];
        w_sum += w_dot * WEIGHTS[i];
        stages[i] = Stage { sin, cos, u, w, q, x_dot, z_dot, drag_u, drag_w, along, across };
        if i < 3 {
            u = u0 + u_dot * (h * AHEAD[i + 1]);
            w = w0 + w_dot * (h * AHEAD[i + 1]);
        }
    }
    block.after = [
        x0 + x_sum * h,
        z0 + z_sum * h,
        th0 + (q0 + turn_acc * (0.5 * h)) * h,
        u0 + u_sum * h,
        w0 + w_sum * h,
        q0 + turn_acc * h,
    ];

    // Adjoints of the stages' slopes, last stage first.
    let [lx, lz, lt, lu, lw, lq] = points.costate;
    let mut pulled = [lt, lu, lw, lq, Lanes::ZERO];
    let mut slope_adjoints = [[Lanes::ZERO; 5]; 4];
    let mut later = [Lanes::ZERO; 4];
    for i in (0..4).rev() {
        let stage = &stages[i];
        let weight = WEIGHTS[i] * h;
        let (kx, kz) = (lx * weight, lz * weight);
        let (mut kt, mut ku, mut kw, mut kq) = (lt * weight, lu * weight, lw * weight, lq * weight);
        if i < 3 {
            let along = AHEAD[i + 1] * h;
            kt += later[TH] * along;
            ku += later[U] * along;
            kw += later[W] * along;
            kq += later[Q] * along;
        }
        let heading = kx * stage.cos + kz * stage.sin;
        let sideways = (kx * stage.sin - kz * stage.cos) * c.lateral;
        later = [
            kz * stage.x_dot - kx * stage.z_dot - (ku * stage.cos + kw * stage.sin) * c.gravity_m_s2,
            heading + ku * stage.drag_u + kw * stage.q,
            sideways + ku * (stage.drag_w - stage.q),
            kt - ku * stage.w + kw * stage.u,
        ];
        pulled[TH] += later[TH];
        pulled[U] += later[U];
        pulled[W] += later[W];
        pulled[Q] += later[Q];
        pulled[D] += ku * side - kw * push + kq * turn_acc_d;
        slope_adjoints[i] = [kx, kz, ku, kw, kq];
    }
    block.pulled = pulled;
    if !DERIVATIVES {
        return;
    }

    // Tangents of u and w from stage to stage, of x, z, u and w over the step, and the curvature.
    let mut tu = [Lanes::ZERO, Lanes::splat(1.0), Lanes::ZERO, Lanes::ZERO, Lanes::ZERO];
    let mut tw = [Lanes::ZERO, Lanes::ZERO, Lanes::splat(1.0), Lanes::ZERO, Lanes::ZERO];
    let mut sums = [[Lanes::ZERO; DIRECTIONS]; 4];
    let mut hessian = [Lanes::ZERO; PAIRS];
    for i in 0..4 {
        let s = &stages[i];
        let [kx, kz, ku, kw, kq] = slope_adjoints[i];
        // Tangents of this stage's pitch by q and delta, and of its pitch rate by delta.
        let (tq, qd) = (AHEAD[i] * h, turn_acc_d * (AHEAD[i] * h));
        let td = turn_acc_d * (0.5 * h * h * TURNED[i]);

        // Curvature of the slope by (theta, u, w, q), weighted.
        let tt = (ku * s.sin - kw * s.cos) * c.gravity_m_s2 - kx * s.x_dot - kz * s.z_dot;
        let t_u = kz * s.cos - kx * s.sin;
        let t_w = (kx * s.cos + kz * s.sin) * c.lateral;
        let (uu, uw, ww);
        if c.printed {
            uu = ku * (2.0 * c.drag_per_m);
            ww = uu;
            uw = Lanes::ZERO;
        } else {
            let scale = ku * -c.drag_per_m;
            let (aa, bb) = (s.along * s.along, s.across * s.across);
            uu = scale * s.along * (Lanes::splat(3.0) - aa);
            ww = scale * s.along * (Lanes::splat(1.0) - bb);
            uw = scale * s.across * (Lanes::splat(1.0) - aa);
        }
        let (u_q, w_q) = (kw, -ku);
        if i == 0 {
            hessian[pair(TH, TH)] += tt;
            hessian[pair(TH, U)] += t_u;
            hessian[pair(TH, W)] += t_w;
            hessian[pair(U, U)] += uu;
            hessian[pair(U, W)] += uw;
            hessian[pair(W, W)] += ww;
            hessian[pair(U, Q)] += u_q;
            hessian[pair(W, Q)] += w_q;
        } else {
            // Columns of (curvature) (tangent).
            let mut ct = [Lanes::ZERO; DIRECTIONS];
            let mut cu = [Lanes::ZERO; DIRECTIONS];
            let mut cw = [Lanes::ZERO; DIRECTIONS];
            let mut cq = [Lanes::ZERO; DIRECTIONS];
            for j in 0..DIRECTIONS {
                ct[j] = t_u * tu[j] + t_w * tw[j];
                cu[j] = uu * tu[j] + uw * tw[j];
                cw[j] = uw * tu[j] + ww * tw[j];
                cq[j] = u_q * tu[j] + w_q * tw[j];
            }
            ct[TH] += tt;
            cu[TH] += t_u;
            cw[TH] += t_w;
            ct[Q] += tt * tq;
            cu[Q] += t_u * tq + u_q;
            cw[Q] += t_w * tq + w_q;
            ct[D] += tt * td;
            cu[D] += t_u * td + u_q * qd;
            cw[D] += t_w * td + w_q * qd;
            for row in 0..DIRECTIONS {
                for column in row..DIRECTIONS {
                    hessian[pair(row, column)] += tu[row] * cu[column] + tw[row] * cw[column];
                }
            }
            for column in 0..DIRECTIONS {
                hessian[pair(TH, column)] += ct[column];
            }
            hessian[pair(Q, Q)] += ct[Q] * tq + cq[Q];
            hessian[pair(Q, D)] += ct[D] * tq + cq[D];
            hessian[pair(D, D)] += ct[D] * td + cq[D] * qd;
        }
        hessian[pair(D, D)] += kw * -side - ku * push - kq * turn_acc;

        // Tangents of the slope.
        let ut = s.cos * -c.gravity_m_s2;
        let wt = s.sin * -c.gravity_m_s2;
        let (ru, rw) = (s.drag_u, s.drag_w - s.q);
        let mut du = [Lanes::ZERO; DIRECTIONS];
        let mut dw = [Lanes::ZERO; DIRECTIONS];
        let mut dx = [Lanes::ZERO; DIRECTIONS];
        let mut dz = [Lanes::ZERO; DIRECTIONS];
        let (ls, lc) = (s.sin * c.lateral, s.cos * c.lateral);
        if i == 0 {
            du = [ut, ru, rw, -s.w, side];
            dw = [wt, s.q, Lanes::ZERO, s.u, -push];
            dx = [-s.z_dot, s.cos, ls, Lanes::ZERO, Lanes::ZERO];
            dz = [s.x_dot, s.sin, -lc, Lanes::ZERO, Lanes::ZERO];
        } else {
            for j in 0..DIRECTIONS {
                du[j] = ru * tu[j] + rw * tw[j];
                dw[j] = s.q * tu[j];
                dx[j] = s.cos * tu[j] + ls * tw[j];
                dz[j] = s.sin * tu[j] - lc * tw[j];
            }
            du[TH] += ut;
            dw[TH] += wt;
            dx[TH] -= s.z_dot;
            dz[TH] += s.x_dot;
            du[Q] += ut * tq - s.w;
            dw[Q] += wt * tq + s.u;
            dx[Q] -= s.z_dot * tq;
            dz[Q] += s.x_dot * tq;
            du[D] += ut * td - s.w * qd + side;
            dw[D] += wt * td + s.u * qd - push;
            dx[D] -= s.z_dot * td;
            dz[D] += s.x_dot * td;
        }
        let weight = WEIGHTS[i] * h;
        for j in 0..DIRECTIONS {
            sums[0][j] += dx[j] * weight;
            sums[1][j] += dz[j] * weight;
            sums[2][j] += du[j] * weight;
            sums[3][j] += dw[j] * weight;
        }
        if i < 3 {
            let along = AHEAD[i + 1] * h;
            for j in 0..DIRECTIONS {
                tu[j] = du[j] * along;
                tw[j] = dw[j] * along;
            }
            tu[U] += Lanes::splat(1.0);
            tw[W] += Lanes::splat(1.0);
        }
    }
    sums[2][U] += Lanes::splat(1.0);
    sums[3][W] += Lanes::splat(1.0);
    block.tangent = sums;
    block.turn = turn_acc_d * h;
    block.curvature = hessian;
}

/// Number of blocks that hold `intervals`.
pub(super) fn blocks_for(intervals: usize) -> usize {
    intervals.div_ceil(LANES)
}
