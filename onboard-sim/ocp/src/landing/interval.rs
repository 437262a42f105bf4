//! One interval with its derivatives, and the air's force in it.
//!
//! The lean moves as under a constant rotational acceleration. The velocity changes by the
//! acceleration at the mean lean of the interval, `p + h p'/2 + h^2 p''/6`, and the products of
//! rates are those of the mean rates, `p' + h p''/2`, both with the gimbal's part of `p''`. The
//! drag sees the velocity that an upright thrust would give in the middle; the gain sideways, left
//! out there, makes 0.2 m/s in a landing of 3.8 s, which the next plan sees.

use crate::add_multiple;

use super::stage::{ACCELERATIONS, Bend, DIRECTIONS, LandingInterval};
use super::{Drag, INPUTS, Nose, Problem, Push, State, Vector, dot, plus, times};

/// Inputs of an interval: nose, rates and air at their means.
struct Middle<'a> {
    problem: &'a Problem,
    push: &'a Push,
    step_s: f64,
    /// Change of the mean lean, and of the mean rate, by a radian of the gimbal.
    lean_by_gimbal: f64,
    rate_by_gimbal: f64,
    nose: Nose,
    p_rate: f64,
    r_rate: f64,
    /// With the fins as they are open.
    drag: Drag,
    air: Air,
}

/// Derivatives of the leans' accelerations by mean p and mean rates.
struct Turning {
    p_by_p: f64,
    p_by_r_rate: f64,
    r_by_p: f64,
    r_by_p_rate: f64,
    r_by_r_rate: f64,
}

impl<'a> Middle<'a> {
    fn of(problem: &'a Problem, k: usize, x: &State, u: &[f64; INPUTS]) -> Self {
        let push = &problem.pushes[k];
        let step_s = problem.step_s;
        let lean_by_gimbal = step_s * step_s / 6.0 * push.turning_rad_s2;
        let rate_by_gimbal = 0.5 * step_s * push.turning_rad_s2;
        let nose = Nose::at(
            x[6] + 0.5 * step_s * x[8] + lean_by_gimbal * u[0],
            x[7] + 0.5 * step_s * x[9] + lean_by_gimbal * u[1],
        );
        let gained_m_s = 0.5 * step_s * (push.thrust_m_s2 - problem.gravity_m_s2);
        let through_air = [x[3] - problem.wind_m_s[0], x[4] - problem.wind_m_s[1], x[5] + gained_m_s];
        let drag = problem.drag.with_fins(u[2]);
        let air = Air::at(&drag, through_air, &nose.n);
        Self {
            problem,
            push,
            step_s,
            lean_by_gimbal,
            rate_by_gimbal,
            nose,
            p_rate: x[8] + rate_by_gimbal * u[0],
            r_rate: x[9] + rate_by_gimbal * u[1],
            drag,
            air,
        }
    }

    /// Accelerations of the leans `p` and `r`, rad/s^2.
    fn leans_rad_s2(&self, u: &[f64; INPUTS]) -> [f64; 2] {
        let Nose { sin_p, cos_p, .. } = self.nose;
        let turning = self.push.turning_rad_s2;
        [
            turning * u[0] - self.r_rate * self.r_rate * sin_p * cos_p,
            (turning * u[1] + 2.0 * self.p_rate * self.r_rate * sin_p) / cos_p,
        ]
    }

    fn turning(&self, u: &[f64; INPUTS]) -> Turning {
        let Nose { sin_p, cos_p, .. } = self.nose;
        let (p_rate, r_rate) = (self.p_rate, self.r_rate);
        let tan_p = sin_p / cos_p;
        Turning {
            p_by_p: -r_rate * r_rate * (cos_p * cos_p - sin_p * sin_p),
            p_by_r_rate: -2.0 * r_rate * sin_p * cos_p,
            r_by_p: 2.0 * p_rate * r_rate + self.leans_rad_s2(u)[1] * tan_p,
            r_by_p_rate: 2.0 * r_rate * tan_p,
            r_by_r_rate: 2.0 * p_rate * tan_p,
        }
    }

