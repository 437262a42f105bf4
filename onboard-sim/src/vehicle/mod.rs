//! The flight computer around one simulated vehicle: phases, checks, controller ticks, touchdown.
//!
//! Pure but for the stopwatch that its caller hands in to time the controller. Time is simulated and moves in
//! frames ([`Vehicle::frame_s`], 20 ms for a 100 ms sample); a controller tick falls on every few frames.
//! Its state estimate is the plant's true state and its accelerometer is perfect: sensors are a matter of their own.

mod craft;
mod flight_loop;
mod snapshot;
#[cfg(test)]
mod tests;

use flight::arming::{Check, Uplink};
use flight::controller::{ControllerConfig, ControllerOutput, ControllerState};
use flight::gate::{GateInput, gate_checks};
use flight::phase::{Mode, StartPoint};
use flight::profile::Profile;
use flight::thrust_estimate::ThrustEstimate;
use flight::verdict::TouchdownLimits;

pub use crate::craft::{Severity, Tick, VehicleEvent};

use crate::craft::{ANSWERING_RAD, Judged, LogState, MotorWatch, Readiness, SelfTest};
use crate::plant::{Impact, Plant, STEP_S};
use crate::scatter::Draw;

/// Frames are at least this long.
const FRAME_MIN_S: f64 = 0.02;
/// The landing is rehearsed this often while the vehicle waits on the pad.
const REHEARSAL_PERIOD_S: f64 = 1.0;
/// Thrust is believed once it has been sensed for this long: one spike is not a burning motor.
const THRUST_CONFIRM_S: f64 = 0.04;
/// Time on the ground after which the flight is over and its controller stands still, s.
const AT_REST_S: f64 = 1.0;

/// Why a profile cannot be flown here.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum VehicleError {
    /// The start is not simulated.
    #[error("profile {profile}: start.at = {at:?} is not simulated; only \"ignition\" is")]
    Start {
        /// Profile.
        profile: String,
        /// What it asks for.
        at: StartPoint,
    },
    /// The sample time does not fit the plant's step.
    #[error(
        "profile {profile}: nmpc.sample_time_s = {sample_time_s}: must be a whole number of milliseconds"
    )]
    SampleTime {
        /// Profile.
        profile: String,
        /// What it asks for.
        sample_time_s: f64,
    },
}

/// How late outputs are treated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum DeadlinePolicy {
    /// Simulated time waits: the output is applied and the miss is counted.
    #[default]
    Observe,
    /// As in hardware: a late output is not applied, the previous plan's next command is.
    Enforce,
}

/// One vehicle, one flight.
pub struct Vehicle {
    profile: Profile,
    limits: TouchdownLimits,
    draw: Draw,
    plant: Plant,
    mode: Mode,
    controller: ControllerState,
    policy: DeadlinePolicy,
    log: LogState,
    uplink: Uplink,
    motor_watch: MotorWatch,
    frame: u64,
    frames_per_sample: u64,
    substeps_per_frame: u64,
    tick: u64,
    ignition_sample: Option<u64>,
    output: Option<ControllerOutput>,
    solve_time_s: f64,
    thrust: ThrustEstimate,
    self_test: SelfTest,
    /// Since when thrust has been felt without a break.
    thrust_felt_since_s: Option<f64>,
    readiness: Readiness,
    /// The gate check that was last complained of.
    gate_complaint: Option<&'static str>,
    /// The command that the actuators get at the next sample.
    next_gimbal_rad: f64,
    gimbal_applied_rad: f64,
    fin_command_rad: [f64; 4],
    /// The last output that came in time, and the ticks missed since.
    in_time: Option<ControllerOutput>,
    misses: usize,
    impacts: Vec<Impact>,
    verdict: Option<Judged>,
    events: Vec<VehicleEvent>,
}

