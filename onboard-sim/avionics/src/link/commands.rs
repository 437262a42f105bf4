//! Translates MAVLink commands to requests for the vehicle.
//!
//! Semantics: <https://mavlink.io/en/messages/common.html#mav_commands>. Numbers are taken exactly:
//! an arm that is neither 0 nor 1 is refused rather than guessed, and no force code opens an
//! interlock. A forced *disarm* is the emergency stop of other ground stations: it always stops
//! everything that can still be stopped.

use alloc::borrow::ToOwned as _;
use alloc::format;
use alloc::string::String;
use mavlink::MessageData as _;
use protocol::command::{CommandRequest, integer_in};
use protocol::dialect::{
    AUTOPILOT_VERSION_DATA, HOME_POSITION_DATA, MESSAGE_INTERVAL_DATA, MavCmd, MavResult,
};

use flight::computer::crew::{CrewCommand, Ending};

/// The parsed command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Command {
    /// A request that the vehicle decides.
    Vehicle(CrewCommand),
    /// A forced disarm: a disarm on the ground, an abort in the air.
    ForcedDisarm,
    /// MAV_CMD_SET_MESSAGE_INTERVAL: message id, interval in microseconds (-1 off, 0 default).
    SetInterval { message_id: u32, interval_us: f32 },
    /// MAV_CMD_REQUEST_MESSAGE: message id and the request's second parameter.
    SendMessage {
        message_id: u32,
        /// Parameter 2: for MESSAGE_INTERVAL, of which message.
        of: u32,
    },
}

/// Why a command is not carried out.
#[derive(Debug, Clone, PartialEq)]
pub struct Unfit {
    /// The result to answer with.
    pub result: MavResult,
    /// A text for the crew, if needed.
    pub reason: Option<String>,
}

/// Reads a command.
///
/// # Errors
/// The command is unknown or its parameters are out of range; the error holds the answer.
pub fn parse(request: &CommandRequest) -> Result<Command, Unfit> {
    let [param1, param2, ..] = request.params;
    if request.is(MavCmd::MAV_CMD_COMPONENT_ARM_DISARM) {
        // A force code does not change an arm: every check still applies.
        if param1.to_bits() == 1.0f32.to_bits() {
            Ok(Command::Vehicle(CrewCommand::Arm))
        } else if param1 == 0.0 && FORCE_CODES.contains(&param2) {
            Ok(Command::ForcedDisarm)
        } else if param1 == 0.0 {
            Ok(Command::Vehicle(CrewCommand::Disarm))
        } else {
            denied(format!("arm refused: param1 = {param1}, must be 1 (arm) or 0 (disarm)"))
        }
    } else if request.is(MavCmd::MAV_CMD_MISSION_START) {
        Ok(Command::Vehicle(CrewCommand::Start))
    } else if request.is(MavCmd::MAV_CMD_DO_PAUSE_CONTINUE) {
        if param1 == 0.0 {
            Ok(Command::Vehicle(CrewCommand::Hold))
        } else {
            denied("a held countdown cannot be continued: start again".to_owned())
        }
    } else if request.is(MavCmd::MAV_CMD_DO_FLIGHTTERMINATION) {
        if param1 > 0.5 {
            Ok(Command::Vehicle(CrewCommand::Abort))
        } else {
            let reason = format!("termination: param1 = {param1}, must be above 0.5");
            Err(Unfit { result: MavResult::MAV_RESULT_FAILED, reason: Some(reason) })
        }
    } else if request.is(MavCmd::MAV_CMD_TD_TAP) {
        Ok(Command::Vehicle(CrewCommand::Tap))
    } else if request.is(MavCmd::MAV_CMD_TD_TAKE_COMMAND) {
        Ok(Command::Vehicle(CrewCommand::TakeCommand))
    } else if request.is(MavCmd::MAV_CMD_TD_PAD_CHECK) {
        let kinds = [CrewCommand::EndCheck, CrewCommand::Check, CrewCommand::CheckStill, CrewCommand::Seen];
        if let Some(number) = integer_in(param1, 0..=3) {
            Ok(Command::Vehicle(kinds[number as usize]))
        } else {
            let accepted = "0 (end), 1 (all), 2 (without motion) or 3 (seen)";
            denied(format!("check: param1 = {param1}, must be {accepted}"))
        }
    } else if request.is(MavCmd::MAV_CMD_SET_MESSAGE_INTERVAL) {
        Ok(Command::SetInterval { message_id: message_id(param1)?, interval_us: param2 })
    } else if request.is(MavCmd::MAV_CMD_REQUEST_MESSAGE) {
        // Parameter 2 means something to two messages only; for the others it may be NaN.
        Ok(Command::SendMessage { message_id: message_id(param1)?, of: message_id(param2).unwrap_or(0) })
    } else if let Some((_, message_id)) =
        LEGACY_REQUESTS.iter().find(|(command, _)| *command == request.command)
    {
        // Parameter 1 states whether it is wanted; old clients leave it at 0 or 1 and expect it
        // either way.
        Ok(Command::SendMessage { message_id: *message_id, of: 0 })
    } else if request.command == GET_MESSAGE_INTERVAL {
        Ok(Command::SendMessage { message_id: MESSAGE_INTERVAL_DATA::ID, of: message_id(param1)? })
    } else {
        Err(Unfit { result: MavResult::MAV_RESULT_UNSUPPORTED, reason: None })
    }
}

