//! The crew's two steps, for a flight without a crew.

use flight::arming;
use flight::phase::Phase;

use crate::craft::{Craft, Request};

/// Arms and starts once the checks pass.
pub(super) struct AutoPilot {
    pub(super) wanted: bool,
    pub(super) refused: Option<String>,
}

impl AutoPilot {
    pub(super) fn act(&mut self, vehicle: &mut dyn Craft) {
        if !self.wanted || self.refused.is_some() || vehicle.phase() != Phase::PadIdle {
            return;
        }
        let refusal = arming::first_refusal(&vehicle.arming_checks());
        match refusal {
            Some(reason) if vehicle.time_s() > vehicle.ready_within_s() => self.refused = Some(reason),
            Some(_) => {}
            None => {
                let answers = [vehicle.request(Request::Arm), vehicle.request(Request::Start)];
                self.refused = answers.into_iter().find_map(|answer| answer.reason);
                self.wanted = false;
            }
        }
    }
}
