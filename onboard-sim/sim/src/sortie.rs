//! One flight of a rocket in space, from power-up until it is at rest: from its rail, from below a
//! drone, or from an apogee that it is put to.
//!
//! A frame is 5 ms: the world moves under the last commands, the sensors measure it, and the flight
//! computer decides. On the pad the same flight is rehearsed with nominal data.

use crate::world::plant::WorldError;
use crate::world::sensors::SensorParamError;
use crate::world::{Battery, World};
use flight::computer::crew::{CrewCommand, Request};
use flight::computer::pilot::Pilot;
use flight::computer::{Commands, Computer, FRAME_S, Input, Output, Rehearsed, SensedInput, flight_time_s};
use flight::estimation::estimator::Measurements;
use flight::estimation::estimator::alignment::ImuCalibration;
use flight::guidance::powered::{ControlLevel, PoweredReport};
use flight::rules::arming::PredictedLanding;
use flight::rules::phase::{Mode, Phase};
use flight::text::text;
use flight::vehicle::mission::{Mission, StartPoint};
use flight::vehicle::rigid::RigidState;
use nalgebra::Vector3;

use crate::dispersion::Dispersion;
use crate::draw::{Draw, draw, rail_upwind_m};
use crate::fault::{Breakage, Injector};
use crate::outcome::{Outcome, by_envelope};
use crate::outside::{Outside, Unwatched, Watch};
use crate::recipe::Recipe;
use crate::surroundings::{Surroundings, falling_as, world_at};

/// A flight that lasts longer is ended, s. A fall from apogee under the parachute takes a minute.
pub(crate) const LONGEST_S: f64 = 150.0;

/// Why a flight cannot be set up.
#[derive(Debug, thiserror::Error)]
pub enum SetUpError {
    /// The drawn truth cannot be simulated.
    #[error(transparent)]
    World(#[from] WorldError),
    /// A sensor parameter is out of its range.
    #[error(transparent)]
    Sensors(#[from] SensorParamError),
}

/// The radio between vehicle and ground, in both directions. Nothing on board waits for it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Radio {
    /// Nothing gets through.
    pub silent: bool,
    /// Messages arrive this much later, s.
    pub delay_s: f64,
}

/// One flight. A clone continues with exactly the same bits.
#[derive(Debug, Clone)]
pub struct Sortie {
    mission: Mission,
    dispersion: Dispersion,
    drawn: Draw,
    computer: Computer,
    rehearsal: Option<Rehearsal>,
    surroundings: Surroundings,
    /// The state in which the fall began.
    fall: Option<RigidState>,
    injector: Injector,
    radio: Radio,
    /// Frames until the dead flight computer starts again.
    frames_down: u64,
    dead: bool,
    /// The frame in which a board has computed the last request.
    plan_ready_at: Option<u64>,
    /// How many times as long as a Cortex-M7 it takes for that.
    slower: u64,
    /// Frames since power-up.
    frame: u64,
    abort: bool,
    largest_errors: EstimatorErrors,
    /// The last decision of the computer that this flight [follows](Self::follow).
    followed: Option<Decision>,
}

/// The flight computer's decisions that its world needs.
#[derive(Debug, Clone, Copy)]
struct Decision {
    mode: Mode,
    released: bool,
    ignited: bool,
}

impl Decision {
    fn of(computer: &Computer) -> Self {
        Self {
            mode: *computer.mode(),
            released: computer.released_at_s().is_some(),
            ignited: computer.pilot().ignited_at_s().is_some(),
        }
    }
}

impl Sortie {
    /// Flight `number` of a recipe, started at once.
    ///
    /// # Errors
    /// It cannot be set up.
    pub fn new(recipe: &Recipe, number: u64) -> Result<Self, SetUpError> {
        let (mission, drawn) = prepared(recipe, number);
        let injector = Injector::new(&recipe.faults, recipe.seed, number);
        Ok(Self { injector, ..Self::of(&mission, &recipe.dispersion, &drawn)?.released() })
    }

    /// A flight without faults with the given draw, started at once.
    ///
    /// # Errors
    /// The mission or the draw cannot be flown.
    pub fn drawn_as(mission: &Mission, dispersion: &Dispersion, drawn: &Draw) -> Result<Self, SetUpError> {
        Ok(Self::of(mission, dispersion, drawn)?.released())
    }

