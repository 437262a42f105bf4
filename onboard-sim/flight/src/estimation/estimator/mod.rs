//! Estimates position, motion, attitude and wind from the sensors.
//!
//! An error-state Kalman filter with a multiplicative quaternion (Solà, "Quaternion kinematics for
//! the error-state Kalman filter", 2017; here the attitude error is in world axes). The inertial
//! unit propagates the whole state in every frame. The error of the state, 29 numbers, is corrected
//! by scalar measurements: barometer with offset, age and ram error, late satellite fixes with a
//! slowly wandering offset and an error of their time tags, lidar, and the sideways force that
//! shows the wind.
//!
//! * [`Measurements`] and [`VehicleNow`] are the only inputs of a frame: with a log of them the
//!   estimator gives the same bits again.
//! * [`EstimatorConfig`] and [`StartUncertainty`] are the assumed errors of the sensors and of the
//!   initial state.
//! * [`Estimate`] is the output: state, wind, standard deviations, two heights, health.
//! * [`alignment`] finds the initial attitude on the pad.
//!
//! A measurement that does not fit is rejected and counted ([`Aids`]). If the state is not a
//! number, the filter restarts from the last good state with a larger uncertainty.

pub mod alignment;
mod barometer;
mod config;
mod correction;
mod covariance;
mod gnss;
mod gnss_gate;
mod health;
mod lidar;
mod recovery;
mod strapdown;
#[cfg(test)]
mod tests;
mod wind;

use nalgebra::{Vector2, Vector3};
use serde::{Deserialize, Serialize};

use self::alignment::ImuCalibration;
pub use self::config::{EstimatorConfig, GRAVITY_M_S2, HealthLimits, StartUncertainty};
pub use self::correction::{AidStatus, Aids};
use self::covariance::{
    ACCELEROMETER_BIAS, ATTITUDE, BAROMETER_LATE, BAROMETER_OFFSET, BAROMETER_RAM, BAROMETER_SCALE,
    BAROMETER_SUCTION, Covariance, GNSS_OFFSET, GNSS_TIME_TAG, GYRO_BIAS, LIDAR_LATE, N, POSITION, Row,
    SLOPE, VELOCITY, WIND,
};
use self::gnss::FixAge;
use self::gnss_gate::GnssGate;
pub use self::health::{Health, HealthIssue, HeightSources};
use self::health::{HeightChannel, Surprise};
use self::recovery::Contradiction;
use self::strapdown::{History, Noise, Nominal, Pending};
use self::wind::Sideways;
pub use self::wind::VehicleNow;
use crate::vehicle::rigid::RigidState;

/// Standard deviations of an estimate, from the diagonal of the covariance.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Sigmas {
    pub position_m: Vector3<f64>,
    pub velocity_m_s: Vector3<f64>,
    /// Attitude, about the world's axes, rad: x and y are lean, z is heading.
    pub attitude_rad: Vector3<f64>,
    /// Gyro bias, body, rad/s.
    pub gyro_bias_rad_s: Vector3<f64>,
    /// Accelerometer bias, body, m/s^2.
    pub accelerometer_bias_m_s2: Vector3<f64>,
    /// Wind, world x and y, m/s.
    pub wind_m_s: Vector2<f64>,
}

/// The output of the estimator after a frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// End of the frame, s.
    pub time_s: f64,
    /// Position, velocity, attitude and rotation.
    pub state: RigidState,
    /// Specific force without its estimated bias, body axes, mean over the frame, m/s^2.
    pub specific_force_m_s2: Vector3<f64>,
    /// Horizontal wind at the vehicle, world x and y, m/s: the velocity of the air.
    pub wind_m_s: Vector2<f64>,
    /// Gyro bias, body, rad/s.
    pub gyro_bias_rad_s: Vector3<f64>,
    /// Accelerometer bias, body, m/s^2.
    pub accelerometer_bias_m_s2: Vector3<f64>,
    pub sigmas: Sigmas,
    /// Two independent heights.
    pub heights: HeightSources,
    /// Whether the estimate may be used.
    pub health: Health,
}

