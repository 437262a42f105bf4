//! Everything of a flight except its flight computer: the world with its initial state, the sensors
//! that measure it, and the actuators that move it.

use crate::world::sensors::{
    Defect, NEARLY_EXACT, Sensor, SensorFaults, SensorParamError, SensorTruth, Sensors, start_with_errors,
};
use crate::world::{Actuators, Battery, Fault, World};
use flight::computer::{Commands, FRAME_MS, FRAME_S, SensedInput, pad_check};
use flight::estimation::estimator::{Measurements, StartUncertainty};
use flight::rules::outputs::PyroOutput;
use flight::rules::phase::Phase;
use flight::vehicle::mission::{Mission, StartPoint};
use flight::vehicle::rigid::RigidState;

use crate::dispersion::Dispersion;
use crate::draw::Draw;
use crate::outcome::{Ending, Outcome, judge};
use crate::sortie::{LONGEST_S, SetUpError};

/// The world of one flight, and its interface to the flight computer.
#[derive(Debug, Clone)]
pub(crate) struct Surroundings {
    pub(crate) world: World,
    sensors: Sensors,
    pub(crate) faults: SensorFaults,
    /// Faults of the vehicle.
    broken: Vec<Fault>,
    actuators: Actuators,
    pub(crate) battery: Battery,
    /// The sensor samples of the last frame.
    measured: Option<Measurements>,
    /// State and commands have been numbers throughout.
    finite: bool,
}

impl Surroundings {
    /// The start of a flight, and the flight computer's estimate of its state there.
    pub(crate) fn at_start(
        mission: &Mission,
        dispersion: &Dispersion,
        drawn: &Draw,
    ) -> Result<(Self, RigidState), SetUpError> {
        let world = world(mission, drawn)?;
        let sensors = sensors(mission, dispersion, drawn)?;
        let uncertainty = StartUncertainty::at_start(mission.start.at);
        let estimate = || start_with_errors(world.state(), &uncertainty, drawn.flight_seed);
        let estimate = match mission.start.at {
            _ if !dispersion.sensors => *world.state(),
            StartPoint::Pad => sensors.levelled(world.state(), &estimate()),
            StartPoint::Apogee | StartPoint::Drone => estimate(),
        };
        let actuators = at_rest(mission);
        let faults = SensorFaults::default();
        let battery = Battery::new(1.0, surfaces_rad(&world));
        let (broken, measured, finite) = (Vec::new(), None, true);
        Ok((Self { world, sensors, faults, broken, actuators, battery, measured, finite }, estimate))
    }

    /// Goes to the start of the flight from wherever the vehicle waited. Both were already set up
    /// at power-up, which would have found any error.
    pub(crate) fn begin(&mut self, mission: &Mission, dispersion: &Dispersion, drawn: &Draw) {
        if let Ok(world) = world(mission, drawn) {
            self.world = world;
            self.broken.iter().for_each(|fault| self.world.inject(fault));
        }
        if let Ok(sensors) = sensors(mission, dispersion, drawn) {
            self.sensors = sensors;
        }
        self.actuators = at_rest(mission);
    }

    /// Breaks a part of the vehicle. A fault on the pad persists in flight.
    pub(crate) fn break_down(&mut self, fault: Fault) {
        self.world.inject(&fault);
        self.broken.push(fault);
    }

    /// A sensor breaks.
    pub(crate) fn break_sensor(&mut self, sensor: Sensor, defect: Defect) {
        match defect {
            Defect::Stale(for_s) => self.sensors.hold_fixes(self.world.state(), for_s),
            _ => self.faults.break_down(sensor, defect),
        }
    }

    /// From now on the receiver's times count from this time of its clock, s: the flight computer's
    /// do.
    pub(crate) fn count_from(&mut self, release_s: f64) {
        self.sensors.count_from(release_s);
    }

    /// Advances the world by one frame and samples the sensors; `None` if they gave no sample.
    pub(crate) fn sample_sensors(&mut self) -> Option<Measurements> {
        let (mut measured, mut left) = (None, FRAME_MS as usize);
        while left > 0 {
            left -= self.world.stride(&self.actuators, left);
            measured = self.sensors.observe(&SensorTruth::of(&self.world)).or(measured);
        }
        // Each igniter of the landing motor has its current.
        let landing = if self.actuators.ignite { self.world.airframe().igniters } else { 0 };
        let energised = landing as usize + usize::from(self.actuators.ignite_booster);
        self.battery.step(surfaces_rad(&self.world), energised, FRAME_S);
        self.measured = measured.map(|measured| self.faults.distort(&measured));
        self.measured
    }

