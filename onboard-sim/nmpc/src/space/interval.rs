//! One interval with its derivatives.
//!
//! The lean moves as under a constant rotational acceleration. The velocity changes by the acceleration at the mean lean
//! of the interval, `p + h p'/2 + h^2 p''/6`, and the products of rates are those of the mean rates, `p' + h p''/2`, both
//! with the gimbal's part of `p''`. The drag sees the velocity that an upright thrust would give in the middle; the gain
//! sideways, left out there, makes 0.2 m/s in a landing of 3.8 s, which the next plan sees.
//!
use stages::Dense;

use super::{Drag, INPUTS, STATES, SpaceProblem, State};

/// Smooths the size of a velocity, m^2/s^2.
const SMOOTH: f64 = 1e-4;

type Vector = [f64; 3];

fn dot(a: &Vector, b: &Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// `a + f b`.
fn plus(a: &Vector, f: f64, b: &Vector) -> Vector {
    [a[0] + f * b[0], a[1] + f * b[1], a[2] + f * b[2]]
}

fn times(f: f64, a: &Vector) -> Vector {
    [f * a[0], f * a[1], f * a[2]]
}

/// The nose and its derivatives by the leans.
struct Nose {
    sin_p: f64,
    cos_p: f64,
    n: Vector,
    e_p: Vector,
    e_r: Vector,
    /// Derivative of `e_r` by `r`.
    m: Vector,
}

impl Nose {
    fn at(p: f64, r: f64) -> Self {
        let (sin_p, cos_p) = libm::sincos(p);
        let (sin_r, cos_r) = libm::sincos(r);
        Self {
            sin_p,
            cos_p,
            n: [sin_p, cos_p * sin_r, cos_p * cos_r],
            e_p: [cos_p, -sin_p * sin_r, -sin_p * cos_r],
            e_r: [0.0, cos_r, -sin_r],
            m: [0.0, -sin_r, -cos_r],
        }
    }
}

/// The air's acceleration times the mass, N, and what its derivatives need.
struct Air {
    force: Vector,
    v: Vector,
    speed: f64,
    along: f64,
    across: Vector,
    across_speed: f64,
}

impl Drag {
    /// With the fins open by a share.
    fn with_fins(&self, share: f64) -> Self {
        Self { fins: share * self.fins, ..*self }
    }
}

impl Air {
    fn at(drag: &Drag, v: Vector, n: &Vector) -> Self {
        let speed = libm::sqrt(dot(&v, &v) + SMOOTH);
        let along = dot(&v, n);
        let across = plus(&v, -along, n);
        let across_speed = libm::sqrt(dot(&across, &across) + SMOOTH);
        let force = plus(
            &plus(&times(-drag.fins * speed, &v), -drag.axial * speed * along, n),
            -drag.crossflow * across_speed,
            &across,
        );
        Self { force, v, speed, along, across, across_speed }
    }

    /// Change of the force by a change of the velocity.
    fn by_velocity(&self, drag: &Drag, n: &Vector, dv: &Vector) -> Vector {
        let d_speed = dot(&self.v, dv) / self.speed;
        let d_along = dot(dv, n);
        let d_across = plus(dv, -d_along, n);
        let even = plus(&times(self.speed, dv), d_speed, &self.v);
        let axial = self.along * d_speed + self.speed * d_along;
        plus(&plus(&times(-drag.fins, &even), -drag.axial * axial, n), -drag.crossflow, &self.bent(&d_across))
    }

    /// Change of the force by a change of the nose.
    fn by_nose(&self, drag: &Drag, n: &Vector, dn: &Vector) -> Vector {
        let d_along = dot(&self.v, dn);
        let d_part = plus(&times(d_along, n), self.along, dn);
        plus(&times(-drag.axial * self.speed, &d_part), drag.crossflow, &self.bent(&d_part))
    }

    /// Change of `|across| across`.
    fn bent(&self, d_across: &Vector) -> Vector {
        plus(
            &times(self.across_speed, d_across),
            dot(&self.across, d_across) / self.across_speed,
            &self.across,
        )
    }
}

/// Second derivatives of `l` times the air's force by the velocity and the leans, times `factor`.
///
/// With `W = v v`, `s = v n`, `b = l n` and `m = l v` the product is
/// `-(fins V m + axial V s b + crossflow Q (m - s b))`, `V = sqrt(W)`, `Q = sqrt(W - s^2)`.
fn air_curvature(drag: &Drag, air: &Air, nose: &Nose, l: &Vector, factor: f64) -> [[f64; 5]; 5] {
    let Drag { fins, axial, crossflow } = *drag;
    let (v, speed, q, s) = (&air.v, air.speed, air.across_speed, air.along);
    let (b, m) = (dot(l, &nose.n), dot(l, v));
    let rest = m - s * b;
    let speed3 = speed * speed * speed;
    let q3 = q * q * q;
    // Derivatives of Q and of (m - s b) by (W, s, b, m).
    let q_1 = [0.5 / q, -s / q, 0.0, 0.0];
    let r_1 = [0.0, -b, -s, 1.0];
    let first = [
        0.5 * (fins * m + axial * s * b) / speed + crossflow * q_1[0] * rest,
        axial * speed * b + crossflow * (q_1[1] * rest + q * r_1[1]),
        axial * speed * s + crossflow * q * r_1[2],
    ];
    let mut second = [[0.0; 4]; 4];
    second[0][0] = -0.25 * (fins * m + axial * s * b) / speed3 - crossflow * 0.25 * rest / q3;
    second[0][1] = 0.5 * axial * b / speed + crossflow * 0.5 * s * rest / q3;
    second[0][2] = 0.5 * axial * s / speed;
    second[0][3] = 0.5 * fins / speed;
    second[1][1] = -crossflow * rest * (1.0 / q + s * s / q3);
    second[1][2] = axial * speed - crossflow * q;
    for i in 0..4 {
        for j in i..4 {
            second[i][j] += crossflow * (q_1[i] * r_1[j] + q_1[j] * r_1[i]);
            second[j][i] = second[i][j];
        }
    }
    let n_r = times(nose.cos_p, &nose.e_r);
    let n_pr = times(-nose.sin_p, &nose.e_r);
    let n_rr = times(nose.cos_p, &nose.m);
    let slopes = [
        [2.0 * v[0], 2.0 * v[1], 2.0 * v[2], 0.0, 0.0],
        [nose.n[0], nose.n[1], nose.n[2], dot(v, &nose.e_p), dot(v, &n_r)],
        [0.0, 0.0, 0.0, dot(l, &nose.e_p), dot(l, &n_r)],
        [l[0], l[1], l[2], 0.0, 0.0],
    ];
    let mut sum = [[0.0; 5]; 5];
    for i in 0..3 {
        sum[i][i] += 2.0 * first[0];
        sum[i][3] += first[1] * nose.e_p[i];
        sum[i][4] += first[1] * n_r[i];
    }
    let turned = plus(&times(first[1], v), first[2], l);
    sum[3][3] -= dot(&turned, &nose.n);
    sum[3][4] += dot(&turned, &n_pr);
    sum[4][4] += dot(&turned, &n_rr);
    for i in 0..5 {
        for j in i..5 {
            for (one, row) in second.iter().enumerate() {
                for (other, value) in row.iter().enumerate() {
                    sum[i][j] += value * slopes[one][i] * slopes[other][j];
                }
            }
            sum[i][j] *= -factor;
            sum[j][i] = sum[i][j];
        }
    }
    sum
}

/// `F`, without derivatives.
pub(super) fn end(problem: &SpaceProblem, k: usize, x: &State, u: &[f64; INPUTS]) -> State {
    let push = &problem.pushes[k];
    let h = problem.step_s;
    let nose = problem.mean_nose(k, x, u);
    let air = Air::at(&problem.drag.with_fins(u[2]), problem.through_air(k, x), &nose.n);
    let direction = plus(&plus(&nose.n, -u[0], &nose.e_p), -u[1], &nose.e_r);
    let mut a = plus(&times(push.thrust_m_s2, &direction), push.per_kg, &air.force);
    a[2] -= problem.gravity_m_s2;
    let [pd, rd] = problem.mean_rates(k, x, u);
    let a_p = push.turning_rad_s2 * u[0] - rd * rd * nose.sin_p * nose.cos_p;
    let a_r = (push.turning_rad_s2 * u[1] + 2.0 * pd * rd * nose.sin_p) / nose.cos_p;
    let half = 0.5 * h * h;
    [
        x[0] + h * x[3] + half * a[0],
        x[1] + h * x[4] + half * a[1],
        x[2] + h * x[5] + half * a[2],
        x[3] + h * a[0],
        x[4] + h * a[1],
        x[5] + h * a[2],
        x[6] + h * x[8] + half * a_p,
        x[7] + h * x[9] + half * a_r,
        x[8] + h * a_p,
        x[9] + h * a_r,
    ]
}

impl SpaceProblem {
    /// The nose at the mean lean of an interval.
    fn mean_nose(&self, k: usize, x: &State, u: &[f64; INPUTS]) -> Nose {
        let half = 0.5 * self.step_s;
        let by_gimbal = self.by_gimbal(k);
        Nose::at(x[6] + half * x[8] + by_gimbal * u[0], x[7] + half * x[9] + by_gimbal * u[1])
    }

    /// The mean rates of an interval, with the gimbal's part of the acceleration.
    fn mean_rates(&self, k: usize, x: &State, u: &[f64; INPUTS]) -> [f64; 2] {
        let by_gimbal = 0.5 * self.step_s * self.pushes[k].turning_rad_s2;
        [x[8] + by_gimbal * u[0], x[9] + by_gimbal * u[1]]
    }

    /// Change of the mean lean by a radian of the gimbal.
    fn by_gimbal(&self, k: usize) -> f64 {
        self.step_s * self.step_s / 6.0 * self.pushes[k].turning_rad_s2
    }

    /// Velocity through the air in the middle of an interval, if the thrust is upright.
    fn through_air(&self, k: usize, x: &State) -> Vector {
        let gained = 0.5 * self.step_s * (self.pushes[k].thrust_m_s2 - self.gravity_m_s2);
        [x[3] - self.wind_m_s[0], x[4] - self.wind_m_s[1], x[5] + gained]
    }
}

/// The interval with its derivatives, at the costate of the node after it.
pub(super) fn evaluated(
    problem: &SpaceProblem,
    k: usize,
    x: &State,
    u: &[f64; INPUTS],
    lambda: &State,
    out: &mut Dense<STATES, INPUTS>,
) {
    let push = &problem.pushes[k];
    let h = problem.step_s;
    let half = 0.5 * h * h;
    let nose = problem.mean_nose(k, x, u);
    let Nose { sin_p, cos_p, n, e_p, e_r, m } = &nose;
    let (sin_p, cos_p) = (*sin_p, *cos_p);
    let drag = problem.drag.with_fins(u[2]);
    let air = Air::at(&drag, problem.through_air(k, x), n);
    let (t, turn) = (push.thrust_m_s2, push.turning_rad_s2);
    let (by_gimbal, rate_by_gimbal) = (problem.by_gimbal(k), 0.5 * h * turn);

    out.end = end(problem, k, x, u);

    // Derivatives of the acceleration by velocity, mean leans and gimbal.
    let mut by_v = [[0.0; 3]; 3];
    for (i, column) in by_v.iter_mut().enumerate() {
        let mut unit = [0.0; 3];
        unit[i] = 1.0;
        *column = times(push.per_kg, &air.by_velocity(&drag, n, &unit));
    }
    let n_r = times(cos_p, e_r);
    let thrust_p = plus(e_p, u[0], n);
    let thrust_r = plus(&times(cos_p + u[0] * sin_p, e_r), -u[1], m);
    let by_p = plus(&times(t, &thrust_p), push.per_kg, &air.by_nose(&drag, n, e_p));
    let by_r = plus(&times(t, &thrust_r), push.per_kg, &air.by_nose(&drag, n, &n_r));
    let fins = -problem.drag.fins * push.per_kg;
    let by_fins = times(fins * air.speed, &air.v);
    // Derivatives of the leans' accelerations by mean p, rate of p, rate of r and gimbal.
    let [pd, rd] = problem.mean_rates(k, x, u);
    let a_r = (turn * u[1] + 2.0 * pd * rd * sin_p) / cos_p;
    let p_by_p = -rd * rd * (cos_p * cos_p - sin_p * sin_p);
    let p_by_rd = -2.0 * rd * sin_p * cos_p;
    let r_by_p = 2.0 * pd * rd + a_r * sin_p / cos_p;
    let r_by_pd = 2.0 * rd * sin_p / cos_p;
    let r_by_rd = 2.0 * pd * sin_p / cos_p;

    let (a, b) = (&mut out.a, &mut out.b);
    *a = [[0.0; STATES]; STATES];
    *b = [[0.0; INPUTS]; STATES];
    for i in 0..3 {
        for (row, share, unit) in [(i, half, h), (3 + i, h, 1.0)] {
            for j in 0..3 {
                a[row][3 + j] = share * by_v[j][i];
            }
            a[row][3 + i] += unit;
            a[row][6] = share * by_p[i];
            a[row][7] = share * by_r[i];
            a[row][8] = share * 0.5 * h * by_p[i];
            a[row][9] = share * 0.5 * h * by_r[i];
            b[row] = [
                share * (by_gimbal * by_p[i] - t * e_p[i]),
                share * (by_gimbal * by_r[i] - t * e_r[i]),
                share * by_fins[i],
            ];
        }
        a[i][i] = 1.0;
    }
    for (first, share, unit) in [(6, half, h), (8, h, 1.0)] {
        let (row_p, row_r) = (first, first + 1);
        a[row_p][6] = share * p_by_p;
        a[row_p][8] = share * 0.5 * h * p_by_p + unit;
        a[row_p][9] = share * p_by_rd;
        a[row_r][6] = share * r_by_p;
        a[row_r][8] = share * (r_by_pd + 0.5 * h * r_by_p);
        a[row_r][9] = share * r_by_rd + unit;
        b[row_p][0] = share * (turn + by_gimbal * p_by_p);
        b[row_p][1] = share * rate_by_gimbal * p_by_rd;
        b[row_r][0] = share * (by_gimbal * r_by_p + rate_by_gimbal * r_by_pd);
        b[row_r][1] = share * (turn / cos_p + rate_by_gimbal * r_by_rd);
    }
    a[6][6] += 1.0;
    a[7][7] += 1.0;

    // Second derivatives of lambda' F by (mean p, mean r, mean rates, gimbal).
    let l = plus(&times(h, &[lambda[3], lambda[4], lambda[5]]), half, &[lambda[0], lambda[1], lambda[2]]);
    let (l_p, l_r) = (h * lambda[8] + half * lambda[6], h * lambda[9] + half * lambda[7]);
    let (l_n, l_ep, l_er, l_m) = (dot(&l, n), dot(&l, e_p), dot(&l, e_r), dot(&l, m));
    let (tan_p, sec2) = (sin_p / cos_p, 1.0 / (cos_p * cos_p));
    let mut c = [[0.0; 6]; 6];
    c[0][0] = t * (-l_n + u[0] * l_ep)
        + l_p * 4.0 * rd * rd * sin_p * cos_p
        + l_r * (turn * u[1] * (1.0 + sin_p * sin_p) * sec2 / cos_p + 4.0 * pd * rd * tan_p * sec2);
    c[0][1] = t * (u[0] * cos_p - sin_p) * l_er;
    c[1][1] = t * ((cos_p + u[0] * sin_p) * l_m + u[1] * l_er);
    c[0][2] = l_r * 2.0 * rd * sec2;
    c[0][3] = -l_p * 2.0 * rd * (cos_p * cos_p - sin_p * sin_p) + l_r * 2.0 * pd * sec2;
    c[2][3] = l_r * 2.0 * tan_p;
    c[3][3] = -l_p * 2.0 * sin_p * cos_p;
    c[0][4] = t * l_n;
    c[1][4] = t * sin_p * l_er;
    c[1][5] = -t * l_m;
    c[0][5] = l_r * turn * sin_p * sec2;
    let by_air = air_curvature(&drag, &air, &nose, &l, push.per_kg);
    c[0][0] += by_air[3][3];
    c[0][1] += by_air[3][4];
    c[1][1] += by_air[4][4];
    for i in 0..6 {
        for j in 0..i {
            c[i][j] = c[j][i];
        }
    }
    let l_v = dot(&l, &air.v) / air.speed;
    for i in 0..3 {
        for j in 0..3 {
            out.curvature.xx[3 + i][3 + j] = by_air[i][j];
        }
        out.curvature.ux[2][3 + i] = fins * (air.speed * l[i] + l_v * air.v[i]);
        for (lean, value) in [(0, by_air[i][3]), (1, by_air[i][4])] {
            for (column, value) in [(6 + lean, value), (8 + lean, 0.5 * h * value)] {
                out.curvature.xx[3 + i][column] = value;
                out.curvature.xx[column][3 + i] = value;
            }
            out.curvature.ux[lean][3 + i] = by_gimbal * value;
        }
    }
    // The mean leans depend on the rates and the gimbal, the mean rates on the gimbal.
    for row in &mut c {
        for lean in 0..2 {
            row[4 + lean] += by_gimbal * row[lean] + rate_by_gimbal * row[2 + lean];
            row[2 + lean] += 0.5 * h * row[lean];
        }
    }
    for lean in 0..2 {
        for j in 0..6 {
            c[4 + lean][j] += by_gimbal * c[lean][j] + rate_by_gimbal * c[2 + lean][j];
            c[2 + lean][j] += 0.5 * h * c[lean][j];
        }
    }
    for i in 0..4 {
        for j in 0..4 {
            out.curvature.xx[6 + i][6 + j] = c[i][j];
        }
        for j in 0..2 {
            out.curvature.ux[j][6 + i] = c[4 + j][i];
        }
    }
    for i in 0..2 {
        for j in 0..2 {
            out.curvature.uu[i][j] = c[4 + i][4 + j];
        }
    }
}

/// `A' lambda` and `B' lambda`, with `A` and `B` as they were last evaluated.
pub(super) fn pulled(interval: &mut Dense<STATES, INPUTS>, lambda: &State) {
    let (mut by_x, mut by_u) = ([0.0; STATES], [0.0; INPUTS]);
    for (i, lambda) in lambda.iter().enumerate() {
        for (sum, entry) in by_x.iter_mut().zip(&interval.a[i]) {
            *sum += lambda * entry;
        }
        for (sum, entry) in by_u.iter_mut().zip(&interval.b[i]) {
            *sum += lambda * entry;
        }
    }
    (interval.pulled_x, interval.pulled_u) = (by_x, by_u);
}