impl Estimate {
    /// An exact estimate from the true state, for flights and tests without an estimator.
    pub fn exact(
        time_s: f64,
        state: RigidState,
        specific_force_m_s2: Vector3<f64>,
        wind_m_s: Vector2<f64>,
    ) -> Self {
        let (zero, height_m) = (Vector3::zeros(), state.position_m.z);
        Self {
            time_s,
            state,
            specific_force_m_s2,
            wind_m_s,
            gyro_bias_rad_s: zero,
            accelerometer_bias_m_s2: zero,
            sigmas: Sigmas::default(),
            heights: HeightSources {
                inertial_m: height_m,
                inertial_sigma_m: 0.0,
                barometric_m: Some(height_m),
            },
            health: Health::Good,
        }
    }

    pub fn velocity_through_air_m_s(&self) -> Vector3<f64> {
        self.state.velocity_m_s - self.wind_m_s.push(0.0)
    }
}

/// The filter. Only `step` advances it. A clone continues with exactly the same bits.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Estimator {
    // Skipped fields are constants of the mission.
    #[serde(skip)]
    config: EstimatorConfig,
    #[serde(skip)]
    noise: Noise,
    #[serde(skip)]
    start: StartUncertainty,
    start_s: f64,
    frames: u64,
    nominal: Nominal,
    covariance: Covariance,
    pending: Pending,
    history: History,
    /// The last range of the lidar, m.
    last_range_m: f64,
    heights: HeightChannel,
    /// The same without the lidar, to check the lidar against.
    heights_without_lidar: HeightChannel,
    sideways: Sideways,
    aids: Aids,
    /// Inertial height and fixes agree on another height than the barometer's.
    barometer_outvoted: bool,
    /// Number of used satellite position components from which on they may outvote it.
    outvoted_from: u32,
    surprise: Surprise,
    fix_age: FixAge,
    gnss_gate: GnssGate,
    contradiction: Contradiction,
    /// Measured specific force over the true one, at rest on the pad.
    accelerometer_scale: f64,
    last_imu: ImuSample,
    /// The landing motor's vibration has shifted the gyro.
    is_shaken: bool,
    rate_rad_s: Vector3<f64>,
    specific_force_m_s2: Vector3<f64>,
    last_good: Nominal,
    restarts: u32,
    restarted_at_s: f64,
    /// Unhealthy until this time after a surprise, s.
    unhealthy_until_s: f64,
}

// Configuration, noise and the initial uncertainty come from the mission.
impl Estimator {
    /// Starts at a time, s, from a state with this uncertainty.
    pub fn new(config: &EstimatorConfig, start: &StartUncertainty, time_s: f64, state: &RigidState) -> Self {
        let nominal = Nominal::at(state);
        Self {
            config: *config,
            noise: Noise::of(config),
            start: *start,
            start_s: time_s,
            frames: 0,
            nominal,
            covariance: start_covariance(start, config, state),
            pending: Pending::default(),
            history: History::new(time_s),
            heights: start_heights(start, state.position_m.z),
            last_range_m: 0.0,
            heights_without_lidar: start_heights(start, state.position_m.z),
            sideways: Sideways::default(),
            aids: Aids::default(),
            barometer_outvoted: false,
            outvoted_from: 0,
            surprise: Surprise::default(),
            fix_age: FixAge::new(config),
            gnss_gate: GnssGate::new(&state.velocity_m_s),
            accelerometer_scale: 1.0,
            contradiction: Contradiction::default(),
            is_shaken: false,
            last_imu: ImuSample { gyro_rad_s: state.rate_rad_s, specific_force_m_s2: Vector3::zeros() },
            rate_rad_s: state.rate_rad_s,
            specific_force_m_s2: Vector3::zeros(),
            last_good: nominal,
            restarts: 0,
            restarted_at_s: f64::NEG_INFINITY,
            unhealthy_until_s: f64::NEG_INFINITY,
        }
    }

    /// The same filter with an inertial unit calibrated on the pad.
    #[must_use]
    pub fn calibrated(mut self, calibration: &ImuCalibration) -> Self {
        self.nominal.gyro_bias_rad_s = calibration.gyro_bias_rad_s;
        self.accelerometer_scale = calibration.accelerometer_scale;
        let (_, sigma_m_s2) = calibration.scale_and_bias();
        for axis in ACCELEROMETER_BIAS..WIND {
            self.covariance.widen(axis, sigma_m_s2 * sigma_m_s2);
        }
        self.last_good = self.nominal;
        self
    }

