//! An abort is acknowledged when its latch is seen, not when it was heard: a flight computer takes it at its next frame.

use flight::phase::Phase;
use protocol::command::{CommandAnswer, CommandRequest};
use protocol::dialect::MavResult;

use super::VehicleEndpoint;
use crate::craft::Craft;

/// Stations whose aborts wait for the latch at once, at most: it comes with the next frame.
const MAX_LATCHING: usize = 8;

impl VehicleEndpoint {
    /// Answers an abort that was taken once its latch is seen. A station that repeats it is answered once.
    pub(super) fn answer_when_latched(&mut self, link: usize, request: &CommandRequest) {
        self.latching.retain(|(_, waiting)| waiting.source != request.source);
        if self.latching.len() < MAX_LATCHING {
            self.latching.push((link, *request));
        }
    }

    /// Answers the aborts that wait: with the latch, or with a failure where the flight ended before it came.
    pub(super) fn answer_latched(&mut self, vehicle: &dyn Craft) {
        let result = match vehicle.phase() {
            _ if vehicle.aborted() => MavResult::MAV_RESULT_ACCEPTED,
            Phase::Touchdown | Phase::Safed => MavResult::MAV_RESULT_FAILED,
            _ => return,
        };
        for (link, request) in std::mem::take(&mut self.latching) {
            self.lane(link).answer_abort(CommandAnswer::to(&request, result));
        }
    }
}
