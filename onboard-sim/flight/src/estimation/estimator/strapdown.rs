//! Propagates the state and its error with the inertial unit, and stores the recent motion for late
//! measurements.
//!
//! The motion follows the navigation equations of a world at rest (Groves 2013, chapter 5); its
//! error grows as in Solà 2017, here in world axes.

use nalgebra::{Matrix3, UnitQuaternion, Vector2, Vector3};
use serde::{Serialize, Serializer};

use super::covariance::{
    ACCELEROMETER_BIAS, ATTITUDE, BAROMETER_LATE, BAROMETER_OFFSET, BAROMETER_RAM, BAROMETER_SCALE,
    BAROMETER_SUCTION, GNSS_OFFSET, GNSS_TIME_TAG, GYRO_BIAS, LIDAR_LATE, N, Row, SLOPE, Transition,
    VELOCITY, WIND,
};
use super::{Estimator, EstimatorConfig, GRAVITY_M_S2, ImuSample};
use crate::vehicle::mission::LeverArms;
use crate::vehicle::rigid::RigidState;

/// Frames between propagations of the covariance; it is also propagated before every correction.
const FRAMES_BETWEEN: u32 = 2;
/// Height below which the wind's power law is not used, m: it does not hold near the ground.
const LOWEST_SHEAR_M: f64 = 2.0;

/// The estimated state; its error is in the filter.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub(super) struct Nominal {
    pub(super) position_m: Vector3<f64>,
    pub(super) velocity_m_s: Vector3<f64>,
    pub(super) world_from_body: UnitQuaternion<f64>,
    pub(super) gyro_bias_rad_s: Vector3<f64>,
    pub(super) accelerometer_bias_m_s2: Vector3<f64>,
    pub(super) wind_m_s: Vector2<f64>,
    pub(super) barometer_offset_m: f64,
    pub(super) barometer_ram: f64,
    pub(super) gnss_offset_m: Vector3<f64>,
    pub(super) gnss_time_tag_s: f64,
    pub(super) barometer_late_s: f64,
    pub(super) lidar_late_s: f64,
    /// Rise of the ground along world x and y.
    pub(super) slope: Vector2<f64>,
    pub(super) barometer_suction: f64,
    /// Error of the barometric height's scale.
    pub(super) barometer_scale: f64,
}

impl Nominal {
    pub(super) fn at(state: &RigidState) -> Self {
        Self {
            position_m: state.position_m,
            velocity_m_s: state.velocity_m_s,
            world_from_body: state.world_from_body,
            ..Self::default()
        }
    }

    /// Adds an error to the state.
    pub(super) fn inject(&mut self, error: &Row) {
        let three = |first: usize| Vector3::new(error[first], error[first + 1], error[first + 2]);
        self.position_m += three(0);
        self.velocity_m_s += three(VELOCITY);
        self.world_from_body = UnitQuaternion::from_scaled_axis(three(ATTITUDE)) * self.world_from_body;
        self.gyro_bias_rad_s += three(GYRO_BIAS);
        self.accelerometer_bias_m_s2 += three(ACCELEROMETER_BIAS);
        self.wind_m_s += three(WIND).xy();
        self.barometer_offset_m += error[BAROMETER_OFFSET];
        self.barometer_ram += error[BAROMETER_RAM];
        self.gnss_offset_m += three(GNSS_OFFSET);
        self.gnss_time_tag_s += error[GNSS_TIME_TAG];
        self.barometer_late_s += error[BAROMETER_LATE];
        self.lidar_late_s += error[LIDAR_LATE];
        self.slope += Vector2::new(error[SLOPE], error[SLOPE + 1]);
        self.barometer_suction += error[BAROMETER_SUCTION];
        self.barometer_scale += error[BAROMETER_SCALE];
    }

    pub(super) fn is_finite(&self) -> bool {
        self.position_m
            .iter()
            .chain(self.velocity_m_s.iter())
            .chain(self.world_from_body.coords.iter())
            .chain(self.gyro_bias_rad_s.iter())
            .chain(self.accelerometer_bias_m_s2.iter())
            .chain(self.wind_m_s.iter())
            .chain(self.gnss_offset_m.iter())
            .chain(self.slope.iter())
            .chain([
                &self.barometer_offset_m,
                &self.barometer_ram,
                &self.gnss_time_tag_s,
                &self.barometer_late_s,
                &self.lidar_late_s,
                &self.barometer_suction,
                &self.barometer_scale,
            ])
            .all(|value| value.is_finite())
    }
}