    /// The inertial unit's calibration, with the gyro bias as estimated now.
    pub fn calibration(&self) -> ImuCalibration {
        ImuCalibration {
            gyro_bias_rad_s: self.nominal.gyro_bias_rad_s,
            accelerometer_scale: self.accelerometer_scale,
        }
    }

    /// End of the last frame, s.
    pub fn time_s(&self) -> f64 {
        self.start_s + self.frames as f64 * self.config.frame_s
    }

    /// Runs one frame: propagates the state with the inertial sample, then corrects it with the
    /// other measurements.
    pub fn step(&mut self, measurements: &Measurements, vehicle: &VehicleNow) -> Estimate {
        self.frames += 1;
        self.aids.begin_frame();
        if vehicle.motor_burning && !self.is_shaken {
            self.is_shaken = true;
            let shift_rad_s = self.config.burning_gyro_bias_deg_s.to_radians();
            for axis in GYRO_BIAS..ACCELEROMETER_BIAS {
                self.covariance.widen(axis, shift_rad_s * shift_rad_s);
            }
        }
        self.carry_forward(&measurements.imu, vehicle.motor_burning, &vehicle.levers);
        self.recover_if_lost(measurements);
        if let Some(altitude_m) = measurements.pressure_altitude_m {
            self.take_barometer(altitude_m, &vehicle.levers.barometer_m);
        }
        if let Some(fix) = measurements.gnss.filter(|fix| self.admits(fix, vehicle.motor_burning)) {
            self.take_gnss(&fix);
        }
        if let Some(range_m) = measurements.lidar_range_m {
            self.take_lidar(range_m, &vehicle.levers.lidar_m);
        }
        self.update_wind(vehicle);
        self.guard();
        self.estimate()
    }

    /// Adds to the standard deviation of the velocity, world, m/s.
    pub(crate) fn inflate_velocity(&mut self, sigma_m_s: &Vector3<f64>) {
        self.catch_up();
        for axis in 0..3 {
            self.covariance.widen(VELOCITY + axis, sigma_m_s[axis] * sigma_m_s[axis]);
        }
    }

    /// Accounts for a shock along the nose that no inertial unit measures: it changes the velocity
    /// by about this much, m/s, and a fix from before it does not show the velocity after it.
    pub(crate) fn take_shock(&mut self, gained_m_s: f64) {
        self.inflate_velocity(&(self.nominal.world_from_body * Vector3::x() * gained_m_s));
        self.history.restart();
        self.gnss_gate.shock_m_s += gained_m_s;
    }

    /// The estimate now.
    pub fn estimate(&self) -> Estimate {
        let time_s = self.time_s();
        let mounting_rad = self.config.mounting_deg.to_radians();
        let sigmas = Sigmas {
            position_m: Vector3::from_fn(|axis, _| {
                libm::sqrt(self.over_ground_covariance(axis, axis).max(0.0))
            }),
            velocity_m_s: self.covariance.sigmas(VELOCITY),
            attitude_rad: self.covariance.sigmas(ATTITUDE).map(|sigma| libm::hypot(sigma, mounting_rad)),
            gyro_bias_rad_s: self.covariance.sigmas(GYRO_BIAS),
            accelerometer_bias_m_s2: self.covariance.sigmas(ACCELEROMETER_BIAS),
            wind_m_s: self.covariance.sigmas(WIND).xy(),
        };
        Estimate {
            time_s,
            state: RigidState {
                position_m: self.over_ground_m(),
                velocity_m_s: self.nominal.velocity_m_s,
                world_from_body: self.nominal.world_from_body,
                rate_rad_s: self.rate_rad_s,
            },
            specific_force_m_s2: self.specific_force_m_s2,
            wind_m_s: self.nominal.wind_m_s,
            gyro_bias_rad_s: self.nominal.gyro_bias_rad_s,
            accelerometer_bias_m_s2: self.nominal.accelerometer_bias_m_s2,
            health: health::judge(
                &self.config,
                &self.aids,
                &sigmas,
                time_s - self.restarted_at_s,
                time_s < self.unhealthy_until_s,
            ),
            sigmas,
            heights: self.heights.sources(),
        }
    }

    /// The status of each aiding measurement.
    pub fn aids(&self) -> &Aids {
        &self.aids
    }

