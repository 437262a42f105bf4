//! One interval's RK4 step and its adjoint, for several nodes at once.
//!
//! Notation as in the step itself: `X_1..X_4` the stage states, `k_i = f(X_i, delta)`, `f` the planar equations of
//! [`crate::dynamics`]. The code uses these simplifications:
//!
//! * Nothing depends on `x` and `z`: they are integrals, and no direction of differentiation.
//! * Mass and thrust are held over an interval, and forces in the air scale with `m_0 / m`.
//! * `q'` depends on `delta` alone, so `q` and `theta` of every stage are known in closed form, and of the tangents
//!   only those of `u` and `w` are propagated (`tangent`).
//!
//! The directions of differentiation are (theta, u, w, q, delta).
#![expect(clippy::inline_always, reason = "inlined into one loop body over vector registers")]

use super::block::{
    AHEAD, Block, Constants, D, Held, Points, Q, Stage, TH, TURNED, U, W, WEIGHTS, lateral_sign,
};
use super::lanes::Lanes;
use super::tangent::differentiate;

/// Below this speed (m/s) the drag's derivatives count as zero, because they have no limit at rest.
const REST_SPEED_M_S: f64 = 1e-9;

/// Evaluates intervals. With `DERIVATIVES` it fills in tangent and curvature, too, otherwise only `after` and `pulled`.
/// `PRINTED` and `ACROSS` select the equations: [`Constants::printed`], [`Constants::pushed_across`].
#[inline(always)]
#[expect(clippy::too_many_lines, reason = "one straight line of arithmetic, in the order of the equations")]
pub(super) fn evaluate<const DERIVATIVES: bool, const PRINTED: bool, const ACROSS: bool>(
    c: &Constants,
    points: &Points,
    block: &mut Block,
) {
    let h = c.step_s;
    let [x0, z0, th0, u0, w0, q0] = points.state;
    let held = Held::of(c, points);
    let Held { push, side, turn_acc, turn_acc_d, drag: drag_per_m, lateral_drag, crossflow } = held;

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
        across_u: Lanes::ZERO,
        across_w: Lanes::ZERO,
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
            let (mut across_acc, mut across_u, mut across_w) = (Lanes::ZERO, Lanes::ZERO, Lanes::ZERO);
            if PRINTED {
                drag = squared * drag_per_m;
                drag_u = u * (drag_per_m * 2.0);
                drag_w = w * (drag_per_m * 2.0);
                (along, across) = (Lanes::ZERO, Lanes::ZERO);
            } else {
                let speed = squared.sqrt();
                let inverse = speed.reciprocal_above(REST_SPEED_M_S);
                along = u * inverse;
                across = w * inverse;
                drag = speed * u * -drag_per_m;
                drag_u = (speed + u * along) * -drag_per_m;
                drag_w = u * across * -drag_per_m;
                if ACROSS {
                    let aside = w.abs();
                    across_acc = -((lateral_drag * speed + crossflow * aside) * w);
                    across_u = -(lateral_drag * (u * across));
                    across_w = -(lateral_drag * (speed + w * across) + crossflow * aside * 2.0);
                }
            }
            let lateral = w * lateral_sign(PRINTED);
            let x_dot = u * cos + lateral * sin;
            let z_dot = u * sin - lateral * cos;
            let u_dot = push + drag - sin * c.gravity_m_s2 - q * w;
            let mut w_dot = side + cos * c.gravity_m_s2 + q * u;
            if ACROSS {
                w_dot += across_acc;
            }
            x_sum += x_dot * WEIGHTS[I];
            z_sum += z_dot * WEIGHTS[I];
            u_sum += u_dot * WEIGHTS[I];
            w_sum += w_dot * WEIGHTS[I];
            stages[I] = Stage {
                sin,
                cos,
                u,
                w,
                q,
                x_dot,
                z_dot,
                u_dot,
                w_dot,
                drag_u,
                drag_w,
                across_u,
                across_w,
                along,
                across,
            };
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
            if ACROSS {
                later[U] += kw * stage.across_u;
                later[W] += kw * stage.across_w;
            }
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
        differentiate::<PRINTED, ACROSS>(c, &held, &stages, &slope_adjoints, block);
    }
}
