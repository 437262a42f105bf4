//! The check that the crew asks for on the pad: when it may run, and what ends it.

use alloc::format;
use alloc::string::String;

use super::crew::{Answer, Asked, Ending};
use super::news::Severity;
use super::pad::as_measured;
use super::pad_check::{CheckState, PadCheck, PadSwitches, Seen};
use super::self_test::SelfTest;
use super::{Computer, Input};
use crate::rules::operator::Operator;
use crate::rules::phase::Phase;

impl Computer {
    /// The last check on the pad.
    pub fn pad_check(&self) -> &PadCheck {
        &self.pad_check
    }

    /// Why no check may run now.
    fn why_no_check(&self) -> Option<String> {
        let mode = self.table.mode();
        let locks = mode.interlocks;
        let reason = match mode.phase {
            _ if locks.abort_latched => "an abort is latched: restart to clear it",
            _ if self.release.is_some() || !mode.phase.on_pad() => "not on the pad",
            _ if locks.armed || mode.countdown_end_s.is_some() => "armed: disarm first",
            // A self-test that has failed is a reason to look closer.
            Phase::Safe if self.self_test != SelfTest::Failed => "the self-test is not over",
            _ => return None,
        };
        Some(reason.into())
    }

    /// Begins a check. One that runs goes on: a repeated request is no other one.
    pub(super) fn begin_check(&mut self, asked: Asked, by: Option<Operator>) -> Answer {
        if let Some(reason) = self.why_no_check() {
            return Answer { ending: Ending::NotNow, ..self.deny(asked, reason) };
        }
        if self.pad_check.is_running() {
            return Answer::ACCEPTED;
        }
        let moves = asked == Asked::Check;
        self.pad_check.begin(&self.pilot.mission().airframe, moves, by);
        let who = by.map_or_else(String::new, |by| format!("{by}: "));
        let what = if moves { "gimbal and fins MOVE" } else { "nothing moves" };
        self.table.say(Severity::Notice, format!("{who}check of the vehicle begins: {what}"));
        Answer::ACCEPTED
    }

    /// Ends a running check, and brings the surfaces to rest. Returns whether one ran.
    pub(super) fn end_check(&mut self, why: &str) -> bool {
        let ran = self.pad_check.stop(self.frame);
        if ran {
            self.rest_surfaces();
            self.table.say(Severity::Warning, format!("check of the vehicle ended early: {why}"));
        }
        ran
    }

    fn rest_surfaces(&mut self) {
        (self.commands.gimbal_rad, self.commands.fins_rad) = ([0.0; 2], [self.closed_rad(); 4]);
    }

    /// One frame of a running check. It ends here at the latest, whatever has happened in this frame.
    pub(super) fn check_itself(&mut self, input: &Input<'_>) {
        if !self.pad_check.is_running() {
            return;
        }
        if let Some(reason) = self.why_no_check() {
            // In the air the pilot commands from the next frame on.
            self.end_check(&reason);
            return;
        }
        let ([pitch_rad, yaw_rad], [one, two, three, four]) = (input.gimbal_rad, input.fins_rad);
        let seen = Seen {
            surfaces_rad: [pitch_rad, yaw_rad, one, two, three, four],
            measured: &as_measured(&input.sensed),
            switches: PadSwitches {
                igniter_continuity: self.igniter_continuity,
                booster_attached: self.booster_attached,
                pin_out: input.pin_out,
                battery_v: self.battery_v,
                log_running: self.log.running,
                log_space_bytes: self.log.space_bytes,
            },
        };
        let told = self.pad_check.step(&seen, self.pilot.mission(), &self.arming);
        self.rest_surfaces();
        match told {
            Some((surface @ 0..2, angle_rad)) => self.commands.gimbal_rad[surface] = angle_rad,
            Some((surface, angle_rad)) => self.commands.fins_rad[surface - 2] = angle_rad,
            None => {}
        }
        match self.pad_check.state() {
            CheckState::Passed => self.table.say(Severity::Notice, self.pad_check.words()),
            CheckState::Failed => self.table.say(Severity::Warning, self.pad_check.words()),
            CheckState::NotRun | CheckState::Running | CheckState::Stopped => {}
        }
    }
}