impl Vehicle {
    /// A vehicle powered up in its rig.
    ///
    /// # Errors
    /// The profile asks for something this simulation does not do.
    pub fn new(
        profile: &Profile,
        draw: Draw,
        policy: DeadlinePolicy,
    ) -> std::result::Result<Self, VehicleError> {
        if profile.start.at != StartPoint::Ignition {
            return Err(VehicleError::Start { profile: profile.name.clone(), at: profile.start.at });
        }
        let sample_time_s = profile.nmpc.sample_time_s;
        let substeps = (sample_time_s / STEP_S).round();
        if substeps < 1.0 || (substeps * STEP_S - sample_time_s).abs() > 1e-9 {
            return Err(VehicleError::SampleTime { profile: profile.name.clone(), sample_time_s });
        }
        let substeps = substeps as u64;
        let shortest = (FRAME_MIN_S / STEP_S).round() as u64;
        let substeps_per_frame =
            (shortest..=substeps).find(|length| substeps.is_multiple_of(*length)).unwrap_or(substeps);
        let config = ControllerConfig::from_profile(profile);
        Ok(Self {
            limits: TouchdownLimits::from_profile(profile),
            plant: Plant::new(profile, &draw),
            mode: Mode::power_up(0.0),
            controller: ControllerState::new(&config),
            policy,
            log: LogState { running: false, space_bytes: 0 },
            uplink: Uplink::NotNeeded,
            motor_watch: MotorWatch::default(),
            frame: 0,
            frames_per_sample: substeps / substeps_per_frame,
            substeps_per_frame,
            tick: 0,
            ignition_sample: None,
            output: None,
            solve_time_s: 0.0,
            thrust: ThrustEstimate::default(),
            self_test: SelfTest::NotBegun,
            thrust_felt_since_s: None,
            readiness: Readiness::default(),
            gate_complaint: None,
            next_gimbal_rad: 0.0,
            gimbal_applied_rad: 0.0,
            fin_command_rad: [profile.fins.closed_rad(); 4],
            in_time: None,
            misses: 0,
            impacts: Vec::new(),
            verdict: None,
            events: Vec::new(),
            profile: profile.clone(),
            draw,
        })
    }

    /// Length of a frame, s.
    pub fn frame_s(&self) -> f64 {
        self.profile.nmpc.sample_time_s / self.frames_per_sample as f64
    }

    /// The ignition gate's checks with the values found now.
    pub fn gate_checks(&self) -> Vec<Check> {
        let state = self.plant.state();
        let predicted = self.output.as_ref();
        let input = GateInput {
            tilt_rad: state.theta_rad - core::f64::consts::FRAC_PI_2,
            vertical_speed_m_s: state.ground_velocity_m_s().1,
            pitch_rate_rad_s: state.q_rad_s,
            speed_m_s: state.speed_m_s(),
            predicted_speed_m_s: self.profile.start.planar_state().speed_m_s(),
            // One height source: the truth.
            height_disagreement_m: 0.0,
            landing_feasible: predicted.is_some_and(|output| output.solver.landing_feasible),
            predicted_touchdown_x_m: predicted
                .map_or(f64::NAN, |output| output.predicted_touchdown.state.x_m),
            // Released at ignition, the fins open with the release; their confirmation belongs to the descent.
            fins_confirmed: true,
            parachute_stowed: true,
            igniter_continuity: self.ignition_sample.is_none(),
            estimator_healthy: state.is_finite(),
        };
        gate_checks(&self.profile.gate, &input)
    }

    /// Fins that have come to their commanded angle.
    fn fins_answering(&self) -> [bool; 4] {
        let (commanded, actual) = self.plant.fins_rad();
        std::array::from_fn(|fin| (commanded[fin] - actual[fin]).abs() <= ANSWERING_RAD)
    }

    /// Whether gimbal and fins have come to their commanded angles.
    fn actuators_answer(&self) -> bool {
        let (commanded, actual) = self.plant.gimbal_rad();
        (commanded - actual).abs() <= ANSWERING_RAD && self.fins_answering() == [true; 4]
    }
}
