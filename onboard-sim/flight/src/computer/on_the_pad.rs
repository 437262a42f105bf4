//! From power-up to the release: self-test, readiness, countdown.

use alloc::format;

use super::news::Severity;
use super::self_test::{ANSWERING_RAD, TestStep};
use super::{Computer, Input, Release, Vehicle};
use crate::rules::phase::{Event, Phase, StartPoint};

impl Computer {
    /// One frame of a rocket on its pad.
    pub(super) fn wait_on_the_pad(&mut self, input: &Input<'_>) {
        if self.table.mode().phase == Phase::Safe {
            let felt = matches!(&self.vehicle, Vehicle::Space(space) if space.pad.has_felt());
            self.test_itself(input, felt);
        }
        if self.rehearsed.is_some() {
            self.complain_of_readiness();
        }
        if self.countdown_is_over() {
            self.let_go();
        }
    }

    /// Moves every actuator and brings it back. The test is not passed before `ready` is true.
    pub(super) fn test_itself(&mut self, input: &Input<'_>, ready: bool) {
        let gimbal = self.commands.gimbal_rad.iter().zip(&input.gimbal_rad);
        let answering = gimbal.clone().all(|(told, found)| (told - found).abs() <= ANSWERING_RAD)
            && self.fins_answering == [true; 4];
        match self.self_test.step(answering, input.time_s) {
            TestStep::Command(angle_rad) => {
                let closed_rad = self.closed_rad();
                let yaw_rad = if matches!(self.vehicle, Vehicle::Space(_)) { angle_rad } else { 0.0 };
                self.commands.gimbal_rad = [angle_rad, yaw_rad];
                self.commands.fins_rad = [closed_rad + angle_rad; 4];
            }
            TestStep::Passed if ready => {
                let _ = self.table.happen(Event::SelfTestPassed);
            }
            TestStep::Failed => {
                let fins = self.fins_answering.iter().filter(|answers| **answers).count();
                let words = format!("self-test failed: an actuator does not answer ({fins} of 4 fins do)");
                self.table.say(Severity::Error, words);
            }
            TestStep::Passed | TestStep::Wait => {}
        }
    }

    pub(super) fn closed_rad(&self) -> f64 {
        match &self.vehicle {
            Vehicle::Space(space) => space.pilot.mission().airframe.fins.closed_rad(),
            Vehicle::Plane(plane) => plane.profile().fins.closed_rad(),
        }
    }

    pub(super) fn countdown_is_over(&self) -> bool {
        self.table.mode().countdown_remaining_s(self.table.time_s()).is_some_and(|left_s| left_s <= 0.0)
    }

    /// The countdown has ended: the flight begins where the simulation releases the vehicle.
    pub(super) fn let_go(&mut self) {
        let at = match self.vehicle {
            Vehicle::Space(_) => StartPoint::Apogee,
            Vehicle::Plane(_) => StartPoint::Ignition,
        };
        if self.happen(Event::ReleasedAt(at)).is_ok() {
            self.release = Some(Release { frame: self.frame, time_s: self.table.time_s() });
            if let Vehicle::Plane(plane) = &mut self.vehicle {
                plane.release();
            }
        }
    }
}
