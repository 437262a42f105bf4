//! A vehicle's state at one instant, for telemetry: what its flight computer believes.

mod space;

use alloc::vec::Vec;

use flight::computer::crew::People;
use flight::computer::pilot::ApogeeAhead;
use flight::computer::{AbortEffect, Commander, Computer, LogState};
use flight::estimation::estimator::Measurements;
use flight::guidance::powered::ControlLevel;
use flight::rules::operator::Operator;
use flight::rules::phase::{HoldCause, Interlocks, Latch, MotorStatus, Phase};
use flight::rules::two_person::{Act, Station};
use flight::rules::verdict::{LandingVerdict, TouchdownLimits};
use flight::vehicle::dynamics::PlanarState;
use flight::vehicle::rigid::RigidState;
use flight::vehicle::site::Site;
use nalgebra::{Quaternion, UnitQuaternion, Vector2, Vector3};
use nmpc::SolveStatus;

pub use self::space::InSpace;
use crate::vehicle::MissionName;

/// Points of a predicted path, at most.
pub const PATH_POINTS: usize = 12;

/// Everything telemetry is made of.
#[derive(Debug, Clone, PartialEq)]
pub struct Snapshot {
    /// Time since power-up, s.
    pub time_s: f64,
    pub phase: Phase,
    /// Latches.
    pub interlocks: Interlocks,
    /// Time to release, s, while a countdown runs.
    pub countdown_s: Option<f64>,
    /// Time since T+0, s; stands still after touchdown. As in the log: since the release, which lights the ascent
    /// motor on a pad and lets the vehicle fall elsewhere (see [`flight::computer::flight_time_s`]).
    pub since_zero_s: Option<f64>,
    /// Time before the pad may be approached, s.
    pub pad_wait_s: Option<f64>,
    /// What is known of the landing motor.
    pub motor: MotorStatus,
    /// Time before anybody may approach the vehicle, s; `None` while that cannot be said.
    pub approach_wait_s: Option<f64>,
    /// Why the last countdown was held, and the time left until the vehicle disarms, s.
    pub held: Option<(HoldCause, f64)>,
    /// While a countdown runs: time before the release from which on nothing holds the countdown, s; `None` if a hold comes in
    /// time until then.
    pub last_hold_s: Option<f64>,
    /// Why the landing motor is inhibited for good.
    pub latch: Option<Latch>,
    /// Bit k: arming check k fails now. Nought off the pad.
    pub checks_failed: u16,
    /// What an abort would do.
    pub abort_effect: AbortEffect,
    /// Where it is and how it moves.
    pub motion: Motion,
    /// Gimbal angles in pitch and in yaw, each commanded and actual, rad.
    pub gimbal_rad: [(f64, f64); 2],
    /// Fin angles commanded and actual, rad.
    pub fins_rad: ([f64; 4], [f64; 4]),
    pub thrust_n: f64,
    /// What the controller did last.
    pub controller: Option<ControllerFacts>,
    /// The end of its plan.
    pub prediction: Option<Prediction>,
    /// The way there.
    pub path: Option<Path>,
    /// How long the controller took, s.
    pub solve_time_s: f64,
    /// How long it may take, s.
    pub deadline_s: f64,
    /// Estimated thrust over nominal.
    pub thrust_scale: f64,
    /// What counts as a landing.
    pub limits: TouchdownLimits,
    /// Mechanical stop of the gimbal on either side, rad.
    pub gimbal_limit_rad: f64,
    /// The verdict, once touched down.
    pub judged: Option<Judged>,
    /// What the descent is steered by.
    pub descent: Option<DescentFacts>,
    /// What the estimator says of itself.
    pub estimator: Option<EstimatorFacts>,
    /// What the sensors said last; `None` where none are modelled.
    pub sensors: Option<SensorFacts>,
    /// Where on the Earth the pad is.
    pub site: Site,
    /// Altitude of the pad above the sea, m.
    pub pad_altitude_m: f64,
    /// Who commands and what is asked; `None` without operators.
    pub crew: Option<CrewFacts>,
    /// Which mission or profile it flies.
    pub mission: MissionName,
    /// `None` where no battery is modelled.
    pub battery: Option<BatteryFacts>,
    /// Where the log is written.
    pub log: LogState,
}