    /// Flight `number` of a recipe at power-up: upright on its pad, on its rail, or below its
    /// drone.
    ///
    /// # Errors
    /// It cannot be set up.
    pub fn on_the_pad(recipe: &Recipe, number: u64) -> Result<Self, SetUpError> {
        let (mission, drawn) = prepared(recipe, number);
        let airframe = &mission.airframe;
        let cg_station_m = airframe.mass.loaded_cg_station_m + drawn.truth.cg_offset_m[0];
        let standing = RigidState::upright(airframe.above_feet_m(cg_station_m));
        let started = Self::of(&mission, &recipe.dispersion, &drawn)?;
        let world = match (mission.start.at, drawn.hanging) {
            (StartPoint::Pad, _) => started.surroundings.world.clone(),
            (StartPoint::Drone, Some(hanging)) => started.surroundings.world.clone().hanging(hanging),
            _ => world_at(&mission, &drawn, &standing)?,
        };
        let mut surroundings = started.surroundings.clone();
        surroundings.world = world;
        Ok(Self {
            surroundings,
            rehearsal: Some(Rehearsal::new(recipe)?),
            injector: Injector::new(&recipe.faults, recipe.seed, number),
            ..started
        })
    }

    /// The same flight without the rehearsal on the pad, for a vehicle that will not be armed.
    #[must_use]
    pub fn without_rehearsal(self) -> Self {
        Self { rehearsal: None, ..self }
    }

    /// The same flight on a board that takes this many times as long for plans as a Cortex-M7.
    #[must_use]
    pub fn planning_slower(self, times: u64) -> Self {
        Self { slower: times, ..self }
    }

    /// The same flight of a vehicle that was aborted on its pad in an earlier power-up, at this
    /// vehicle time, s: at most zero.
    #[must_use]
    pub fn aborted_before(self, at_s: f64) -> Self {
        Self { computer: self.computer.aborted_before(at_s), ..self }
    }

    /// A flight in a world at its start, with a computer at power-up.
    fn of(mission: &Mission, dispersion: &Dispersion, drawn: &Draw) -> Result<Self, SetUpError> {
        let drawn = falling_as(mission, drawn)?;
        let (surroundings, estimate) = Surroundings::at_start(mission, dispersion, &drawn)?;
        Ok(Self {
            computer: Computer::at_power_up(mission, &estimate),
            rehearsal: None,
            surroundings,
            fall: None,
            injector: Injector::default(),
            radio: Radio::default(),
            frames_down: 0,
            dead: false,
            plan_ready_at: None,
            slower: 1,
            frame: 0,
            abort: false,
            largest_errors: EstimatorErrors::default(),
            followed: None,
            mission: mission.clone(),
            dispersion: dispersion.clone(),
            drawn,
        })
    }

    fn released(self) -> Self {
        Self { computer: self.computer.released(0), ..self }
    }

    /// Begins the flight: on its rail, or in the air, where the way there is not simulated.
    fn begin(&mut self) {
        // A self-ignited motor is under way already: only the clock restarts.
        if self.surroundings.world.booster_thrust_n() > 0.0 {
            return self.surroundings.count_from(flight_time_s(self.frame));
        }
        self.surroundings.begin(&self.mission, &self.dispersion, &self.drawn);
    }

    /// Flies one frame without a crew.
    pub fn step(&mut self) -> Option<Output> {
        self.step_with(&Outside::NOBODY, &mut Unwatched)
    }

    /// Flies one frame.
    pub fn step_with(&mut self, outside: &Outside<'_>, watch: &mut dyn Watch) -> Option<Output> {
        let waits = self.computer.released_at_s().is_none() && self.computer.mode().phase != Phase::Safe;
        if let Some(rehearsal) = self.rehearsal.as_mut().filter(|_| waits) {
            rehearsal.step();
        }
        let from_sensors = self.sense()?;
        let mut requests = outside.requests.to_vec();
        if core::mem::take(&mut self.abort) {
            requests.push(Request::of_the_programme(CrewCommand::Abort));
        }
        let sensed = SensedInput {
            pin_out: outside.pin_out,
            log: outside.log,
            uplink: outside.uplink,
            commander: outside.commander,
            people: outside.people,
            ..from_sensors
        };
        let input = Input {
            sensed,
            requests: &requests,
            rehearsed: self.rehearsal.as_ref().and_then(Rehearsal::over).map(|(rehearsed, _)| rehearsed),
            plan_ready: self.plan_ready_at.take_if(|at| self.frame >= *at).is_some(),
        };
        let mut output = self.computer.step(&input);
        if let Some(frames) = self.computer.solve_requested() {
            self.plan_ready_at = Some(self.frame + self.slower * frames);
        }
        watch.decided(&input, &output, &self.computer);
        // An abort from `abort` has no station that waits for its answer.
        output.answers.truncate(outside.requests.len());
        self.command(&output.commands);
        if output.released {
            self.begin();
        }
        Some(output)
    }

