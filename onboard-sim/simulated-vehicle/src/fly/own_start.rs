//! Arms and starts a flight without a crew.

use flight::computer::crew::{Answer, Asked, Request};
use flight::rules::arming;
use flight::rules::phase::Phase;

use crate::vehicle::Vehicle;

/// The arming checks pass within this time, s, if they ever do: the rehearsal of a long flight takes some seconds.
const READY_WITHIN_S: f64 = 10.0;

/// Arms and starts once the checks pass.
pub(super) struct OwnStart {
    pub(super) wanted: bool,
    pub(super) refused: Option<String>,
    /// It has asked for arming and start.
    pub(super) asked: bool,
}

impl OwnStart {
    /// The request for this frame.
    pub(super) fn requests(&mut self, vehicle: &Vehicle) -> Vec<Request> {
        let mode = vehicle.mode();
        if self.asked && mode.phase.on_pad() && !mode.interlocks.armed && !vehicle.aborted() {
            // A reset has disarmed it. Only a person arms it again.
            self.refused.get_or_insert_with(|| "disarmed on the pad after it was started".to_owned());
        }
        if !self.wanted || self.refused.is_some() || vehicle.phase() != Phase::PadIdle {
            return Vec::new();
        }
        match arming::first_refusal(&vehicle.arming_checks()) {
            Some(reason) if vehicle.time_s() > READY_WITHIN_S => self.refused = Some(reason),
            Some(_) => {}
            None => {
                (self.wanted, self.asked) = (false, true);
                return [Asked::Arm, Asked::Start].map(Request::of_the_programme).to_vec();
            }
        }
        Vec::new()
    }

    /// Takes the answer to the request.
    pub(super) fn on_answers(&mut self, answers: &[Answer]) {
        self.refused =
            self.refused.take().or_else(|| answers.iter().find_map(|answer| answer.reason.clone()));
    }
}