/// The battery.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BatteryFacts {
    pub volts: f64,
    /// `None` where it is not measured.
    pub current_a: Option<f64>,
    /// What is left of its charge, 0 to 1; `None` where it is not known.
    pub left: Option<f64>,
}

/// Position, velocity, attitude and rotation, north-east-down. Body axes: x towards the nose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Turns body vectors to north-east-down: w, x, y, z.
    pub ned_from_body: [f64; 4],
    /// Rotation rate in body axes, rad/s.
    pub rate_rad_s: [f64; 3],
    /// Position from the pad, m; down is measured at the feet.
    pub position_m: [f64; 3],
    pub velocity_m_s: [f64; 3],
    /// Speed through the air, m/s.
    pub airspeed_m_s: f64,
}

impl From<&PlanarState> for Motion {
    /// The pitch plane is north-down; pitch from the horizontal is a rotation about east.
    fn from(state: &PlanarState) -> Self {
        let half_rad = 0.5 * state.theta_rad;
        let (north_m_s, up_m_s) = state.ground_velocity_m_s();
        Self {
            ned_from_body: [libm::cos(half_rad), 0.0, libm::sin(half_rad), 0.0],
            rate_rad_s: [0.0, state.q_rad_s, 0.0],
            position_m: [state.x_m, 0.0, -state.z_m],
            velocity_m_s: [north_m_s, 0.0, -up_m_s],
            airspeed_m_s: state.speed_m_s(),
        }
    }
}

impl Motion {
    /// A motion in the world's axes ([`flight::vehicle::rigid`]): x is north, so y is west.
    pub fn in_space(state: &RigidState, feet_below_cg_m: f64, wind_m_s: &Vector2<f64>) -> Self {
        // Half a turn about north takes north-west-up to north-east-down.
        let half_turn = UnitQuaternion::new_unchecked(Quaternion::new(0.0, 1.0, 0.0, 0.0));
        let attitude = half_turn * state.world_from_body;
        let through_air: Vector3<f64> = state.velocity_m_s - wind_m_s.push(0.0);
        Self {
            ned_from_body: [attitude.w, attitude.i, attitude.j, attitude.k],
            rate_rad_s: state.rate_rad_s.into(),
            position_m: [state.position_m.x, -state.position_m.y, -(state.position_m.z - feet_below_cg_m)],
            velocity_m_s: [state.velocity_m_s.x, -state.velocity_m_s.y, -state.velocity_m_s.z],
            airspeed_m_s: libm::sqrt(through_air.norm_squared()),
        }
    }
}

/// One run of the controller, in numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ControllerFacts {
    /// Its number.
    pub tick: u64,
    /// Cost of the plan.
    pub cost: f64,
    /// Stationarity residual.
    pub kkt_stationarity: f64,
    /// Constraint residual.
    pub kkt_feasibility: f64,
    pub iterations: u32,
    /// The level that acted.
    pub level: ControlLevel,
    /// How the solve ended.
    pub status: SolveStatus,
}

/// The end of a plan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prediction {
    /// From now to there, s.
    pub time_to_go_s: f64,
    /// The state there, in the plane of the plan; velocities over the ground.
    pub state: PlanarState,
    /// Limits that it violates, one bit each in the verdict's order.
    pub violations: u16,
}

/// A plan's path seen from the side: horizontal and vertical positions, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Path {
    /// The points; the first `count` hold.
    pub points_m: [(f64, f64); PATH_POINTS],
    /// How many.
    pub count: usize,
}

