//! The input of one frame of the flight computer: everything it depends on besides its memory.

use alloc::string::String;

use super::crew::{Asked, People, Request};
use super::pilot::{PilotInput, Sensed};
use crate::rules::arming::{PredictedLanding, Uplink};
use crate::rules::operator::Operator;
use crate::rules::two_person::Station;

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

/// Result of a rehearsal of the landing. The simulation rehearses, not the flight computer: it takes a simulated world.
#[derive(Debug, Clone, PartialEq)]
pub struct Rehearsed {
    /// It found plans, and landed within the limits of the legs.
    pub warm: bool,
    /// The result in words.
    pub found: String,
    /// Its touchdown; `None` if it did not come down.
    pub landing: Option<PredictedLanding>,
}

/// The station that armed the vehicle, and how long ago it was last heard, s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Commander {
    pub station: Station,
    pub age_s: f64,
    /// Whose key it armed with.
    pub by: Option<Operator>,
}

/// Everything that a frame depends on besides the computer's memory.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Input<'a> {
    /// Number of the frame since power-up.
    pub frame: u64,
    /// Vehicle time at its end, s.
    pub time_s: f64,
    pub sensed: Sensed,
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
    /// Requests since the last frame, in order.
    pub requests: &'a [Request],
    /// Result of the rehearsal, once it is over.
    pub rehearsed: Option<&'a Rehearsed>,
}

impl Input<'_> {
    /// A frame in the air of a computer that was [released at once](Computer::released), made from its record in a
    /// pilot's log: no station is connected, and a recorded abort becomes a request.
    pub fn in_the_air(input: &PilotInput) -> Self {
        const ABORT: [Request; 1] = [Request {
            asked: Asked::Abort,
            uplink: Uplink::NotNeeded,
            station: None,
            by: None,
            confirms: None,
        }];
        Self {
            frame: input.frame,
            time_s: input.time_s,
            sensed: input.sensed,
            gimbal_rad: [0.0; 2],
            fins_rad: input.fins_rad,
            contact: input.contact,
            igniter_continuity: input.igniter_continuity,
            booster_attached: input.booster_attached,
            pin_out: true,
            battery_v: None,
            log: LogState { running: true, space_bytes: u64::MAX },
            uplink: Uplink::NotNeeded,
            commander: None,
            people: None,
            requests: if input.abort { &ABORT } else { &[] },
            rehearsed: None,
        }
    }
}
