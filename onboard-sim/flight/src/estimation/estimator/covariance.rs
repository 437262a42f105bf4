//! The covariance of the error state: its propagation in blocks, and its update by scalar
//! measurements.
//!
//! Error state, all small: position (0..3, world, m), velocity (3..6, world, m/s), attitude (6..9,
//! rotation vector in the world, rad, `R = exp(dphi) R_est`), gyro bias (9..12, body, rad/s),
//! accelerometer bias (12..15, body, m/s^2), wind (15..17, world x and y, m/s), barometer offset
//! (17, m), ram coefficient (18), offset of the satellite position (19..22, world, m), error of the
//! satellite fixes' time tags (22, s), age of a barometer sample (23, s), age of a lidar sample
//! (24, s), slope of the ground (25..27, rise along world x and y), suction coefficient of the flow
//! across the axis at the barometer (27), scale of the barometric height (28).

use nalgebra::{Matrix3, Vector3};
use serde::ser::SerializeTuple as _;
use serde::{Serialize, Serializer};

/// Length of the error state.
pub(super) const N: usize = 29;
pub(super) const POSITION: usize = 0;
pub(super) const VELOCITY: usize = 3;
pub(super) const ATTITUDE: usize = 6;
pub(super) const GYRO_BIAS: usize = 9;
pub(super) const ACCELEROMETER_BIAS: usize = 12;
pub(super) const WIND: usize = 15;
pub(super) const BAROMETER_OFFSET: usize = 17;
pub(super) const BAROMETER_RAM: usize = 18;
pub(super) const GNSS_OFFSET: usize = 19;
pub(super) const GNSS_TIME_TAG: usize = 22;
pub(super) const BAROMETER_LATE: usize = 23;
pub(super) const LIDAR_LATE: usize = 24;
pub(super) const SLOPE: usize = 25;
pub(super) const BAROMETER_SUCTION: usize = 27;
pub(super) const BAROMETER_SCALE: usize = 28;

/// A row of the covariance, and any other vector over the error state.
pub(super) type Row = [f64; N];

/// Variances below this are rounding errors.
const SMALLEST_VARIANCE: f64 = 1e-14;

/// The matrix is exactly symmetric: after each change the upper half is copied to the lower half.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(super) struct Covariance {
    #[serde(serialize_with = "upper_half")]
    rows: [Row; N],
}

/// Serialises the upper half: it determines a symmetric matrix.
fn upper_half<S: Serializer>(rows: &[Row; N], serializer: S) -> Result<S::Ok, S::Error> {
    let mut half = serializer.serialize_tuple(N * (N + 1) / 2)?;
    for (i, row) in rows.iter().enumerate() {
        for value in &row[i..] {
            half.serialize_element(value)?;
        }
    }
    half.end()
}

/// Propagation of the error over one interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Transition {
    pub(super) interval_s: f64,
    /// Velocity gained from the specific force, world, m/s: `dv -= [sensed]x dphi`.
    pub(super) sensed_m_s: Vector3<f64>,
    /// Integral of the body-to-world rotation over the interval, s: `dphi -= it dbg`, `dv -= it
    /// dba`.
    pub(super) world_from_body_s: Matrix3<f64>,
    /// Factor on the wind's error.
    pub(super) wind_factor: f64,
    /// Variance added to each error.
    pub(super) noise: Row,
}

impl Covariance {
    pub(super) fn diagonal(variances: &Row) -> Self {
        let mut rows = [[0.0; N]; N];
        for (index, variance) in variances.iter().enumerate() {
            rows[index][index] = *variance;
        }
        Self { rows }
    }

    pub(super) fn variance(&self, index: usize) -> f64 {
        self.rows[index][index]
    }

    /// Covariance of two weighted sums of errors.
    pub(super) fn between(&self, one: &[(usize, f64)], other: &[(usize, f64)]) -> f64 {
        one.iter()
            .flat_map(|(row, share)| {
                other.iter().map(move |(column, part)| share * part * self.rows[*row][*column])
            })
            .sum()
    }

    /// Standard deviations of three neighbouring errors.
    pub(super) fn sigmas(&self, first: usize) -> Vector3<f64> {
        Vector3::from_fn(|axis, _| libm::sqrt(self.rows[first + axis][first + axis]))
    }

    pub(super) fn is_finite(&self) -> bool {
        self.rows.iter().flatten().all(|value| value.is_finite())
    }

