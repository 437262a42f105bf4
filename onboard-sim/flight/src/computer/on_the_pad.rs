//! From power-up to the release: self-test, readiness, countdown.

use alloc::format;

use super::news::Severity;
use super::self_test::{ANSWERING_RAD, TestStep};
use super::{Computer, Input, Release};
use crate::rules::phase::{Event, Phase, StartPoint};
use crate::vehicle::atmosphere::STANDARD_GRAVITY_M_S2;
use crate::vehicle::rigid::RigidState;

impl Computer {
    /// One frame on the pad.
    pub(super) fn wait_on_the_pad(&mut self, input: &Input<'_>) {
        if self.table.mode().phase == Phase::Safe {
            self.test_itself(input);
        }
        if self.rehearsed.is_some() {
            self.complain_of_readiness();
        }
        match self.start_point() {
            // A drone's pilot lets go, and the fall is felt.
            StartPoint::Drone => self.wait_below_the_drone(),
            _ if self.countdown_is_over() => self.let_go(),
            StartPoint::Pad => self.wait_on_the_rail(input),
            StartPoint::Apogee => {}
        }
        self.check_itself(input);
    }

    /// A motor may light that nobody lit.
    fn wait_on_the_rail(&mut self, input: &Input<'_>) {
        if self.pilot.feels_lift_off(&input.sensed) {
            self.table.say(Severity::Critical, "LIFT-OFF without a countdown".into());
            if self.table.happen(Event::LiftOff).is_ok() {
                self.begin_flight();
            }
        }
    }

    fn wait_below_the_drone(&mut self) {
        if !self.pad.falls() {
            return;
        }
        let released = if self.countdown_is_over() {
            self.table.happen(Event::ReleasedAt(StartPoint::Drone))
        } else {
            self.table.say(Severity::Critical, "RELEASED before it was cleared".into());
            let parachute_fills = self.parachute_fills_below_the_drone();
            self.table.happen(Event::ReleasedEarly { parachute_fills })
        };
        if released.is_ok() {
            self.begin_flight();
        }
    }

    pub(super) fn start_point(&self) -> StartPoint {
        self.pilot.mission().start.at
    }

    /// Moves every actuator and brings it back. The test is not passed before the sensors were felt for a second.
    fn test_itself(&mut self, input: &Input<'_>) {
        let gimbal = self.commands.gimbal_rad.iter().zip(&input.gimbal_rad);
        let answering = gimbal.clone().all(|(told, found)| (told - found).abs() <= ANSWERING_RAD)
            && self.fins_answering == [true; 4];
        // A computer that restarts begins its test late on the vehicle's clock.
        let since_s = input.time_s - self.table.mode().entered_at_s;
        match self.self_test.step(answering, since_s) {
            TestStep::Command(angle_rad) => {
                let closed_rad = self.closed_rad();
                self.commands.gimbal_rad = [angle_rad; 2];
                self.commands.fins_rad = [closed_rad + angle_rad; 4];
            }
            TestStep::Passed if self.pad.has_felt() => {
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
        self.pilot.mission().airframe.fins.closed_rad()
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
        if self.table.happen(event).is_ok() {
            self.begin_flight();
        }
    }

    /// A vehicle that stood on its rail knows its attitude and the bias of its gyro from there.
    fn begin_flight(&mut self) {
        self.release = Some(Release { frame: self.frame, time_s: self.table.time_s() });
        let mission = self.pilot.mission();
        if let (Some(launch), Some(start)) = (&mission.launch, self.pad.at_rest())
            && mission.start.at == StartPoint::Pad
        {
            let believed = RigidState {
                world_from_body: start.world_from_body,
                ..launch.standing(mission.airframe.mass.loaded_cg_station_m)
            };
            self.pilot.stand(&believed, start.gyro_bias_rad_s);
        }
    }

    /// Whether the parachute fills before a vehicle that falls from its drone meets the ground.
    fn parachute_fills_below_the_drone(&self) -> bool {
        let parachute = &self.pilot.mission().airframe.parachute;
        // From rest it falls faster and faster: the speed when the lines are taut.
        let delay_s = parachute.ejection_delay_s;
        let fall_m = 0.5 * STANDARD_GRAVITY_M_S2 * delay_s * delay_s + parachute.inflation_distance_m;
        self.pad.stance(true).hanging_m.is_some_and(|height_m| height_m > fall_m)
    }
}