/// The number of the proposal that an arm or a start confirms, in parameter 3. Other ground
/// stations leave it at 0 or NaN: their command is a proposal.
pub fn confirmed_proposal(request: &CommandRequest) -> Option<u16> {
    integer_in(request.params[2], 1..=u16::MAX.into()).and_then(|number| u16::try_from(number).ok())
}

/// Parameter 2 of a forced arm or disarm, as other ground stations send it: PX4's (QGroundControl,
/// MAVSDK) and ArduPilot's (Mission Planner, MAVProxy).
const FORCE_CODES: [f32; 2] = [21196.0, 2989.0];
/// MAV_CMD_GET_MESSAGE_INTERVAL, the predecessor of a request for MESSAGE_INTERVAL.
const GET_MESSAGE_INTERVAL: u16 = 510;
/// Requests for one message each, from before MAV_CMD_REQUEST_MESSAGE; clients in use still send
/// them: MAV_CMD_GET_HOME_POSITION, MAV_CMD_REQUEST_PROTOCOL_VERSION and
/// MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES.
const LEGACY_REQUESTS: [(u16, u32); 3] =
    [(410, HOME_POSITION_DATA::ID), (519, 300), (520, AUTOPILOT_VERSION_DATA::ID)];

/// The MAV_RESULT of a vehicle's answer.
pub fn mav_result(ending: Ending) -> MavResult {
    match ending {
        Ending::Accepted => MavResult::MAV_RESULT_ACCEPTED,
        // Other ground stations take it for the refusal that it is for them.
        Ending::NotNow | Ending::ToConfirm => MavResult::MAV_RESULT_TEMPORARILY_REJECTED,
        Ending::Denied => MavResult::MAV_RESULT_DENIED,
        Ending::Failed => MavResult::MAV_RESULT_FAILED,
    }
}

/// A message id sent as a float.
fn message_id(param: f32) -> Result<u32, Unfit> {
    let wrong = || denied(format!("message id {param}: must be a whole number from 0 to 16777215"));
    integer_in(param, 0..=0x00FF_FFFF).map_or_else(wrong, Ok)
}