    /// Flies the frame of this number since the release, which another computer has just flown: its
    /// commands move the world. Returns the sensed input, or `None` where one computer was down and
    /// the other was not.
    pub fn follow(&mut self, frame: u64, computer: &Computer) -> Option<SensedInput> {
        while self.frame + 1 < frame {
            if self.sense().is_some() {
                return None;
            }
        }
        let from_sensors = self.sense()?;
        self.followed = Some(Decision::of(computer));
        self.surroundings.command(computer.commands());
        Some(from_sensors)
    }

    /// The computer's decisions, or those that this flight follows.
    fn decision(&self) -> Decision {
        self.followed.unwrap_or_else(|| Decision::of(&self.computer))
    }

    /// Advances the world by one frame. Returns the computer's sensor input without its crew's;
    /// `None` if the computer is down, or if there is no sample: then there is no frame, and the
    /// last commands persist.
    fn sense(&mut self) -> Option<SensedInput> {
        let Decision { mode, released, .. } = self.decision();
        for breakage in self.injector.due(self.surroundings.world.time_s(), mode.phase) {
            self.break_down(&breakage);
        }
        self.let_go_when_cleared(&mode);
        let measured = self.surroundings.sample_sensors();
        self.frame += 1;
        self.dead = self.frames_down > 0;
        if self.dead {
            self.frames_down -= 1;
            if self.frames_down == 0 {
                self.computer.restart(flight_time_s(self.frame));
                self.plan_ready_at = None;
            }
            return None;
        }
        let measured = measured?;
        Some(SensedInput {
            frame: self.frame,
            time_s: flight_time_s(self.frame),
            measured,
            ..self.surroundings.feedback(released)
        })
    }

    fn command(&mut self, commands: &Commands) {
        self.surroundings.command(commands);
        let falls = !self.computer.mode().phase.before_apogee();
        if falls && self.fall.is_none() {
            self.fall = Some(*self.world().state());
        }
        if falls && self.world().touchdown().is_none() && self.world().height_m() < 10.0 {
            self.largest_errors = self.largest_errors.or_larger(&self.errors());
        }
    }

    /// A drone's pilot lets go some time after the countdown has ended.
    fn let_go_when_cleared(&mut self, mode: &Mode) {
        let after_s = self.mission.drop.map_or(0.0, |drop| drop.release_after_s);
        if self.world().hangs()
            && mode.countdown_end_s.is_some_and(|ended_s| flight_time_s(self.frame) > ended_s + after_s)
        {
            self.surroundings.world.release();
        }
    }

    /// The state in which the fall began: that of the flight if it has, else as drawn.
    pub fn fell_from(&self) -> &RigidState {
        self.fall.as_ref().unwrap_or(&self.drawn.apogee)
    }

    /// Whether the flight continues: the vehicle is not at rest and the time limit has not passed.
    pub fn goes_on(&self) -> bool {
        let Decision { mode, released, .. } = self.decision();
        let stays = released && mode.phase.on_pad() && !self.world().leaves_pad();
        self.surroundings.go_on() && !stays
    }

    /// Flies to the end.
    pub fn run(&mut self) -> Outcome {
        loop {
            self.step();
            if !self.goes_on() {
                return self.outcome();
            }
        }
    }

    /// Asks for an abort in the next frame.
    pub fn abort(&mut self) {
        self.abort = true;
    }

    /// Stops the flight computer, which restarts after a time, s. The servos hold their last
    /// command meanwhile.
    pub fn reboot(&mut self, down_s: f64) {
        self.frames_down = libm::ceil(down_s / FRAME_S).max(1.0) as u64;
    }

    /// Changes the mission from now on, for the flight computer and for the verdict. The world does
    /// not change.
    pub fn reconfigure(&mut self, mission: &Mission) {
        self.computer.reconfigure(mission);
        self.mission = mission.clone();
    }

    /// The flight computer.
    pub fn computer(&self) -> &Computer {
        &self.computer
    }

    /// The pilot in the flight computer.
    pub fn pilot(&self) -> &Pilot {
        self.computer.pilot()
    }

    /// Phase, latches and countdown.
    pub fn mode(&self) -> Mode {
        self.decision().mode
    }

