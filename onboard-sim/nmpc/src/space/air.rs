//! The air's force and its derivatives.

use super::Drag;
use super::nose::{Nose, Vector, dot, plus, times};

/// Smooths the size of a velocity, m^2/s^2.
const SMOOTH: f64 = 1e-4;

/// The air's acceleration times the mass, N, and what its derivatives need.
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

    /// Change of the force by a change of the velocity.
    pub(super) fn by_velocity(&self, drag: &Drag, n: &Vector, dv: &Vector) -> Vector {
        let d_speed = dot(&self.v, dv) / self.speed;
        let d_along = dot(dv, n);
        let d_across = plus(dv, -d_along, n);
        let even = plus(&times(self.speed, dv), d_speed, &self.v);
        let axial = self.along * d_speed + self.speed * d_along;
        plus(&plus(&times(-drag.fins, &even), -drag.axial * axial, n), -drag.crossflow, &self.bent(&d_across))
    }

    /// Change of the force by a change of the nose.
    pub(super) fn by_nose(&self, drag: &Drag, n: &Vector, dn: &Vector) -> Vector {
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
