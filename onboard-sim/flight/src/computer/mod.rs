//! The flight computer: every decision on board, from power-up to safed.
//!
//! [`Computer::step`] is the only way to advance it: one [`Input`] in, one [`Output`] out per
//! frame. The same inputs give the same outputs, bit for bit. Self-test, pin, arming, countdown,
//! release, descent, landing, abort and safing are all decided here, through one [phase
//! table](crate::rules::phase).
//!
//! * [`table`]: applies each event to the phase table once, and predicts the effect of an abort.
//! * [`crew`]: the crew's requests and the decision on each.
//! * [`events`]: the events of a flight.
//! * [`findings`]: faults detected in flight.
//! * [`messages`]: messages to the crew.
//! * [`pad_check`]: the vehicle check that the crew runs on the pad.
//! * [`pad`]: from power-up to the release.
//! * [`pilot`]: flies the rocket after its release.
//! * [`saved`]: power-up, the state saved through a reset, and resuming from it.
//! * `digest`: a hash of the complete memory, to compare a replay with a log.

pub mod crew;
mod digest;
pub mod events;
pub mod findings;
pub mod messages;
pub mod pad;
pub mod pad_check;
pub mod pilot;
pub mod saved;
pub mod table;

use alloc::boxed::Box;
use core::ops::Deref;

use serde::{Deserialize, Serialize};

pub use self::crew::CrewMemory;
use self::crew::{Answers, People, Request};
use self::messages::{MotorWatch, Readiness, Severity};
use self::pad::{ANSWERING_RAD, PadWatch, SelfTest};
use self::pad_check::{PadCheck, SURFACES, surfaces_rad};
use self::pilot::{Pilot, Pointed};
pub use self::table::AbortEffect;
use self::table::{Messages, PhaseTable};
use crate::control::servo::ServoModel;
use crate::estimation::estimator::Measurements;
use crate::estimation::sensor_watch::SensorWatch;
use crate::estimation::spikes::SpikeFilter;
use crate::guidance::powered::ControlLevel;
use crate::guidance::vertical::EvenLanding;
use crate::rules::arming::{PredictedLanding, Uplink};
use crate::rules::operator::Operator;
use crate::rules::outputs::{FlightProgress, Outputs};
use crate::rules::phase::{Event, HOLD_LIMIT_S, Latch, Mode, Motor, Phase, StartPoint};
use crate::rules::two_person::Station;
use crate::text::{Text, text};
use crate::vehicle::mission::{ArmingLimits, Mission};
use crate::vehicle::rigid::RigidState;

/// Frame length, ms.
pub const FRAME_MS: u32 = 5;
/// Frame length, s.
pub const FRAME_S: f64 = FRAME_MS as f64 * 1e-3;
/// Time on the ground after which the flight is over, s.
const AT_REST_S: f64 = 1.0;

/// Sine of a fin's opening angle above which the fin is clear of the parachute hatch. At this angle
/// the tip of mk3's fin is 8 cm off the skin.
const HATCH_FREE_SINE: f64 = 0.7;

/// When the vehicle was released.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Release {
    frame: u64,
    time_s: f64,
}

/// The flight computer with its complete memory.
#[derive(Debug, Clone, Serialize)]
pub struct Computer {
    table: PhaseTable,
    pressure: SpikeFilter,
    /// Health of each sensor.
    sensors: SensorWatch,
    /// State on the pad.
    pad: PadWatch,
    /// Flight control after the release.
    pilot: Box<Pilot>,
    /// State at power-up, used again by [`Computer::restart`].
    #[serde(skip)]
    initial_state: RigidState,
    /// The last frame's input. Anything still relevant is repeated in the next one.
    #[serde(skip)]
    input: SensedInput,
    /// The gate check last reported to the crew.
    reported_gate_check: Option<&'static str>,
    #[serde(skip)]
    arming: ArmingLimits,
    #[serde(skip)]
    countdown_s: f64,
    commands: Commands,
    self_test: SelfTest,
    readiness: Readiness,
    rehearsed: Option<Rehearsed>,
    motor_watch: MotorWatch,
    crew: CrewMemory,
    fins_answering: [bool; 4],
    /// Feedback of the closed fins before the self-test moved them, less the closed angle, rad.
    fins_zero_rad: [f64; 4],
    pad_check: PadCheck,
    /// Servo models of a vehicle without servo feedback, from the first frame on.
    silent: Option<[ServoModel; SURFACES]>,
    release: Option<Release>,
    level: ControlLevel,
}

