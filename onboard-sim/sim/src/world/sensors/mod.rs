//! The flight computer's sensors: an inertial unit, a barometer, a satellite receiver with late
//! fixes, and a lidar.
//!
//! [`Sensors::observe`] is called after every millisecond of truth. After every fifth it returns
//! the measurements of one frame of the flight computer. Each sensor has a separate stream of
//! random numbers and continues to draw while it is out, so a fault in one sensor does not change
//! the noise of another.

mod barometer;
mod faults;
mod gnss;
mod imu;
mod lidar;
mod noise;
mod params;
mod switches;

use flight::computer::FRAME_MS;
use flight::estimation::estimator::{GRAVITY_M_S2, GnssFix, Measurements};
use flight::vehicle::mission::SensorPlaces;
use flight::vehicle::rigid::RigidState;
use nalgebra::Vector3;

pub use self::barometer::BarometerParams;
pub use self::faults::{Defect, Sensor, SensorFaults};
pub use self::gnss::GnssParams;
pub use self::imu::ImuParams;
pub use self::lidar::LidarParams;
pub use self::noise::start_with_errors;
use self::noise::{Flaws, Wander};
pub use self::params::{SensorParamError, SensorParams};
pub use self::switches::SwitchParams;
use crate::world::normal::Normal;
use crate::world::plant::{Inertial, World};

const MS_S: f64 = 1e-3;
/// Factor on the sensor errors for a flight with nearly exact sensors. It is not zero, because a
/// sensor that repeats one value counts as broken.
pub const NEARLY_EXACT: f64 = 1e-3;
/// A hobby receiver loses its satellites under the acceleration of the ascent motor (its tracking
/// loops follow 4 g) and finds them again this long after it, ms: a hot start takes 1 to 2 s.
const REACQUIRED_MS: u32 = 1500;

/// The truth that the sensors measure, after a millisecond or several.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensorTruth {
    /// Position, velocity, attitude and rotation; the position is the centre of gravity's.
    pub state: RigidState,
    /// Means since the truth before; a step takes a millisecond.
    pub inertial: Inertial,
    /// Speed through the air, m/s.
    pub airspeed_m_s: f64,
    /// The part of it across the axis, m/s.
    pub airspeed_across_m_s: f64,
    /// Height of the centre of gravity over the feet when upright, m.
    pub cg_over_feet_m: f64,
    /// Centre of gravity: its station, and its distance from the axis, m.
    pub cg_m: Vector3<f64>,
    /// Height of the ground where the lidar's beam meets it, m.
    pub ground_m: f64,
    /// The motor burns.
    pub burning: bool,
    /// Time since the last charge was fired inside the vehicle, s: that of the parachute, or that
    /// of the booster.
    pub ejected_for_s: Option<f64>,
    /// The ascent motor burns.
    pub boosted: bool,
}

impl SensorTruth {
    /// The truth over level ground, without rotation's acceleration, flow across the axis, exhaust
    /// or parachute: state, specific force, m/s^2, airspeed, m/s, and the centre of gravity's
    /// height over the feet, m.
    pub fn of_motion(
        state: &RigidState,
        specific_force_m_s2: &Vector3<f64>,
        airspeed_m_s: f64,
        cg_over_feet_m: f64,
    ) -> Self {
        Self {
            state: *state,
            inertial: Inertial {
                steps: 1,
                rate_rad_s: state.rate_rad_s,
                specific_force_m_s2: *specific_force_m_s2,
                ..Inertial::default()
            },
            airspeed_m_s,
            airspeed_across_m_s: 0.0,
            cg_over_feet_m,
            cg_m: Vector3::zeros(),
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
            inertial: *world.inertial(),
            airspeed_across_m_s: libm::hypot(in_body.y, in_body.z),
            airspeed_m_s: world.air_velocity_m_s().norm(),
            cg_over_feet_m: world.cg_above_feet_m(),
            cg_m: world.cg_m(),
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
    places: SensorPlaces,
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
    /// Time of the first fix after the start, ms: receivers have their own time base.
    gnss_phase_ms: u32,
    on_its_way: Option<(u32, GnssFix)>,
    rate_sum_rad_s: Vector3<f64>,
    force_sum_m_s2: Vector3<f64>,
    flaws: Flaws,
    /// Elapsed time at the first contact, ms.
    contact_ms: Option<u32>,
    /// The last millisecond under the ascent motor.
    boosted_ms: Option<u32>,
    /// The motion repeated by the receiver, and the end of the repetition, ms.
    stale: Option<(RigidState, u32)>,
}

impl Sensors {
    /// From now on times count from this one, s.
    pub fn count_from(&mut self, time_s: f64) {
        self.start_s -= time_s;
    }

    /// Draws one flight's sensors. Their errors are this share of the parameters: 1, or
    /// [`NEARLY_EXACT`].
    ///
    /// # Errors
    /// A parameter is out of range.
    pub fn new(
        params: &SensorParams,
        places: &SensorPlaces,
        seed: u64,
        share: f64,
    ) -> Result<Self, SensorParamError> {
        params.validate()?;
        let (imu, gnss) = (&params.imu, &params.gnss);
        let [mut imu_noise, mut barometer_noise, mut gnss_noise, lidar_noise] =
            [0, 1, 2, 3].map(|stream| Normal::new(seed, stream, share));
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
            places: *places,
            start_s: 0.0,
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
            flaws: Flaws::draw(params, seed, share),
            contact_ms: None,
            boosted_ms: None,
            stale: None,
        })
    }

    /// The true errors of this flight's sensors at this moment, without faults.
    pub fn errors(&self) -> &SensorErrors {
        &self.errors
    }

    /// Measures the truth after some more milliseconds; returns a frame's measurements after every
    /// fifth.
    pub fn observe(&mut self, truth: &SensorTruth) -> Option<Measurements> {
        let milliseconds = truth.inertial.steps as f64;
        self.elapsed_ms += truth.inertial.steps as u32;
        self.rate_sum_rad_s += truth.inertial.rate_rad_s * milliseconds;
        self.force_sum_m_s2 += self.force_at_unit_m_s2(truth) * milliseconds;
        if truth.boosted {
            if self.boosted_ms.is_none() && self.params.gnss.stale_s > 0.0 {
                self.hold_fixes(&truth.state, self.params.gnss.stale_s);
            }
            self.boosted_ms = Some(self.elapsed_ms);
        }
        let unlocked = self.boosted_ms.is_some_and(|at_ms| self.elapsed_ms - at_ms < REACQUIRED_MS);
        self.watch_satellites(truth, unlocked);
        if !self.elapsed_ms.is_multiple_of(FRAME_MS) {
            return None;
        }
        Some(Measurements {
            imu: self.imu(truth.burning),
            pressure_altitude_m: self.barometer(truth),
            gnss: self.arrived(),
            lidar_range_m: self.lidar(truth),
        })
    }
}

#[cfg(test)]
mod tests;
