//! Moves one surface after another to both ends of its range and observes its feedback. Then reads
//! the sensors with the vehicle at rest.

use arrayvec::ArrayVec;
use nalgebra::Vector3;
use serde::Serialize;

use super::{CheckedValue, Item, SURFACES, SurfaceCommand, at_least, at_most, between, larger, only_shown};
use crate::computer::pad::ANSWERING_RAD;
use crate::computer::{FRAME_MS, FRAME_S};
use crate::estimation::estimator::Measurements;
use crate::estimation::estimator::alignment::{AT_REST_M_S2, BIAS_MAX_RAD_S};
use crate::vehicle::airframe::{Airframe, Servo};
use crate::vehicle::mission::{ArmingLimits, Mission};

/// Dwell time at an end after the expected arrival, s. A servo at half its rate arrives late and is
/// still observed to arrive. mk2's longest travel takes 0.3 s.
const STAYS_S: f64 = 0.4;
/// Last part of the dwell in which the feedback counts as settled, s.
const SETTLED_S: f64 = 0.1;
/// Dwell time of a surface without feedback, so that people can see it, s.
const SEEN_S: f64 = 2.0;
/// Permitted extra delay of a surface beyond its airframe's data, s: one more of the 20 ms delays
/// that the missions were simulated with.
const LATER_S: f64 = 0.020;
/// A command takes effect at the end of its frame, and the feedback is from the end of another one.
const FRAMES_LATER: f64 = 2.0;

/// Range of one surface, and its motion.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Reach {
    low_rad: f64,
    high_rad: f64,
    rest_rad: f64,
    servo: Servo,
}

impl Reach {
    /// Of gimbal pitch and yaw, and of fins 1 to 4.
    fn of_each(airframe: &Airframe) -> [Self; SURFACES] {
        let (gimbal, fins) = (&airframe.gimbal, &airframe.fins);
        let limit_rad = gimbal.limit_rad();
        let of_gimbal = Self { low_rad: -limit_rad, high_rad: limit_rad, rest_rad: 0.0, servo: gimbal.servo };
        let of_fin = Self {
            low_rad: fins.closed_rad(),
            high_rad: fins.open_rad(),
            rest_rad: fins.closed_rad(),
            servo: fins.servo,
        };
        [of_gimbal, of_gimbal, of_fin, of_fin, of_fin, of_fin]
    }

    /// Target angles, in order; the last is its rest.
    fn targets_rad(&self) -> ArrayVec<f64, 3> {
        let low_rad = (self.low_rad < self.rest_rad).then_some(self.low_rad);
        [Some(self.high_rad), low_rad, Some(self.rest_rad)].into_iter().flatten().collect()
    }

    /// Time until a servo without delay, at its rate, counts as arrived, s.
    fn ideal_s(&self, way_rad: f64) -> f64 {
        (way_rad - ANSWERING_RAD).max(0.0) / self.servo.rate_rad_s()
    }

    fn stay_frames(&self, way_rad: f64, tells: bool) -> u32 {
        let stays_s = if tells { STAYS_S } else { SEEN_S };
        libm::ceil((self.servo.delay_s + way_rad / self.servo.rate_rad_s() + stays_s) / FRAME_S) as u32
    }

    /// Largest permitted delay after the ideal arrival, s: servo delay, play, frames, and a margin.
    fn lag_most_s(&self) -> f64 {
        self.servo.delay_s
            + self.servo.slop_rad() / self.servo.rate_rad_s()
            + FRAMES_LATER * FRAME_S
            + LATER_S
    }
}

/// Results of one surface so far.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
struct SurfaceShown {
    least_rad: f64,
    most_rad: f64,
    error_rad: f64,
    /// NaN if it has missed an arrival.
    lag_s: f64,
}

const NOTHING_SHOWN: SurfaceShown =
    SurfaceShown { least_rad: f64::INFINITY, most_rad: f64::NEG_INFINITY, error_rad: 0.0, lag_s: 0.0 };

/// The sweep of all surfaces.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Sweep {
    // Skipped fields are constants of the mission.
    #[serde(skip)]
    reaches: [Reach; SURFACES],
    /// The servos report their positions.
    #[serde(skip)]
    feedback: bool,
    surface: usize,
    /// Index of the present target of the surface.
    target: usize,
    /// Frames since the surface was commanded there.
    frames: u32,
    frames_before: u64,
    arrived_s: Option<f64>,
    shown: SurfaceShown,
}