impl Path {
    /// Evenly spread over a plan's nodes, both ends kept; `None` of an empty plan. `place` says where a node is, m: along
    /// the plane and up.
    pub fn through(nodes: usize, place: impl Fn(usize) -> (f64, f64)) -> Option<Self> {
        let last = nodes.checked_sub(1)?;
        let count = nodes.min(PATH_POINTS);
        let mut points_m = [(0.0, 0.0); PATH_POINTS];
        for (point, point_m) in points_m.iter_mut().enumerate().take(count) {
            *point_m = place(last * point / (count - 1).max(1));
        }
        Some(Self { points_m, count })
    }
}

/// The contact that a landing is judged by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Impact {
    /// Time since power-up, s.
    pub time_s: f64,
    /// State just before it.
    pub state: PlanarState,
}

/// A touchdown and its judgement, which only a simulation knows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Judged {
    /// The contact that was judged.
    pub impact: Impact,
    /// Limit by limit.
    pub verdict: LandingVerdict,
    /// Inside every limit, and it stands.
    pub landed: bool,
}

impl Judged {
    /// One bit per broken limit, in the verdict's order.
    pub fn violations(&self) -> u16 {
        violations(&self.verdict)
    }
}

/// What a descent on the fins is steered by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DescentFacts {
    /// Height of the feet, m.
    pub height_m: f64,
    /// Vertical velocity, up, m/s.
    pub vertical_m_s: f64,
    /// Lowest and greatest height at which thrust that begins still lands, m.
    pub band_m: Option<(f64, f64)>,
    /// Height at which it is to begin, m.
    pub chosen_m: Option<f64>,
    /// Below this height a parachute has no room, m.
    pub commit_height_m: f64,
    /// Time until the motor is to be lit, s.
    pub ignition_in_s: Option<f64>,
    /// Estimated wind, towards north and east, m/s.
    pub wind_m_s: [f64; 2],
    /// Estimated drag over nominal.
    pub drag_scale: f64,
    /// Estimated thrust over nominal.
    pub thrust_scale: f64,
    /// Where the present velocity leads to on the ground, north and east of the pad, m.
    pub touchdown_m: [f64; 2],
    /// The parachute.
    pub chute: Chute,
    /// The way up; `None` in a flight without ascent.
    pub ascent: Option<AscentFacts>,
}

/// The way up, as the flight computer knows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AscentFacts {
    pub booster: Booster,
    /// The apogee that is expected; `None` under the ascent motor.
    pub apogee: Option<ApogeeAhead>,
    /// It is over.
    pub over: bool,
}

/// The booster stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Booster {
    Attached,
    /// Its charge is fired, and the wire to it is still whole.
    Separating,
    Separated,
}

/// The parachute, as the flight computer knows it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Chute {
    Stowed,
    /// Thrown out; the fall is still fast.
    Fired,
    /// It carries: the fall has become slow.
    Open,
}

/// What an estimator says of itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EstimatorFacts {
    /// Whether to rely on it.
    pub health: flight::estimation::estimator::Health,
    /// Standard deviation of the horizontal position, the larger axis, m.
    pub horizontal_sigma_m: f64,
    /// Standard deviation of the height, m.
    pub height_sigma_m: f64,
}

/// What the sensors said last.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensorFacts {
    /// The last frame's.
    pub last: Measurements,
    /// Pressure height, m, when it last reported.
    pub pressure_altitude_m: f64,
    /// The barometer reports.
    pub barometer: bool,
    /// The satellite receiver reports.
    pub gnss: bool,
    /// The lidar reports: only close to the ground.
    pub lidar: bool,
}

