//! One surface after the other is told to go to both ends of its range, and its feedback is
//! watched. Then the sensors are read while the vehicle stands still.

use alloc::vec;
use alloc::vec::Vec;
use nalgebra::Vector3;
use serde::Serialize;

use super::{CheckedValue, Item, SURFACES, SurfaceCommand, larger};
use crate::computer::pad::ANSWERING_RAD;
use crate::computer::{FRAME_MS, FRAME_S};
use crate::estimation::estimator::Measurements;
use crate::estimation::estimator::alignment::{BIAS_MAX_RAD_S, FELT_AT_REST_M_S2};
use crate::vehicle::airframe::{Airframe, Servo};
use crate::vehicle::mission::{ArmingLimits, Mission};

/// A surface stays at an end for this long after it should have arrived, s: a servo at half its
/// rate arrives late, and yet is seen to arrive. mk2's longest way takes 0.3 s.
const STAYS_S: f64 = 0.4;
/// The feedback counts as that of a surface at its end in the last part of the stay, s.
const SETTLED_S: f64 = 0.1;
/// A surface that tells nothing stays at an end for people to see it, s.
const SEEN_S: f64 = 2.0;
/// A surface may arrive this much later than its airframe says, s: one more of the delays of 20 ms
/// that the missions were flown with, in simulation.
const LATER_S: f64 = 0.020;
/// A command leaves at the end of its frame, and the feedback is from the end of another one.
const FRAMES_LATER: f64 = 2.0;

/// How far one surface goes, and how it is moved.
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

    /// Where it is told to go, in order; back to its rest at last.
    fn targets_rad(&self) -> Vec<f64> {
        if self.low_rad < self.rest_rad {
            vec![self.high_rad, self.low_rad, self.rest_rad]
        } else {
            vec![self.high_rad, self.rest_rad]
        }
    }

    /// Time of a servo that turns at once at its rate until the surface counts as arrived, s.
    fn ideal_s(&self, way_rad: f64) -> f64 {
        (way_rad - ANSWERING_RAD).max(0.0) / self.servo.rate_rad_s()
    }

    fn stay_frames(&self, way_rad: f64, tells: bool) -> u32 {
        let stays_s = if tells { STAYS_S } else { SEEN_S };
        libm::ceil((self.servo.delay_s + way_rad / self.servo.rate_rad_s() + stays_s) / FRAME_S) as u32
    }

    /// The latest arrival after the ideal one, s: its delay, its play, the frames, and a margin.
    fn lag_most_s(&self) -> f64 {
        self.servo.delay_s
            + self.servo.slop_rad() / self.servo.rate_rad_s()
            + FRAMES_LATER * FRAME_S
            + LATER_S
    }
}

/// What one surface has shown so far.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
struct SurfaceShown {
    least_rad: f64,
    most_rad: f64,
    error_rad: f64,
    /// NaN once it has not arrived anywhere.
    lag_s: f64,
}

const NOTHING_SHOWN: SurfaceShown =
    SurfaceShown { least_rad: f64::INFINITY, most_rad: f64::NEG_INFINITY, error_rad: 0.0, lag_s: 0.0 };

/// The sweep of all surfaces.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Sweep {
    // What is skipped is a constant of the mission.
    #[serde(skip)]
    reaches: [Reach; SURFACES],
    /// The servos report where they are.
    #[serde(skip)]
    tell: bool,
    surface: usize,
    /// The place of the present target among the surface's.
    target: usize,
    /// Frames since the surface was told to go there.
    frames: u32,
    frames_before: u64,
    arrived_s: Option<f64>,
    shown: SurfaceShown,
}

impl Sweep {
    pub(super) fn new(airframe: &Airframe) -> Self {
        Self {
            reaches: Reach::of_each(airframe),
            tell: airframe.servos_tell,
            surface: 0,
            target: 0,
            frames: 0,
            frames_before: 0,
            arrived_s: None,
            shown: NOTHING_SHOWN,
        }
    }

    /// Frames done, and all of them.
    pub(super) fn frames(&self) -> (u64, u64) {
        let all = self.reaches.iter().map(|reach| {
            let targets = reach.targets_rad();
            let ways = (0..targets.len()).map(|place| way_rad(reach, &targets, place));
            ways.map(|way_rad| u64::from(reach.stay_frames(way_rad, self.tell))).sum::<u64>()
        });
        (self.frames_before + u64::from(self.frames), all.sum())
    }

