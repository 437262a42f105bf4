//! The flight computer's sensors: an inertial unit, a barometer, a satellite receiver with late fixes, and a lidar.
//!
//! [`Sensors::observe`] is called after every millisecond of truth. After every fifth it returns the measurements of
//! one frame of the flight computer. Each sensor has its own stream of random numbers and keeps drawing while it is
//! out, so a fault in one sensor does not change the noise of another.

mod noise;
mod params;
mod start;
#[cfg(test)]
mod tests;

use flight::computer::{FRAME_MS, FRAME_S};
use flight::estimation::estimator::{GRAVITY_M_S2, GnssFix, ImuSample, Measurements};
use flight::vehicle::rigid::RigidState;
use nalgebra::Vector3;

use self::noise::{Normal, Wander};
pub use self::params::{BarometerParams, GnssParams, ImuParams, LidarParams, SensorParamError, SensorParams};
pub use self::start::believed_start;
use crate::world::World;

const MS_S: f64 = 1e-3;

/// The truth that the sensors measure, after a millisecond.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensorTruth {
    /// Position, velocity, attitude and rotation; the position is the centre of gravity's.
    pub state: RigidState,
    /// Acceleration less gravity at the centre of gravity, body axes, m/s^2.
    pub specific_force_m_s2: Vector3<f64>,
    /// Speed through the air, m/s.
    pub airspeed_m_s: f64,
    /// Height of the centre of gravity over the feet when upright, m.
    pub cg_over_feet_m: f64,
}

impl SensorTruth {
    /// The truth of a world.
    pub fn of(world: &World) -> Self {
        Self {
            state: *world.state(),
            specific_force_m_s2: *world.specific_force_m_s2(),
            airspeed_m_s: world.air_velocity_m_s().norm(),
            cg_over_feet_m: world.cg_above_feet_m(),
        }
    }
}

/// The faults of the sensors at this moment.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SensorFaults {
    /// No satellite fixes.
    pub gnss_out: bool,
    /// No barometer samples.
    pub barometer_out: bool,
    /// No lidar ranges.
    pub lidar_out: bool,
    /// Added to the gyro's bias, body, rad/s.
    pub gyro_bias_step_rad_s: Vector3<f64>,
    /// Added to the accelerometer's bias, body, m/s^2.
    pub accelerometer_bias_step_m_s2: Vector3<f64>,
}

/// The true sensor errors that a filter estimates, for comparison.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensorErrors {
    /// Gyro bias, body, rad/s.
    pub gyro_bias_rad_s: Vector3<f64>,
    /// Accelerometer bias, body, m/s^2.
    pub accelerometer_bias_m_s2: Vector3<f64>,
    pub barometer_offset_m: f64,
    /// Ram coefficient.
    pub barometer_ram: f64,
}

/// A vehicle's sensors in one flight.
#[derive(Debug, Clone)]
pub struct Sensors {
    params: SensorParams,
    start_s: f64,
    elapsed_ms: u32,
    imu_noise: Normal,
    barometer_noise: Normal,
    gnss_noise: Normal,
    lidar_noise: Normal,
    errors: SensorErrors,
    accelerometer_scale: Vector3<f64>,
    wander: [Wander; 3],
    /// The wandering error at the time when the position was zeroed on the pad, m.
    zero_m: Vector3<f64>,
    /// Time of the first fix after the start, ms: receivers keep their own time.
    gnss_phase_ms: u32,
    on_its_way: Option<(u32, GnssFix)>,
    rate_sum_rad_s: Vector3<f64>,
    force_sum_m_s2: Vector3<f64>,
}

