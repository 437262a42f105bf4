//! One interval's RK4 step, its adjoint, its tangent and its curvature, for several nodes at once.
//!
//! Notation as in the step itself: `X_1..X_4` the stage states, `k_i = f(X_i, delta)`, `f` the planar equations of
//! [`crate::plane::dynamics`]. The code uses these simplifications:
//!
//! * Nothing depends on `x` and `z`: they are integrals, and no direction of differentiation.
//! * `q'` depends on `delta` alone, so `q` and `theta` of every stage are known in closed form, and of the tangents
//!   only those of `u` and `w` are propagated.
//!
//! The directions of differentiation are (theta, u, w, q, delta).
#![expect(clippy::inline_always, reason = "inlined into one loop body over vector registers")]

use super::lanes::Lanes;
use super::{
    AHEAD, Block, Constants, D, DIRECTIONS, Held, PAIRS, Points, Q, Stage, TH, TURNED, U, W, WEIGHTS,
    lateral_sign, pair,
};

/// Below this speed (m/s) the drag's derivatives count as zero, because they have no limit at rest.
const REST_SPEED_M_S: f64 = 1e-9;

/// Evaluates intervals. With `DERIVATIVES` it fills in tangent and curvature, too, otherwise only `after` and `pulled`.
/// `PRINTED` selects the equations: [`Constants::printed`].
#[inline(always)]
#[expect(clippy::too_many_lines, reason = "one straight line of arithmetic, in the order of the equations")]
pub(super) fn evaluate<const DERIVATIVES: bool, const PRINTED: bool>(
    c: &Constants,
    points: &Points,
    block: &mut Block,
) {
    let h = c.step_s;
    let [x0, z0, th0, u0, w0, q0] = points.state;
    let held = Held::of(c, points.gimbal);
    let Held { push, side, turn_acc, turn_acc_d } = held;

    // The four stages.
    let mut stages = [Stage {
        sin: Lanes::ZERO,
        cos: Lanes::ZERO,
        u: u0,
        w: w0,
        q: q0,
        x_dot: Lanes::ZERO,
        z_dot: Lanes::ZERO,
        u_dot: Lanes::ZERO,
        w_dot: Lanes::ZERO,
        drag_u: Lanes::ZERO,
        drag_w: Lanes::ZERO,
        along: Lanes::ZERO,
        across: Lanes::ZERO,
    }; 4];
    let (mut x_sum, mut z_sum, mut u_sum, mut w_sum) = (Lanes::ZERO, Lanes::ZERO, Lanes::ZERO, Lanes::ZERO);
    // Unrolled by a macro: the compiler would keep a loop, and multiply by the zeros of its tables.
    macro_rules! stage {
        ($i:literal) => {{
            const I: usize = $i;
            let (u, w) = if I == 0 {
                (u0, w0)
            } else {
                let Stage { u_dot, w_dot, .. } = stages[(I + 3) % 4];
                (u0 + u_dot * (h * AHEAD[I]), w0 + w_dot * (h * AHEAD[I]))
            };
            let (theta, q) = if I == 0 {
                (th0, q0)
            } else {
                let theta = th0 + (q0 * AHEAD[I] + turn_acc * (0.5 * h * TURNED[I])) * h;
                (theta, q0 + turn_acc * (h * AHEAD[I]))
            };
            let (sin, cos) = theta.sin_cos();
            let squared = u * u + w * w;
            let (drag, drag_u, drag_w, along, across);
            if PRINTED {
                drag = squared * c.drag_per_m;
                drag_u = u * (c.drag_per_m * 2.0);
                drag_w = w * (c.drag_per_m * 2.0);
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
            let lateral = w * lateral_sign(PRINTED);
            let x_dot = u * cos + lateral * sin;
            let z_dot = u * sin - lateral * cos;
            let u_dot = push + drag - sin * c.gravity_m_s2 - q * w;
            let w_dot = side + cos * c.gravity_m_s2 + q * u;
            x_sum += x_dot * WEIGHTS[I];
            z_sum += z_dot * WEIGHTS[I];
            u_sum += u_dot * WEIGHTS[I];
            w_sum += w_dot * WEIGHTS[I];
            stages[I] =
                Stage { sin, cos, u, w, q, x_dot, z_dot, u_dot, w_dot, drag_u, drag_w, along, across };
        }};
    }
    stage!(0);
    stage!(1);
    stage!(2);
    stage!(3);
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
    macro_rules! back {
        ($i:literal) => {{
            const I: usize = $i;
            let stage = &stages[I];
            let weight = WEIGHTS[I] * h;
            let (kx, kz) = (lx * weight, lz * weight);
            let (mut kt, mut ku, mut kw, mut kq) = (lt * weight, lu * weight, lw * weight, lq * weight);
            if I < 3 {
                let along = AHEAD[(I + 1) & 3] * h;
                kt += later[TH] * along;
                ku += later[U] * along;
                kw += later[W] * along;
                kq += later[Q] * along;
            }
            let heading = kx * stage.cos + kz * stage.sin;
            let sideways = (kx * stage.sin - kz * stage.cos) * lateral_sign(PRINTED);
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
            slope_adjoints[I] = [kx, kz, ku, kw, kq];
        }};
    }
    back!(3);
    back!(2);
    back!(1);
    back!(0);
    block.pulled = pulled;
    if DERIVATIVES {
        differentiate::<PRINTED>(c, &held, &stages, &slope_adjoints, block);
    }
}

// Tangent and adjoint-weighted curvature of one interval's step, for several nodes at once.
//
// The second derivative of `lambda . step` is the sum over the stages of (tangent)^T (second derivative of the slope
// weighted by its adjoint) (tangent): the step is a composition in which only `f` is nonlinear.

/// Fills in a block's tangent and curvature from the stages and the adjoints of their slopes by (x, z, u, w, q).
#[inline(always)]
#[expect(clippy::too_many_lines, reason = "one straight line of arithmetic, in the order of the equations")]
pub(super) fn differentiate<const PRINTED: bool>(
    c: &Constants,
    held: &Held,
    stages: &[Stage; 4],
    slope_adjoints: &[[Lanes; 5]; 4],
    block: &mut Block,
) {
    let h = c.step_s;
    let Held { push, side, turn_acc, turn_acc_d } = *held;
    // Tangents of u and w from stage to stage, tangents of x, z, u and w over the step, and the curvature.
    let mut tu = [Lanes::ZERO, Lanes::splat(1.0), Lanes::ZERO, Lanes::ZERO, Lanes::ZERO];
    let mut tw = [Lanes::ZERO, Lanes::ZERO, Lanes::splat(1.0), Lanes::ZERO, Lanes::ZERO];
    let mut sums = [[Lanes::ZERO; DIRECTIONS]; 4];
    let mut hessian = [Lanes::ZERO; PAIRS];
    macro_rules! stage {
        ($i:literal) => {{
            const I: usize = $i;
            let s = &stages[I];
            let [kx, kz, ku, kw, kq] = slope_adjoints[I];
            // Tangents of this stage's pitch by q and delta, and of its pitch rate by delta.
            let (tq, qd) = (AHEAD[I] * h, turn_acc_d * (AHEAD[I] * h));
            let td = turn_acc_d * (0.5 * h * h * TURNED[I]);

            // Curvature of the slope by (theta, u, w, q), weighted.
            let tt = (ku * s.sin - kw * s.cos) * c.gravity_m_s2 - kx * s.x_dot - kz * s.z_dot;
            let t_u = kz * s.cos - kx * s.sin;
            let t_w = (kx * s.cos + kz * s.sin) * lateral_sign(PRINTED);
            let (uu, uw, ww);
            if PRINTED {
                uu = ku * (c.drag_per_m * 2.0);
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
            if I == 0 {
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
            let (ls, lc) = (s.sin * lateral_sign(PRINTED), s.cos * lateral_sign(PRINTED));
            if I == 0 {
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
            let weight = WEIGHTS[I] * h;
            for j in 0..DIRECTIONS {
                sums[0][j] += dx[j] * weight;
                sums[1][j] += dz[j] * weight;
                sums[2][j] += du[j] * weight;
                sums[3][j] += dw[j] * weight;
            }
            if I < 3 {
                let along = AHEAD[(I + 1) & 3] * h;
                for j in 0..DIRECTIONS {
                    tu[j] = du[j] * along;
                    tw[j] = dw[j] * along;
                }
                tu[U] += Lanes::splat(1.0);
                tw[W] += Lanes::splat(1.0);
            }
        }};
    }
    stage!(0);
    stage!(1);
    stage!(2);
    stage!(3);
    sums[2][U] += Lanes::splat(1.0);
    sums[3][W] += Lanes::splat(1.0);
    block.tangent = sums;
    block.turn = turn_acc_d * h;
    block.curvature = hessian;
}