    /// Correlates the lean with the accelerometer's bias, of this variance, (m/s^2)^2: levelling
    /// has attributed the bias to gravity, m/s^2.
    pub(super) fn level(&mut self, world_from_body: &Matrix3<f64>, bias_m2_s4: f64, gravity_m_s2: f64) {
        for axis in 0..3 {
            let column = ACCELEROMETER_BIAS + axis;
            for (lean, share) in [(0, -world_from_body[(1, axis)]), (1, world_from_body[(0, axis)])] {
                let both = share * bias_m2_s4 / gravity_m_s2;
                (self.rows[ATTITUDE + lean][column], self.rows[column][ATTITUDE + lean]) = (both, both);
            }
        }
    }

    /// Adds variance to an error.
    pub(super) fn widen(&mut self, index: usize, variance: f64) {
        self.rows[index][index] += variance;
    }

    /// `P <- F P F' + Q`. Only position, velocity and attitude have rows in `F` beyond the unit
    /// matrix's, so only their rows change; the rest is their mirror image.
    pub(super) fn propagate(&mut self, step: &Transition) {
        let (dt, sensed, turn) = (step.interval_s, step.sensed_m_s, step.world_from_body_s);
        // -[sensed]x
        let lever = [[0.0, sensed.z, -sensed.y], [-sensed.z, 0.0, sensed.x], [sensed.y, -sensed.x, 0.0]];
        for axis in 0..3 {
            let velocity = self.rows[VELOCITY + axis];
            add(&mut self.rows[POSITION + axis], dt, &velocity);
        }
        for axis in 0..3 {
            let mut row = self.rows[VELOCITY + axis];
            for (from, share) in lever[axis].iter().enumerate() {
                add(&mut row, *share, &self.rows[ATTITUDE + from]);
            }
            for from in 0..3 {
                add(&mut row, -turn[(axis, from)], &self.rows[ACCELEROMETER_BIAS + from]);
            }
            self.rows[VELOCITY + axis] = row;
        }
        for axis in 0..3 {
            let mut row = self.rows[ATTITUDE + axis];
            for from in 0..3 {
                add(&mut row, -turn[(axis, from)], &self.rows[GYRO_BIAS + from]);
            }
            self.rows[ATTITUDE + axis] = row;
        }
        for row in &mut self.rows[..GYRO_BIAS] {
            for axis in 0..3 {
                row[POSITION + axis] += dt * row[VELOCITY + axis];
            }
            let attitude = [row[ATTITUDE], row[ATTITUDE + 1], row[ATTITUDE + 2]];
            for axis in 0..3 {
                let mut change = 0.0;
                let mut turned = 0.0;
                for from in 0..3 {
                    change += lever[axis][from] * attitude[from]
                        - turn[(axis, from)] * row[ACCELEROMETER_BIAS + from];
                    turned -= turn[(axis, from)] * row[GYRO_BIAS + from];
                }
                row[VELOCITY + axis] += change;
                row[ATTITUDE + axis] += turned;
            }
        }
        self.mirror();
        for wind in WIND..WIND + 2 {
            for index in 0..N {
                self.rows[wind][index] *= step.wind_factor;
                self.rows[index][wind] *= step.wind_factor;
            }
        }
        for (index, variance) in step.noise.iter().enumerate() {
            self.rows[index][index] += variance;
        }
    }

    /// Variance of a measurement's prediction, and the covariance of each error with it: `(h P h',
    /// P h')`.
    pub(super) fn project(&self, sensitivity: &[(usize, f64)]) -> (f64, Row) {
        let mut with = [0.0; N];
        for (index, share) in sensitivity {
            add(&mut with, *share, &self.rows[*index]);
        }
        let variance = sensitivity.iter().map(|(index, share)| share * with[*index]).sum();
        (variance, with)
    }

    /// Joseph's form (R. S. Bucy and P. D. Joseph, Filtering for Stochastic Processes with
    /// Applications to Guidance, 1968) for one scalar and any gain, `(I - K h) P (I - K h)' + K r
    /// K'`, multiplied out: `P - K (P h')' - (P h') K' + s K K'` with `s = h P h' + r`.
    pub(super) fn update(&mut self, gain: &Row, with: &Row, innovation_variance: f64) {
        for (index, row) in self.rows.iter_mut().enumerate() {
            let by_with = -gain[index];
            let by_gain = innovation_variance * gain[index] - with[index];
            for column in 0..N {
                row[column] += by_with * with[column] + by_gain * gain[column];
            }
        }
        self.mirror();
        for index in 0..N {
            self.rows[index][index] = self.rows[index][index].max(SMALLEST_VARIANCE);
        }
    }