impl Sensors {
    /// Draws one flight's sensors; `start_s` is the flight computer's time at the start of the simulation.
    ///
    /// # Errors
    /// A parameter is out of range.
    pub fn new(params: &SensorParams, seed: u64, start_s: f64) -> Result<Self, SensorParamError> {
        params.validate()?;
        let (imu, gnss) = (&params.imu, &params.gnss);
        let [mut imu_noise, mut barometer_noise, mut gnss_noise, lidar_noise] =
            [0, 1, 2, 3].map(|stream| Normal::new(seed, stream));
        let errors = SensorErrors {
            gyro_bias_rad_s: imu_noise.next3() * imu.gyro_bias_deg_s.to_radians(),
            accelerometer_bias_m_s2: imu_noise.next3() * (imu.accelerometer_bias_mg * 1e-3 * GRAVITY_M_S2),
            barometer_offset_m: params.barometer.offset_m * barometer_noise.next(),
            barometer_ram: params.barometer.ram_coefficient * barometer_noise.next(),
        };
        let accelerometer_scale =
            Vector3::from_element(1.0) + imu_noise.next3() * imu.accelerometer_scale_share;
        let gnss_phase_ms = (gnss_noise.unit() * f64::from(gnss.period_ms)) as u32;
        let mut wander = [gnss.horizontal_wander_m, gnss.horizontal_wander_m, gnss.vertical_wander_m]
            .map(|sigma| Wander::new(sigma, gnss.wander_correlation_s, &mut gnss_noise));
        let zero_m = Vector3::from_fn(|axis, _| wander[axis].value);
        for axis in &mut wander {
            axis.advance(gnss.zeroed_before_s, &mut gnss_noise);
        }
        Ok(Self {
            params: *params,
            start_s,
            elapsed_ms: 0,
            imu_noise,
            barometer_noise,
            gnss_noise,
            lidar_noise,
            errors,
            accelerometer_scale,
            wander,
            zero_m,
            gnss_phase_ms,
            on_its_way: None,
            rate_sum_rad_s: Vector3::zeros(),
            force_sum_m_s2: Vector3::zeros(),
        })
    }

    /// The true errors of this flight's sensors at this moment, without faults.
    pub fn errors(&self) -> &SensorErrors {
        &self.errors
    }

    /// Measures the truth after one more millisecond; returns a frame's measurements after every fifth.
    pub fn observe(&mut self, truth: &SensorTruth, faults: &SensorFaults) -> Option<Measurements> {
        self.elapsed_ms += 1;
        self.rate_sum_rad_s += truth.state.rate_rad_s;
        self.force_sum_m_s2 += truth.specific_force_m_s2;
        self.watch_satellites(truth, faults.gnss_out);
        if !self.elapsed_ms.is_multiple_of(FRAME_MS) {
            return None;
        }
        Some(Measurements {
            imu: self.imu(faults),
            pressure_altitude_m: self.barometer(truth).filter(|_| !faults.barometer_out),
            gnss: self.arrived(),
            lidar_range_m: self.lidar(truth).filter(|_| !faults.lidar_out),
        })
    }

    fn imu(&mut self, faults: &SensorFaults) -> ImuSample {
        let imu = &self.params.imu;
        let mean = |sum: &mut Vector3<f64>| core::mem::take(sum) / f64::from(FRAME_MS);
        // White noise of this density, averaged over a frame.
        let spread = 1.0 / libm::sqrt(FRAME_S);
        let milli_g = 1e-3 * GRAVITY_M_S2;

        let walk = imu.gyro_bias_walk_deg_s_sqrt_s.to_radians() * libm::sqrt(FRAME_S);
        self.errors.gyro_bias_rad_s += self.imu_noise.next3() * walk;
        let gyro_white = self.imu_noise.next3() * (imu.gyro_noise_deg_s_sqrt_hz.to_radians() * spread);
        let gyro = mean(&mut self.rate_sum_rad_s)
            + self.errors.gyro_bias_rad_s
            + faults.gyro_bias_step_rad_s
            + gyro_white;

        let force_white = self.imu_noise.next3() * (imu.accelerometer_noise_mg_sqrt_hz * milli_g * spread);
        let force = mean(&mut self.force_sum_m_s2).component_mul(&self.accelerometer_scale)
            + self.errors.accelerometer_bias_m_s2
            + faults.accelerometer_bias_step_m_s2
            + force_white;

        let clip = |value: Vector3<f64>, range: f64| value.map(|axis| axis.clamp(-range, range));
        ImuSample {
            gyro_rad_s: clip(gyro, imu.gyro_range_deg_s.to_radians()),
            specific_force_m_s2: clip(force, imu.accelerometer_range_g * GRAVITY_M_S2),
        }
    }

