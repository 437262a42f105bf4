//! The vehicle's end of MAVLink: what it says, how often, and how it takes what a ground station asks for.
//!
//! The crate is pure and needs no operating system: frames, times and the vehicle are arguments. A simulated vehicle and
//! a board's program use the same code.
//!
//! * [`vehicle`]: what the links read of a vehicle.
//! * [`endpoint`]: frames in and frames out, within a radio's budget.
//! * [`commands`]: translates MAVLink commands to requests for the vehicle.
//! * [`stations`]: how well the vehicle hears each ground station.
//! * [`snapshot`]: the vehicle's state at one instant, as its flight computer believes it.
//! * [`telemetry`] and [`streams`]: that state as MAVLink messages, and their rates.
//! * [`sensed`]: what the sensors said last.
//! * [`parameters`]: values that a ground station may read by name, and the few that it may set.
#![cfg_attr(not(test), no_std)]

extern crate alloc;

pub mod commands;
pub mod endpoint;
pub mod parameters;
pub mod sensed;
pub mod snapshot;
pub mod stations;
pub mod streams;
pub mod telemetry;

/// What the links read of a vehicle.
pub mod vehicle {
    use alloc::string::String;

    use flight::computer::Computer;
    use flight::computer::crew::People;
    use flight::rules::operator::Operator;
    use flight::rules::phase::{Mode, Phase};
    use flight::vehicle::mission::{StartPoint, StateWeights};
    use protocol::mission::MissionHash;

    use crate::snapshot::Snapshot;

    /// Whether something real can light and move. A station acts by itself only on a simulated vehicle.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub enum VehicleKind {
        Real,
        Simulated,
    }

    /// Which vehicle speaks, and since which power-up.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub struct Identity {
        pub kind: VehicleKind,
        pub boot_number: u32,
        /// A random number of the vehicle, the same after each power-up; 0: not told.
        pub uid: u16,
    }

    /// Which mission or profile a vehicle flies.
    #[derive(Debug, Clone, PartialEq, Eq)]
    pub struct MissionName {
        pub name: String,
        pub hash: MissionHash,
        /// Where the flight begins, which the hash leaves out.
        pub start: Option<StartPoint>,
    }

    impl Default for MissionName {
        fn default() -> Self {
            Self { name: String::new(), hash: MissionHash::of(""), start: None }
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
}
