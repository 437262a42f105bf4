//! Sensor health: which sensors are silent, and which report implausible values. One set of rules,
//! used before arming, until the igniter is energised, in flight, and on a log.

use nalgebra::{SVector, Vector3};
use serde::Serialize;

use super::estimator::Measurements;
use super::estimator::alignment::AT_REST_M_S2;
use crate::text::{Text, text};

/// The sensors, as their arming checks name them.
pub const SENSORS: [&str; 5] = ["accelerometer", "gyro", "barometer", "GNSS", "lidar"];

/// Consecutive equal inertial samples that noise does not produce.
pub(super) const FROZEN_IMU: u32 = 4;
/// The same for a barometer, half a second, and for a lidar, a second: both round more coarsely. A
/// receiver at rest may repeat one fix (static hold).
const FROZEN_BAROMETER: u32 = 25;
const FROZEN_RANGES: u32 = 100;
/// The same of a receiver and of a lidar in motion.
const FROZEN_FIXES: u32 = 3;
const FROZEN_IN_MOTION: u32 = 10;
/// Range below which a lidar may miss the ground, m (TF-Luna, Benewake).
pub const LIDAR_BLIND_M: f64 = 0.2;
/// Permitted deviation of a range at rest, m: noise, grass and slope are smaller.
const LIDAR_OFF_M: f64 = 0.35;
/// Consecutive deviating ranges that count, 0.2 s: outliers are single.
const RANGES: usize = 20;

/// The barometer samples at 50 Hz.
pub const BAROMETER_LOST_S: f64 = 0.25;
/// Time without a fix after which a satellite receiver has lost it, s: it reports five times a
/// second and drops one sample in 50.
pub const GNSS_LOST_S: f64 = 1.5;
/// Time after which a silent lidar that must see the ground is lost, s.
pub const LIDAR_LOST_S: f64 = 0.25;
/// An inertial unit reports in every frame; its samples are bridged for this time, s.
const IMU_LOST_S: f64 = 0.05;

/// Averaging time of a resting vehicle's inertial samples, s: a shudder of the rail in a gust is
/// shorter, and the noise of one sample (0.5 deg/s, 0.1 m/s^2) drops to a seventh.
const RESTS_OVER_S: f64 = 0.25;
/// Deviation from the pad beyond which a barometer zeroed at power-up is wrong, m: over a day the
/// weather changes it by 15 m.
const BAROMETER_OFF_M: f64 = 20.0;
/// Largest distance of fixes from the pad, m: four times the wander of a single-frequency receiver.
const GNSS_OFF_M: f64 = 20.0;
/// Weight of the newest fix in the mean position: an outlier of 50 m moves it by 10.
const NEWEST_FIX: f64 = 0.2;

/// Time of a sensor's last sample, and the duration of its repetition.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Channel<const N: usize> {
    last: SVector<f64, N>,
    /// Time of the last sample; before the first, the start of the observation. NaN: not started.
    sampled_at_s: f64,
    has_sample: bool,
    same: u32,
    same_since_s: f64,
}

impl<const N: usize> Default for Channel<N> {
    fn default() -> Self {
        Self {
            last: SVector::repeat(f64::NAN),
            sampled_at_s: f64::NAN,
            has_sample: false,
            same: 0,
            same_since_s: f64::NAN,
        }
    }
}

impl<const N: usize> Channel<N> {
    /// Takes a frame's sample, if there is one. NaN counts as no sample.
    fn take(&mut self, sample: Option<[f64; N]>, time_s: f64) {
        if self.sampled_at_s.is_nan() {
            self.sampled_at_s = time_s;
        }
        let Some(sample) = sample.filter(|axes| axes.iter().all(|value| value.is_finite())) else { return };
        let again = self.has_sample && sample.map(f64::to_bits) == self.last.data.0[0].map(f64::to_bits);
        if !again {
            self.same_since_s = time_s;
        }
        self.same = if again { self.same.saturating_add(1) } else { 0 };
        (self.last, self.sampled_at_s, self.has_sample) = (sample.into(), time_s, true);
    }

    /// The last sample, if it is not older than this, s.
    pub fn fresh(&self, time_s: f64, within_s: f64) -> Option<[f64; N]> {
        (self.has_sample && self.silent_s(time_s) <= within_s).then(|| self.last.into())
    }

    /// Time without a sample, s.
    pub fn silent_s(&self, time_s: f64) -> f64 {
        time_s - self.sampled_at_s
    }

