//! Determines from the sensors whether the vehicle is at rest on its pad, or how it hangs below its
//! drone, and its attitude. Also the self-test, the arming checks, and the sequence from power-up
//! to the release.

use nalgebra::Vector3;
use serde::Serialize;

use super::messages::Severity;
use super::{Computer, Release, SensedInput};
use crate::estimation::estimator::Measurements;
use crate::estimation::estimator::alignment::{PadAlignment, PadRecord, PadStart};
use crate::estimation::sensor_watch::Rests;
use crate::estimation::spikes::SpikeFilter;
use crate::rules::arming::{ArmingInput, Checks, Uplink, arming_checks, failing_checks};
use crate::rules::phase::{Event, HoldCause, Phase, StartPoint};
use crate::text::text;
use crate::vehicle::atmosphere::STANDARD_GRAVITY_M_S2;
use crate::vehicle::rigid::{RigidState, upright};

/// Interval at which the stance is evaluated, frames: once a second.
const WINDOW_FRAMES: u32 = 200;

/// Specific force below which a hanging vehicle has been released, m/s^2, for [`FALLING_FRAMES`]. A
/// swing of 30 degrees reduces the force by at most a quarter.
const FALLING_M_S2: f64 = 3.0;
/// 0.1 s, in which it falls by 5 cm.
const FALLING_FRAMES: u32 = 20;

/// Attitude and motion on the pad, as last measured. An unavailable value is NaN and passes no
/// check.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stance {
    /// Tilt of the nose from the vertical, rad.
    pub tilt_rad: f64,
    pub rotation_rad_s: f64,
    pub speed_m_s: f64,
    /// The attitude is available.
    pub settled: bool,
    /// Height of a hanging vehicle, m; NaN if not available. `None` on a pad.
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
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
struct PadSecond {
    /// Attitude with the heading of the pad, and the gyro's bias, rad/s; `None` if the vehicle was
    /// not at rest.
    at_rest: Option<PadStart>,
    /// Mean angle between the axis and the specific force, rad: the tilt of a vehicle whose swing
    /// averages out.
    lean_rad: f64,
    /// Mean pressure altitude, m; NaN without a sample.
    pressure_altitude_m: f64,
    /// Mean GNSS velocity, world, m/s; NaN without a fix.
    velocity_m_s: Vector3<f64>,
}

/// The sums of the current second, and the result of the last one.
#[derive(Debug, Clone, Copy, Default, Serialize)]
pub(super) struct PadWatch {
    alignment: PadAlignment,
    record: PadRecord,
    frames: u32,
    fixes: u32,
    velocity_sum_m_s: Vector3<f64>,
    force_sum_m_s2: Vector3<f64>,
    pressures: u32,
    altitude_sum_m: f64,
    falling_frames: u32,
    /// Seconds in a row in which the pressure changed as in an ascent or a fall.
    moving_seconds: u32,
    found: Option<PadSecond>,
}

/// Change of the pressure altitude in a second that no crew causes, m: a vehicle under its
/// parachute sinks by 6 m a second, a person climbs a ladder at less than 1 m a second.
const MOVES_M: f64 = 5.0;
/// A bay that closes changes the pressure in one second, and not in the next.
const MOVING_SECONDS: u32 = 2;

impl PadWatch {
    /// Returns whether the vehicle rises or falls: a computer that was reset in the air takes
    /// itself for one on its pad.
    pub(super) fn moves(&self) -> bool {
        self.moving_seconds >= MOVING_SECONDS
    }

    /// Adds a frame.
    pub(super) fn update_stillness(&mut self, measurements: &Measurements) {
        self.alignment.take(&measurements.imu);
        let sensed_m_s2 = measurements.imu.specific_force_m_s2;
        self.force_sum_m_s2 += sensed_m_s2;
        self.falling_frames = if sensed_m_s2.norm() < FALLING_M_S2 { self.falling_frames + 1 } else { 0 };
        if let Some(altitude_m) = measurements.pressure_altitude_m {
            self.pressures += 1;
            self.altitude_sum_m += altitude_m;
        }
        if let Some(fix) = &measurements.gnss {
            self.fixes += 1;
            self.velocity_sum_m_s += fix.velocity_m_s;
        }
        self.frames += 1;
        if self.frames < WINDOW_FRAMES {
            return;
        }
        let over = core::mem::take(self);
        (self.falling_frames, self.record) = (over.falling_frames, over.record);
        let altitude_m = over.altitude_sum_m / f64::from(over.pressures);
        let climbs_m = over.found.map_or(0.0, |before| altitude_m - before.pressure_altitude_m);
        self.moving_seconds = if climbs_m.abs() > MOVES_M { over.moving_seconds + 1 } else { 0 };
        let across_m_s2 = over.force_sum_m_s2.yz().norm();
        self.found = Some(PadSecond {
            at_rest: self.record.take(&over.alignment, 0.0).ok(),
            lean_rad: libm::atan2(across_m_s2, over.force_sum_m_s2.x),
            pressure_altitude_m: altitude_m,
            // Without a fix in this second the velocity is that of the second before; a missing fix
            // is a separate check. Before the first fix this is 0 / 0 = NaN, which passes no check.
            velocity_m_s: match over.found.filter(|_| over.fixes == 0) {
                Some(before) => before.velocity_m_s,
                None => over.velocity_sum_m_s / f64::from(over.fixes),
            },
        });
    }