    fn mirror(&mut self) {
        for row in 1..N {
            for column in 0..row {
                self.rows[row][column] = self.rows[column][row];
            }
        }
    }
}

fn add(to: &mut Row, share: f64, from: &Row) {
    for (sum, value) in to.iter_mut().zip(from) {
        *sum += share * value;
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::SMatrix;

    use super::*;

    fn sample() -> Covariance {
        // A A' + I with a fixed pattern: positive definite, without zero entries.
        let pattern = SMatrix::<f64, N, N>::from_fn(|r, c| f64::from(((7 * r + 3 * c) % 11) as u32) / 11.0);
        let full = pattern * pattern.transpose() + SMatrix::identity();
        let mut rows = [[0.0; N]; N];
        for (r, row) in rows.iter_mut().enumerate() {
            for (c, value) in row.iter_mut().enumerate() {
                *value = full[(r, c)];
            }
        }
        Covariance { rows }
    }

    fn dense(covariance: &Covariance) -> SMatrix<f64, N, N> {
        SMatrix::from_fn(|r, c| covariance.rows[r][c])
    }

    fn assert_close(found: &SMatrix<f64, N, N>, expected: &SMatrix<f64, N, N>) {
        let worst = (found - expected).abs().max();
        assert!(worst < 1e-12 * expected.abs().max(), "{worst}");
        assert_eq!(*found, found.transpose());
    }

    #[test]
    fn blocks_propagate_like_the_full_matrices() {
        let sensed = Vector3::new(0.03, -0.02, 0.1);
        let turn = Matrix3::new(1.0, 0.2, -0.3, 0.4, 0.9, 0.1, -0.2, 0.3, 0.8) * 0.01;
        let mut noise = [0.0; N];
        noise.iter_mut().enumerate().for_each(|(i, q)| *q = 1e-3 * i as f64);
        let step = Transition {
            interval_s: 0.01,
            sensed_m_s: sensed,
            world_from_body_s: turn,
            wind_factor: 0.98,
            noise,
        };
        let mut full = SMatrix::<f64, N, N>::identity();
        for axis in 0..3 {
            full[(POSITION + axis, VELOCITY + axis)] = 0.01;
        }
        full.fixed_view_mut::<3, 3>(VELOCITY, ATTITUDE).copy_from(&-sensed.cross_matrix());
        full.fixed_view_mut::<3, 3>(VELOCITY, ACCELEROMETER_BIAS).copy_from(&-turn);
        full.fixed_view_mut::<3, 3>(ATTITUDE, GYRO_BIAS).copy_from(&-turn);
        full[(WIND, WIND)] = 0.98;
        full[(WIND + 1, WIND + 1)] = 0.98;
        let mut covariance = sample();
        let expected = full * dense(&covariance) * full.transpose()
            + SMatrix::from_diagonal(&nalgebra::SVector::from(noise));
        covariance.propagate(&step);
        assert_close(&dense(&covariance), &expected);
    }

    #[test]
    fn a_scalar_update_is_josephs_form_for_any_gain() {
        let mut covariance = sample();
        let sensitivity = [(2, 1.0), (6, -0.3), (17, 0.5)];
        let noise = 0.7;
        let mut h = nalgebra::SVector::<f64, N>::zeros();
        for (index, share) in sensitivity {
            h[index] = share;
        }
        let before = dense(&covariance);
        let (seen, with) = covariance.project(&sensitivity);
        assert!((seen - h.dot(&(before * h))).abs() < 1e-12);
        let variance = seen + noise;
        // Half the optimal gain, and some errors held, as in a filter that considers errors without
        // estimating them.
        let mut gain = with.map(|value| 0.5 * value / variance);
        gain[4] = 0.0;
        gain[20] = 0.0;
        let k = nalgebra::SVector::<f64, N>::from(gain);
        let left = SMatrix::<f64, N, N>::identity() - k * h.transpose();
        let expected = left * before * left.transpose() + k * noise * k.transpose();
        covariance.update(&gain, &with, variance);
        assert_close(&dense(&covariance), &expected);
    }
}
