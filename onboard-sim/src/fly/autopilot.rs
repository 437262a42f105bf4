//! The crew's two steps, for a flight without a crew.

use flight::arming;
use flight::phase::Phase;

use crate::vehicle::{Request, Vehicle};

/// Arms and starts once the checks pass.
pub(super) struct AutoPilot {
    pub(super) wanted: bool,
    pub(super) refused: Option<String>,
}

impl AutoPilot {
    /// The first controller tick has run by then, or never will.
    const PATIENCE_S: f64 = 3.0;

    pub(super) fn act(&mut self, vehicle: &mut Vehicle) {
        if !self.wanted || self.refused.is_some() || vehicle.phase() != Phase::PadIdle {
            return;
        }
        let refusal = arming::first_refusal(&vehicle.arming_checks());
        match refusal {
            Some(reason) if vehicle.time_s() > Self::PATIENCE_S => self.refused = Some(reason),
            Some(_) => {}
            None => {
                let answers = [vehicle.request(Request::Arm), vehicle.request(Request::Start)];
                self.refused = answers.into_iter().find_map(|answer| answer.reason);
                self.wanted = false;
            }
        }
    }
}
