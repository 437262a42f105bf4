//! Checks the addressing of a command that can move something: this vehicle, this boot of it, its
//! mission, and a station that can be distinguished from others. Commands that stop the launch
//! (abort, hold, disarm, the end of a check) are always accepted.

use alloc::borrow::ToOwned as _;
use alloc::format;
use alloc::string::String;

use flight::computer::crew::CrewCommand;
use flight::rules::two_person::Station;
use protocol::command::{AddressedBoot, CommandRequest};
use protocol::dialect::MavResult;
use protocol::mission::Expected;

use super::VehicleEndpoint;
use crate::link::commands::{Command, Unfit};
use crate::link::stations::SAME_IDS_FOR_S;
use crate::link::vehicle::{VehicleKind, VehicleState};

/// Time after a frame of another vehicle under our ids, s, for which a command must name the boot
/// that it is addressed to.
const TWIN_FOR_S: f64 = 10.0;

impl VehicleEndpoint {
    /// Notes a frame with our ids as its sender.
    pub(super) fn note_twin(&mut self, time_s: f64) {
        if !self.has_twin(time_s) {
            let (system, component) = (self.us.system_id, self.us.component_id);
            let words = format!(
                "another system {system} component {component} is on this link: commands must name the boot they are for"
            );
            self.send_text(flight::computer::messages::Severity::Warning, &words);
        }
        self.twin_received_at_s = Some(time_s);
    }

    /// Whether another vehicle under our ids was received recently.
    fn has_twin(&self, time_s: f64) -> bool {
        self.twin_received_at_s.is_some_and(|at_s| time_s - at_s <= TWIN_FOR_S)
    }

    /// Why a command is refused before the vehicle decides it; `None` if it is not.
    pub(super) fn address_refusal(
        &self,
        request: &CommandRequest,
        command: &Command,
        station: Station,
        vehicle: &VehicleState<'_>,
    ) -> Option<Unfit> {
        let Command::Vehicle(command) = command else { return None };
        if !can_move(*command) {
            return None;
        }
        let refused = |result, why: String| {
            Some(Unfit { result, reason: Some(format!("{} refused: {why}", command.name())) })
        };
        let (denied, not_now) = (MavResult::MAV_RESULT_DENIED, MavResult::MAV_RESULT_TEMPORARILY_REJECTED);
        if request.target.system_id == 0 {
            return refused(denied, "it is for every vehicle, and must be for one".to_owned());
        }
        let us = self.identity.boot_number;
        match request.addressed_boot() {
            AddressedBoot::Boot(boot) if boot == us => {}
            AddressedBoot::Boot(boot) => {
                return refused(denied, format!("for boot {boot}; this is boot {us}"));
            }
            AddressedBoot::Unreadable => {
                return refused(denied, format!("parameter 7 is no boot number: name boot {us}"));
            }
            AddressedBoot::Any if self.has_twin(vehicle.time_s) => {
                let why = "another vehicle has these ids: name the boot that it is for in parameter 7";
                return refused(not_now, why.to_owned());
            }
            // A program that names no boot has not received this vehicle's status. Other ground
            // stations fly a simulated vehicle without one until it receives a Touchdown station.
            AddressedBoot::Any
                if self.identity.kind == VehicleKind::Real || self.stations.has_received_touchdown() =>
            {
                return refused(denied, format!("name boot {us} in parameter 7"));
            }
            AddressedBoot::Any => {}
        }
        let others = self.stations.same_ids(station, vehicle.time_s);
        if others > 0 {
            let why = format!("{others} more under the ids {station} in the last {SAME_IDS_FOR_S} s");
            return refused(not_now, why);
        }
        let why = (*command == CrewCommand::Arm).then(|| why_other_mission(request, vehicle)).flatten();
        why.and_then(|why| refused(denied, why))
    }
}

/// Whether the command may move or ignite something, or lets another operator do so.
pub(super) fn can_move(command: CrewCommand) -> bool {
    !matches!(command, CrewCommand::Disarm | CrewCommand::Hold | CrewCommand::Abort | CrewCommand::EndCheck)
}

/// Why the station expects another mission; `None` if it expects this one or states none.
pub fn why_other_mission(request: &CommandRequest, vehicle: &VehicleState<'_>) -> Option<String> {
    let [_, _, _, param4, param5, param6, _] = request.params;
    let flies = vehicle.name;
    match Expected::of_params([param4, param5, param6]) {
        Expected::Any => None,
        Expected::Hash(expected) if expected == flies.hash => None,
        Expected::Hash(expected) => {
            Some(format!("this vehicle flies {} {}, not {expected}", flies.name, flies.hash))
        }
        Expected::Unreadable => {
            Some("parameters 4 to 6 are no mission's hash (0 for any mission)".to_owned())
        }
    }
}