impl Sweep {
    pub(super) fn new(airframe: &Airframe) -> Self {
        Self {
            reaches: Reach::of_each(airframe),
            feedback: airframe.servos_report,
            surface: 0,
            target: 0,
            frames: 0,
            frames_before: 0,
            arrived_s: None,
            shown: NOTHING_SHOWN,
        }
    }

    /// Completed frames, and all frames.
    pub(super) fn frames(&self) -> (u64, u64) {
        let all = self.reaches.iter().map(|reach| {
            let targets = reach.targets_rad();
            let ways = (0..targets.len()).map(|place| way_rad(reach, &targets, place));
            ways.map(|way_rad| u64::from(reach.stay_frames(way_rad, self.feedback))).sum::<u64>()
        });
        (self.frames_before + u64::from(self.frames), all.sum())
    }

    /// Executes one frame; returns the command, `None` at the end, and the findings of a completed
    /// surface.
    pub(super) fn step(
        &mut self,
        surfaces_rad: &[f64; SURFACES],
    ) -> (Option<SurfaceCommand>, Option<[CheckedValue; 3]>) {
        let Some(reach) = self.reaches.get(self.surface).copied() else { return (None, None) };
        let targets = reach.targets_rad();
        let (target_rad, way_rad) = (targets[self.target], way_rad(&reach, &targets, self.target));
        let stay_frames = reach.stay_frames(way_rad, self.feedback);
        if self.frames > 0 {
            self.watch(surfaces_rad[self.surface], target_rad, reach.ideal_s(way_rad), stay_frames);
        }
        if self.frames < stay_frames {
            self.frames += 1;
            return (Some((self.surface, target_rad)), None);
        }
        self.shown.lag_s = larger(self.shown.lag_s, self.arrived_s.take().unwrap_or(f64::NAN));
        self.frames_before += u64::from(self.frames);
        (self.frames, self.target) = (0, self.target + 1);
        let mut found = None;
        if self.target == targets.len() {
            found = Some(self.findings(&reach));
            (self.surface, self.target, self.shown) = (self.surface + 1, 0, NOTHING_SHOWN);
        }
        let (command, _) = self.step(surfaces_rad);
        (command, found)
    }

    /// Takes one feedback of the moving surface.
    fn watch(&mut self, found_rad: f64, target_rad: f64, ideal_s: f64, stay_frames: u32) {
        let off_rad = (found_rad - target_rad).abs();
        let since_s = f64::from(self.frames) * FRAME_S;
        if self.arrived_s.is_none() && off_rad <= ANSWERING_RAD {
            self.arrived_s = Some((since_s - ideal_s).max(0.0));
        }
        let settled_frames = libm::round(SETTLED_S * 1e3) as u32 / FRAME_MS;
        if self.frames + settled_frames >= stay_frames {
            let shown = &mut self.shown;
            shown.least_rad = shown.least_rad.min(found_rad);
            shown.most_rad = shown.most_rad.max(found_rad);
            shown.error_rad = larger(shown.error_rad, off_rad);
        }
    }

    fn findings(&self, reach: &Reach) -> [CheckedValue; 3] {
        if !self.feedback {
            return [Item::Range, Item::Error, Item::Lag]
                .map(|item| only_shown(item(self.surface), f64::NAN));
        }
        let SurfaceShown { least_rad, most_rad, error_rad, lag_s } = self.shown;
        let whole_rad = reach.high_rad - reach.low_rad;
        [
            // The same tolerance as at power-up and before arming, at both ends.
            at_least(Item::Range(self.surface), most_rad - least_rad, whole_rad - 2.0 * ANSWERING_RAD),
            at_most(Item::Error(self.surface), error_rad, ANSWERING_RAD),
            at_most(Item::Lag(self.surface), lag_s, reach.lag_most_s()),
        ]
    }
}

fn way_rad(reach: &Reach, targets_rad: &[f64], place: usize) -> f64 {
    let from_rad = place.checked_sub(1).map_or(reach.rest_rad, |before| targets_rad[before]);
    (targets_rad[place] - from_rad).abs()
}

// Sensors of a vehicle at rest: means and spreads over some seconds.

/// Observed frames: 5 s, which determines a spread to 2 % (1 / sqrt(2 * 1000)).
pub(super) const STILL_FRAMES: u32 = 1000;
/// The surfaces have come to rest after this many frames.
const SKIPPED: u32 = 100;
/// Permitted spread as a multiple of the filter's assumption. At twice the spread the filter
/// weights a sample four times too high.
const SPREAD_MOST: f64 = 2.0;
/// One fix a second: without a fix in its second the pad monitor has no velocity, and arming is
/// refused.
const FIXES_LEAST: f64 = STILL_FRAMES as f64 * FRAME_S;