    /// Attitude and motion on the pad, or below a drone, with the measured body rate, rad/s.
    pub(super) fn stance(&self, hangs: bool, measured_rad_s: Vector3<f64>) -> Stance {
        let Some(found) = &self.found else { return Stance::UNKNOWN };
        let bias_rad_s =
            self.at_rest().map_or_else(Vector3::zeros, |start| start.calibration.gyro_bias_rad_s);
        let rotation_rad_s = (measured_rad_s - bias_rad_s).norm();
        let standing_rad = || found.at_rest.map_or(f64::NAN, |_| self.estimate().tilt_rad());
        Stance {
            tilt_rad: if hangs { found.lean_rad } else { standing_rad() },
            rotation_rad_s,
            speed_m_s: found.velocity_m_s.norm(),
            settled: hangs || found.at_rest.is_some(),
            hanging_m: hangs.then_some(found.pressure_altitude_m),
        }
    }

    /// Whether a hanging vehicle has been released: it senses no weight.
    pub(super) fn falls(&self) -> bool {
        self.falling_frames >= FALLING_FRAMES
    }

    /// Attitude and gyro bias, from the last second at rest.
    pub(super) fn at_rest(&self) -> Option<&PadStart> {
        self.found.as_ref()?.at_rest.as_ref()
    }

    /// The last measured attitude, at rest at the origin.
    pub(super) fn estimate(&self) -> RigidState {
        let found = self.found.as_ref();
        RigidState {
            world_from_body: self.at_rest().map_or_else(upright, |start| start.world_from_body),
            velocity_m_s: found.map_or_else(Vector3::zeros, |found| found.velocity_m_s),
            ..RigidState::upright(0.0)
        }
    }
}

// The self-test at power-up: every actuator moves and returns.

/// Angle by which the self-test moves fins and gimbal, rad.
const MOVED_RAD: f64 = 0.05;
/// Largest deviation of an actuator from its command, rad; beyond it the actuator does not answer.
/// It is larger than the play of a linkage.
pub(super) const ANSWERING_RAD: f64 = 0.02;
/// Largest offset of a closed fin's feedback, rad: fins are set by eye, and their potentiometers
/// are glued. One tooth of a servo spline is 0.25 rad (25 teeth).
const ZERO_MAX_RAD: f64 = 0.06;
/// Time after power-up at which the servos have reached their rest, s.
const REST_S: f64 = 0.5;
/// Time limit of the self-test after power-up, s.
const LIMIT_S: f64 = 3.0;

/// Progress of the self-test.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub(super) enum SelfTest {
    NotBegun,
    Moved,
    BroughtBack,
    Failed,
}

/// The next action of the self-test.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum TestStep {
    /// Command every actuator to this angle from its rest, rad.
    Command(f64),
    /// It has passed.
    Passed,
    /// It has failed just now.
    Failed,
    /// No action in this frame.
    Wait,
}

impl SelfTest {
    /// Advances the self-test until it has passed. `since_s` is the time since power-up;
    /// `answering`: every actuator has reached its commanded angle.
    pub(super) fn step(&mut self, answering: bool, since_s: f64) -> TestStep {
        match self {
            Self::NotBegun if since_s >= REST_S => {
                *self = Self::Moved;
                TestStep::Command(MOVED_RAD)
            }
            Self::Moved if answering => {
                *self = Self::BroughtBack;
                TestStep::Command(0.0)
            }
            Self::BroughtBack if answering => TestStep::Passed,
            Self::Moved | Self::BroughtBack if since_s > LIMIT_S => {
                *self = Self::Failed;
                TestStep::Failed
            }
            Self::NotBegun | Self::Moved | Self::BroughtBack | Self::Failed => TestStep::Wait,
        }
    }
}

// Arming checks on the pad.

impl Computer {
    /// Attitude and motion on the pad.
    pub fn stance(&self) -> Stance {
        self.pad.stance(self.start_point() == StartPoint::Drone, self.sensors.turns_rad_s())
    }