    /// Whether the flight computer is down: it neither receives nor sends.
    pub fn computer_is_dead(&self) -> bool {
        self.dead
    }

    /// The truth.
    pub fn world(&self) -> &World {
        &self.surroundings.world
    }

    /// The battery.
    pub fn battery(&self) -> &Battery {
        &self.surroundings.battery
    }

    /// Exchanges the battery for one with this charge, 0 to 1.
    pub fn set_battery(&mut self, charge: f64) {
        self.surroundings.battery = Battery::new(charge, crate::surroundings::surfaces_rad(self.world()));
    }

    /// The truth, for a caller that replaces it.
    pub fn world_mut(&mut self) -> &mut World {
        &mut self.surroundings.world
    }

    /// The sensor samples of the last frame; `None` before the first.
    pub fn measured(&self) -> Option<&Measurements> {
        self.surroundings.measured()
    }

    /// The drawn differences.
    pub fn drawn(&self) -> &Draw {
        &self.drawn
    }

    /// How many faults have happened.
    pub fn faults_happened(&self) -> u64 {
        self.injector.happened()
    }

    /// The radio. In a campaign there is no station; in a live flight the ground listens.
    pub fn radio(&self) -> &Radio {
        &self.radio
    }

    /// The same flight of a computer that has found its state and the calibration of its inertial
    /// unit on its rail.
    #[must_use]
    pub fn standing(self, estimate: &RigidState, calibration: &ImuCalibration) -> Self {
        Self { computer: self.computer.standing(estimate, calibration), ..self }
    }

    /// The mission as flown.
    pub fn mission(&self) -> &Mission {
        &self.mission
    }

    /// Frames since power-up.
    pub fn frame(&self) -> u64 {
        self.frame
    }

    /// The result of the rehearsal on the pad and its last plan, once it is over.
    pub fn rehearsed(&self) -> Option<&(Rehearsed, PoweredReport)> {
        self.rehearsal.as_ref()?.over()
    }

    /// The largest errors of the estimate in the last ten metres.
    pub fn largest_errors(&self) -> &EstimatorErrors {
        &self.largest_errors
    }

    /// The outcome so far.
    pub fn outcome(&self) -> Outcome {
        let Decision { mode, ignited, .. } = self.decision();
        self.surroundings.outcome(&self.mission, mode.phase, ignited)
    }
}

/// The mission and the draw.
pub(crate) fn prepared(recipe: &Recipe, number: u64) -> (Mission, Draw) {
    let mut mission = recipe.mission.clone();
    let drawn = draw(&mission, &recipe.dispersion, recipe.seed, number);
    if mission.start.at == StartPoint::Pad
        && let Some(rail) = mission.launch.as_mut().map(|launch| &mut launch.rail)
        && rail.upwind_s != 0.0
        && rail.foot_m() == Vector3::zeros()
    {
        [rail.x_m, rail.y_m] =
            rail_upwind_m(rail.upwind_s, &recipe.dispersion, &drawn.truth, recipe.seed, number);
    }
    (mission, drawn)
}

// Applies a fault to a flight.

impl Sortie {
    /// Something breaks now.
    pub fn break_down(&mut self, breakage: &Breakage) {
        match *breakage {
            Breakage::Vehicle(fault) => self.surroundings.break_down(fault),
            Breakage::Sensor(sensor, defect) => self.surroundings.break_sensor(sensor, defect),
            Breakage::LinkLoss => self.radio.silent = true,
            Breakage::LinkDelay(delay_s) => self.radio.delay_s = delay_s,
            Breakage::Reboot(down_s) => self.reboot(down_s),
            Breakage::Abort => self.abort(),
        }
    }
}

// The estimate against the truth.

/// Errors of the estimate against the truth.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct EstimatorErrors {
    /// Vertical velocity, m/s.
    pub vertical_m_s: f64,
    /// Horizontal velocity, m/s.
    pub lateral_m_s: f64,
    pub height_m: f64,
    /// Angle between the estimated and the true nose, rad.
    pub nose_rad: f64,
}

impl EstimatorErrors {
    /// The larger value of each error.
    fn or_larger(self, other: &Self) -> Self {
        Self {
            vertical_m_s: self.vertical_m_s.max(other.vertical_m_s),
            lateral_m_s: self.lateral_m_s.max(other.lateral_m_s),
            height_m: self.height_m.max(other.height_m),
            nose_rad: self.nose_rad.max(other.nose_rad),
        }
    }
}

