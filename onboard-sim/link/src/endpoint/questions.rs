//! Answers messages that are not commands: questions about parameters, files and lists.

use alloc::vec;
use protocol::dialect::MavParamError;
use protocol::frame::Frame;
use protocol::ftp::FileRequest;
use protocol::parameter::{ParamKey, ParamQuestion, ParamRequest, error_message};

use super::lists::ListQuestion;
use super::{Path, VehicleEndpoint, operator_of, sender_of};
use crate::parameters;
use crate::vehicle::Vehicle;
use flight::computer::news::Severity;

impl VehicleEndpoint {
    /// Answers a question about parameters, files or lists; returns whether the frame was one.
    pub(super) fn on_question(&mut self, path: Path, frame: &Frame, vehicle: &dyn Vehicle) -> bool {
        let link = path.link;
        if let Some(request) = FileRequest::from_frame(frame) {
            if self.us.accepts(request.target) {
                self.on_file_request(link, &request, operator_of(frame, vehicle), vehicle);
            }
            return true;
        }
        if let Some(question) = ListQuestion::from_frame(frame) {
            if self.us.accepts(question.target) {
                self.lane(link).request(vec![question.answer]);
            }
            return true;
        }
        let Some(request) = ParamRequest::from_frame(frame) else { return false };
        if !self.us.accepts(request.target) {
            return true;
        }
        let (asker, by) = (frame.source(), operator_of(frame, vehicle));
        match request.question {
            ParamQuestion::List => self.lane(link).list_parameters(),
            ParamQuestion::Read(key) => {
                let lane = self.lane(link);
                let answer = match parameters::place_of(key) {
                    Some(place) => parameters::value(place, &lane.streams, &vehicle.weights()),
                    None => error_message(key, MavParamError::MAV_PARAM_ERROR_DOES_NOT_EXIST, asker),
                };
                lane.request(vec![answer]);
            }
            ParamQuestion::Set { id, value, value_type } => {
                let station = self.stations.of(&sender_of(frame, path, vehicle));
                let forbidden = self.rates_forbidden(station, by, vehicle);
                let now_s = self.now_s;
                let set = self.with_rates_of(link, |streams| {
                    parameters::set(id, value, value_type, forbidden, streams, now_s)
                });
                let lane = self.lane(link);
                let (answer, refusal) = match set {
                    Ok((place, refusal)) => {
                        (parameters::value(place, &lane.streams, &vehicle.weights()), refusal)
                    }
                    Err(refusal) => (error_message(ParamKey::Name(id), refusal.error, asker), Some(refusal)),
                };
                lane.answer(answer.into());
                if let Some(refusal) = refusal {
                    self.say(Severity::Warning, &refusal.reason);
                }
            }
        }
        true
    }
}
