//! What the links read of a vehicle.

use alloc::string::String;

use flight::computer::Computer;
use flight::computer::crew::People;
use flight::rules::operator::Operator;
use flight::rules::phase::{Mode, Phase};
use flight::vehicle::mission::StateWeights;
use protocol::mission::MissionHash;

use crate::snapshot::Snapshot;

/// Which mission or profile a vehicle flies.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MissionName {
    pub name: String,
    pub hash: MissionHash,
}

impl Default for MissionName {
    fn default() -> Self {
        Self { name: String::new(), hash: MissionHash::of("") }
    }
}

/// A vehicle as its links see it.
pub trait Vehicle {
    /// Its flight computer.
    fn computer(&self) -> &Computer;

    /// Time since power-up, s.
    fn time_s(&self) -> f64;

    /// Which mission or profile it flies.
    fn mission(&self) -> &MissionName;

    /// Who may command; empty without operators.
    fn operators(&self) -> &[Operator];

    /// How many people an arming and a start take; `None` without operators.
    fn people(&self) -> Option<People>;

    /// Weights of the landing cost.
    fn weights(&self) -> StateWeights;

    /// The state now.
    fn snapshot(&self) -> Snapshot;

    /// Phase, latches and countdown.
    fn mode(&self) -> &Mode {
        self.computer().mode()
    }

    fn phase(&self) -> Phase {
        self.mode().phase
    }
}