/// Levelling error of a rail with a spirit level, degrees, about each axis.
const RAIL_LEVEL_DEG: f64 = 1.0;
/// A correct rail and mount pass 99 of 100 checks (Rayleigh: 1 - exp(-3^2 / 2)).
const LEAN_SIGMAS: f64 = 3.0;

/// Mean and sum of squared differences from it (Welford 1962), of one number.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
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

#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub(super) struct Still {
    frames: u32,
    gyro_rad_s: [Spread; 3],
    force_m_s2: [Spread; 3],
    pressure_altitude_m: Spread,
    fixes: u32,
    velocity_sum_m_s: Vector3<f64>,
    lidar_m: Option<f64>,
}

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
        self.frames >= SKIPPED + STILL_FRAMES
    }

    pub(super) fn frames(&self) -> u64 {
        u64::from(self.frames.saturating_sub(SKIPPED))
    }

    /// Below a drone the vehicle swings and climbs: then only the fixes are judged.
    pub(super) fn findings(
        &self,
        mission: &Mission,
        arming: &ArmingLimits,
        hangs: bool,
    ) -> [CheckedValue; 8] {
        let config = &mission.estimator;
        // White noise of this density, seen up to half the sampling rate.
        let band_sqrt_hz = libm::sqrt(0.5 / FRAME_S);
        let gyro_rad_s = config.gyro_noise_deg_s_sqrt_hz.to_radians() * band_sqrt_hz;
        let accelerometer_m_s2 =
            1e-3 * config.accelerometer_noise_mg_sqrt_hz * config.gravity_m_s2 * band_sqrt_hz;
        // The offset's random walk spreads about its own mean by sqrt(t / 6).
        let walked_m =
            config.barometer_offset_walk_m_sqrt_s * libm::sqrt(f64::from(STILL_FRAMES) * FRAME_S / 6.0);
        let barometer_m = libm::hypot(config.barometer_m, walked_m);
        let mean = |spreads: &[Spread; 3]| Vector3::from(spreads.map(|spread| spread.mean)).norm();
        let largest = |spreads: &[Spread; 3]| spreads.iter().map(Spread::sigma).fold(0.0, larger);
        let speed_m_s = (self.velocity_sum_m_s / f64::from(self.fixes)).norm();
        let found = [
            at_most(Item::GyroBias, mean(&self.gyro_rad_s), BIAS_MAX_RAD_S),
            at_most(Item::GyroNoise, largest(&self.gyro_rad_s), SPREAD_MOST * gyro_rad_s),
            between(Item::Gravity, mean(&self.force_m_s2), *AT_REST_M_S2.start(), *AT_REST_M_S2.end()),
            at_most(Item::AccelerometerNoise, largest(&self.force_m_s2), SPREAD_MOST * accelerometer_m_s2),
            at_most(Item::BarometerNoise, self.pressure_altitude_m.sigma(), SPREAD_MOST * barometer_m),
            at_least(Item::GnssFixes, f64::from(self.fixes), FIXES_LEAST),
            at_most(Item::GnssSpeed, speed_m_s, arming.speed_max_m_s),
            only_shown(Item::LidarRange, self.lidar_m.unwrap_or(f64::NAN)),
        ];
        if !hangs {
            return found;
        }
        found.map(|found| match found.item {
            Item::GnssFixes => found,
            item => only_shown(item, found.value),
        })
    }

    /// On a rail: the combined lean of rail level and inertial-unit mount. The filter's initial
    /// attitude uncertainty includes the stated misalignment of the mount, which no sensor shows in
    /// flight.
    pub(super) fn lean_from_the_rail(&self, mission: &Mission) -> Option<CheckedValue> {
        let launch = mission.launched()?;
        let rail = launch.standing(mission.airframe.mass.loaded_cg_station_m).world_from_body;
        let up = rail.inverse_transform_vector(&Vector3::z());
        let sensed = Vector3::from(self.force_m_s2.map(|spread| spread.mean));
        let lean_rad = libm::atan2(sensed.cross(&up).norm(), sensed.dot(&up));
        let stated_rad = libm::hypot(RAIL_LEVEL_DEG, mission.estimator.mounting_deg).to_radians();
        Some(at_most(Item::RailLean, lean_rad, LEAN_SIGMAS * stated_rad))
    }
}
