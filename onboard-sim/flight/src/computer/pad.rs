//! Finds from the sensors on the pad whether the vehicle stands still, and in which attitude.

use nalgebra::{UnitQuaternion, Vector3};

use crate::computer::memory::remembers;
use crate::computer::pilot::Sensed;
use crate::estimation::estimator::alignment::PadAlignment;
use crate::estimation::estimator::{Estimate, GnssFix, ImuSample, Measurements};
use crate::vehicle::rigid::{RigidState, upright};

/// The stance is evaluated every so many frames: once a second.
const WINDOW_FRAMES: u32 = 200;

/// Attitude and motion on the pad, as last measured. An unknown value is NaN and passes no check.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stance {
    /// Tilt of the nose from the vertical, rad.
    pub tilt_rad: f64,
    pub rotation_rad_s: f64,
    pub speed_m_s: f64,
    /// The attitude is known.
    pub settled: bool,
}

impl Stance {
    pub(super) const UNKNOWN: Self =
        Self { tilt_rad: f64::NAN, rotation_rad_s: f64::NAN, speed_m_s: f64::NAN, settled: false };
}

/// Result of one second on the pad.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Found {
    /// Attitude with the heading of the pad; `None` if the vehicle was not at rest.
    world_from_body: Option<UnitQuaternion<f64>>,
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
    found: Option<Found>,
}

remembers!(Found { world_from_body, rotation_rad_s, velocity_m_s });
remembers!(PadWatch { alignment, frames, gyro_sum_rad_s, fixes, velocity_sum_m_s, found });

impl PadWatch {
    /// Adds a frame.
    pub(super) fn feel(&mut self, sensed: &Sensed) {
        let measurements = match sensed {
            Sensed::Measured(measurements) => *measurements,
            Sensed::Known(estimate) => as_measured(estimate),
        };
        self.alignment.take(&measurements.imu);
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
        self.found = Some(Found {
            world_from_body: over.alignment.finish(0.0).ok().map(|start| start.world_from_body),
            rotation_rad_s: (over.gyro_sum_rad_s / f64::from(over.frames)).norm(),
            // Without a fix this is zero by zero: NaN, which passes no check.
            velocity_m_s: over.velocity_sum_m_s / f64::from(over.fixes),
        });
    }

    /// Whether a whole second has been evaluated.
    pub(super) fn has_felt(&self) -> bool {
        self.found.is_some()
    }

    /// Attitude and motion on the pad.
    pub(super) fn stance(&self) -> Stance {
        let Some(found) = &self.found else { return Stance::UNKNOWN };
        Stance {
            tilt_rad: found.world_from_body.map_or(f64::NAN, |_| self.believed().tilt_rad()),
            rotation_rad_s: found.rotation_rad_s,
            speed_m_s: found.velocity_m_s.norm(),
            settled: found.world_from_body.is_some(),
        }
    }

    /// The last measured attitude, at rest at the origin.
    pub(super) fn believed(&self) -> RigidState {
        let found = self.found.as_ref();
        RigidState {
            world_from_body: found.and_then(|found| found.world_from_body).unwrap_or_else(upright),
            velocity_m_s: found.map_or_else(Vector3::zeros, |found| found.velocity_m_s),
            ..RigidState::upright(0.0)
        }
    }
}

/// The measurements of perfect sensors in a known state.
fn as_measured(estimate: &Estimate) -> Measurements {
    let state = &estimate.state;
    Measurements {
        imu: ImuSample { gyro_rad_s: state.rate_rad_s, specific_force_m_s2: estimate.specific_force_m_s2 },
        pressure_altitude_m: None,
        gnss: Some(GnssFix {
            position_m: state.position_m,
            velocity_m_s: state.velocity_m_s,
            valid_at_s: estimate.time_s,
        }),
        lidar_range_m: None,
    }
}