    /// How often the filter has restarted because its state was not a number.
    pub fn restarts(&self) -> u32 {
        self.restarts
    }

    /// Normalised estimation error squared (Bar-Shalom, Li and Kirubarajan 2001, section 5.4) of
    /// position, velocity and attitude against the truth. In a consistent filter it is chi-square
    /// with 9 degrees of freedom. `None` if the covariance has lost rank.
    pub fn nees_of_motion(&self, truth: &RigidState) -> Option<f64> {
        let turn = (truth.world_from_body * self.nominal.world_from_body.inverse()).scaled_axis();
        let position = truth.position_m - self.over_ground_m();
        let velocity = truth.velocity_m_s - self.nominal.velocity_m_s;
        let error = nalgebra::SVector::<f64, 9>::from_iterator(
            position.iter().chain(velocity.iter()).chain(turn.iter()).copied(),
        );
        let mounting_rad = self.config.mounting_deg.to_radians();
        let covariance = nalgebra::SMatrix::<f64, 9, 9>::from_fn(|row, column| {
            let mounted = if row == column && row >= ATTITUDE { mounting_rad * mounting_rad } else { 0.0 };
            self.over_ground_covariance(row, column) + mounted
        });
        Some(error.dot(&covariance.cholesky()?.solve(&error)))
    }

    /// Position with the height over the ground below the vehicle, as needed for a landing.
    fn over_ground_m(&self) -> Vector3<f64> {
        let position_m = self.nominal.position_m;
        position_m - Vector3::z() * self.nominal.slope.dot(&position_m.xy())
    }

    /// Covariance of two errors of the motion, the height's over the ground below.
    fn over_ground_covariance(&self, row: usize, column: usize) -> f64 {
        let at_m = self.nominal.position_m;
        let made_of = |index| {
            let slope = if index == POSITION + 2 { -at_m.xy() } else { Vector2::zeros() };
            [(index, 1.0), (SLOPE, slope.x), (SLOPE + 1, slope.y)]
        };
        self.covariance.between(&made_of(row), &made_of(column))
    }

    fn velocity_through_air_m_s(&self) -> Vector3<f64> {
        self.nominal.velocity_m_s - self.nominal.wind_m_s.push(0.0)
    }

    /// Stores the last good state, and restores it when the present state is NaN.
    fn guard(&mut self) {
        if self.nominal.is_finite() && self.covariance.is_finite() && self.heights.is_finite() {
            self.last_good = self.nominal;
            return;
        }
        let time_s = self.time_s();
        self.restarts = self.restarts.saturating_add(1);
        self.restarted_at_s = time_s;
        self.nominal = self.last_good;
        let start = StartUncertainty { levelled: false, ..self.start };
        self.covariance = start_covariance(&start, &self.config, &RigidState::upright(0.0));
        self.pending = Pending::default();
        self.history = History::new(time_s);
        self.sideways.clear();
        self.heights = start_heights(&self.start, self.nominal.position_m.z);
        self.heights_without_lidar = self.heights;
    }
}

fn start_heights(start: &StartUncertainty, height_m: f64) -> HeightChannel {
    HeightChannel::new(height_m, start.height_m, start.gnss_vertical_offset_m)
}

