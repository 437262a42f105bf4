//! Whether a station that arms is prepared for the mission that this vehicle flies.

use alloc::borrow::ToOwned as _;
use alloc::format;
use alloc::string::String;
use flight::computer::crew::Asked;
use protocol::command::CommandRequest;
use protocol::mission::Expected;

use crate::commands::Command;
use crate::vehicle::Vehicle;

/// Why the station expects another mission; `None` if it expects this one or says nothing of it.
pub fn why_other(request: &CommandRequest, asked: &Command, vehicle: &dyn Vehicle) -> Option<String> {
    if *asked != Command::Vehicle(Asked::Arm) {
        return None;
    }
    let [_, _, _, param4, param5, param6, _] = request.params;
    let flies = vehicle.mission();
    match Expected::of_params([param4, param5, param6]) {
        Expected::Any => None,
        Expected::Hash(expected) if expected == flies.hash => None,
        Expected::Hash(expected) => {
            Some(format!("arm refused: this vehicle flies {} {}, not {expected}", flies.name, flies.hash))
        }
        Expected::Unreadable => {
            Some("arm refused: parameters 4 to 6 are no mission's hash (0 for any mission)".to_owned())
        }
    }
}