/// The configured noise in SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Noise {
    pub(super) accelerometer_m_s2_sqrt_hz: f64,
    /// Variance that each error gains in a second: in the fall, and while the motor's vibration
    /// affects the inertial unit.
    per_second: Row,
    burning_per_second: Row,
}

impl Noise {
    pub(super) fn of(config: &EstimatorConfig) -> Self {
        let milli_g = 1e-3 * GRAVITY_M_S2;
        let accelerometer = config.accelerometer_noise_mg_sqrt_hz * milli_g;
        let mut sigmas: Row = [0.0; N];
        sigmas[VELOCITY..ATTITUDE].fill(accelerometer);
        sigmas[ATTITUDE..GYRO_BIAS].fill(config.gyro_noise_deg_s_sqrt_hz.to_radians());
        sigmas[GYRO_BIAS..ACCELEROMETER_BIAS].fill(config.gyro_bias_walk_deg_s_sqrt_s.to_radians());
        sigmas[ACCELEROMETER_BIAS..WIND].fill(config.accelerometer_bias_walk_mg_sqrt_s * milli_g);
        sigmas[WIND..BAROMETER_OFFSET].fill(config.wind_walk_m_s_sqrt_s);
        sigmas[BAROMETER_OFFSET] = config.barometer_offset_walk_m_sqrt_s;
        sigmas[BAROMETER_RAM] = config.barometer_ram_walk_sqrt_s;
        sigmas[GNSS_OFFSET] = config.gnss_horizontal_walk_m_sqrt_s;
        sigmas[GNSS_OFFSET + 1] = config.gnss_horizontal_walk_m_sqrt_s;
        sigmas[GNSS_OFFSET + 2] = config.gnss_vertical_walk_m_sqrt_s;
        let per_second = sigmas.map(|sigma| sigma * sigma);
        let mut burning_per_second = per_second;
        let shaken = [
            (VELOCITY, config.burning_accelerometer_mg_sqrt_hz * milli_g),
            (ATTITUDE, config.burning_gyro_deg_s_sqrt_hz.to_radians()),
        ];
        for (first, sigma) in shaken {
            for variance in &mut burning_per_second[first..first + 3] {
                *variance += sigma * sigma;
            }
        }
        Self { accelerometer_m_s2_sqrt_hz: accelerometer, per_second, burning_per_second }
    }
}

with_defaults! {
    /// The motion in the frames not yet propagated in the covariance.
    #[derive(Debug, Clone, Copy, PartialEq, Serialize)]
    pub(super) struct Pending {
        frames: u32 = 0,
        sensed_m_s: Vector3<f64> = Vector3::zeros(),
        world_from_body_s: Matrix3<f64> = Matrix3::zeros(),
        wind_factor: f64 = 1.0,
        burning: bool = false,
    }
}