    fn end(&self, x: &State, u: &[f64; INPUTS]) -> State {
        let Nose { n, e_p, e_r, .. } = &self.nose;
        let direction = plus(&plus(n, -u[0], e_p), -u[1], e_r);
        let mut a = plus(&times(self.push.thrust_m_s2, &direction), self.push.per_kg, &self.air.force);
        a[2] -= self.problem.gravity_m_s2;
        let [a_p, a_r] = self.leans_rad_s2(u);
        let h = self.step_s;
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

    /// The derivatives of the accelerations.
    fn slopes(&self, u: &[f64; INPUTS]) -> [[f64; DIRECTIONS]; ACCELERATIONS] {
        let Self { push, nose, air, drag, lean_by_gimbal, rate_by_gimbal, step_s: h, .. } = self;
        let Nose { sin_p, cos_p, n, e_p, e_r, m } = nose;
        let t = push.thrust_m_s2;
        let by_v = air.by_velocity(drag, n);
        let thrust_p = plus(e_p, u[0], n);
        let thrust_r = plus(&times(cos_p + u[0] * sin_p, e_r), -u[1], m);
        let by_p = plus(&times(t, &thrust_p), push.per_kg, &air.by_nose(drag, n, e_p));
        let by_r = plus(&times(t, &thrust_r), push.per_kg, &air.by_nose(drag, n, &times(*cos_p, e_r)));
        let by_fins = times(self.by_fins() * air.speed, &air.v);
        let of_place = |i: usize| {
            [
                push.per_kg * by_v[i][0],
                push.per_kg * by_v[i][1],
                push.per_kg * by_v[i][2],
                by_p[i],
                by_r[i],
                0.5 * h * by_p[i],
                0.5 * h * by_r[i],
                lean_by_gimbal * by_p[i] - t * e_p[i],
                lean_by_gimbal * by_r[i] - t * e_r[i],
                by_fins[i],
            ]
        };
        let by = self.turning(u);
        let of_p = [
            0.0,
            0.0,
            0.0,
            by.p_by_p,
            0.0,
            0.5 * h * by.p_by_p,
            by.p_by_r_rate,
            push.turning_rad_s2 + lean_by_gimbal * by.p_by_p,
            rate_by_gimbal * by.p_by_r_rate,
            0.0,
        ];
        let of_r = [
            0.0,
            0.0,
            0.0,
            by.r_by_p,
            0.0,
            by.r_by_p_rate + 0.5 * h * by.r_by_p,
            by.r_by_r_rate,
            lean_by_gimbal * by.r_by_p + rate_by_gimbal * by.r_by_p_rate,
            push.turning_rad_s2 / cos_p + rate_by_gimbal * by.r_by_r_rate,
            0.0,
        ];
        [of_place(0), of_place(1), of_place(2), of_p, of_r]
    }

    /// Acceleration by the fins' share, over minus the product of speed and velocity, 1/m.
    fn by_fins(&self) -> f64 {
        -self.problem.drag.fins * self.push.per_kg
    }

    /// The second derivatives of `lambda' F`.
    fn bend(&self, u: &[f64; INPUTS], lambda: &State) -> Bend {
        const LEANS: usize = 3;
        const FINS: usize = DIRECTIONS - 1;
        let h = self.step_s;
        let half = 0.5 * h * h;
        let l = plus(&times(h, &[lambda[3], lambda[4], lambda[5]]), half, &[lambda[0], lambda[1], lambda[2]]);
        let l_leans = [h * lambda[8] + half * lambda[6], h * lambda[9] + half * lambda[7]];
        let by_air = air_curvature(&self.drag, &self.air, &self.nose, &l, self.push.per_kg);
        let c = self.outwards(self.by_means(u, &l, l_leans, &by_air));
        let mut bend = [[0.0; DIRECTIONS]; DIRECTIONS];
        for (row, from) in bend[LEANS..FINS].iter_mut().zip(&c) {
            row[LEANS..FINS].copy_from_slice(from);
        }
        let l_v = dot(&l, &self.air.v) / self.air.speed;
        for i in 0..3 {
            bend[i][..3].copy_from_slice(&by_air[i][..3]);
            let by_fins = self.by_fins() * (self.air.speed * l[i] + l_v * self.air.v[i]);
            let mut crossed = |direction: usize, value: f64| {
                (bend[i][direction], bend[direction][i]) = (value, value);
            };
            crossed(FINS, by_fins);
            for lean in 0..2 {
                let value = by_air[i][3 + lean];
                crossed(LEANS + lean, value);
                crossed(LEANS + 2 + lean, 0.5 * h * value);
                crossed(LEANS + 4 + lean, self.lean_by_gimbal * value);
            }
        }
        bend
    }

    /// Second derivatives by (mean p, mean r, mean rates, gimbal).
    fn by_means(
        &self,
        u: &[f64; INPUTS],
        l: &Vector,
        l_leans: [f64; 2],
        by_air: &[[f64; 5]; 5],
    ) -> [[f64; 6]; 6] {
        let Nose { sin_p, cos_p, n, e_p, e_r, m } = &self.nose;
        let (t, turning) = (self.push.thrust_m_s2, self.push.turning_rad_s2);
        let (p_rate, r_rate) = (self.p_rate, self.r_rate);
        let [l_p, l_r] = l_leans;
        let (l_n, l_ep, l_er, l_m) = (dot(l, n), dot(l, e_p), dot(l, e_r), dot(l, m));
        let (tan_p, sec2) = (sin_p / cos_p, 1.0 / (cos_p * cos_p));
        let mut c = [[0.0; 6]; 6];
        c[0][0] = t * (u[0] * l_ep - l_n)
            + l_p * 4.0 * r_rate * r_rate * sin_p * cos_p
            + l_r
                * (turning * u[1] * (1.0 + sin_p * sin_p) * sec2 / cos_p
                    + 4.0 * p_rate * r_rate * tan_p * sec2)
            + by_air[3][3];
        c[0][1] = t * (u[0] * cos_p - sin_p) * l_er + by_air[3][4];
        c[1][1] = t * ((cos_p + u[0] * sin_p) * l_m + u[1] * l_er) + by_air[4][4];
        c[0][2] = l_r * 2.0 * r_rate * sec2;
        c[0][3] = l_r * 2.0 * p_rate * sec2 - l_p * 2.0 * r_rate * (cos_p * cos_p - sin_p * sin_p);
        c[2][3] = l_r * 2.0 * tan_p;
        c[3][3] = -l_p * 2.0 * sin_p * cos_p;
        c[0][4] = t * l_n;
        c[1][4] = t * sin_p * l_er;
        c[1][5] = -t * l_m;
        c[0][5] = l_r * turning * sin_p * sec2;
        mirrored(&c)
    }

    /// The same by (p, r, rates, gimbal): the mean leans depend on the rates and the gimbal, the
    /// mean rates on the gimbal.
    fn outwards(&self, mut c: [[f64; 6]; 6]) -> [[f64; 6]; 6] {
        for row in &mut c {
            for lean in 0..2 {
                row[4 + lean] += self.lean_by_gimbal * row[lean] + self.rate_by_gimbal * row[2 + lean];
                row[2 + lean] += 0.5 * self.step_s * row[lean];
            }
        }
        for lean in 0..2 {
            let (by_lean, by_rate) = (c[lean], c[2 + lean]);
            for (entry, (lean, rate)) in c[4 + lean].iter_mut().zip(by_lean.iter().zip(&by_rate)) {
                *entry += self.lean_by_gimbal * lean + self.rate_by_gimbal * rate;
            }
            for (entry, lean) in c[2 + lean].iter_mut().zip(&by_lean) {
                *entry += 0.5 * self.step_s * lean;
            }
        }
        c
    }
}

/// The symmetric matrix with this upper triangle.
fn mirrored(upper: &[[f64; 6]; 6]) -> [[f64; 6]; 6] {
    core::array::from_fn(|i| core::array::from_fn(|j| upper[i.min(j)][i.max(j)]))
}

/// `F`, without derivatives.
pub(super) fn end(problem: &Problem, k: usize, x: &State, u: &[f64; INPUTS]) -> State {
    Middle::of(problem, k, x, u).end(x, u)
}

/// The interval with its derivatives, at the costate of the node after it.
pub(super) fn evaluated(
    problem: &Problem,
    k: usize,
    x: &State,
    u: &[f64; INPUTS],
    lambda: &State,
    out: &mut LandingInterval,
) {
    let middle = Middle::of(problem, k, x, u);
    out.step_s = problem.step_s;
    out.end = middle.end(x, u);
    out.by = middle.slopes(u);
    out.bend = middle.bend(u, lambda);
}

// The air's force and its derivatives.

/// Smooths the size of a velocity, m^2/s^2.
const SMOOTH: f64 = 1e-4;

/// The aerodynamic acceleration times the mass, N, and the terms of its derivatives.
pub(super) struct Air {
    pub(super) force: Vector,
    pub(super) v: Vector,
    pub(super) speed: f64,
    along: f64,
    across: Vector,
    across_speed: f64,
}

impl Drag {
    /// With the fins open by a share.
    pub(super) fn with_fins(&self, share: f64) -> Self {
        Self { fins: share * self.fins, ..*self }
    }
}

impl Air {
    pub(super) fn at(drag: &Drag, v: Vector, n: &Vector) -> Self {
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

    /// Derivative of the force (rows) by the velocity.
    fn by_velocity(&self, drag: &Drag, n: &Vector) -> [Vector; 3] {
        let Self { v, speed, along, across, across_speed, .. } = self;
        let even = -(drag.fins * speed + drag.crossflow * across_speed);
        let by_n = drag.crossflow * across_speed - drag.axial * speed;
        let mut by = [[0.0; 3]; 3];
        for i in 0..3 {
            let by_v = -(drag.fins * v[i] + drag.axial * along * n[i]) / speed;
            let by_across = -drag.crossflow * across[i] / across_speed;
            for j in 0..3 {
                by[i][j] = by_v * v[j] + by_n * n[i] * n[j] + by_across * across[j];
            }
            by[i][i] += even;
        }
        by
    }

    /// Change of the force by a change of the nose.
    fn by_nose(&self, drag: &Drag, n: &Vector, dn: &Vector) -> Vector {
        let d_along = dot(&self.v, dn);
        let d_part = plus(&times(d_along, n), self.along, dn);
        let even = drag.crossflow * self.across_speed - drag.axial * self.speed;
        let bent = drag.crossflow * dot(&self.across, &d_part) / self.across_speed;
        plus(&times(even, &d_part), bent, &self.across)
    }
}

/// Second derivatives of `l` times the air's force by the velocity and the leans, times `factor`.
///
/// With `W = v v`, `s = v n`, `b = l n` and `m = l v` the product is
/// `-(fins V m + axial V s b + crossflow Q (m - s b))`, `V = sqrt(W)`, `Q = sqrt(W - s^2)`.
pub(super) fn air_curvature(drag: &Drag, air: &Air, nose: &Nose, l: &Vector, factor: f64) -> [[f64; 5]; 5] {
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
    let along = plus(&times(first[1], v), first[2], l);
    sum[3][3] -= dot(&along, &nose.n);
    sum[3][4] += dot(&along, &n_pr);
    sum[4][4] += dot(&along, &n_rr);
    let mut turned = [[0.0; 5]; 4];
    for (sums, row) in turned.iter_mut().zip(&second) {
        for (value, slopes) in row.iter().zip(&slopes) {
            add_multiple(sums, *value, slopes);
        }
    }
    for i in 0..5 {
        for j in i..5 {
            for (slopes, turned) in slopes.iter().zip(&turned) {
                sum[i][j] += slopes[i] * turned[j];
            }
            sum[i][j] *= -factor;
            sum[j][i] = sum[i][j];
        }
    }
    sum
}
