//! Whether the vehicle may be armed, from its checks of itself on the pad.

use alloc::vec::Vec;

use super::Computer;
use super::news::Severity;
use super::pad::Stance;
use crate::rules::arming::{ArmingInput, Check, Uplink, arming_checks};
use crate::rules::phase::Phase;
use crate::vehicle::mission::StartPoint;
use crate::vehicle::rigid::RigidState;

impl Computer {
    /// Attitude and motion on the pad.
    pub fn stance(&self) -> Stance {
        self.pad.stance(self.start_point() == StartPoint::Drone)
    }

    /// The estimated state on the pad, at rest at the origin.
    pub fn believed_on_the_pad(&self) -> RigidState {
        self.pad.believed()
    }

    /// The arming checks with the present values; the uplink is that of the station heard best.
    pub fn arming_checks(&self) -> Vec<Check> {
        self.arming_checks_by(self.uplink)
    }

    pub(super) fn arming_checks_by(&self, uplink: Uplink) -> Vec<Check> {
        let locks = &self.table.mode().interlocks;
        let stance = self.stance();
        let (controller_warm, controller_found, predicted_landing) = match &self.rehearsed {
            Some(rehearsed) => (rehearsed.warm, rehearsed.found.clone(), rehearsed.landing.clone()),
            None => (false, "no rehearsal yet".into(), None),
        };
        let input = ArmingInput {
            pin_out: locks.pin_out,
            abort_latched: locks.abort_latched,
            tilt_rad: stance.tilt_rad,
            rotation_rad_s: stance.rotation_rad_s,
            speed_m_s: stance.speed_m_s,
            self_test_passed: self.table.mode().phase != Phase::Safe,
            is_checking: self.pad_check.is_busy(self.frame),
            estimator_converged: stance.settled,
            hanging_m: stance.hanging_m,
            fins_answering: self.fins_answering,
            igniter_continuity: self.igniter_continuity,
            log_running: self.log.running,
            log_space_bytes: self.log.space_bytes,
            battery_v: self.battery_v,
            controller_warm,
            controller_found,
            predicted_landing,
            uplink,
        };
        arming_checks(&self.arming, &input)
    }

    pub(super) fn complain_of_readiness(&mut self) {
        if self.table.mode().phase == Phase::PadIdle
            && let Some(words) = self.readiness.news(&self.arming_checks())
        {
            self.table.say(Severity::Warning, words);
        }
    }
}