fn start_covariance(start: &StartUncertainty, config: &EstimatorConfig, state: &RigidState) -> Covariance {
    let milli_g = 1e-3 * GRAVITY_M_S2;
    let mut sigmas: Row = [0.0; N];
    sigmas[POSITION..POSITION + 2].fill(start.horizontal_m);
    sigmas[POSITION + 2] = start.height_m;
    sigmas[VELOCITY..ATTITUDE].fill(start.velocity_m_s);
    sigmas[ATTITUDE..ATTITUDE + 2].fill(start.tilt_deg.to_radians());
    sigmas[ATTITUDE + 2] = start.heading_deg.to_radians();
    sigmas[GYRO_BIAS..ACCELEROMETER_BIAS].fill(start.gyro_bias_deg_s.to_radians());
    sigmas[ACCELEROMETER_BIAS..WIND].fill(start.accelerometer_bias_mg * milli_g);
    sigmas[WIND..BAROMETER_OFFSET].fill(start.wind_m_s);
    sigmas[BAROMETER_OFFSET] = start.barometer_offset_m;
    sigmas[BAROMETER_RAM] = start.barometer_ram;
    sigmas[GNSS_OFFSET..GNSS_OFFSET + 2].fill(start.gnss_horizontal_offset_m);
    sigmas[GNSS_OFFSET + 2] = start.gnss_vertical_offset_m;
    sigmas[GNSS_TIME_TAG] = config.gnss_time_tag_s;
    sigmas[BAROMETER_LATE] = config.barometer_late_s;
    sigmas[LIDAR_LATE] = config.lidar_late_s;
    sigmas[SLOPE..BAROMETER_SUCTION].fill(libm::tan(config.ground_slope_deg.to_radians()));
    sigmas[BAROMETER_SUCTION] = config.barometer_suction;
    sigmas[BAROMETER_SCALE] = config.barometer_scale;
    let variances = sigmas.map(|sigma| sigma * sigma);
    let mut covariance = Covariance::diagonal(&variances);
    if start.levelled {
        let world_from_body = state.world_from_body.to_rotation_matrix().into_inner();
        covariance.level(&world_from_body, variances[ACCELEROMETER_BIAS], config.gravity_m_s2);
    }
    covariance
}

// The measurements of one frame, as plain data. A log of them is enough to run the estimator again.

/// Beyond the range of hobby gyros (4,000 deg/s), rad/s.
pub const LARGEST_RATE_RAD_S: f64 = 75.0;
/// Beyond the range of high-g accelerometers (200 g), m/s^2.
pub const LARGEST_SPECIFIC_FORCE_M_S2: f64 = 2000.0;

/// Inertial measurement unit, the mean over the frame that has just ended.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct ImuSample {
    /// Rotation rate in body axes, rad/s.
    pub gyro_rad_s: Vector3<f64>,
    /// Specific force (acceleration minus gravity) at the centre of gravity, body axes, m/s^2.
    pub specific_force_m_s2: Vector3<f64>,
}

impl ImuSample {
    /// Whether an inertial unit can produce these values: they are below [`LARGEST_RATE_RAD_S`] and
    /// [`LARGEST_SPECIFIC_FORCE_M_S2`] in each axis.
    pub fn is_plausible(&self) -> bool {
        self.gyro_is_plausible() && self.accelerometer_is_plausible()
    }

    pub(crate) fn gyro_is_plausible(&self) -> bool {
        self.gyro_rad_s.iter().all(|rate| rate.abs() <= LARGEST_RATE_RAD_S)
    }

    pub(crate) fn accelerometer_is_plausible(&self) -> bool {
        self.specific_force_m_s2.iter().all(|force| force.abs() <= LARGEST_SPECIFIC_FORCE_M_S2)
    }
}

/// One fix of the satellite receiver, for the antenna. It arrives late and is valid at
/// `valid_at_s`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GnssFix {
    /// Position of the antenna in the world, relative to the pad, m.
    pub position_m: Vector3<f64>,
    pub velocity_m_s: Vector3<f64>,
    /// Time of validity on the flight computer's clock, s: from power-up on the pad, and T+ (from
    /// the release) in flight. A fix older than the estimator's history is rejected.
    pub valid_at_s: f64,
    /// The receiver's accuracy report for the fix.
    pub quality: FixQuality,
}

/// Quality reported by a satellite receiver; zero where it reports none.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FixQuality {
    /// Number of satellites used.
    pub satellites: u32,
    /// Standard deviation of the horizontal position, m.
    pub horizontal_m: f64,
    /// Standard deviation of the height, m.
    pub vertical_m: f64,
    /// Standard deviation of the velocity, m/s.
    pub speed_m_s: f64,
}

/// All measurements of one frame; a sensor that did not report is `None`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Measurements {
    /// The inertial sample; every frame has one.
    pub imu: ImuSample,
    /// Height of the centre of gravity above the pad from the static pressure, m.
    pub pressure_altitude_m: Option<f64>,
    pub gnss: Option<GnssFix>,
    /// Distance to the ground along body `-x` from the lidar, m.
    pub lidar_range_m: Option<f64>,
}

impl Measurements {
    /// Measurements of a frame in which no other sensor reported.
    pub const fn of_imu(imu: ImuSample) -> Self {
        Self { imu, pressure_altitude_m: None, gnss: None, lidar_range_m: None }
    }
}
