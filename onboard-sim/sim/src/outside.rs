//! The input from the crew and the ground in one frame, and the result of that frame.

use flight::computer::crew::{People, Request};
use flight::computer::{Commander, Computer, Input, LogState, Output};
use flight::rules::arming::Uplink;

/// The input from the crew and the ground in one frame.
#[derive(Debug, Clone, Copy)]
pub struct Outside<'a> {
    /// The pin of the landing motor is out.
    pub pin_out: bool,
    pub log: LogState,
    /// The link quality of the station with the best link.
    pub uplink: Uplink,
    /// The station that armed the vehicle, if one did.
    pub commander: Option<Commander>,
    /// How many people an arming and a start take; `None` without operators.
    pub people: Option<People>,
    /// The requests since the last frame.
    pub requests: &'a [Request],
}

impl Outside<'_> {
    /// A flight without a crew: the pin is out, and there are no requests.
    pub const NOBODY: Self = Self {
        pin_out: true,
        log: LogState { running: true, space_bytes: u64::MAX },
        uplink: Uplink::NotNeeded,
        commander: None,
        people: None,
        requests: &[],
    };
}

/// An observer of the flight computer.
pub trait Watch {
    /// A frame that `computer` has just decided.
    fn decided(&mut self, input: &Input<'_>, output: &Output, computer: &Computer);
}

/// No observer.
#[derive(Debug, Clone, Copy)]
pub struct Unwatched;

impl Watch for Unwatched {
    fn decided(&mut self, _: &Input<'_>, _: &Output, _: &Computer) {}
}
