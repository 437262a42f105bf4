//! One simulated flight whose flight computer is elsewhere: hardware in the loop.
//!
//! It is the flight that [`Sortie`](crate::sortie::Sortie) flies with the same recipe and number, released at once and
//! with `wire_resolution`. Of the computer it hears commands and the phase.

use flight::computer::pilot::Sensed;
use flight::computer::{Commands, flight_time_s};
use flight::rules::phase::Phase;
use flight::vehicle::mission::Mission;
use flight::vehicle::rigid::RigidState;
use hil::carried::{CarriedReadings, Wire};
use hil::readings::Readings;
use world::World;

use crate::outcome::Outcome;
use crate::recipe::Recipe;
use crate::sortie::{SetUpError, prepared, start};
use crate::surroundings::Surroundings;

/// One flight, seen from the world.
#[derive(Debug, Clone)]
pub struct RemoteFlight {
    mission: Mission,
    surroundings: Surroundings,
    believed: RigidState,
    wire: Wire,
    frame: u64,
    phase: Phase,
    ignited: bool,
}

impl RemoteFlight {
    /// Flight `number` of a recipe.
    ///
    /// # Errors
    /// It cannot be set up, or its set of dispersions has no sensors or a fault that the wire does not carry.
    pub fn new(recipe: &Recipe, number: u64) -> Result<Self, SetUpError> {
        if !recipe.dispersion.sensors {
            return Err(SetUpError::NoSensors);
        }
        if let Some(fault) = recipe.faults.first() {
            return Err(SetUpError::Fault(fault.to_string()));
        }
        let (mission, _, drawn) = prepared(recipe, number);
        let drawn = start::falling_as(&mission, &drawn)?;
        let (surroundings, believed) = Surroundings::at_start(&mission, &recipe.dispersion, &drawn)?;
        Ok(Self {
            wire: Wire::new(&mission),
            mission,
            surroundings,
            believed,
            frame: 0,
            phase: Phase::Deploy,
            ignited: false,
        })
    }

    /// The computer's estimate of its state at the start.
    pub fn believed(&self) -> &RigidState {
        &self.believed
    }

    /// The world moves for one frame; returns what the wire carries of it.
    pub fn sense(&mut self) -> CarriedReadings {
        let sensed = self.surroundings.feel();
        self.frame += 1;
        let feedback = self.surroundings.feedback(true, true);
        let Sensed::Measured(measured) = sensed else { unreachable!("a flight with sensors") };
        self.wire.narrow(&Readings { measured, feedback })
    }

    /// The computer's commands, and its phase.
    pub fn act(&mut self, commands: &Commands, phase: Phase) {
        self.surroundings.command(commands);
        self.phase = phase;
        self.ignited |= commands.ignite;
    }

    /// Whether the flight continues: the vehicle is not at rest and the time limit has not passed.
    pub fn goes_on(&self) -> bool {
        self.surroundings.go_on() && !self.phase.on_pad()
    }

    /// The truth.
    pub fn world(&self) -> &World {
        &self.surroundings.world
    }

    /// Frames since the start.
    pub fn frame(&self) -> u64 {
        self.frame
    }

    /// Time since the start, s.
    pub fn time_s(&self) -> f64 {
        flight_time_s(self.frame)
    }

    /// The outcome so far.
    pub fn outcome(&self) -> Outcome {
        self.surroundings.outcome(&self.mission, self.phase, self.ignited)
    }
}
