//! Everything that a flight computer is told in a frame of a flight without a crew.

use flight::estimation::estimator::Measurements;

/// The readings of one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Readings {
    pub measured: Measurements,
    pub feedback: Feedback,
}

/// What actuators and switches say at the end of the frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Feedback {
    /// Where the gimbal is (pitch, yaw), rad.
    pub gimbal_rad: [f64; 2],
    /// Where the fins are, rad.
    pub fins_rad: [f64; 4],
    pub switches: Switches,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Switches {
    /// A foot touches the ground.
    pub contact: bool,
    pub igniter_continuity: bool,
    /// The wire between booster and vehicle is whole.
    pub booster_attached: bool,
    /// The pin of the landing motor is out.
    pub pin_out: bool,
}