    /// One frame: what to command, `None` at the end; and what was found of a surface that is done.
    pub(super) fn step(
        &mut self,
        surfaces_rad: &[f64; SURFACES],
    ) -> (Option<SurfaceCommand>, Option<[CheckedValue; 3]>) {
        let Some(reach) = self.reaches.get(self.surface).copied() else { return (None, None) };
        let targets = reach.targets_rad();
        let (target_rad, way_rad) = (targets[self.target], way_rad(&reach, &targets, self.target));
        let stay_frames = reach.stay_frames(way_rad, self.tell);
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
        let (told, _) = self.step(surfaces_rad);
        (told, found)
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
        if !self.tell {
            return [Item::Range, Item::Error, Item::Lag]
                .map(|item| CheckedValue::only_shown(item(self.surface), f64::NAN));
        }
        let SurfaceShown { least_rad, most_rad, error_rad, lag_s } = self.shown;
        let whole_rad = reach.high_rad - reach.low_rad;
        [
            // The same tolerance as at power-up and before arming, at both ends.
            CheckedValue::at_least(
                Item::Range(self.surface),
                most_rad - least_rad,
                whole_rad - 2.0 * ANSWERING_RAD,
            ),
            CheckedValue::at_most(Item::Error(self.surface), error_rad, ANSWERING_RAD),
            CheckedValue::at_most(Item::Lag(self.surface), lag_s, reach.lag_most_s()),
        ]
    }
}

fn way_rad(reach: &Reach, targets_rad: &[f64], place: usize) -> f64 {
    let from_rad = place.checked_sub(1).map_or(reach.rest_rad, |before| targets_rad[before]);
    (targets_rad[place] - from_rad).abs()
}

// The sensors of a vehicle that stands still: means and spreads over some seconds.

/// Frames watched: 5 s, in which a spread is known to 2 % (1 / sqrt(2 * 1000)).
pub(super) const STILL_FRAMES: u32 = 1000;
/// The surfaces have come to rest after this many frames.
const SKIPPED: u32 = 100;
/// A spread may be this many times what the filter assumes of the sensor. At twice the spread the
/// filter trusts a sample four times as much as it should.
const SPREAD_MOST: f64 = 2.0;
/// One fix a second: without one in its second the pad's watch knows no speed, and arming is
/// refused.
const FIXES_LEAST: f64 = STILL_FRAMES as f64 * FRAME_S;

/// A rail is levelled with a bubble, degrees, about each axis.
const RAIL_LEVEL_DEG: f64 = 1.0;
/// A rail and a mount as they should be pass in 99 of 100 checks (Rayleigh: 1 - exp(-3^2 / 2)).
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

    /// A vehicle that hangs below a drone swings, and climbs: then only the fixes are judged.
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
            CheckedValue::at_most(Item::GyroBias, mean(&self.gyro_rad_s), BIAS_MAX_RAD_S),
            CheckedValue::at_most(Item::GyroNoise, largest(&self.gyro_rad_s), SPREAD_MOST * gyro_rad_s),
            CheckedValue::between(
                Item::Gravity,
                mean(&self.force_m_s2),
                *FELT_AT_REST_M_S2.start(),
                *FELT_AT_REST_M_S2.end(),
            ),
            CheckedValue::at_most(
                Item::AccelerometerNoise,
                largest(&self.force_m_s2),
                SPREAD_MOST * accelerometer_m_s2,
            ),
            CheckedValue::at_most(
                Item::BarometerNoise,
                self.pressure_altitude_m.sigma(),
                SPREAD_MOST * barometer_m,
            ),
            CheckedValue::at_least(Item::GnssFixes, f64::from(self.fixes), FIXES_LEAST),
            CheckedValue::at_most(Item::GnssSpeed, speed_m_s, arming.speed_max_m_s),
            CheckedValue::only_shown(Item::LidarRange, self.lidar_m.unwrap_or(f64::NAN)),
        ];
        if !hangs {
            return found;
        }
        found.map(|found| match found.item {
            Item::GnssFixes => found,
            item => CheckedValue::only_shown(item, found.value),
        })
    }

    /// What the rail's level and the inertial unit's mount lean together, on a rail. The filter
    /// doubts its attitude by the mount's stated misalignment, and no sensor shows it in flight.
    pub(super) fn lean_from_the_rail(&self, mission: &Mission) -> Option<CheckedValue> {
        let launch = mission.launched()?;
        let rail = launch.standing(mission.airframe.mass.loaded_cg_station_m).world_from_body;
        let up = rail.inverse_transform_vector(&Vector3::z());
        let felt = Vector3::from(self.force_m_s2.map(|spread| spread.mean));
        let lean_rad = libm::atan2(felt.cross(&up).norm(), felt.dot(&up));
        let stated_rad = libm::hypot(RAIL_LEVEL_DEG, mission.estimator.mounting_deg).to_radians();
        Some(CheckedValue::at_most(Item::RailLean, lean_rad, LEAN_SIGMAS * stated_rad))
    }
}
