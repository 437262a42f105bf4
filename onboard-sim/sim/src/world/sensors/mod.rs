//! The flight computer's sensors: an inertial unit, a barometer, a satellite receiver with late fixes, and a lidar.
//!
//! [`Sensors::observe`] is called after every millisecond of truth. After every fifth it returns the measurements of
//! one frame of the flight computer. Each sensor has its own stream of random numbers and keeps drawing while it is
//! out, so a fault in one sensor does not change the noise of another.

mod noise;
mod params;

use flight::computer::{FRAME_MS, FRAME_S};
use flight::estimation::estimator::{GRAVITY_M_S2, GnssFix, ImuSample, Measurements};
use flight::vehicle::rigid::RigidState;
use nalgebra::Vector3;

pub use self::noise::believed_start;
use self::noise::{EJECTION_LASTS_S, Fate, Flaws, Normal, Wander};
pub use self::params::{
    BarometerParams, GnssParams, ImuParams, LidarParams, SensorParamError, SensorParams, SwitchParams,
};
use crate::world::whole::World;

const MS_S: f64 = 1e-3;
/// A hobby receiver loses its satellites under the acceleration of the ascent motor (its tracking loops follow 4 g) and
/// finds them again this long after it, ms: a hot start takes 1 to 2 s.
const REACQUIRED_MS: u32 = 1500;

/// The truth that the sensors measure, after a millisecond.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensorTruth {
    /// Position, velocity, attitude and rotation; the position is the centre of gravity's.
    pub state: RigidState,
    /// Acceleration less gravity at the centre of gravity, body axes, m/s^2.
    pub specific_force_m_s2: Vector3<f64>,
    /// Speed through the air, m/s.
    pub airspeed_m_s: f64,
    /// The part of it across the axis, m/s.
    pub airspeed_across_m_s: f64,
    /// Height of the centre of gravity over the feet when upright, m.
    pub cg_over_feet_m: f64,
    /// Angular acceleration, body axes, rad/s^2.
    pub angular_acceleration_rad_s2: Vector3<f64>,
    /// Height of the ground where the lidar's beam meets it, m.
    pub ground_m: f64,
    /// The motor burns.
    pub burning: bool,
    /// Time since the last charge was fired inside the vehicle, s: that of the parachute, or that of the booster.
    pub ejected_for_s: Option<f64>,
    /// The ascent motor burns.
    pub boosted: bool,
}

impl SensorTruth {
    /// The truth over level ground, without rotation's acceleration, flow across the axis, exhaust or parachute: state, specific force, m/s^2,
    /// airspeed, m/s, and the centre of gravity's height over the feet, m.
    pub fn of_motion(
        state: &RigidState,
        specific_force_m_s2: &Vector3<f64>,
        airspeed_m_s: f64,
        cg_over_feet_m: f64,
    ) -> Self {
        Self {
            state: *state,
            specific_force_m_s2: *specific_force_m_s2,
            airspeed_m_s,
            airspeed_across_m_s: 0.0,
            cg_over_feet_m,
            angular_acceleration_rad_s2: Vector3::zeros(),
            ground_m: 0.0,
            burning: false,
            ejected_for_s: None,
            boosted: false,
        }
    }