impl Computer {
    /// Executes one frame. In the air: take over a finished plan, estimate, answer the crew,
    /// decide, request the next plan, steer. On the pad: answer the crew and wait. The outputs
    /// follow from the mode at the end of the frame, and from nothing else.
    pub fn step(&mut self, input: &Input<'_>) -> Output {
        let mut input = self.with_silent_servos(input);
        let measured = &mut input.sensed.measured;
        measured.pressure_altitude_m = self.pressure.take(measured.pressure_altitude_m, input.sensed.time_s);
        let input = &input;
        self.table.time_s = input.time_s;
        self.report_changes(input);
        self.input = input.sensed;
        let Self { commands: Commands { fins_rad: commanded_rad, .. }, fins_zero_rad: zero_rad, .. } = self;
        self.fins_answering = core::array::from_fn(|fin| {
            (commanded_rad[fin] + zero_rad[fin] - input.fins_rad[fin]).abs() <= ANSWERING_RAD
        });
        if self.rehearsed.is_none() {
            self.rehearsed = input.rehearsed.cloned();
        }
        self.sensors.take(&input.measured, input.time_s);
        if self.table.mode().phase.on_pad() {
            self.pad.update_stillness(&input.measured);
            if self.rehearsed.is_some() {
                self.repeat_the_checks();
            }
        }
        self.inhibit_if_moving();
        let flown = self.flown();
        let planned =
            flown.filter(|_| input.plan_ready).is_some_and(|flown| self.pilot.take_over(flown.time_s));
        if let Some(flown) = &flown {
            let phase = self.table.mode().phase;
            let is_over = matches!(phase, Phase::Touchdown | Phase::Safed) && self.is_over();
            self.pilot.estimate_state((phase, is_over), flown, &self.sensors);
            self.pilot.predict(&mut self.table, flown);
        }
        let mut answers = Answers::new();
        for request in input.requests {
            let answer = self.answer(request);
            let _ = answers.try_push(answer);
        }
        self.check_the_commander(input);
        self.check_dead_man_timeout();
        if let Some(flown) = &flown {
            self.pilot.decide(&mut self.table, flown, &self.sensors);
            self.pilot.plan(self.table.mode(), flown, input.plan_ready);
            let pointed = self.pilot.point(self.table.mode(), flown);
            self.take_over(pointed);
        } else {
            self.wait_on_the_pad(input);
        }
        self.apply_timeouts();
        let progress = FlightProgress {
            flying: flown.is_some(),
            lifted_off: self.pilot.ascent.has_lifted_off(),
            separation_due: self.pilot.ascent.separates(),
            igniting: flown.is_some_and(|flown| self.pilot.ignites(flown.time_s)),
            hatch_free: self.hatch_is_free(input),
        };
        self.commands.outputs = Outputs::decided(self.table.mode(), progress);
        Output {
            commands: self.commands,
            released: flown.is_none() && self.release.is_some(),
            answers,
            messages: self.table.take_messages(),
            planned,
        }
    }

