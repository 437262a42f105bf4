//! Finds from the sensors whether the vehicle stands still on its pad, or how it hangs below its drone, and in which
//! attitude.

use nalgebra::Vector3;

use crate::computer::memory::remembers;
use crate::computer::pilot::Sensed;
use crate::estimation::estimator::alignment::{PadAlignment, PadStart};
use crate::estimation::estimator::{GnssFix, ImuSample, Measurements};
use crate::vehicle::rigid::{RigidState, upright};

/// The stance is evaluated every so many frames: once a second.
const WINDOW_FRAMES: u32 = 200;

/// A hanging vehicle that feels less than this, m/s^2, for [`FALLING_FRAMES`] has been let go. A swing of 30 degrees takes
/// at most a quarter of its weight away.
const FALLING_M_S2: f64 = 3.0;
/// 0.1 s, in which it falls by 5 cm.
const FALLING_FRAMES: u32 = 20;

/// Attitude and motion on the pad, as last measured. An unknown value is NaN and passes no check.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stance {
    /// Tilt of the nose from the vertical, rad.
    pub tilt_rad: f64,
    pub rotation_rad_s: f64,
    pub speed_m_s: f64,
    /// The attitude is known.
    pub settled: bool,
    /// Height of a hanging vehicle, m; NaN if it is not known. `None` on a pad.
    pub hanging_m: Option<f64>,
}

impl Stance {
    pub(super) const UNKNOWN: Self = Self {
        tilt_rad: f64::NAN,
        rotation_rad_s: f64::NAN,
        speed_m_s: f64::NAN,
        settled: false,
        hanging_m: None,
    };
}

/// Result of one second on the pad.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Found {
    /// Attitude with the heading of the pad, and the gyro's bias, rad/s; `None` if the vehicle was not at rest.
    at_rest: Option<PadStart>,
    /// Mean angle between the axis and what is felt, rad: the tilt of a vehicle that hangs still in the mean.
    lean_rad: f64,
    /// Mean pressure altitude, m; NaN without a sample.
    pressure_altitude_m: f64,
    /// Mean rotation rate, rad/s.
    rotation_rad_s: f64,
    /// Mean GNSS velocity, world, m/s; NaN without a fix.
    velocity_m_s: Vector3<f64>,
}

/// The sums of the current second, and the result of the last one.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct PadWatch {
    alignment: PadAlignment,
    frames: u32,
    gyro_sum_rad_s: Vector3<f64>,
    fixes: u32,
    velocity_sum_m_s: Vector3<f64>,
    force_sum_m_s2: Vector3<f64>,
    pressures: u32,
    altitude_sum_m: f64,
    falling_frames: u32,
    found: Option<Found>,
}

remembers!(Found { at_rest, lean_rad, pressure_altitude_m, rotation_rad_s, velocity_m_s });
remembers!(PadStart { world_from_body, gyro_bias_rad_s });
remembers!(PadWatch {
    alignment,
    frames,
    gyro_sum_rad_s,
    fixes,
    velocity_sum_m_s,
    force_sum_m_s2,
    pressures,
    altitude_sum_m,
    falling_frames,
    found
});

impl PadWatch {
    /// Adds a frame.
    pub(super) fn feel(&mut self, sensed: &Sensed) {
        let measurements = as_measured(sensed);
        self.alignment.take(&measurements.imu);
        let felt_m_s2 = measurements.imu.specific_force_m_s2;
        self.force_sum_m_s2 += felt_m_s2;
        self.falling_frames = if felt_m_s2.norm() < FALLING_M_S2 { self.falling_frames + 1 } else { 0 };
        if let Some(altitude_m) = measurements.pressure_altitude_m {
            self.pressures += 1;
            self.altitude_sum_m += altitude_m;
        }
        self.gyro_sum_rad_s += measurements.imu.gyro_rad_s;
        if let Some(fix) = &measurements.gnss {
            self.fixes += 1;
            self.velocity_sum_m_s += fix.velocity_m_s;
        }
        self.frames += 1;
        if self.frames < WINDOW_FRAMES {
            return;
        }
        let over = core::mem::take(self);
        self.falling_frames = over.falling_frames;
        let across_m_s2 = over.force_sum_m_s2.yz().norm();
        self.found = Some(Found {
            at_rest: over.alignment.finish(0.0).ok(),
            lean_rad: libm::atan2(across_m_s2, over.force_sum_m_s2.x),
            pressure_altitude_m: over.altitude_sum_m / f64::from(over.pressures),
            rotation_rad_s: (over.gyro_sum_rad_s / f64::from(over.frames)).norm(),
            // Without a fix this is zero by zero: NaN, which passes no check.
            velocity_m_s: over.velocity_sum_m_s / f64::from(over.fixes),
        });
    }

    /// Whether a whole second has been evaluated.
    pub(super) fn has_felt(&self) -> bool {
        self.found.is_some()
    }

    /// Attitude and motion on the pad, or below a drone.
    pub(super) fn stance(&self, hangs: bool) -> Stance {
        let Some(found) = &self.found else { return Stance::UNKNOWN };
        if hangs {
            return Stance {
                tilt_rad: found.lean_rad,
                rotation_rad_s: found.rotation_rad_s,
                speed_m_s: found.velocity_m_s.norm(),
                settled: true,
                hanging_m: Some(found.pressure_altitude_m),
            };
        }
        Stance {
            tilt_rad: found.at_rest.map_or(f64::NAN, |_| self.believed().tilt_rad()),
            rotation_rad_s: found.rotation_rad_s,
            speed_m_s: found.velocity_m_s.norm(),
            settled: found.at_rest.is_some(),
            hanging_m: None,
        }
    }

    /// A hanging vehicle feels no weight any more.
    pub(super) fn falls(&self) -> bool {
        self.falling_frames >= FALLING_FRAMES
    }

    /// Attitude and gyro bias, from the last second at rest.
    pub(super) fn at_rest(&self) -> Option<&PadStart> {
        self.found.as_ref()?.at_rest.as_ref()
    }

    /// The last measured attitude, at rest at the origin.
    pub(super) fn believed(&self) -> RigidState {
        let found = self.found.as_ref();
        RigidState {
            world_from_body: self.at_rest().map_or_else(upright, |start| start.world_from_body),
            velocity_m_s: found.map_or_else(Vector3::zeros, |found| found.velocity_m_s),
            ..RigidState::upright(0.0)
        }
    }
}

/// The measurements; of perfect sensors if the state is known.
pub(super) fn as_measured(sensed: &Sensed) -> Measurements {
    let estimate = match sensed {
        Sensed::Measured(measurements) => return *measurements,
        Sensed::Known(estimate) => estimate,
    };
    let state = &estimate.state;
    Measurements {
        imu: ImuSample { gyro_rad_s: state.rate_rad_s, specific_force_m_s2: estimate.specific_force_m_s2 },
        pressure_altitude_m: Some(state.position_m.z),
        gnss: Some(GnssFix {
            position_m: state.position_m,
            velocity_m_s: state.velocity_m_s,
            valid_at_s: estimate.time_s,
        }),
        lidar_range_m: None,
    }
}