    /// The truth of a world.
    pub fn of(world: &World) -> Self {
        let in_body = world.state().world_from_body.inverse_transform_vector(&world.air_velocity_m_s());
        Self {
            state: *world.state(),
            airspeed_across_m_s: libm::hypot(in_body.y, in_body.z),
            specific_force_m_s2: *world.specific_force_m_s2(),
            airspeed_m_s: world.air_velocity_m_s().norm(),
            cg_over_feet_m: world.cg_above_feet_m(),
            angular_acceleration_rad_s2: *world.angular_acceleration_rad_s2(),
            ground_m: world.ground_under_beam_m(),
            burning: world.thrust_n() > 0.0 || world.booster_thrust_n() > 0.0,
            ejected_for_s: world
                .parachute_ejected_s()
                .or(world.charge_fired_s())
                .map(|at_s| world.time_s() - at_s),
            boosted: world.booster_thrust_n() > 0.0,
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
    /// Every axis of the accelerometer reads nothing.
    pub accelerometer_dead: bool,
    /// Added to the barometer's height, m.
    pub barometer_step_m: f64,
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
    flaws: Flaws,
    /// Elapsed time at the first contact, ms.
    contact_ms: Option<u32>,
    /// The last millisecond under the ascent motor.
    boosted_ms: Option<u32>,
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
            flaws: Flaws::draw(params, seed),
            contact_ms: None,
            boosted_ms: None,
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
        self.force_sum_m_s2 += self.force_at_unit_m_s2(truth);
        if truth.boosted {
            self.boosted_ms = Some(self.elapsed_ms);
        }
        let unlocked = self.boosted_ms.is_some_and(|at_ms| self.elapsed_ms - at_ms < REACQUIRED_MS);
        self.watch_satellites(truth, faults.gnss_out || unlocked);
        if !self.elapsed_ms.is_multiple_of(FRAME_MS) {
            return None;
        }
        Some(Measurements {
            imu: self.imu(truth.burning, faults),
            pressure_altitude_m: self
                .barometer(truth)
                .filter(|_| !faults.barometer_out)
                .map(|height_m| height_m + faults.barometer_step_m),
            gnss: self.arrived(),
            lidar_range_m: self.lidar(truth).filter(|_| !faults.lidar_out),
        })
    }

    /// Fin openings as the feedback tells them, rad.
    pub fn fins_rad(&self, fins_rad: &[f64; 4]) -> [f64; 4] {
        core::array::from_fn(|fin| fins_rad[fin] + self.flaws.fin_feedback_rad[fin])
    }

    /// Whether the igniter's continuity is reported.
    pub fn igniter_continuity(&self) -> bool {
        !self.flaws.continuity_lost
    }

    /// Whether contact is reported, from whether there has been one.
    pub fn contact(&mut self, touched: bool) -> bool {
        if !touched {
            return false;
        }
        let since_ms = *self.contact_ms.get_or_insert(self.elapsed_ms);
        self.elapsed_ms - since_ms >= self.params.switches.contact_late_ms
    }

    /// Specific force where the inertial unit sits: that of the centre of gravity, and what turning adds.
    fn force_at_unit_m_s2(&self, truth: &SensorTruth) -> Vector3<f64> {
        let (place, rate) = (&self.flaws.unit_m, &truth.state.rate_rad_s);
        truth.specific_force_m_s2
            + truth.angular_acceleration_rad_s2.cross(place)
            + rate.cross(&rate.cross(place))
    }

    fn imu(&mut self, burning: bool, faults: &SensorFaults) -> ImuSample {
        let imu = &self.params.imu;
        let mean = |sum: &mut Vector3<f64>| core::mem::take(sum) / f64::from(FRAME_MS);
        // White noise of this density, averaged over a frame.
        let spread = 1.0 / libm::sqrt(FRAME_S);
        let milli_g = 1e-3 * GRAVITY_M_S2;

        let walk = imu.gyro_bias_walk_deg_s_sqrt_s.to_radians() * libm::sqrt(FRAME_S);
        self.errors.gyro_bias_rad_s += self.imu_noise.next3() * walk;
        let gyro_white = self.imu_noise.next3() * (imu.gyro_noise_deg_s_sqrt_hz.to_radians() * spread);
        let (shaken_rad_s, shaken_m_s2) =
            if burning { self.flaws.vibration(&self.params) } else { (Vector3::zeros(), Vector3::zeros()) };
        let gyro = self.flaws.unit_from_body * mean(&mut self.rate_sum_rad_s)
            + shaken_rad_s
            + self.errors.gyro_bias_rad_s
            + faults.gyro_bias_step_rad_s
            + gyro_white;

        let force_white = self.imu_noise.next3() * (imu.accelerometer_noise_mg_sqrt_hz * milli_g * spread);
        let rectified_m_s2 = if burning { self.flaws.burning_bias_m_s2 } else { Vector3::zeros() };
        let felt_m_s2 = self.flaws.unit_from_body * mean(&mut self.force_sum_m_s2);
        let force = felt_m_s2.component_mul(&self.accelerometer_scale)
            + self.flaws.cross_axis * felt_m_s2
            + rectified_m_s2
            + shaken_m_s2
            + self.errors.accelerometer_bias_m_s2
            + faults.accelerometer_bias_step_m_s2
            + force_white;

        let force = if faults.accelerometer_dead { Vector3::zeros() } else { force };

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
        let then_m = truth.state.position_m.z - truth.state.velocity_m_s.z * self.flaws.barometer_late_s;
        let plume_m = if truth.burning { self.flaws.barometer_plume_m } else { 0.0 };
        let ejection_m = truth
            .ejected_for_s
            .map_or(0.0, |for_s| self.flaws.barometer_ejection_m * libm::exp(-for_s / EJECTION_LASTS_S));
        let across_m_s = truth.airspeed_across_m_s;
        let suction_m = self.flaws.barometer_crossflow * across_m_s * across_m_s / (2.0 * GRAVITY_M_S2);
        Some(
            then_m + self.errors.barometer_offset_m + plume_m + ejection_m + suction_m
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
        let (older_s, slow_m_s) = self.flaws.of_satellites(&self.params);
        let then = moved_back(truth, older_s);
        let mut fix = GnssFix {
            position_m: then.position_m + wandered_m + self.gnss_noise.next3().component_mul(&white_m),
            velocity_m_s: then.velocity_m_s + slow_m_s + self.gnss_noise.next3() * gnss.velocity_m_s,
            valid_at_s: self.start_s + f64::from(self.elapsed_ms) * MS_S + self.flaws.gnss_tag_s,
        };
        let (fate, off_m) = self.flaws.of_fix(&self.params);
        if fate == Fate::Outlier {
            fix.position_m += off_m;
        }
        if !out && fate != Fate::Lost {
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
        let (fate, anywhere) = self.flaws.of_range(&self.params);
        let along_beam = truth.state.world_from_body * self.flaws.beam;
        let tilt_rad = RigidState { world_from_body: along_beam, ..truth.state }.tilt_rad();
        if tilt_rad > lidar.tilt_max_deg.to_radians() {
            return None;
        }
        // From the lidar along the axis to the ground: the slant range from the centre of gravity, less the lidar's
        // distance from it.
        let then_m = truth.state.position_m.z
            - truth.ground_m
            - self.flaws.grass_m
            - truth.state.velocity_m_s.z * self.flaws.lidar_late_s;
        let slant_m = then_m / libm::cos(tilt_rad);
        let range_m = slant_m - lidar.behind_cg_m(truth.cg_over_feet_m) + noise_m;
        // Rough ground reflects light in all directions, and less at an angle (Lambert's cosine law). The echo weakens
        // with the square of the range.
        let farthest_m = lidar.range_max_m * libm::cos(tilt_rad).sqrt();
        let blind = truth.burning
            && truth.state.position_m.z - truth.ground_m - truth.cg_over_feet_m < lidar.blind_below_m;
        match fate {
            Fate::Lost => None,
            _ if blind => None,
            Fate::Outlier => Some(lidar.range_min_m + anywhere * (lidar.range_max_m - lidar.range_min_m)),
            Fate::Arrives => (lidar.range_min_m..=farthest_m).contains(&range_m).then_some(range_m),
        }
    }
}

/// The motion some time ago, s, under the present acceleration.
fn moved_back(truth: &SensorTruth, older_s: f64) -> RigidState {
    let mut acceleration_m_s2 = truth.state.world_from_body * truth.specific_force_m_s2;
    acceleration_m_s2.z -= GRAVITY_M_S2;
    RigidState {
        position_m: truth.state.position_m - truth.state.velocity_m_s * older_s,
        velocity_m_s: truth.state.velocity_m_s - acceleration_m_s2 * older_s,
        ..truth.state
    }
}

#[cfg(test)]
mod tests;