    /// Returns the input with modelled servo positions if the vehicle has no servo feedback.
    fn with_silent_servos<'a>(&mut self, input: &Input<'a>) -> Input<'a> {
        let airframe = &self.pilot.mission().airframe;
        if airframe.servos_report {
            return *input;
        }
        let command_rad = surfaces_rad(self.commands.gimbal_rad, self.commands.fins_rad);
        let servos = self.silent.get_or_insert_with(|| ServoModel::of_each(airframe, command_rad));
        for (servo, command_rad) in servos.iter_mut().zip(command_rad) {
            servo.take(command_rad);
            servo.advance();
        }
        let [pitch, yaw, fins_rad @ ..] = servos.each_ref().map(|servo| servo.at_rad);
        let sensed = SensedInput { gimbal_rad: [pitch, yaw], fins_rad, ..input.sensed };
        Input { sensed, ..*input }
    }

    /// Latches an abort if a computer that starts as on its pad rises or falls: it was switched on
    /// in the air, and its motor may be live. A drone carries its vehicle up before it is armed.
    fn inhibit_if_moving(&mut self) {
        let Mode { phase, interlocks, .. } = *self.table.mode();
        let waits = matches!(phase, Phase::Safe | Phase::PadIdle) && self.release.is_none();
        let on_ground = self.start_point() != StartPoint::Drone;
        if waits && on_ground && !interlocks.abort_latched && self.pad.moves() {
            let words = "switched on while it moves: it cannot be armed, DO NOT APPROACH";
            self.table.report(Severity::Critical, words);
            let abort = self.abort_event();
            let _ = self.table.apply(abort);
        }
    }

    /// Returns whether no fin covers the parachute hatch: all fins are open, or have had time to
    /// open since they were commanded. A stuck fin does not hold back the parachute.
    fn hatch_is_free(&self, input: &SensedInput) -> bool {
        let airframe = &self.pilot.mission().airframe;
        let fins = &airframe.fins;
        let opening_s = fins.servo.delay_s + (fins.open_rad() - fins.closed_rad()) / fins.servo.rate_rad_s();
        let stand_open = input.fins_rad.iter().all(|fin_rad| libm::sin(*fin_rad) >= HATCH_FREE_SINE);
        airframe.servos_report && stand_open
            || self.table.time_s - self.table.mode().entered_at_s >= opening_s
    }

    /// Reports changes in the input: the pin, and a log that has stopped.
    fn report_changes(&mut self, input: &SensedInput) {
        let pin_out = self.table.mode().interlocks.pin_out;
        if input.pin_out != pin_out {
            // Refused in the air, where the pin is out of reach.
            let _ = self.table.apply(if input.pin_out { Event::PinPulled } else { Event::PinInserted });
        }
        if self.input.log.running && !input.log.running {
            let words = "the log has stopped: this flight is no longer recorded whole";
            self.table.report(Severity::Error, words);
        }
    }

    /// Sets the fin and gimbal commands from the pilot; reports an inhibited ignition and a changed
    /// control level.
    fn take_over(&mut self, pointed: Pointed) {
        let Pointed { gimbal_rad, fins_rad, level } = pointed;
        let phase = self.table.mode().phase;
        let refusal = self.pilot.gate_refusal().filter(|_| phase == Phase::LandArmed);
        if let Some(check) = refusal.filter(|_| refusal != self.reported_gate_check) {
            self.table.report(Severity::Critical, text!("ignition gate closed: {check}"));
        }
        self.reported_gate_check = refusal;
        self.commands = Commands { gimbal_rad, fins_rad, ..self.commands };
        // A new plan, converged or nearly, is the normal case: it is reported only after a missed
        // one.
        let misses = |level| matches!(level, ControlLevel::ShiftedPlan | ControlLevel::Stabiliser);
        if phase.in_landing_burn() && level != self.level && (misses(level) || misses(self.level)) {
            self.table.report(Severity::Notice, text!("controller level {}", level.name()));
        }
        self.level = level;
    }

    /// Applies changes that depend on time alone: the end of a hold, a cooled motor, safing.
    fn apply_timeouts(&mut self) {
        let (mode, time_s) = (*self.table.mode(), self.table.time_s);
        if mode.held(time_s).is_some_and(|(_, left_s)| left_s <= 0.0) {
            let words = text!("held for {HOLD_LIMIT_S} s without a new start");
            self.table.report(Severity::Warning, words);
            let _ = self.table.apply(Event::HoldElapsed);
        }
        if mode.phase == Phase::Touchdown && self.is_over() {
            if mode.interlocks.armed {
                let _ = self.table.apply(Event::DisarmRequested { lifted_off: true });
            }
            if mode.may_be_safed(time_s).is_ok() {
                let _ = self.table.apply(Event::SafingDone);
            }
        }
        if let Some((severity, words)) = self.motor_watch.update(&mode, time_s) {
            self.table.report(severity, words);
        }
    }

    /// Crew state: the pending proposal, the dead-man confirmations, and the operator who held.
    pub fn crew(&self) -> &CrewMemory {
        &self.crew
    }

    /// Number of the last frame.
    pub fn frame(&self) -> u64 {
        self.input.frame
    }

    /// The input of the last frame.
    pub fn input(&self) -> &SensedInput {
        &self.input
    }

    /// Phase, latches, countdown and motor.
    pub fn mode(&self) -> &Mode {
        self.table.mode()
    }

    /// Why the landing motor is permanently inhibited; the first cause if there are several.
    pub fn latch(&self) -> Option<Latch> {
        self.table.latch()
    }

    /// Time before the release after which no hold can stop the countdown, s; `None` if a hold can
    /// still stop it at the release.
    pub fn last_hold_s(&self) -> Option<f64> {
        self.start_point().last_hold_s()
    }

    /// Whether the flight is over: the vehicle is at rest on the ground, or was aborted on the pad.
    /// Safing depends on the motor and may follow much later, or never.
    pub fn is_over(&self) -> bool {
        let mode = self.table.mode();
        let in_phase_s = self.table.time_s - mode.entered_at_s;
        match mode.phase {
            Phase::Touchdown => in_phase_s >= AT_REST_S && mode.motor != Motor::Burning,
            Phase::Safed => true,
            // A motor whose igniter has carried current may still ignite.
            phase => {
                let stays = self.release.is_none() || in_phase_s >= AT_REST_S;
                phase.on_pad() && mode.interlocks.abort_latched && stays
            }
        }
    }

    /// Health of each sensor.
    pub fn sensors(&self) -> &SensorWatch {
        &self.sensors
    }

    /// Flight control after the release.
    pub fn pilot(&self) -> &Pilot {
        &self.pilot
    }

    /// The input of the last frame in the air, its frame and time counted from the release.
    pub fn flown(&self) -> Option<SensedInput> {
        let release = self.release?;
        (self.input.frame > release.frame).then(|| self.input.since(release.frame))
    }

    /// The control level that set the attitude command in the last frame.
    pub fn level(&self) -> ControlLevel {
        self.level
    }

    /// Vehicle time of the release, s.
    pub fn released_at_s(&self) -> Option<f64> {
        self.release.map(|release| release.time_s)
    }

    /// The last commands to the actuators.
    pub fn commands(&self) -> &Commands {
        &self.commands
    }

    /// Result of the rehearsal, once it is complete.
    pub fn rehearsed(&self) -> Option<&Rehearsed> {
        self.rehearsed.as_ref()
    }

    pub fn countdown_s(&self) -> f64 {
        self.countdown_s
    }
}