impl Estimator {
    /// Integrates one frame: the attitude by the mean rate, the velocity by the mean specific force
    /// rotated by the attitude in the middle of the frame.
    pub(super) fn carry_forward(&mut self, imu: &ImuSample, burning: bool, levers: &LeverArms) {
        let interval_s = self.config.frame_s;
        let measured = self.aids.imu.count(imu.is_plausible());
        let repeated = imu.specific_force_m_s2 == self.last_imu.specific_force_m_s2;
        if measured {
            self.last_imu = *imu;
        }
        let (scale, _) = self.calibration().scale_and_bias();
        let state = &mut self.nominal;
        let before_rad_s = self.rate_rad_s;
        self.rate_rad_s = self.last_imu.gyro_rad_s - state.gyro_bias_rad_s;
        // At the centre of gravity (Groves 2013, section 5.5): the rate in the middle of two
        // samples.
        let angular_m_s2 = (self.rate_rad_s - before_rad_s) / interval_s;
        let middle_rad_s = (self.rate_rad_s + before_rad_s) * 0.5;
        self.specific_force_m_s2 = self.last_imu.specific_force_m_s2 / scale
            - state.accelerometer_bias_m_s2
            - angular_m_s2.cross(&levers.imu_m)
            - middle_rad_s.cross(&middle_rad_s.cross(&levers.imu_m));

        let half_turn = UnitQuaternion::from_scaled_axis(self.rate_rad_s * (0.5 * interval_s));
        let middle = state.world_from_body * half_turn;
        state.world_from_body = middle * half_turn;
        // Products of unit quaternions drift from unit length by rounding.
        state.world_from_body.renormalize_fast();
        let middle = middle.to_rotation_matrix();
        let sensed_m_s = middle * self.specific_force_m_s2 * interval_s;
        self.gnss_gate.begin_frame(sensed_m_s.norm(), measured, repeated);
        let gained_m_s = sensed_m_s - Vector3::z() * (self.config.gravity_m_s2 * interval_s);
        let moved_m = (state.velocity_m_s + gained_m_s * 0.5) * interval_s;
        state.position_m += moved_m;
        state.velocity_m_s += gained_m_s;

        let climb = state.velocity_m_s.z * interval_s / state.position_m.z.max(LOWEST_SHEAR_M);
        let wind_factor = if state.position_m.z > LOWEST_SHEAR_M {
            1.0 + self.config.wind_shear_exponent * climb
        } else {
            1.0
        };
        state.wind_m_s *= wind_factor;

        self.pending.frames += 1;
        self.pending.sensed_m_s += sensed_m_s;
        self.pending.world_from_body_s += middle.matrix() * interval_s;
        self.pending.wind_factor *= wind_factor;
        self.pending.burning = burning;
        let antenna_m = state.world_from_body * levers.gnss_m;
        let antenna_m_s = state.world_from_body * self.rate_rad_s.cross(&levers.gnss_m);
        let time_s = self.time_s();
        self.history.push(time_s, interval_s, &gained_m_s, [antenna_m, antenna_m_s]);
        let velocity_m2_s2 = self.covariance.variance(VELOCITY + 2);
        for heights in [&mut self.heights, &mut self.heights_without_lidar] {
            heights.predict(&self.config, moved_m.z, velocity_m2_s2, interval_s);
        }
        if self.pending.frames >= FRAMES_BETWEEN {
            self.catch_up();
        }
    }

    /// Propagates the covariance over the pending frames.
    pub(super) fn catch_up(&mut self) {
        if self.pending.frames == 0 {
            return;
        }
        let interval_s = f64::from(self.pending.frames) * self.config.frame_s;
        let noise = &self.noise;
        let per_second = if self.pending.burning { &noise.burning_per_second } else { &noise.per_second };
        self.covariance.propagate(&Transition {
            interval_s,
            sensed_m_s: self.pending.sensed_m_s,
            world_from_body_s: self.pending.world_from_body_s,
            wind_factor: self.pending.wind_factor,
            noise: per_second.map(|variance| variance * interval_s),
        });
        self.pending = Pending::default();
    }
}

// The antenna's recent motion, for late fixes.
//
// The history holds the velocity gained and its integral, not past estimates. The past state is the
// present estimate run backwards, so it contains every correction made since. (This is the
// recalculation of Larsen and others, "Incorporation of time delayed measurements in a
// discrete-time Kalman filter", CDC 1998, for a system whose motion in between is more accurate
// than the measurement.)

/// Stored frames: 320 ms at 200 Hz.
const LENGTH: usize = 64;

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
struct Sums {
    time_s: f64,
    /// Velocity gained since the start, and that of the antenna's lever arm, world, m/s.
    velocity_m_s: Vector3<f64>,
    /// Integral of the velocity gained, and the antenna's lever arm, world, m.
    position_m: Vector3<f64>,
}

/// The motion since a measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Since {
    pub(super) age_s: f64,
    /// Velocity gained since, gravity included, m/s.
    pub(super) gained_m_s: Vector3<f64>,
    /// Distance moved since, m.
    pub(super) moved_m: Vector3<f64>,
    /// Acceleration then, m/s^2.
    pub(super) acceleration_m_s2: Vector3<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct History {
    ring: [Sums; LENGTH],
    filled: usize,
    newest: usize,
    /// Lever arm of the antenna, m, and its velocity, m/s, in the newest frame, world.
    pub(super) lever: [Vector3<f64>; 2],
}

/// The newest entry alone: the others have not changed since the frames whose digests contain them.
impl Serialize for History {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        (self.ring[self.newest], self.filled, self.newest, self.lever).serialize(serializer)
    }
}