    fn barometer(&mut self, truth: &SensorTruth) -> Option<f64> {
        let barometer = &self.params.barometer;
        if !self.elapsed_ms.is_multiple_of(barometer.period_ms) {
            return None;
        }
        let walk = barometer.offset_walk_m_sqrt_s * libm::sqrt(f64::from(barometer.period_ms) * MS_S);
        self.errors.barometer_offset_m += walk * self.barometer_noise.next();
        // A pressure that is too high by k rho V^2 / 2 gives a height that is too low by k V^2 / 2 g.
        let speed_height_m = truth.airspeed_m_s * truth.airspeed_m_s / (2.0 * GRAVITY_M_S2);
        Some(
            truth.state.position_m.z + self.errors.barometer_offset_m
                - self.errors.barometer_ram * speed_height_m
                + barometer.noise_m * self.barometer_noise.next(),
        )
    }

    fn watch_satellites(&mut self, truth: &SensorTruth, out: bool) {
        let gnss = &self.params.gnss;
        if self.elapsed_ms % gnss.period_ms != self.gnss_phase_ms {
            return;
        }
        for axis in &mut self.wander {
            axis.advance(f64::from(gnss.period_ms) * MS_S, &mut self.gnss_noise);
        }
        let wandered_m = Vector3::from_fn(|axis, _| self.wander[axis].value) - self.zero_m;
        let white_m = Vector3::new(gnss.horizontal_white_m, gnss.horizontal_white_m, gnss.vertical_white_m);
        let fix = GnssFix {
            position_m: truth.state.position_m + wandered_m + self.gnss_noise.next3().component_mul(&white_m),
            velocity_m_s: truth.state.velocity_m_s + self.gnss_noise.next3() * gnss.velocity_m_s,
            valid_at_s: self.start_s + f64::from(self.elapsed_ms) * MS_S,
        };
        if !out {
            self.on_its_way = Some((self.elapsed_ms + gnss.delay_ms, fix));
        }
    }

    /// The fix that has arrived by this frame.
    fn arrived(&mut self) -> Option<GnssFix> {
        let now_ms = self.elapsed_ms;
        self.on_its_way.take_if(|(at_ms, _)| *at_ms <= now_ms).map(|(_, fix)| fix)
    }

    fn lidar(&mut self, truth: &SensorTruth) -> Option<f64> {
        let lidar = &self.params.lidar;
        if !self.elapsed_ms.is_multiple_of(lidar.period_ms) {
            return None;
        }
        let noise_m = lidar.noise_m * self.lidar_noise.next();
        let tilt_rad = truth.state.tilt_rad();
        if tilt_rad > lidar.tilt_max_deg.to_radians() {
            return None;
        }
        // From the lidar along the axis to the ground: the slant range from the centre of gravity, less the lidar's
        // distance from it.
        let slant_m = truth.state.position_m.z / libm::cos(tilt_rad);
        let range_m = slant_m - lidar.behind_cg_m(truth.cg_over_feet_m) + noise_m;
        // Rough ground reflects light in all directions, and less at an angle (Lambert's cosine law). The echo weakens
        // with the square of the range.
        let farthest_m = lidar.range_max_m * libm::cos(tilt_rad).sqrt();
        (lidar.range_min_m..=farthest_m).contains(&range_m).then_some(range_m)
    }
}
