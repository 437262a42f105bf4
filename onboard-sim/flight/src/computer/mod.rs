//! The flight computer: everything that decides on board, from power-up to safed.
//!
//! [`Computer::step`] is the only way to advance it: one [`Input`] a frame, one [`Output`] back,
//! and the same inputs give the same outputs, bit for bit. Self-test, pin, arming, countdown,
//! release, descent, landing, abort and safing are all decided here, through one [phase
//! table](crate::rules::phase).
//!
//! * [`table`]: the phase table as the computer uses it: each event goes through it once; what an
//!   abort would do now.
//! * [`crew`]: the crew's requests, and the decision about each.
//! * [`findings`]: what went wrong in a flight.
//! * [`news`]: the computer's messages to the crew.
//! * [`pad_check`]: the check that the crew asks for on the pad.
//! * [`pad`]: from power-up to the release.
//! * [`pilot`]: flies the rocket from its release.
//! * [`saved`]: power-up; what is kept through a reset, and going on from it.
//! * `digest`: one number for the whole memory, to compare a replay with a log.

pub mod crew;
mod digest;
pub mod findings;
pub mod news;
pub mod pad;
pub mod pad_check;
pub mod pilot;
pub mod saved;
pub mod table;

use alloc::borrow::ToOwned as _;
use alloc::boxed::Box;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;
use core::ops::Deref;

use serde::{Deserialize, Serialize};

pub use self::crew::CrewMemory;
use self::crew::{Answer, People, Request};
use self::news::{CrewMessage, MotorWatch, Readiness, Severity};
use self::pad::{ANSWERING_RAD, PadWatch, SelfTest};
use self::pad_check::{PadCheck, SURFACES, surfaces_rad};
use self::pilot::{Pilot, Pointed};
pub use self::table::AbortEffect;
use self::table::PhaseTable;
use crate::control::servo::ServoModel;
use crate::estimation::estimator::{ImuSample, Measurements};
use crate::estimation::sensor_watch::SensorWatch;
use crate::estimation::spikes::SpikeFilter;
use crate::guidance::powered::ControlLevel;
use crate::guidance::vertical::EvenLanding;
use crate::rules::arming::{PredictedLanding, Uplink};
use crate::rules::operator::Operator;
use crate::rules::outputs::{FlightProgress, Outputs};
use crate::rules::phase::{Event, HOLD_LIMIT_S, Latch, Mode, Motor, Phase};
use crate::rules::two_person::Station;
use crate::vehicle::mission::{ArmingLimits, Mission};
use crate::vehicle::rigid::RigidState;

/// Frame length, ms.
pub const FRAME_MS: u32 = 5;
/// Frame length, s.
pub const FRAME_S: f64 = FRAME_MS as f64 * 1e-3;
/// Time on the ground after which the flight is over, s.
const AT_REST_S: f64 = 1.0;

/// From this sine of its opening on a fin is out of the way of what leaves the hatch: mk3's end
/// then stands 8 cm off the skin.
const HATCH_FREE_SINE: f64 = 0.7;

/// When the vehicle was released.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Release {
    frame: u64,
    time_s: f64,
}

/// The flight computer and everything that it remembers.
#[derive(Debug, Clone, Serialize)]
pub struct Computer {
    table: PhaseTable,
    pressure: SpikeFilter,
    /// Which sensors speak.
    sensors: SensorWatch,
    /// The wait on the pad.
    pad: PadWatch,
    /// Flies from the release on.
    pilot: Box<Pilot>,
    /// The state at power-up, to power up again.
    #[serde(skip)]
    believed: RigidState,
    /// What is kept of the last frame's input. What of it decides later is in the next one, too.
    #[serde(skip)]
    input: KeptInput,
    /// The gate check that the crew was last told of.
    gate_told: Option<&'static str>,
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
    /// What the fins' feedback said of the closed fins before the self-test moved them, less the
    /// angle of closed fins, rad.
    fins_zero_rad: [f64; 4],
    pad_check: PadCheck,
    /// The servos of a vehicle that tell nothing, from the first frame on.
    silent: Option<[ServoModel; SURFACES]>,
    release: Option<Release>,
    level: ControlLevel,
}