impl Sortie {
    /// Normalised estimation error squared of the motion ([`Estimator::nees_of_motion`]); `None`
    /// while its computer is dead.
    ///
    /// [`Estimator::nees_of_motion`]: flight::estimation::estimator::Estimator::nees_of_motion
    pub fn nees_of_motion(&self) -> Option<f64> {
        self.measured().filter(|_| !self.dead)?;
        self.pilot().estimator().nees_of_motion(&self.over_the_ground())
    }

    /// The true state with its height above the ground below it, as needed for a landing and
    /// measured by the lidar.
    fn over_the_ground(&self) -> RigidState {
        let mut state = *self.world().state();
        state.position_m.z = self.world().truth().over_ground_m(&state.position_m);
        state
    }

    /// Normalised estimation error squared of the motor's impulse scale and burn time
    /// ([`nees_of_scales`][scales]); `None` before the motor has ignited, and for a motor
    /// of another curve than expected. The accelerometer cannot distinguish more impulse from less
    /// mass.
    ///
    /// [scales]: flight::estimation::motor_estimate::MotorEstimate::nees_of_scales
    pub fn nees_of_motor(&self) -> Option<f64> {
        self.measured().filter(|_| !self.dead)?;
        let motor = self.pilot().motor();
        let truth = self.world().truth();
        motor.ignition_s().filter(|_| truth.other_curve == 0.0)?;
        motor.nees_of_scales(truth.impulse_scale / truth.mass_scale, truth.burn_time_scale)
    }

    /// Errors of the estimate at this moment.
    pub fn errors(&self) -> EstimatorErrors {
        let Some(estimate) = self.pilot().estimate() else { return EstimatorErrors::default() };
        let truth = self.over_the_ground();
        let velocity = estimate.state.velocity_m_s - truth.velocity_m_s;
        EstimatorErrors {
            vertical_m_s: velocity.z.abs(),
            lateral_m_s: libm::hypot(velocity.x, velocity.y),
            height_m: (estimate.state.position_m.z - truth.position_m.z).abs(),
            nose_rad: (estimate.state.nose_in_world() - truth.nose_in_world()).norm(),
        }
    }
}

// The rehearsal on the pad: one flight of the mission with its nominal data, faster than real time.
//
// It shows whether the flight computer's solver works, and whether a landing is possible with this
// vehicle, motor and mission. It includes neither the wind on the day nor the scatter of the real
// motor.

/// Frames rehearsed in each frame on the pad: the complete flight takes a second or two.
const FRAMES_AT_ONCE: u32 = 20;

/// A rehearsal, running or finished.
#[derive(Debug, Clone)]
enum Rehearsal {
    Flying {
        flight: Box<Sortie>,
        /// How many plans there were so far, and how many of them converged.
        plans: [u64; 2],
    },
    Over(Box<(Rehearsed, PoweredReport)>),
}

impl Rehearsal {
    fn new(recipe: &Recipe) -> Result<Self, SetUpError> {
        let as_data_stand =
            Recipe { dispersion: Dispersion::default(), faults: Vec::new(), ..recipe.clone() };
        Ok(Self::Flying { flight: Box::new(Sortie::new(&as_data_stand, 0)?), plans: [0; 2] })
    }

    /// Flies some frames of the rehearsal.
    fn step(&mut self) {
        let Self::Flying { flight, plans } = self else { return };
        for _ in 0..FRAMES_AT_ONCE {
            let planned = flight.step().is_some_and(|output| output.planned);
            let powered = flight.computer().mode().phase == Phase::Powered;
            if planned && powered && flight.world().touchdown().is_none() {
                plans[0] += 1;
                plans[1] += u64::from(flight.computer().level() == ControlLevel::Converged);
            }
            if !flight.goes_on() {
                break;
            }
        }
        if flight.goes_on() {
            return;
        }
        let [plans, converged] = *plans;
        let outcome = flight.outcome();
        let how = outcome.failure.map_or("landed", |failure| failure.name());
        let legs = &flight.mission().leg_limits;
        let landing = outcome.touchdown.map(|contact| PredictedLanding::from(&by_envelope(legs, &contact)));
        let rehearsed = Rehearsed {
            warm: outcome.landing.stands && converged > 0,
            found: text!("{how}, {converged} of {plans} plans converged"),
            landing,
        };
        let report = *flight.pilot().report();
        *self = Self::Over(Box::new((rehearsed.explained(flight.mission()), report)));
    }

    fn over(&self) -> Option<&(Rehearsed, PoweredReport)> {
        match self {
            Self::Flying { .. } => None,
            Self::Over(over) => Some(over),
        }
    }
}