impl History {
    pub(super) fn new(time_s: f64) -> Self {
        let start = Sums { time_s, velocity_m_s: Vector3::zeros(), position_m: Vector3::zeros() };
        Self { ring: [start; LENGTH], filled: 1, newest: 0, lever: [Vector3::zeros(); 2] }
    }

    /// Discards the motion before the newest frame.
    pub(super) fn restart(&mut self) {
        self.filled = 1;
    }

    /// Adds one frame: the velocity gained by the centre of gravity, m/s, and the antenna's lever
    /// arm, m, with its velocity, m/s.
    pub(super) fn push(
        &mut self,
        time_s: f64,
        interval_s: f64,
        gained_m_s: &Vector3<f64>,
        lever: [Vector3<f64>; 2],
    ) {
        let before = self.ring[self.newest];
        let [before_m, before_m_s] = self.lever;
        let [lever_m, lever_m_s] = lever;
        let cg_m_s = before.velocity_m_s - before_m_s;
        self.newest = (self.newest + 1) % LENGTH;
        self.filled = (self.filled + 1).min(LENGTH);
        self.ring[self.newest] = Sums {
            time_s,
            velocity_m_s: cg_m_s + gained_m_s + lever_m_s,
            position_m: before.position_m - before_m + (cg_m_s + gained_m_s * 0.5) * interval_s + lever_m,
        };
        self.lever = lever;
    }

    /// Sum of the velocity gained up to the newest frame, m/s.
    pub(super) fn gained_m_s(&self) -> Vector3<f64> {
        self.ring[self.newest].velocity_m_s
    }

    /// The motion since a time, for an antenna that now has this velocity. `None` for a time in the
    /// future or too long ago.
    pub(super) fn since(&self, valid_at_s: f64, velocity_m_s: &Vector3<f64>) -> Option<Since> {
        let now = self.ring[self.newest];
        let age_s = now.time_s - valid_at_s;
        if age_s.is_nan() || age_s < -1e-9 {
            return None;
        }
        let mut later = now;
        for back in 0..self.filled {
            let sums = self.ring[(self.newest + LENGTH - back) % LENGTH];
            // The time of a fix may equal a frame's time except for rounding.
            if sums.time_s <= valid_at_s + 1e-9 {
                let gap_s = later.time_s - sums.time_s;
                let share = if gap_s > 0.0 { (valid_at_s - sums.time_s) / gap_s } else { 0.0 };
                let then_m_s = sums.velocity_m_s + (later.velocity_m_s - sums.velocity_m_s) * share;
                let then_m = sums.position_m + (later.position_m - sums.position_m) * share;
                return Some(Since {
                    age_s: age_s.max(0.0),
                    gained_m_s: now.velocity_m_s - then_m_s,
                    moved_m: (velocity_m_s - now.velocity_m_s) * age_s + now.position_m - then_m,
                    acceleration_m_s2: if gap_s > 0.0 {
                        (later.velocity_m_s - sums.velocity_m_s) / gap_s
                    } else {
                        Vector3::zeros()
                    },
                });
            }
            later = sums;
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fall_runs_backwards_exactly() {
        let (dt, g) = (0.005, Vector3::new(0.4, 0.0, -9.8));
        let mut history = History::new(0.0);
        for frame in 1..=200 {
            history.push(f64::from(frame) * dt, dt, &(g * dt), [Vector3::zeros(); 2]);
        }
        // The time is 1 s. The velocity at the start, which the history does not contain, was (3,
        // 0, -5).
        let start = Vector3::new(3.0, 0.0, -5.0);
        let now = start + g;
        for age in [0.0, 0.005, 0.12, 0.2] {
            let since = history.since(1.0 - age, &now).unwrap();
            let moved = now * age - g * (age * age / 2.0);
            assert!((since.moved_m - moved).norm() < 1e-12, "{age}: {} {moved}", since.moved_m);
            assert!((since.gained_m_s - g * age).norm() < 1e-12);
        }
        // Between frames the velocity is exact; the error of the position is below its curvature
        // over a frame.
        let since = history.since(1.0 - 0.1234, &now).unwrap();
        assert!((since.gained_m_s - g * 0.1234).norm() < 1e-12);
        assert!(history.since(1.1, &now).is_none(), "to come");
        assert!(history.since(0.5, &now).is_none(), "forgotten");
        assert!(history.since(f64::NAN, &now).is_none());
    }
}