impl Computer {
    /// One frame. In the air: take over a plan that is ready, estimate, answer the crew, decide,
    /// pose the next plan, point. On the pad: answer the crew, and wait. At the end, and nowhere
    /// else, the outputs follow from the mode that the frame ends in.
    pub fn step(&mut self, input: &Input<'_>) -> Output {
        let mut input = self.with_silent_servos(input);
        let measured = &mut input.kept.measured;
        measured.pressure_altitude_m = self.pressure.take(measured.pressure_altitude_m, input.kept.time_s);
        let input = &input;
        self.table.begin(input.time_s);
        self.report_changes(input);
        self.input = input.kept;
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
                self.ask_the_checks_again();
            }
        }
        let flown = self.flown();
        let planned =
            flown.filter(|_| input.plan_ready).is_some_and(|flown| self.pilot.take_over(flown.time_s));
        if let Some(flown) = &flown {
            self.pilot.estimate_state(self.table.mode().phase, flown, &self.sensors);
            self.pilot.predict(&mut self.table, flown);
        }
        let answers = input.requests.iter().map(|request| self.answer(request)).collect();
        self.watch_the_commander(input);
        self.watch_the_taps();
        if let Some(flown) = &flown {
            self.pilot.decide(&mut self.table, flown, &self.sensors);
            self.pilot.plan(self.table.mode(), flown, input.plan_ready);
            let pointed = self.pilot.point(self.table.mode(), flown);
            self.take_over(pointed);
        } else {
            self.wait_on_the_pad(input);
        }
        self.keep_time();
        let progress = FlightProgress {
            flying: flown.is_some(),
            lifted_off: self.pilot.ascent.has_lifted_off(),
            separation_due: self.pilot.ascent.separates(),
            hatch_free: self.hatch_is_free(input),
        };
        self.commands.outputs = Outputs::decided(self.table.mode(), progress);
        Output {
            commands: self.commands,
            released: flown.is_none() && self.release.is_some(),
            answers,
            news: self.table.take_news(),
            planned,
        }
    }

    /// The input with the positions that servos should have which tell none.
    fn with_silent_servos<'a>(&mut self, input: &Input<'a>) -> Input<'a> {
        let airframe = &self.pilot.mission().airframe;
        if airframe.servos_tell {
            return *input;
        }
        let told_rad = surfaces_rad(self.commands.gimbal_rad, self.commands.fins_rad);
        let servos = self.silent.get_or_insert_with(|| ServoModel::of_each(airframe, told_rad));
        for (servo, command_rad) in servos.iter_mut().zip(told_rad) {
            servo.take(command_rad);
            servo.advance();
        }
        let [pitch, yaw, one, two, three, four] = servos.each_ref().map(|servo| servo.at_rad);
        let kept = KeptInput { gimbal_rad: [pitch, yaw], fins_rad: [one, two, three, four], ..input.kept };
        Input { kept, ..*input }
    }

    /// Whether no fin is over the parachute's hatch: they stand open, or have had the time of their
    /// servos since they were told to. One that is stuck keeps no parachute in.
    fn hatch_is_free(&self, input: &KeptInput) -> bool {
        let airframe = &self.pilot.mission().airframe;
        let fins = &airframe.fins;
        let opening_s = fins.servo.delay_s + (fins.open_rad() - fins.closed_rad()) / fins.servo.rate_rad_s();
        let stand_open = input.fins_rad.iter().all(|fin_rad| libm::sin(*fin_rad) >= HATCH_FREE_SINE);
        airframe.servos_tell && stand_open
            || self.table.time_s() - self.table.mode().entered_at_s >= opening_s
    }

    /// Reports what the input changes: the pin, and a log that has stopped.
    fn report_changes(&mut self, input: &KeptInput) {
        let pin_out = self.table.mode().interlocks.pin_out;
        if input.pin_out != pin_out {
            // Refused in the air, where nobody can move it.
            let _ = self.table.happen(if input.pin_out { Event::PinPulled } else { Event::PinInserted });
        }
        if self.input.log.running && !input.log.running {
            let words = "the log has stopped: this flight is no longer recorded whole";
            self.table.say(Severity::Error, words.into());
        }
    }

    /// Commands fins and gimbal as the pilot points them, and reports a shut gate and another
    /// control level.
    fn take_over(&mut self, pointed: Pointed) {
        let Pointed { gimbal_rad, fins_rad, level } = pointed;
        let phase = self.table.mode().phase;
        let refusal = self.pilot.gate_refusal().filter(|_| phase == Phase::LandArmed);
        if let Some(check) = refusal.filter(|_| refusal != self.gate_told) {
            self.table.say(Severity::Critical, format!("ignition gate closed: {check}"));
        }
        self.gate_told = refusal;
        self.commands = Commands { gimbal_rad, fins_rad, ..self.commands };
        // A new plan, converged or nearly, is what is expected: it is told after one that was
        // missed.
        let misses = |level| matches!(level, ControlLevel::ShiftedPlan | ControlLevel::Stabiliser);
        if phase.in_landing_burn() && level != self.level && (misses(level) || misses(self.level)) {
            self.table.say(Severity::Notice, format!("controller level {}", level.name()));
        }
        self.level = level;
    }

    /// Changes that come with time alone, in every frame: a hold ends, a motor cools, the vehicle
    /// is SAFED.
    fn keep_time(&mut self) {
        let (mode, time_s) = (*self.table.mode(), self.table.time_s());
        if mode.held(time_s).is_some_and(|(_, left_s)| left_s <= 0.0) {
            let words = format!("held for {HOLD_LIMIT_S} s without a new start");
            self.table.say(Severity::Warning, words);
            let _ = self.table.happen(Event::HoldElapsed);
        }
        if mode.phase == Phase::Touchdown && self.is_over() {
            if mode.interlocks.armed {
                let _ = self.table.happen(Event::DisarmRequested { lifted_off: true });
            }
            if mode.may_be_safed(time_s).is_ok() {
                let _ = self.table.happen(Event::SafingDone);
            }
        }
        if let Some((severity, words)) = self.motor_watch.news(&mode, time_s) {
            self.table.say(severity, words);
        }
    }

    /// What it remembers of its crew: an ask that waits, the taps, who held.
    pub fn crew(&self) -> &CrewMemory {
        &self.crew
    }

    /// Number of the last frame.
    pub fn frame(&self) -> u64 {
        self.input.frame
    }

    /// The input of the last frame.
    pub fn input(&self) -> &KeptInput {
        &self.input
    }

    /// Phase, latches, countdown and motor.
    pub fn mode(&self) -> &Mode {
        self.table.mode()
    }

    /// Why the landing motor is inhibited for good, by what came first.
    pub fn latch(&self) -> Option<Latch> {
        self.table.latch()
    }

    /// Time before the release from which on nothing holds the countdown, s; `None` if a hold comes
    /// in time until then.
    pub fn last_hold_s(&self) -> Option<f64> {
        self.start_point().last_hold_s()
    }

    /// Whether the flight is over: the vehicle lies on the ground, or was aborted on the pad. SAFED
    /// depends on the motor: it may come much later, or never.
    pub fn is_over(&self) -> bool {
        let mode = self.table.mode();
        let in_phase_s = self.table.time_s() - mode.entered_at_s;
        match mode.phase {
            Phase::Touchdown => in_phase_s >= AT_REST_S && mode.motor != Motor::Burning,
            Phase::Safed => true,
            // A motor whose igniter had current may still light.
            phase => {
                let stays = self.release.is_none() || in_phase_s >= AT_REST_S;
                phase.on_pad() && mode.interlocks.abort_latched && stays
            }
        }
    }

    /// Which sensors speak, and what is wrong with them.
    pub fn sensors(&self) -> &SensorWatch {
        &self.sensors
    }

    /// Flies the rocket from its release on.
    pub fn pilot(&self) -> &Pilot {
        &self.pilot
    }

    /// The input of the last frame in the air, its frame and time counted from the release.
    pub fn flown(&self) -> Option<KeptInput> {
        let release = self.release?;
        (self.input.frame > release.frame).then(|| self.input.since(release.frame))
    }

    /// What decided where the nose points in the last frame.
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

    /// Result of the rehearsal, once it is over.
    pub fn rehearsed(&self) -> Option<&Rehearsed> {
        self.rehearsed.as_ref()
    }

    pub fn countdown_s(&self) -> f64 {
        self.countdown_s
    }
}

