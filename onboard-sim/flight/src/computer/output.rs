//! The output of one frame of the flight computer.

use alloc::vec::Vec;
use serde::{Deserialize, Serialize};

use super::crew::Answer;
use super::news::News;
use super::pilot::BoosterCommands;

/// Commands to the actuators.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Commands {
    /// Gimbal angles (pitch, yaw), rad.
    pub gimbal_rad: [f64; 2],
    /// Opening angles of the fins, rad.
    pub fins_rad: [f64; 4],
    /// Current through the landing motor's igniter.
    pub ignite: bool,
    /// The parachute is ejected.
    pub parachute: bool,
    pub booster: BoosterCommands,
}

/// The output of one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Output {
    pub commands: Commands,
    /// The countdown has ended in this frame: the simulation releases the vehicle where its flight begins.
    pub released: bool,
    /// An answer to each request, in order.
    pub answers: Vec<Answer>,
    /// Reports, in order.
    pub news: Vec<News>,
    /// A plan was made.
    pub planned: bool,
}
