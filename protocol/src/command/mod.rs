//! Parses MAVLink commands, builds their answers, and sends commands with retries.
//!
//! Protocol: <https://mavlink.io/en/services/command.html>. Requests and answers hold numbers
//! instead of the dialect's enums, because a command outside the dialect must still be answered
//! UNSUPPORTED.

mod sender;

use core::ops::RangeInclusive;

use crate::dialect::{MavCmd, MavResult};
use crate::frame::{Encoder, Frame};
use crate::identity::{Address, LARGEST_BOOT_NUMBER};

pub use sender::{CommandEvent, CommandSender, Resend, Ticket};

const COMMAND_INT_ID: u32 = 75;
const COMMAND_LONG_ID: u32 = 76;
const COMMAND_ACK_ID: u32 = 77;
const COMMAND_CANCEL_ID: u32 = 80;

/// A command as received, from COMMAND_LONG or COMMAND_INT.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CommandRequest {
    pub source: Address,
    /// The addressed component; id 0 means all.
    pub target: Address,
    /// MAV_CMD number, which may be unknown.
    pub command: u16,
    /// Parameters 1 to 7; unused ones may be NaN. COMMAND_INT's integers are converted.
    pub params: [f32; 7],
    /// How often the sender has sent it before.
    pub confirmation: u8,
}

impl CommandRequest {
    /// Parses the request in a COMMAND_LONG or COMMAND_INT frame; returns `None` for any other
    /// message.
    pub fn from_frame(frame: &Frame) -> Option<Self> {
        let payload = frame.padded_payload();
        let float =
            |at: usize| f32::from_le_bytes([payload[at], payload[at + 1], payload[at + 2], payload[at + 3]]);
        let integer = |at: usize| {
            i32::from_le_bytes([payload[at], payload[at + 1], payload[at + 2], payload[at + 3]]) as f32
        };
        let (params, confirmation) = match frame.message_id() {
            COMMAND_LONG_ID => {
                ([float(0), float(4), float(8), float(12), float(16), float(20), float(24)], payload[32])
            }
            COMMAND_INT_ID => {
                ([float(0), float(4), float(8), float(12), integer(16), integer(20), float(24)], 0)
            }
            _ => return None,
        };
        Some(Self {
            source: frame.source(),
            target: Address { system_id: payload[30], component_id: payload[31] },
            command: u16::from_le_bytes([payload[28], payload[29]]),
            params,
            confirmation,
        })
    }

    /// The command that a COMMAND_CANCEL frame names, without its parameters; `None` for any other
    /// message.
    pub fn cancelled_by(frame: &Frame) -> Option<Self> {
        if frame.message_id() != COMMAND_CANCEL_ID {
            return None;
        }
        let payload = frame.padded_payload();
        Some(Self {
            source: frame.source(),
            target: Address { system_id: payload[2], component_id: payload[3] },
            command: u16::from_le_bytes([payload[0], payload[1]]),
            params: [f32::NAN; 7],
            confirmation: 0,
        })
    }

    /// The number of this command, in parameter 2: its repetitions have the same one. `None` from
    /// other ground stations, which leave it at 0 or NaN, or put a force code or the number of a
    /// mission item there.
    pub fn number(&self) -> Option<u32> {
        number_in(self.params[1])
    }

    /// Why the station itself requests a hold; `None` if a person does.
    pub fn station_hold(&self) -> Option<StationHold> {
        StationHold::ALL.into_iter().find(|why| why.parameter().to_bits() == self.params[1].to_bits())
    }

    /// Reads parameter 7 of a command that can move something. Other ground stations leave it at 0
    /// or NaN.
    pub fn addressed_boot(&self) -> AddressedBoot {
        let param7 = self.params[6];
        if param7.is_nan() || param7.abs() < 0.5 {
            return AddressedBoot::Any;
        }
        integer_in(param7, 1..=LARGEST_BOOT_NUMBER).map_or(AddressedBoot::Unreadable, AddressedBoot::Boot)
    }

    /// Returns whether the request is this MAV_CMD.
    pub fn is(&self, command: MavCmd) -> bool {
        self.command == command as u16
    }
}

/// Why a station requests a hold that no person has requested.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StationHold {
    NoScreen = 1,
    TwoVehicles,
    LogFails,
}

