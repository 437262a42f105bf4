//! Whether a command that can move something is meant for this vehicle, this boot of it and its
//! mission, and comes from a station that can be told from others. What stops the launch (abort,
//! hold, disarm, the end of a check) is always taken.

use alloc::borrow::ToOwned as _;
use alloc::format;
use alloc::string::String;

use flight::computer::crew::Asked;
use flight::rules::two_person::Station;
use protocol::command::{CommandRequest, MeantBoot};
use protocol::dialect::MavResult;
use protocol::mission::Expected;

use super::VehicleEndpoint;
use crate::link::commands::{Command, Unfit};
use crate::link::stations::SAME_IDS_FOR_S;
use crate::link::vehicle::VehicleState;

/// So long after a frame of another vehicle under our ids, s, a command must name the boot that it
/// is meant for.
const TWIN_FOR_S: f64 = 10.0;

impl VehicleEndpoint {
    /// Notes a frame that names our own ids as its sender.
    pub(super) fn note_twin(&mut self, time_s: f64) {
        if !self.hears_twin(time_s) {
            let (system, component) = (self.us.system_id, self.us.component_id);
            let words = format!(
                "another system {system} component {component} is on this link: commands must name the boot they are for"
            );
            self.say(flight::computer::news::Severity::Warning, &words);
        }
        self.twin_heard_at_s = Some(time_s);
    }

    /// Whether another vehicle under our ids was heard a short while ago.
    fn hears_twin(&self, time_s: f64) -> bool {
        self.twin_heard_at_s.is_some_and(|at_s| time_s - at_s <= TWIN_FOR_S)
    }

    /// Why a command is not carried out, whatever the vehicle would decide; `None` if nothing
    /// speaks against it.
    pub(super) fn why_not_meant(
        &self,
        request: &CommandRequest,
        asked: &Command,
        station: Station,
        vehicle: &VehicleState<'_>,
    ) -> Option<Unfit> {
        let Command::Vehicle(asked) = asked else { return None };
        if !can_move(*asked) {
            return None;
        }
        let refused = |result, why: String| {
            Some(Unfit { result, reason: Some(format!("{} refused: {why}", asked.name())) })
        };
        let (denied, not_now) = (MavResult::MAV_RESULT_DENIED, MavResult::MAV_RESULT_TEMPORARILY_REJECTED);
        if request.target.system_id == 0 {
            return refused(denied, "it is for every vehicle, and must be for one".to_owned());
        }
        let us = self.identity.boot_number;
        match request.meant_boot() {
            MeantBoot::Boot(boot) if boot == us => {}
            MeantBoot::Boot(boot) => {
                return refused(denied, format!("for boot {boot}; this is boot {us}"));
            }
            MeantBoot::Unreadable => {
                return refused(denied, "parameter 7 is no boot number (0 for any boot)".to_owned());
            }
            MeantBoot::Any if self.hears_twin(vehicle.time_s) => {
                let why = "another vehicle has these ids: name the boot that it is for in parameter 7";
                return refused(not_now, why.to_owned());
            }
            MeantBoot::Any => {}
        }
        let others = self.stations.same_ids(station, vehicle.time_s);
        if others > 0 {
            let why = format!("{others} more under the ids {station} in the last {SAME_IDS_FOR_S} s");
            return refused(not_now, why);
        }
        let other_mission = (*asked == Asked::Arm).then(|| why_other_mission(request, vehicle)).flatten();
        other_mission.and_then(|why| refused(denied, why))
    }
}

/// Whether it may move or light something, or lets somebody go on who does.
pub(super) fn can_move(asked: Asked) -> bool {
    !matches!(asked, Asked::Disarm | Asked::Hold | Asked::Abort | Asked::EndCheck)
}

/// Why the station expects another mission; `None` if it expects this one or says nothing of it.
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
