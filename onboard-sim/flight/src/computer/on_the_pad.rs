//! From power-up to the release: self-test, readiness, countdown.

use alloc::format;

use super::news::Severity;
use super::self_test::{ANSWERING_RAD, TestStep};
use super::{Computer, Feeling, Input, Release, Vehicle};
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
        match self.start_point() {
            // A drone's pilot lets go, and the fall is felt.
            StartPoint::Drone => self.wait_below_the_drone(),
            _ if self.countdown_is_over() => self.let_go(),
            StartPoint::Pad => self.wait_on_the_rail(input),
            StartPoint::Apogee | StartPoint::Ignition => {}
        }
        self.check_itself(input);
    }

    /// A motor may light that nobody lit.
    fn wait_on_the_rail(&mut self, input: &Input<'_>) {
        if let (Vehicle::Space(space), Feeling::InSpace(sensed)) = (&mut self.vehicle, &input.feeling)
            && space.pilot.feels_lift_off(sensed)
        {
            self.table.say(Severity::Critical, "LIFT-OFF without a countdown".into());
            if self.happen(Event::LiftOff).is_ok() {
                self.begin_flight();
            }
        }
    }

    fn wait_below_the_drone(&mut self) {
        let Vehicle::Space(space) = &self.vehicle else { return };
        if !space.pad.falls() {
            return;
        }
        let released = if self.countdown_is_over() {
            self.happen(Event::ReleasedAt(StartPoint::Drone))
        } else {
            self.table.say(Severity::Critical, "RELEASED before it was cleared".into());
            let parachute_fills = space.parachute_fills_below_the_drone();
            self.happen(Event::ReleasedEarly { parachute_fills })
        };
        if released.is_ok() {
            self.begin_flight();
        }
    }

    pub(super) fn start_point(&self) -> StartPoint {
        match &self.vehicle {
            Vehicle::Space(space) => space.start_point(),
            Vehicle::Plane(_) => StartPoint::Ignition,
        }
    }

    /// Moves every actuator and brings it back. The test is not passed before `ready` is true.
    pub(super) fn test_itself(&mut self, input: &Input<'_>, ready: bool) {
        let gimbal = self.commands.gimbal_rad.iter().zip(&input.gimbal_rad);
        let answering = gimbal.clone().all(|(told, found)| (told - found).abs() <= ANSWERING_RAD)
            && self.fins_answering == [true; 4];
        // A computer that restarts begins its test late on the vehicle's clock.
        let since_s = input.time_s - self.table.mode().entered_at_s;
        match self.self_test.step(answering, since_s) {
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
        let event = match self.start_point() {
            StartPoint::Pad => Event::CountdownElapsed,
            at => Event::ReleasedAt(at),
        };
        if self.happen(event).is_ok() {
            self.begin_flight();
        }
    }

    fn begin_flight(&mut self) {
        self.release = Some(Release { frame: self.frame, time_s: self.table.time_s() });
        match &mut self.vehicle {
            Vehicle::Space(space) => space.leave_the_pad(),
            Vehicle::Plane(plane) => plane.release(),
        }
    }
}
