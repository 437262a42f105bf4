//! One flight, from apogee until it lies still.

mod errors;

use std::time::Duration;

pub use self::errors::EstimatorErrors;
use flight::estimator::{Measurements, StartUncertainty};
use flight::mission::{Mission, MissionError};
use flight::pilot::{Pilot, PilotInput, PilotOutput, Sensed};
use flight::rigid::RigidState;
use world::sensors::{
    FRAME_MS, FRAME_S, SensorFaults, SensorParamError, SensorTruth, Sensors, believed_start,
};
use world::world::WorldError;
use world::{Actuators, World};

use crate::baseline::Baseline;
use crate::dispersion::Dispersion;
use crate::draw::Draw;
use crate::outcome::{Ending, Outcome, judge};

/// A flight that lasts longer is given up, s: a fall from apogee under the parachute takes a minute.
const LONGEST_S: f64 = 150.0;

/// A flight that cannot be set up.
#[derive(Debug, thiserror::Error)]
pub enum FlyError {
    /// The mission's motor is not to be had.
    #[error(transparent)]
    Mission(#[from] MissionError),
    /// The drawn truth cannot be simulated.
    #[error(transparent)]
    World(#[from] WorldError),
    /// A sensor figure cannot be.
    #[error(transparent)]
    Sensors(#[from] SensorParamError),
}

/// What the radio between vehicle and ground does, both ways. Nothing on board waits for it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Radio {
    /// Nothing gets through.
    pub silent: bool,
    /// What gets through arrives so much later, s.
    pub delay_s: f64,
}

/// One flight in the air. A clone flies on exactly as it does.
#[derive(Debug, Clone)]
pub struct Flight {
    mission: Mission,
    world: World,
    sensors: Option<Sensors>,
    sensor_faults: SensorFaults,
    pilot: Pilot,
    baseline: Option<Baseline>,
    /// Frames that the flight computer is still dead for.
    frames_down: u64,
    radio: Radio,
    pilot_took: Duration,
    command: Actuators,
    input: Option<PilotInput>,
    /// What the pilot itself wanted at the last frame.
    piloted: Option<PilotOutput>,
    believed: RigidState,
    output: Option<PilotOutput>,
    frame: u64,
    abort: bool,
    finite: bool,
    largest_errors: EstimatorErrors,
}

impl Flight {
    /// A flight about to be let go at apogee.
    ///
    /// # Errors
    /// The mission or the draw cannot be flown.
    pub fn new(mission: &Mission, dispersion: &Dispersion, draw: &Draw) -> Result<Self, FlyError> {
        let curve = mission.motor()?;
        let world = World::new(&mission.airframe, &curve, &draw.truth, &draw.apogee, draw.flight_seed)?;
        let uncertainty = StartUncertainty::at_apogee();
        let (sensors, believed) = if dispersion.sensors {
            let sensors = Sensors::new(&dispersion.sensor_params, draw.flight_seed, 0.0)?;
            (Some(sensors), believed_start(&draw.apogee, &uncertainty, draw.flight_seed))
        } else {
            (None, draw.apogee)
        };
        let pilot = Pilot::at_apogee(mission, 0.0, &believed, &uncertainty)?;
        let closed_rad = mission.airframe.fins.closed_rad();
        Ok(Self {
            mission: mission.clone(),
            world,
            sensors,
            sensor_faults: SensorFaults::default(),
            pilot,
            baseline: None,
            frames_down: 0,
            radio: Radio::default(),
            pilot_took: Duration::ZERO,
            input: None,
            piloted: None,
            believed,
            command: Actuators {
                gimbal_rad: [0.0; 2],
                fins_rad: [closed_rad; 4],
                ignite: false,
                parachute: false,
            },
            output: None,
            frame: 0,
            abort: false,
            finite: true,
            largest_errors: EstimatorErrors::default(),
        })
    }

    /// The truth.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// The truth, to break something in it.
    pub fn world_mut(&mut self) -> &mut World {
        &mut self.world
    }

    /// What is broken about the sensors, to break more.
    pub fn sensor_faults_mut(&mut self) -> &mut SensorFaults {
        &mut self.sensor_faults
    }

    /// The flight computer.
    pub fn pilot(&self) -> &Pilot {
        &self.pilot
    }

    /// Asks for an abort at the next frame.
    pub fn abort(&mut self) {
        self.abort = true;
    }

    /// Has the landing burn flown by another controller than the pilot's own.
    #[must_use]
    pub fn with_baseline(mut self, baseline: Option<Baseline>) -> Self {
        self.baseline = baseline;
        self
    }

    /// Another mission from now on, for the flight computer and for the judgement; the world stays what it is.
    ///
    /// # Errors
    /// The mission's motor is not to be had.
    pub fn reconfigure(&mut self, mission: &Mission) -> Result<(), MissionError> {
        self.pilot = self.pilot.reconfigured(mission)?;
        self.mission = mission.clone();
        Ok(())
    }

    /// The flight computer dies, and starts again after a time, s. Servos keep their last command meanwhile.
    pub fn reboot(&mut self, down_s: f64) {
        self.frames_down = libm::ceil(down_s / FRAME_S).max(1.0) as u64;
    }

    /// The radio. A campaign has nobody at its other end; a flight on the wire has.
    pub fn radio(&self) -> &Radio {
        &self.radio
    }

    /// The radio, to break it.
    pub fn radio_mut(&mut self) -> &mut Radio {
        &mut self.radio
    }

    /// How long the flight computer took over the last frame, by the stopwatch that [`Flight::step_timed`] was given.
    pub fn pilot_took(&self) -> Duration {
        self.pilot_took
    }

    /// What the flight computer was given at the last frame; `None` before the first and while it is dead.
    pub fn input(&self) -> Option<&PilotInput> {
        self.input.as_ref()
    }

    /// What the pilot itself wanted at the last frame, whoever flew it.
    pub fn piloted(&self) -> Option<&PilotOutput> {
        self.piloted.as_ref()
    }

    /// What the flight computer believed about its state at apogee.
    pub fn believed_at_apogee(&self) -> &RigidState {
        &self.believed
    }

    /// The mission as flown.
    pub fn mission(&self) -> &Mission {
        &self.mission
    }

    /// Number of frames flown.
    pub fn frame(&self) -> u64 {
        self.frame
    }

    /// The commands of the last frame.
    pub fn output(&self) -> Option<&PilotOutput> {
        self.output.as_ref()
    }

    /// Flies one frame. `false` when there is no more to fly.
    pub fn step(&mut self) -> bool {
        self.step_timed(&mut || Duration::ZERO)
    }

    /// The same with a clock of which only differences are used, to time the flight computer.
    pub fn step_timed(&mut self, stopwatch: &mut dyn FnMut() -> Duration) -> bool {
        let mut measured: Option<Measurements> = None;
        for _ in 0..FRAME_MS {
            self.world.step(&self.command);
            if let Some(sensors) = &mut self.sensors {
                measured = sensors.observe(&SensorTruth::of(&self.world), &self.sensor_faults).or(measured);
            }
        }
        self.frame += 1;
        if self.frames_down > 0 {
            self.input = None;
            self.frames_down -= 1;
            if self.frames_down == 0 {
                self.pilot = self.pilot.restarted(self.world.time_s());
            }
            return self.goes_on();
        }
        let input = PilotInput {
            frame: self.frame,
            time_s: self.world.time_s(),
            sensed: measured.map_or_else(|| Sensed::Known(errors::known(&self.world)), Sensed::Measured),
            fins_rad: self.world.fins_rad(),
            contact: self.world.touchdown().is_some(),
            igniter_continuity: true,
            abort: core::mem::take(&mut self.abort),
        };
        let began = stopwatch();
        let mut output = self.pilot.step(&input);
        self.pilot_took = stopwatch().saturating_sub(began);
        self.piloted = Some(output);
        if let Some(baseline) = &mut self.baseline {
            baseline.fly(input.time_s, &self.pilot, &mut output);
        }
        self.input = Some(input);
        self.command = Actuators {
            gimbal_rad: output.gimbal_rad,
            fins_rad: output.fins_rad,
            ignite: output.ignite,
            parachute: output.parachute,
        };
        self.output = Some(output);
        self.finite &= self.world.state().is_finite()
            && output.gimbal_rad.iter().chain(&output.fins_rad).all(|angle| angle.is_finite());
        if self.world.touchdown().is_none() && self.world.height_m() < 10.0 {
            self.largest_errors = self.largest_errors.or_larger(&self.errors());
        }
        self.goes_on()
    }

    /// Whether there is more to fly: it is not at rest, and not to be given up.
    pub fn goes_on(&self) -> bool {
        self.finite && self.world.rest().is_none() && self.world.time_s() < LONGEST_S
    }

    /// The largest errors of the estimate in the last ten metres.
    pub fn largest_errors(&self) -> &EstimatorErrors {
        &self.largest_errors
    }

    /// What became of it so far.
    pub fn outcome(&self) -> Outcome {
        let ending = Ending {
            touchdown: self.world.touchdown().copied(),
            rest: self.world.rest().map(|rest| rest.outcome),
            phase: self.pilot.mode().phase,
            ignited: self.pilot.ignited_at_s().is_some(),
            lit: self.world.thrust_begins_s().is_some(),
            parachute: self.world.parachute_ejected(),
            finite: self.finite,
        };
        judge(&self.mission, &ending)
    }

    /// Flies to the end.
    pub fn run(&mut self) -> Outcome {
        while self.step() {}
        self.outcome()
    }
}