    /// The resting place of the vehicle while it waits.
    fn rests(&self) -> Rests {
        let mission = self.pilot.mission();
        let cg_station_m = mission.airframe.mass.loaded_cg_station_m;
        let standing = match (mission.launched(), self.start_point()) {
            (Some(launch), _) => launch.standing(cg_station_m),
            (None, StartPoint::Drone) => return Rests::Hanging,
            (None, _) => RigidState::upright(mission.airframe.above_feet_m(cg_station_m)),
        };
        let lever_m = mission.sensors.lever_arms(&(Vector3::x() * cg_station_m)).lidar_m;
        let lidar_m = standing.position_m + standing.world_from_body * lever_m;
        Rests::Standing { at_m: standing.position_m, range_m: lidar_m.z / standing.nose_in_world().z }
    }

    /// The estimated state on the pad, at rest at the origin.
    pub fn estimated_on_pad(&self) -> RigidState {
        self.pad.estimate()
    }

    /// The arming checks with the present values and the best uplink.
    pub fn arming_checks(&self) -> Checks {
        arming_checks(&self.arming, &self.arming_input(self.input.uplink))
    }

    /// The arming checks that fail, with the uplink of a station.
    pub(super) fn failing_checks(&self, uplink: Uplink) -> Checks {
        failing_checks(&self.arming, &self.arming_input(uplink))
    }

    fn arming_input(&self, uplink: Uplink) -> ArmingInput {
        let locks = &self.table.mode().interlocks;
        let stance = self.stance();
        let (controller_warm, controller_found, predicted_landing) = match &self.rehearsed {
            Some(rehearsed) => (rehearsed.warm, rehearsed.found, rehearsed.landing.clone()),
            None => (false, text!("no rehearsal yet"), None),
        };
        ArmingInput {
            pin_out: locks.pin_out,
            abort_latched: locks.abort_latched,
            pad_wait_s: self.table.mode().pad_wait_remaining_s(self.table.time_s),
            tilt_rad: stance.tilt_rad,
            rotation_rad_s: stance.rotation_rad_s,
            speed_m_s: stance.speed_m_s,
            self_test_passed: self.table.mode().phase != Phase::Safe,
            is_checking: self.pad_check.is_busy(self.input.frame),
            sensor_defects: self.sensors.defects(self.rests()),
            estimator_converged: stance.settled,
            hanging_m: stance.hanging_m,
            fins_answering: self.fins_answering,
            seers: (!self.pilot.mission().airframe.servos_report).then(|| self.pad_check.seers()),
            igniter_continuity: self.input.igniter_continuity,
            log_running: self.input.log.running,
            log_space_bytes: self.input.log.space_bytes,
            battery_v: self.input.battery_v,
            servo_battery_v: self.input.servo_battery_v,
            controller_warm,
            controller_found,
            predicted_landing,
            uplink,
        }
    }

    /// Evaluates every arming check again. While the vehicle waits, a failure is reported; in the
    /// countdown it holds, until the igniter is energised.
    pub(super) fn repeat_the_checks(&mut self) {
        let armed = match self.table.mode().phase {
            Phase::PadIdle => false,
            Phase::PadArmed => true,
            _ => return,
        };
        let checks = self.failing_checks(self.input.uplink);
        let Some((why, untold)) = self.readiness.failing(&checks, self.table.time_s) else { return };
        let held = armed && self.hold(HoldCause::CheckFailed, || why);
        if untold && !held {
            // The crew runs a check or has put the pin in: this is no fault of the vehicle.
            let is_of_crew =
                self.pad_check.is_busy(self.input.frame) || !self.table.mode().interlocks.pin_out;
            let (severity, state) = match (armed, is_of_crew) {
                (true, _) => (Severity::Critical, "armed, and "),
                (false, true) => (Severity::Notice, "not ready: "),
                (false, false) => (Severity::Warning, "not ready: "),
            };
            self.table.report(severity, text!("{state}{why}"));
        }
    }
}

// The sequence from power-up to the release: self-test, readiness, countdown.

impl Computer {
    /// One frame on the pad.
    pub(super) fn wait_on_the_pad(&mut self, input: &SensedInput) {
        if self.table.mode().phase == Phase::Safe {
            self.test_itself(input);
        }
        match self.start_point() {
            // The drone's pilot releases the vehicle, and the fall is sensed.
            StartPoint::Drone => self.wait_below_the_drone(),
            _ if self.countdown_is_over() => self.release(),
            StartPoint::Pad => self.wait_on_the_rail(input),
            StartPoint::Apogee => {}
        }
        self.check_itself(input);
    }