    fn repeats_for_s(&self, frozen: u32, time_s: f64) -> Option<f64> {
        (self.same >= frozen).then_some(time_s - self.same_since_s)
    }

    /// The channel's loss as text: it is silent for too long, or has repeated one value for
    /// `frozen` samples.
    fn lost(&self, name: &str, time_s: f64, longest_s: f64, frozen: u32) -> Option<Text> {
        let silent_s = self.silent_s(time_s);
        let repeats = || self.repeats_for_s(frozen, time_s);
        (silent_s > longest_s)
            .then(|| text!("{name} silent for {silent_s:.1} s"))
            .or_else(|| repeats().map(|for_s| text!("{name} repeats one value for {for_s:.1} s")))
    }
}

/// The monitor of all sensors.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct SensorWatch {
    time_s: f64,
    gyro: Channel<3>,
    accelerometer: Channel<3>,
    /// Height, m.
    barometer: Channel<1>,
    /// Position and velocity, world, m and m/s.
    gnss: Channel<6>,
    /// Range, m.
    lidar: Channel<1>,
    /// Means over [`RESTS_OVER_S`], body, rad/s and m/s^2.
    turns_rad_s: Vector3<f64>,
    sensed_m_s2: Vector3<f64>,
    /// Mean position of the fixes, world, m.
    fixed_m: Vector3<f64>,
    /// Ranges of the lidar, the newest first, m.
    ranges_m: [f64; RANGES],
}

/// Resting place of the vehicle while its sensors are checked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Rests {
    /// On its rail or its legs, with its centre of gravity at this position, m, and its lidar this
    /// far from the ground, m.
    Standing { at_m: Vector3<f64>, range_m: f64 },
    /// Below a drone, which moves.
    Hanging,
}

impl SensorWatch {
    /// Takes a frame's measurements.
    pub fn take(&mut self, measured: &Measurements, time_s: f64) {
        let frame_s = if self.gyro.has_sample { time_s - self.time_s } else { RESTS_OVER_S };
        self.time_s = time_s;
        let imu = &measured.imu;
        self.gyro.take(Some(imu.gyro_rad_s.into()).filter(|_| imu.gyro_is_plausible()), time_s);
        self.accelerometer
            .take(Some(imu.specific_force_m_s2.into()).filter(|_| imu.accelerometer_is_plausible()), time_s);
        self.barometer.take(measured.pressure_altitude_m.map(|height_m| [height_m]), time_s);
        self.lidar.take(measured.lidar_range_m.map(|range_m| [range_m]), time_s);
        if let Some(range_m) = measured.lidar_range_m {
            self.ranges_m.rotate_right(1);
            self.ranges_m[0] = range_m;
        }
        let fix = measured.gnss.map(|fix| {
            let ([x, y, z], [u, v, w]) = (fix.position_m.into(), fix.velocity_m_s.into());
            [x, y, z, u, v, w]
        });
        let share = if self.gnss.has_sample { NEWEST_FIX } else { 1.0 };
        if let Some(fix) =
            measured.gnss.filter(|fix| fix.position_m.iter().all(|place_m| place_m.is_finite()))
        {
            self.fixed_m += (fix.position_m - self.fixed_m) * share;
        }
        self.gnss.take(fix, time_s);
        if imu.is_plausible() {
            let share = (frame_s / RESTS_OVER_S).clamp(0.0, 1.0);
            self.turns_rad_s += (imu.gyro_rad_s - self.turns_rad_s) * share;
            self.sensed_m_s2 += (imu.specific_force_m_s2 - self.sensed_m_s2) * share;
        }
    }

    /// Whether the satellite receiver has a fix.
    pub fn gnss_speaks(&self) -> bool {
        self.gnss.fresh(self.time_s, GNSS_LOST_S).is_some()
    }

    /// Pressure altitude, m, unless the barometer is silent.
    pub fn pressure_altitude_m(&self) -> Option<f64> {
        self.barometer.fresh(self.time_s, BAROMETER_LOST_S).map(|[height_m]| height_m)
    }

    /// The lidar's range, m, unless it receives no echo.
    pub fn lidar_range_m(&self) -> Option<f64> {
        self.lidar.fresh(self.time_s, LIDAR_LOST_S).map(|[range_m]| range_m)
    }

    /// Time without a sample, s: barometer, satellites, lidar.
    pub fn silent_s(&self) -> [f64; 3] {
        let time_s = self.time_s;
        [self.barometer.silent_s(time_s), self.gnss.silent_s(time_s), self.lidar.silent_s(time_s)]
    }