    /// Feedback and switches after the frame, without other inputs; `released`: contact counts.
    pub(crate) fn feedback(&mut self, released: bool) -> SensedInput {
        let (gimbal_rad, fins_rad) = if self.world.airframe().servos_report {
            (self.world.gimbal_feedback_rad(), self.sensors.fins_rad(&self.world.fins_feedback_rad()))
        } else {
            (self.actuators.gimbal_rad, self.actuators.fins_rad)
        };
        SensedInput {
            gimbal_rad,
            fins_rad,
            contact: self.sensors.contact(released && self.world.touchdown().is_some()),
            igniter_continuity: self.sensors.igniter_continuity(),
            booster_attached: self.world.booster_attached(),
            battery_v: Some(self.battery.volts()),
            servo_battery_v: Some(self.battery.servo_volts()),
            ..SensedInput::default()
        }
    }

    /// Commands for the next frame.
    pub(crate) fn command(&mut self, commands: &Commands) {
        let Commands { gimbal_rad, fins_rad, outputs } = *commands;
        self.actuators = Actuators {
            gimbal_rad,
            fins_rad,
            ignite: outputs.is_on(PyroOutput::LandingIgniter),
            parachute: outputs.is_on(PyroOutput::Parachute),
            ignite_booster: outputs.is_on(PyroOutput::AscentIgniter),
            separate: outputs.is_on(PyroOutput::Separation),
        };
        self.finite &= self.world.state().is_finite()
            && gimbal_rad.iter().chain(&fins_rad).all(|angle| angle.is_finite());
    }

    /// Whether the vehicle is still moving and the time limit has not passed.
    pub(crate) fn go_on(&self) -> bool {
        self.finite && self.world.rest().is_none() && self.world.time_s() < LONGEST_S
    }

    /// The outcome so far of a flight whose computer is in this phase; `ignited`: it has fired the
    /// landing motor's igniter.
    pub(crate) fn outcome(&self, mission: &Mission, phase: Phase, ignited: bool) -> Outcome {
        let ending = Ending {
            touchdown: self.world.touchdown().copied(),
            rest: self.world.rest().copied(),
            phase,
            ignited,
            motor_started: self.world.thrust_begins_s().is_some(),
            parachute: self.world.parachute_ejected_s().is_some(),
            finite: self.finite,
        };
        judge(mission, &ending)
    }

    /// The sensor samples of the last frame; `None` if the computer gets the truth.
    pub(crate) fn measured(&self) -> Option<&Measurements> {
        self.measured.as_ref()
    }
}

fn sensors(mission: &Mission, dispersion: &Dispersion, drawn: &Draw) -> Result<Sensors, SensorParamError> {
    let errors = if dispersion.sensors { 1.0 } else { NEARLY_EXACT };
    Sensors::new(&dispersion.sensor_params, &mission.sensors, drawn.flight_seed, errors)
}

/// Where gimbal and fins are, rad.
pub(crate) fn surfaces_rad(world: &World) -> [f64; 6] {
    pad_check::surfaces_rad(world.gimbal_feedback_rad(), world.fins_feedback_rad())
}

// The world in which a flight begins.

/// Frames that a hanging vehicle falls until its computer detects it.
const UNNOTICED_FRAMES: usize = 20;

/// The world at the start of the flight.
pub(crate) fn world(mission: &Mission, drawn: &Draw) -> Result<World, SetUpError> {
    let world = world_at(mission, drawn, &drawn.apogee)?;
    Ok(match mission.launched() {
        Some(launch) => world.on_rail(launch, &drawn.ascent),
        None => world,
    })
}

/// A world with the vehicle in a state.
pub(crate) fn world_at(mission: &Mission, drawn: &Draw, state: &RigidState) -> Result<World, SetUpError> {
    let Draw { truth, winds_aloft, flight_seed, .. } = drawn;
    let curve = truth.curve(mission)?;
    let world = World::new(&mission.site, &mission.airframe, curve.as_ref(), truth, state, *flight_seed)?;
    Ok(world.with_winds_aloft(winds_aloft.as_ref()))
}

/// The draw with the state in which the fall begins.
pub(crate) fn falling_as(mission: &Mission, drawn: &Draw) -> Result<Draw, SetUpError> {
    Ok(Draw { apogee: falling(mission, drawn)?, ..drawn.clone() })
}

/// The state in which the fall begins.
fn falling(mission: &Mission, drawn: &Draw) -> Result<RigidState, SetUpError> {
    let (StartPoint::Drone, Some(hanging)) = (mission.start.at, &drawn.hanging) else {
        return Ok(drawn.apogee);
    };
    let (let_go, _) = hanging.at(0.0);
    let mut world = world_at(mission, drawn, &let_go)?;
    world.advance(&at_rest(mission), UNNOTICED_FRAMES * FRAME_MS as usize);
    Ok(*world.state())
}

/// Every fin closed, and no current.
pub(crate) fn at_rest(mission: &Mission) -> Actuators {
    Actuators { fins_rad: [mission.airframe.fins.closed_rad(); 4], ..Actuators::NONE }
}