/// Time since its release at the end of a frame, s: what crews and logs call T+. A flight from a
/// pad is released when its ascent motor is lit; a flight from apogee or below a drone, when it
/// begins to fall.
pub fn flight_time_s(frame: u64) -> f64 {
    // Saturating, because a recorded frame may have any number.
    frame.saturating_mul(u64::from(FRAME_MS)) as f64 * 1e-3
}

// The input of one frame of the flight computer: everything it depends on besides its memory.

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LogState {
    /// The log is being written, or the operator chose to fly without one.
    pub running: bool,
    /// Free space for it, bytes.
    pub space_bytes: u64,
}

impl LogState {
    /// No log yet.
    pub const NONE: Self = Self { running: false, space_bytes: 0 };
}

/// Result of a rehearsal of the landing: of a [planned](Computer::rehearse) one, or of one in a
/// simulated world.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rehearsed {
    /// It found plans, and landed on its legs.
    pub warm: bool,
    /// The result in words.
    pub found: String,
    /// Its touchdown; `None` if it did not come down.
    pub landing: Option<PredictedLanding>,
}

impl Rehearsed {
    /// It did not land, and motor and weight do not go together: it says that instead.
    #[must_use]
    pub fn explained(self, mission: &Mission) -> Self {
        let misfit = if self.warm { None } else { EvenLanding::of(mission).misfit() };
        Self { found: misfit.map_or(self.found, str::to_owned), ..self }
    }
}

