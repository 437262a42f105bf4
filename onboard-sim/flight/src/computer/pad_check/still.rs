//! The sensors of a vehicle that stands still: means and spreads over some seconds.

use nalgebra::Vector3;

use super::finding::{Finding, Item, larger};
use crate::computer::FRAME_S;
use crate::computer::memory::remembers;
use crate::estimation::estimator::Measurements;
use crate::estimation::estimator::alignment::{FELT_AT_REST_M_S2, STILL_RAD_S};
use crate::vehicle::mission::ArmingLimits;
use crate::vehicle::mission::Mission;

/// Frames watched: 5 s, in which a spread is known to 2 % (1 / sqrt(2 * 1000)).
pub(super) const FRAMES: u32 = 1000;
/// The surfaces have come to rest after this many frames.
const SKIPPED: u32 = 100;
/// A spread may be this many times what the filter assumes of the sensor. At twice the spread the filter trusts a sample
/// four times as much as it should.
const SPREAD_MOST: f64 = 2.0;
/// One fix a second: without one in its second the pad's watch knows no speed, and arming is refused.
const FIXES_LEAST: f64 = FRAMES as f64 * FRAME_S;

/// Mean and sum of squared differences from it (Welford 1962), of one number.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Spread {
    samples: u32,
    mean: f64,
    squares: f64,
}

impl Spread {
    fn take(&mut self, value: f64) {
        self.samples += 1;
        let off = value - self.mean;
        self.mean += off / f64::from(self.samples);
        self.squares += off * (value - self.mean);
    }

    /// Standard deviation; NaN with fewer than two samples.
    fn sigma(&self) -> f64 {
        if self.samples < 2 {
            return f64::NAN;
        }
        libm::sqrt(self.squares / f64::from(self.samples - 1))
    }
}

#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Still {
    frames: u32,
    gyro_rad_s: [Spread; 3],
    force_m_s2: [Spread; 3],
    pressure_altitude_m: Spread,
    fixes: u32,
    velocity_sum_m_s: Vector3<f64>,
    lidar_m: Option<f64>,
}

remembers!(Spread { samples, mean, squares });
remembers!(Still { frames, gyro_rad_s, force_m_s2, pressure_altitude_m, fixes, velocity_sum_m_s, lidar_m });

impl Still {
    pub(super) fn take(&mut self, measured: &Measurements) {
        self.frames += 1;
        if self.frames <= SKIPPED {
            return;
        }
        for axis in 0..3 {
            self.gyro_rad_s[axis].take(measured.imu.gyro_rad_s[axis]);
            self.force_m_s2[axis].take(measured.imu.specific_force_m_s2[axis]);
        }
        if let Some(altitude_m) = measured.pressure_altitude_m {
            self.pressure_altitude_m.take(altitude_m);
        }
        if let Some(fix) = &measured.gnss {
            self.fixes += 1;
            self.velocity_sum_m_s += fix.velocity_m_s;
        }
        self.lidar_m = measured.lidar_range_m.or(self.lidar_m);
    }

    pub(super) fn is_over(&self) -> bool {
        self.frames >= SKIPPED + FRAMES
    }

    pub(super) fn frames(&self) -> u64 {
        u64::from(self.frames.saturating_sub(SKIPPED))
    }

    /// A vehicle that hangs below a drone swings, and climbs: then only the fixes are judged.
    pub(super) fn findings(&self, mission: &Mission, arming: &ArmingLimits, hangs: bool) -> [Finding; 8] {
        let config = &mission.estimator;
        // White noise of this density, seen up to half the sampling rate.
        let band_sqrt_hz = libm::sqrt(0.5 / FRAME_S);
        let gyro_rad_s = config.gyro_noise_deg_s_sqrt_hz.to_radians() * band_sqrt_hz;
        let accelerometer_m_s2 =
            1e-3 * config.accelerometer_noise_mg_sqrt_hz * config.gravity_m_s2 * band_sqrt_hz;
        // The offset's random walk spreads about its own mean by sqrt(t / 6).
        let walked_m = config.barometer_offset_walk_m_sqrt_s * libm::sqrt(f64::from(FRAMES) * FRAME_S / 6.0);
        let barometer_m = libm::hypot(config.barometer_m, walked_m);
        let mean = |spreads: &[Spread; 3]| Vector3::from(spreads.map(|spread| spread.mean)).norm();
        let largest = |spreads: &[Spread; 3]| spreads.iter().map(Spread::sigma).fold(0.0, larger);
        let speed_m_s = (self.velocity_sum_m_s / f64::from(self.fixes)).norm();
        let found = [
            Finding::at_most(Item::GyroBias, mean(&self.gyro_rad_s), STILL_RAD_S),
            Finding::at_most(Item::GyroNoise, largest(&self.gyro_rad_s), SPREAD_MOST * gyro_rad_s),
            Finding::between(
                Item::Gravity,
                mean(&self.force_m_s2),
                *FELT_AT_REST_M_S2.start(),
                *FELT_AT_REST_M_S2.end(),
            ),
            Finding::at_most(
                Item::AccelerometerNoise,
                largest(&self.force_m_s2),
                SPREAD_MOST * accelerometer_m_s2,
            ),
            Finding::at_most(
                Item::BarometerNoise,
                self.pressure_altitude_m.sigma(),
                SPREAD_MOST * barometer_m,
            ),
            Finding::at_least(Item::GnssFixes, f64::from(self.fixes), FIXES_LEAST),
            Finding::at_most(Item::GnssSpeed, speed_m_s, arming.speed_max_m_s),
            Finding::only_shown(Item::LidarRange, self.lidar_m.unwrap_or(f64::NAN)),
        ];
        if !hangs {
            return found;
        }
        found.map(|found| match found.item {
            Item::GnssFixes => found,
            item => Finding::only_shown(item, found.value),
        })
    }
}