fn denied<T>(reason: String) -> Result<T, Unfit> {
    Err(Unfit { result: MavResult::MAV_RESULT_DENIED, reason: Some(reason) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::identity::{GROUND, VEHICLE};

    fn command(command: u16, param1: f32, param2: f32) -> CommandRequest {
        CommandRequest {
            source: GROUND,
            target: VEHICLE,
            command,
            params: [param1, param2, f32::NAN, f32::NAN, f32::NAN, f32::NAN, f32::NAN],
            confirmation: 0,
        }
    }

    fn result_of(request: &CommandRequest) -> MavResult {
        parse(request).unwrap_err().result
    }

    #[test]
    fn arm_takes_exactly_one_and_disarm_exactly_zero() {
        assert_eq!(parse(&command(400, 1.0, f32::NAN)), Ok(Command::Vehicle(CrewCommand::Arm)));
        assert_eq!(parse(&command(400, 0.0, 0.0)), Ok(Command::Vehicle(CrewCommand::Disarm)));
        for param1 in [0.5, 2.0, -1.0, f32::NAN, f32::INFINITY, 1.000_000_1] {
            assert_eq!(result_of(&command(400, param1, 0.0)), MavResult::MAV_RESULT_DENIED, "{param1}");
        }
    }

    #[test]
    fn a_pause_holds_and_nothing_continues() {
        assert_eq!(parse(&command(193, 0.0, f32::NAN)), Ok(Command::Vehicle(CrewCommand::Hold)));
        for param1 in [1.0, 0.5, -1.0, f32::NAN] {
            assert_eq!(result_of(&command(193, param1, 0.0)), MavResult::MAV_RESULT_DENIED, "{param1}");
        }
    }

    #[test]
    fn a_check_is_begun_and_ended_by_exact_numbers() {
        let kinds = [CrewCommand::EndCheck, CrewCommand::Check, CrewCommand::CheckStill, CrewCommand::Seen];
        for (param1, kind) in [0.0, 1.0, 2.0, 3.0].into_iter().zip(kinds) {
            assert_eq!(parse(&command(54002, param1, f32::NAN)), Ok(Command::Vehicle(kind)));
        }
        for param1 in [0.5, 4.0, -1.0, f32::NAN, f32::INFINITY] {
            assert_eq!(result_of(&command(54002, param1, 0.0)), MavResult::MAV_RESULT_DENIED, "{param1}");
        }
    }

    #[test]
    fn force_codes_request_no_more_than_an_arm() {
        for code in [21196.0, 2989.0] {
            assert_eq!(parse(&command(400, 1.0, code)), Ok(Command::Vehicle(CrewCommand::Arm)));
        }
    }

    #[test]
    fn a_disarm_is_forced_by_these_codes_and_by_nothing_else() {
        for code in [21196.0, 2989.0] {
            assert_eq!(parse(&command(400, 0.0, code)), Ok(Command::ForcedDisarm));
        }
        for code in [0.0, 1.0, 21195.0, 2989.5, f32::NAN, f32::INFINITY] {
            assert_eq!(parse(&command(400, 0.0, code)), Ok(Command::Vehicle(CrewCommand::Disarm)), "{code}");
        }
    }

    #[test]
    fn termination_needs_more_than_half() {
        assert_eq!(parse(&command(185, 1.0, 0.0)), Ok(Command::Vehicle(CrewCommand::Abort)));
        for param1 in [0.0, 0.5, f32::NAN, -1.0] {
            assert_eq!(result_of(&command(185, param1, 0.0)), MavResult::MAV_RESULT_FAILED, "{param1}");
        }
    }

    #[test]
    fn a_message_id_is_an_integer_and_nan_is_none() {
        for bad in [f32::NAN, -1.0, 0.5, f32::INFINITY, 2e7] {
            assert_eq!(result_of(&command(511, bad, -1.0)), MavResult::MAV_RESULT_DENIED, "{bad}");
            assert_eq!(result_of(&command(512, bad, 0.0)), MavResult::MAV_RESULT_DENIED, "{bad}");
        }
        assert_eq!(
            parse(&command(512, 148.0, f32::NAN)),
            Ok(Command::SendMessage { message_id: 148, of: 0 })
        );
    }

    #[test]
    fn legacy_message_requests_are_accepted() {
        for (number, param1, message_id, of) in
            [(410, 0.0, 242, 0), (519, 1.0, 300, 0), (520, 1.0, 148, 0), (510, 30.0, 244, 30)]
        {
            assert_eq!(
                parse(&command(number, param1, f32::NAN)),
                Ok(Command::SendMessage { message_id, of })
            );
        }
    }

    #[test]
    fn an_unknown_command_is_unsupported() {
        for number in [0, 22, 176, 65_535] {
            assert_eq!(result_of(&command(number, 1.0, 1.0)), MavResult::MAV_RESULT_UNSUPPORTED);
        }
    }
}