/// The station that armed the vehicle, and how long ago it was last heard, s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Commander {
    pub station: Station,
    pub age_s: f64,
    /// Whose key it armed with.
    pub by: Option<Operator>,
    /// It says that it hears nothing of the vehicle.
    pub deaf: bool,
}

/// Everything that a frame depends on besides the computer's memory.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Input<'a> {
    pub kept: KeptInput,
    /// Requests since the last frame, in order.
    pub requests: &'a [Request],
    /// Result of the rehearsal, once it is over.
    pub rehearsed: Option<&'a Rehearsed>,
    /// What was posed last is computed: this frame takes it over.
    pub plan_ready: bool,
}

impl Deref for Input<'_> {
    type Target = KeptInput;

    fn deref(&self) -> &KeptInput {
        &self.kept
    }
}

/// What the computer keeps of a frame's input until the next one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KeptInput {
    /// Number of the frame since power-up.
    pub frame: u64,
    /// Vehicle time at its end, s.
    pub time_s: f64,
    pub measured: Measurements,
    /// Where the gimbal is (pitch, yaw), rad.
    pub gimbal_rad: [f64; 2],
    /// Where the fins are, rad.
    pub fins_rad: [f64; 4],
    /// A foot touches the ground.
    pub contact: bool,
    pub igniter_continuity: bool,
    /// The wire between booster and vehicle is whole.
    pub booster_attached: bool,
    pub pin_out: bool,
    /// Voltage of the battery, V; `None` if it is not measured.
    pub battery_v: Option<f64>,
    pub log: LogState,
    /// The uplink of the station that is heard best.
    pub uplink: Uplink,
    /// The station that armed the vehicle, if one did.
    pub commander: Option<Commander>,
    /// How many people an arming and a start take; `None` without operators.
    pub people: Option<People>,
}

impl KeptInput {
    /// Before the first frame: nothing is known, and nothing answers.
    pub const NONE: Self = Self {
        frame: 0,
        time_s: 0.0,
        measured: Measurements::of_imu(ImuSample::NONE),
        gimbal_rad: [0.0; 2],
        fins_rad: [0.0; 4],
        contact: false,
        igniter_continuity: false,
        booster_attached: false,
        pin_out: false,
        battery_v: None,
        log: LogState::NONE,
        uplink: Uplink::NeverHeard,
        commander: None,
        people: None,
    };

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
    /// What lights, parts and ejects.
    pub outputs: Outputs,
}

/// The output of one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Output {
    pub commands: Commands,
    /// The countdown has ended in this frame: the simulation releases the vehicle where its flight
    /// begins.
    pub released: bool,
    /// An answer to each request, in order.
    pub answers: Vec<Answer>,
    /// Reports, in order.
    pub news: Vec<CrewMessage>,
    /// A plan of a landing was taken over.
    pub planned: bool,
}