/// What every snapshot is made of, whatever flies.
#[derive(Debug, Clone, Copy)]
pub struct Known<'a> {
    pub computer: &'a Computer,
    /// Time since power-up, s.
    pub time_s: f64,
    /// How long the controller may take, s.
    pub deadline_s: f64,
    /// `None` before the landing is judged, and on a vehicle that nobody simulates.
    pub judged: Option<Judged>,
    /// How many people an arming and a start take; `None` without operators.
    pub people: Option<People>,
    /// Who may command; empty without operators.
    pub operators: &'a [Operator],
    /// The station that armed the vehicle, if one did.
    pub commander: Option<Commander>,
    pub mission: &'a MissionName,
    /// Where the log is written.
    pub log: LogState,
}

impl Known<'_> {
    /// What the phase table and the checks say: everything else is left at nothing.
    pub fn standing(&self, motion: Motion, limits: TouchdownLimits) -> Snapshot {
        let (computer, time_s) = (self.computer, self.time_s);
        let mode = computer.mode();
        let on_pad = mode.phase.on_pad();
        let failing = on_pad.then(|| bits(computer.arming_checks().iter().map(|check| !check.passed)));
        Snapshot {
            time_s,
            phase: mode.phase,
            interlocks: mode.interlocks,
            countdown_s: mode.countdown_remaining_s(time_s),
            since_zero_s: None,
            pad_wait_s: mode.pad_wait_remaining_s(time_s),
            motor: mode.motor_status(time_s),
            approach_wait_s: mode.approach_wait_s(time_s),
            held: mode.held(time_s),
            last_hold_s: computer.last_hold_s().filter(|_| mode.countdown_end_s.is_some()),
            latch: computer.latch(),
            checks_failed: failing.unwrap_or(0),
            abort_effect: computer.abort_effect(),
            motion,
            gimbal_rad: [(0.0, 0.0); 2],
            fins_rad: ([0.0; 4], [0.0; 4]),
            thrust_n: 0.0,
            controller: None,
            prediction: None,
            path: None,
            solve_time_s: 0.0,
            deadline_s: self.deadline_s,
            thrust_scale: 1.0,
            limits,
            gimbal_limit_rad: 0.0,
            judged: self.judged,
            descent: None,
            estimator: None,
            sensors: None,
            site: Site::default(),
            pad_altitude_m: 0.0,
            crew: self.crew_facts(),
            mission: self.mission.clone(),
            battery: None,
            log: self.log,
        }
    }
}

/// One bit per broken limit, in the verdict's order.
pub fn violations(verdict: &LandingVerdict) -> u16 {
    bits(verdict.results.iter().map(|result| !result.passed))
}

/// Flags as bits, the first in bit 0.
fn bits(flags: impl Iterator<Item = bool>) -> u16 {
    flags.take(16).enumerate().fold(0, |bits, (place, set)| bits | (u16::from(set) << place))
}

// Who commands, what is asked and what is waited for, for telemetry.

/// What the crew is told of itself.
#[derive(Debug, Clone, PartialEq)]
pub struct CrewFacts {
    pub people: People,
    pub operators: Vec<Operator>,
    /// What waits for a confirmation: the act, its number, who asks, and the time left, s.
    pub ask: Option<(Act, u16, Operator, f64)>,
    /// Who has to tap, and the time left, s.
    pub tap: Option<(Operator, f64)>,
    /// The station that armed the vehicle or has taken command, and its operator.
    pub commander: Option<(Station, Option<Operator>)>,
    /// Who held the last countdown, or whose silence did.
    pub held_by: Option<Operator>,
}

impl Known<'_> {
    fn crew_facts(&self) -> Option<CrewFacts> {
        let (memory, time_s) = (self.computer.crew(), self.time_s);
        let ask = memory.two_person.waiting(time_s);
        let tap = memory.two_person.tapping();
        Some(CrewFacts {
            people: self.people?,
            operators: self.operators.to_vec(),
            ask: ask.map(|ask| (ask.act, ask.number, ask.by, ask.left_s(time_s))),
            tap: tap.map(|tapping| (tapping.by, tapping.left_s(time_s))),
            commander: self.commander.map(|commander| (commander.station, commander.by)),
            held_by: memory.held_by,
        })
    }
}