    /// A motor may ignite without a command.
    fn wait_on_the_rail(&mut self, input: &SensedInput) {
        if self.pilot.detects_lift_off(&input.measured) {
            self.table.report(Severity::Critical, "LIFT-OFF without a countdown");
            if self.table.apply(Event::LiftOff).is_ok() {
                self.begin_flight();
            }
        }
    }

    fn wait_below_the_drone(&mut self) {
        if !self.pad.falls() {
            return;
        }
        let released = if self.countdown_is_over() {
            self.table.apply(Event::ReleasedAt(StartPoint::Drone))
        } else {
            self.table.report(Severity::Critical, "RELEASED before it was cleared");
            let parachute_fills = self.parachute_fills_below_the_drone();
            self.table.apply(Event::ReleasedEarly { parachute_fills })
        };
        if released.is_ok() {
            self.begin_flight();
        }
    }

    pub(super) fn start_point(&self) -> StartPoint {
        self.pilot.mission().start.at
    }

    /// Moves every actuator and returns it. The test passes only after one second of sensor data.
    fn test_itself(&mut self, input: &SensedInput) {
        let gimbal = self.commands.gimbal_rad.iter().zip(&input.gimbal_rad);
        let answering = gimbal.clone().all(|(told, found)| (told - found).abs() <= ANSWERING_RAD)
            && self.fins_answering == [true; 4];
        // A restarted computer begins its test late on the vehicle's clock.
        let since_s = input.time_s - self.table.mode().entered_at_s;
        match self.self_test.step(answering, since_s) {
            TestStep::Command(angle_rad) => {
                let closed_rad = self.closed_rad();
                if self.self_test == SelfTest::Moved {
                    // An actuator answers if it follows its command; its feedback may have an
                    // offset.
                    let off_rad = input.fins_rad.map(|fin_rad| fin_rad - closed_rad);
                    self.fins_zero_rad =
                        off_rad.map(|off_rad| if off_rad.abs() <= ZERO_MAX_RAD { off_rad } else { 0.0 });
                }
                self.commands.gimbal_rad = [angle_rad; 2];
                self.commands.fins_rad = [closed_rad + angle_rad; 4];
            }
            TestStep::Passed if self.pad.found.is_some() => {
                let _ = self.table.apply(Event::SelfTestPassed);
            }
            TestStep::Failed => {
                let fins = self.fins_answering.iter().filter(|answers| **answers).count();
                let words = text!("self-test failed: an actuator does not answer ({fins} of 4 fins do)");
                self.table.report(Severity::Error, words);
            }
            TestStep::Passed | TestStep::Wait => {}
        }
    }

    pub(super) fn closed_rad(&self) -> f64 {
        self.pilot.mission().airframe.fins.closed_rad()
    }

    pub(super) fn countdown_is_over(&self) -> bool {
        self.table.mode().countdown_remaining_s(self.table.time_s).is_some_and(|left_s| left_s <= 0.0)
    }

    /// The countdown has ended: the flight begins where the simulation releases the vehicle.
    pub(super) fn release(&mut self) {
        let event = match self.start_point() {
            StartPoint::Pad => Event::CountdownElapsed,
            at => Event::ReleasedAt(at),
        };
        if self.table.apply(event).is_ok() {
            self.begin_flight();
        }
    }

    /// A vehicle from a rail takes its attitude and gyro bias from there.
    fn begin_flight(&mut self) {
        self.release = Some(Release { frame: self.input.frame, time_s: self.table.time_s });
        // A flight simulated from apogee starts with a step in pressure.
        self.pressure = SpikeFilter::default();
        let mission = self.pilot.mission();
        if let (Some(launch), Some(start)) = (mission.launched(), self.pad.at_rest()) {
            let mut estimate = RigidState {
                world_from_body: start.world_from_body,
                ..launch.standing(mission.airframe.mass.loaded_cg_station_m)
            };
            // An uncommanded lift-off is detected a moment after it began.
            estimate.velocity_m_s = estimate.nose_in_world() * self.pilot.ascent.gained_m_s;
            self.pilot.stand(&estimate, &start.calibration);
        }
    }

    /// Whether the parachute fills before a vehicle dropped by its drone reaches the ground.
    fn parachute_fills_below_the_drone(&self) -> bool {
        let parachute = &self.pilot.mission().airframe.parachute;
        // The fall accelerates from rest: the speed when the lines are taut.
        let delay_s = parachute.ejection_delay_s;
        let fall_m = 0.5 * STANDARD_GRAVITY_M_S2 * delay_s * delay_s + parachute.inflation_distance_m;
        self.pad.stance(true, Vector3::zeros()).hanging_m.is_some_and(|height_m| height_m > fall_m)
    }
}