impl StationHold {
    const ALL: [Self; 3] = [Self::NoScreen, Self::TwoVehicles, Self::LogFails];

    /// Parameter 2 of MAV_CMD_DO_PAUSE_CONTINUE, below every command number.
    pub fn parameter(self) -> f32 {
        f32::from(self as u8)
    }

    pub fn words(self) -> &'static str {
        match self {
            Self::NoScreen => "no commanding screen",
            Self::TwoVehicles => "TWO VEHICLES",
            Self::LogFails => "the station's log fails",
        }
    }
}

/// Smallest command number, above every force code and every proposal number.
pub const FIRST_NUMBER: u32 = 65_536;
/// End of the command numbers: a parameter is a float, which represents integers below this one
/// exactly.
const NUMBERS_END: u32 = 1 << 24;

fn number_in(param2: f32) -> Option<u32> {
    integer_in(param2, FIRST_NUMBER..=NUMBERS_END - 1)
}

/// The whole number of this range that a parameter contains. A float represents both ends exactly.
pub fn integer_in(param: f32, range: RangeInclusive<u32>) -> Option<u32> {
    let fits = (*range.start() as f32..=*range.end() as f32).contains(&param);
    (fits && libm::truncf(param).to_bits() == param.to_bits()).then_some(param as u32)
}

/// The boot of a vehicle that a command is addressed to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AddressedBoot {
    /// It names none.
    Any,
    Boot(u32),
    /// The parameter is no number of a boot: no permission.
    Unreadable,
}

/// An answer to a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CommandAnswer {
    /// MAV_CMD number of the request.
    pub command: u16,
    /// MAV_RESULT number.
    pub result: u8,
    /// RESULT_PARAM2: the number of the command, negative if a second person must confirm it. For a
    /// command without a number it is the number of the proposal to confirm; 0 if there is none.
    pub detail: i32,
    /// The component that the answer is for.
    pub target: Address,
}

impl CommandAnswer {
    pub fn to(request: &CommandRequest, result: MavResult) -> Self {
        Self {
            command: request.command,
            result: result as u8,
            detail: request.number().and_then(|number| i32::try_from(number).ok()).unwrap_or(0),
            target: request.source,
        }
    }

    /// The same, for a command that a second person must confirm by this proposal number.
    #[must_use]
    pub fn for_confirmation(self, proposal: u16) -> Self {
        let detail = if self.detail == 0 { proposal.into() } else { -self.detail };
        Self { detail, ..self }
    }

    /// The number of the command that it answers, if the answer has it.
    fn number(&self) -> Option<u32> {
        Some(self.detail.unsigned_abs()).filter(|number| *number >= FIRST_NUMBER)
    }

    /// Whether a second person must confirm the command.
    pub fn is_open(&self) -> bool {
        self.detail < 0 || (self.detail > 0 && self.number().is_none())
    }

    /// Encodes the answer as a COMMAND_ACK frame.
    pub fn encode(&self, encoder: &mut Encoder) -> Option<Frame> {
        const PROGRESS: u8 = 0;
        let payload = [
            &self.command.to_le_bytes()[..],
            &[self.result, PROGRESS],
            &self.detail.to_le_bytes(),
            &[self.target.system_id, self.target.component_id],
        ];
        encoder.encode_payload(COMMAND_ACK_ID, &payload.concat())
    }

    /// Parses the answer in a COMMAND_ACK frame; returns `None` for any other message.
    pub fn from_frame(frame: &Frame) -> Option<Self> {
        if frame.message_id() != COMMAND_ACK_ID {
            return None;
        }
        let payload = frame.padded_payload();
        Some(Self {
            command: u16::from_le_bytes([payload[0], payload[1]]),
            result: payload[2],
            detail: i32::from_le_bytes([payload[4], payload[5], payload[6], payload[7]]),
            target: Address { system_id: payload[8], component_id: payload[9] },
        })
    }

    /// The result in words, for the operator.
    pub fn result_words(&self) -> &'static str {
        result_words(self.result)
    }
}

/// A MAV_RESULT number in words, for the operator.
pub fn result_words(result: u8) -> &'static str {
    match result {
        0 => "accepted",
        1 => "temporarily rejected",
        2 => "denied",
        3 => "unsupported",
        4 => "failed",
        5 => "in progress",
        6 => "cancelled",
        _ => "answered with an unknown result",
    }
}