/// Time since the release at the end of a frame, s: T+ on screens and in logs. A flight from a pad
/// is released at ignition of the ascent motor; a flight from apogee or below a drone, when it
/// begins to fall.
pub fn flight_time_s(frame: u64) -> f64 {
    // Saturating, because a recorded frame may have any number.
    frame.saturating_mul(u64::from(FRAME_MS)) as f64 * 1e-3
}

// The input of one frame: everything a frame depends on besides the computer's memory.

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LogState {
    /// The log is being written, or the operator has chosen to fly without one.
    pub running: bool,
    /// Free space for the log, bytes.
    pub space_bytes: u64,
}

/// Result of a rehearsed landing, [planned](Computer::rehearse) or flown in a simulated world.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rehearsed {
    /// The planner found plans, and the vehicle landed on its legs.
    pub warm: bool,
    /// The result as text.
    pub found: Text,
    /// The rehearsed touchdown; `None` if the vehicle did not reach the ground.
    pub landing: Option<PredictedLanding>,
}

impl Rehearsed {
    /// Replaces the result by an explanation if the vehicle did not land and its weight does not
    /// match its motor.
    #[must_use]
    pub fn explained(self, mission: &Mission) -> Self {
        let misfit = if self.warm { None } else { EvenLanding::of(mission).misfit() };
        Self { found: misfit.map_or(self.found, |words| text!("{words}")), ..self }
    }
}

