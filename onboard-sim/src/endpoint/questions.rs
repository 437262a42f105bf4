//! Questions that are no commands: parameters, and files that this vehicle does not have.

use protocol::dialect::{MavMessage, MavParamError};
use protocol::frame::Frame;
use protocol::ftp::FileRequest;
use protocol::parameter::{ParamKey, ParamQuestion, ParamRequest, error_message};

use super::{MAX_REQUESTED, VehicleEndpoint};
use crate::craft::{Craft, Severity};
use crate::parameters;

impl VehicleEndpoint {
    /// Answers a question about parameters or files; says whether the frame was one.
    pub(super) fn on_question(&mut self, frame: &Frame, vehicle: &dyn Craft) -> bool {
        if let Some(request) = FileRequest::from_frame(frame) {
            if self.us.accepts(request.target) {
                self.queue(request.decline());
            }
            return true;
        }
        let Some(request) = ParamRequest::from_frame(frame) else { return false };
        if !self.us.accepts(request.target) {
            return true;
        }
        let asker = frame.source();
        match request.question {
            // From the beginning, also while an earlier list is on its way.
            ParamQuestion::List => self.next_parameter = Some(0),
            ParamQuestion::Read(key) => match parameters::place_of(key, &self.streams) {
                Some(place) => {
                    let answer = parameters::value(place, &self.streams, vehicle.weights());
                    self.queue(answer);
                }
                None => {
                    self.queue(error_message(key, MavParamError::MAV_PARAM_ERROR_DOES_NOT_EXIST, asker));
                }
            },
            ParamQuestion::Set { id, value, value_type } => {
                let may_change = vehicle.phase().on_pad() && !vehicle.mode().interlocks.armed;
                let now_s = self.last_poll_s;
                match parameters::set(id, value, value_type, may_change, &mut self.streams, now_s) {
                    Ok((place, refusal)) => {
                        let answer = parameters::value(place, &self.streams, vehicle.weights());
                        self.answer(&answer);
                        if let Some(refusal) = refusal {
                            self.say(Severity::Warning, &refusal.reason);
                        }
                    }
                    Err(refusal) => {
                        self.answer(&error_message(ParamKey::Name(id), refusal.error, asker));
                        self.say(Severity::Warning, &refusal.reason);
                    }
                }
            }
        }
        true
    }

    /// Sends it when there is room. Beyond what may wait it is dropped: whoever wants it asks again.
    fn queue(&mut self, message: MavMessage) {
        if self.requested.len() < MAX_REQUESTED {
            self.requested.push_back(message);
        }
    }

    /// What was asked for and is to be sent next: single messages first, then the list of parameters.
    pub(super) fn next_requested(&mut self, vehicle: &dyn Craft) -> Option<MavMessage> {
        if let Some(message) = self.requested.pop_front() {
            return Some(message);
        }
        let place = self.next_parameter.filter(|place| *place < parameters::count(&self.streams));
        self.next_parameter = place.map(|place| place + 1);
        place.map(|place| parameters::value(place, &self.streams, vehicle.weights()))
    }
}