    /// Time for which the accelerometer has repeated one sample, s; `None` if it does not.
    pub fn accelerometer_frozen_s(&self) -> Option<f64> {
        self.accelerometer.repeats_for_s(FROZEN_IMU, self.time_s)
    }

    /// Time without a plausible sample, and time for which a sensor in motion has repeated one, s,
    /// in the order of [`SENSORS`].
    pub fn lost_s(&self) -> [[f64; 2]; SENSORS.len()] {
        fn of<const N: usize>(channel: &Channel<N>, frozen: u32, time_s: f64) -> [f64; 2] {
            [channel.silent_s(time_s), channel.repeats_for_s(frozen, time_s).unwrap_or(0.0)]
        }
        let time_s = self.time_s;
        [
            of(&self.accelerometer, FROZEN_IMU, time_s),
            of(&self.gyro, FROZEN_IMU, time_s),
            of(&self.barometer, FROZEN_BAROMETER, time_s),
            of(&self.gnss, FROZEN_FIXES, time_s),
            of(&self.lidar, FROZEN_IN_MOTION, time_s),
        ]
    }

    /// Whether the accelerometer is frozen or implausible.
    pub fn accelerometer_is_lost(&self) -> bool {
        self.accelerometer_frozen_s().is_some() || self.accelerometer.silent_s(self.time_s) > 0.0
    }

    /// Time without inertial data, s: accelerometer or gyro repeat one sample, or report
    /// implausible values.
    pub fn no_inertial_data_for_s(&self) -> f64 {
        let [_, [silent_s, repeats_s], ..] = self.lost_s();
        self.accelerometer_lost_s().max(repeats_s).max(silent_s)
    }

    /// Time for which the accelerometer has repeated one sample, or sent none, s.
    pub fn accelerometer_lost_s(&self) -> f64 {
        let [[silent_s, repeats_s], ..] = self.lost_s();
        repeats_s.max(silent_s)
    }

    /// Recent mean of the gyro, body, rad/s.
    pub fn turns_rad_s(&self) -> Vector3<f64> {
        self.turns_rad_s
    }

    /// The defect of each of the [`SENSORS`] of a vehicle at rest, as text for the crew.
    pub fn defects(&self, rests: Rests) -> [Option<Text>; SENSORS.len()] {
        let time_s = self.time_s;
        let sensed_m_s2 = self.sensed_m_s2.norm();
        let accelerometer =
            self.accelerometer.lost("accelerometer", time_s, IMU_LOST_S, FROZEN_IMU).or_else(|| {
                let wrong = !AT_REST_M_S2.contains(&sensed_m_s2) && rests != Rests::Hanging;
                wrong.then(|| text!("accelerometer reads {sensed_m_s2:.1} m/s2 at rest, not 9.8"))
            });
        let gyro = self.gyro.lost("gyro", time_s, IMU_LOST_S, FROZEN_IMU);
        let place_m = match rests {
            Rests::Standing { at_m, .. } => Some(at_m),
            Rests::Hanging => None,
        };
        let barometer = self.barometer.lost("barometer", time_s, BAROMETER_LOST_S, FROZEN_BAROMETER);
        let barometer = barometer.or_else(|| {
            let off_m = self.barometer.last[0] - place_m?.z;
            (off_m.abs() > BAROMETER_OFF_M)
                .then(|| text!("barometer {off_m:.0} m off: power cycle to zero it"))
        });
        let gnss_silent_s = self.gnss.silent_s(time_s);
        let gnss = (gnss_silent_s > GNSS_LOST_S)
            .then(|| text!("no GNSS fix for {gnss_silent_s:.1} s"))
            .or_else(|| {
                let off_m = (self.fixed_m - place_m?).norm();
                (self.gnss.has_sample && off_m > GNSS_OFF_M).then(|| text!("GNSS {off_m:.0} m off"))
            });
        let lidar = match rests {
            Rests::Standing { range_m, .. } if range_m >= LIDAR_BLIND_M => {
                self.lidar.lost("lidar", time_s, LIDAR_LOST_S, FROZEN_RANGES).or_else(|| {
                    let off = self.ranges_m.iter().all(|found_m| (found_m - range_m).abs() > LIDAR_OFF_M);
                    let found_m = self.ranges_m[0];
                    off.then(|| text!("lidar {found_m:.2} m at rest, not {range_m:.2}"))
                })
            }
            Rests::Standing { .. } | Rests::Hanging => None,
        };
        [accelerometer, gyro, barometer, gnss, lidar]
    }
}