/// The station that armed the vehicle, and the age of its last heartbeat, s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Commander {
    pub station: Station,
    pub age_s: f64,
    /// Operator whose key signed the arming.
    pub by: Option<Operator>,
    /// Its heartbeat reports that it receives nothing from the vehicle.
    pub deaf: bool,
}

/// Everything that a frame depends on besides the computer's memory.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Input<'a> {
    pub sensed: SensedInput,
    /// Requests since the last frame, in order.
    pub requests: &'a [Request],
    /// Result of the rehearsal, once it is over.
    pub rehearsed: Option<&'a Rehearsed>,
    /// The requested plan is computed: this frame takes it over.
    pub plan_ready: bool,
}

impl Deref for Input<'_> {
    type Target = SensedInput;

    fn deref(&self) -> &SensedInput {
        &self.sensed
    }
}

/// The part of a frame's input that is stored until the next frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SensedInput {
    /// Number of the frame since power-up.
    pub frame: u64,
    /// Vehicle time at its end, s.
    pub time_s: f64,
    pub measured: Measurements,
    /// Measured gimbal angles (pitch, yaw), rad.
    pub gimbal_rad: [f64; 2],
    /// Measured fin openings, rad.
    pub fins_rad: [f64; 4],
    /// A foot contacts the ground.
    pub contact: bool,
    pub igniter_continuity: bool,
    /// The wire between booster and vehicle is intact.
    pub booster_attached: bool,
    pub pin_out: bool,
    /// Voltage of the flight computer's pack, V; `None` if it is not measured.
    pub battery_v: Option<f64>,
    /// Voltage of the pack of servos and igniters, V; `None` if it is not measured, or the same.
    pub servo_battery_v: Option<f64>,
    pub log: LogState,
    /// The uplink of the station with the newest heartbeat.
    pub uplink: Uplink,
    /// The station that armed the vehicle, if one did.
    pub commander: Option<Commander>,
    /// Number of people who must agree to arm and start; `None` without operators.
    pub people: Option<People>,
}

impl SensedInput {
    /// The same input with frame and time counted from a release.
    #[must_use]
    pub fn since(&self, release_frame: u64) -> Self {
        let frame = self.frame.saturating_sub(release_frame);
        Self { frame, time_s: flight_time_s(frame), ..*self }
    }
}

// The output of one frame of the flight computer.

/// Commands to the actuators.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Commands {
    /// Gimbal angles (pitch, yaw), rad.
    pub gimbal_rad: [f64; 2],
    /// Opening angles of the fins, rad.
    pub fins_rad: [f64; 4],
    /// Igniters, separation charge and parachute.
    pub outputs: Outputs,
}

/// The output of one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Output {
    pub commands: Commands,
    /// The countdown has ended in this frame: the simulation releases the vehicle at the start of
    /// its flight.
    pub released: bool,
    /// An answer to each request, in order.
    pub answers: Answers,
    /// Messages, in order.
    pub messages: Messages,
    /// A plan of a landing was taken over.
    pub planned: bool,
}
