//! The vehicle as its run loop and its crew meet it.

use std::time::Duration;

use flight::arming::{self, ArmingInput, Check, Uplink, arming_checks};
use flight::controller::ControlLevel;
use flight::dynamics::PlanarParams;
use flight::phase::{Effect, Event, Mode, Phase, Refusal, transition};
use flight::profile::StateWeights;
use flight::verdict::LandingVerdict;
use flight::vertical::fall_ends_m_s;
use protocol::log::record::Record;
use protocol::log::v1;

use super::{AT_REST_S, Severity, Vehicle};
use crate::craft::{
    Craft, Judged, LogState, MotorWatch, Snapshot, VehicleEvent, words_of, words_of_landing_here,
};
use crate::streams::{STANDARD, Standard};

impl Craft for Vehicle {
    /// A product rather than a sum, so that it does not drift.
    fn time_s(&self) -> f64 {
        self.frame as f64 * self.frame_s()
    }

    fn frame_s(&self) -> f64 {
        Self::frame_s(self)
    }

    fn mode(&self) -> &Mode {
        &self.mode
    }

    fn is_over(&self) -> bool {
        let in_phase_s = self.time_s() - self.mode.entered_at_s;
        match self.mode.phase {
            Phase::Touchdown => in_phase_s >= AT_REST_S,
            Phase::Safed => true,
            phase => phase.on_pad() && self.aborted(),
        }
    }

    fn standard(&self) -> &'static [Standard] {
        &STANDARD
    }

    fn weights(&self) -> &StateWeights {
        &self.profile.nmpc.weights
    }

    fn arming_checks(&self) -> Vec<Check> {
        let state = self.plant.state();
        let solver = self.output.as_ref().map(|output| output.solver);
        let rehearsed = self.output.as_ref().filter(|output| output.level == ControlLevel::Rehearsal);
        let input = ArmingInput {
            pin_out: self.mode.interlocks.pin_out,
            abort_latched: self.mode.interlocks.abort_latched,
            tilt_rad: state.theta_rad - core::f64::consts::FRAC_PI_2,
            rotation_rad_s: state.q_rad_s,
            speed_m_s: state.speed_m_s(),
            self_test_passed: self.mode.phase != Phase::Safe,
            // The estimate is the truth.
            estimator_converged: true,
            fins_answering: self.fins_answering(),
            igniter_continuity: self.ignition_sample.is_none(),
            log_running: self.log.running,
            log_space_bytes: self.log.space_bytes,
            controller_warm: solver.is_some_and(|solver| solver.converged()),
            controller_found: solver.map_or_else(|| "no rehearsal yet".to_owned(), |solver| solver.summary()),
            predicted_landing: rehearsed
                .filter(|output| output.plan.len > 0)
                .map(|output| LandingVerdict::judge_plan(&self.limits, &output.predicted_touchdown.state)),
            uplink: self.uplink,
        };
        arming_checks(&self.profile.arming, &input)
    }

    fn countdown_s(&self) -> f64 {
        self.profile.start.countdown_s
    }

    fn log_state(&mut self) -> &mut LogState {
        &mut self.log
    }

    fn uplink(&mut self) -> &mut Uplink {
        &mut self.uplink
    }

    fn motor_watch(&mut self) -> &mut MotorWatch {
        &mut self.motor_watch
    }

    fn happen(&mut self, event: Event) -> Option<Refusal> {
        let time_s = self.time_s();
        let from = self.mode;
        let next = transition(&self.mode, event, time_s);
        if next.refusal.is_some() {
            return next.refusal;
        }
        self.mode = next.mode;
        for effect in next.effects.iter() {
            self.take_effect(effect);
        }
        if let Some((severity, words)) = words_of_landing_here(from.interlocks, self.mode.interlocks) {
            self.say(severity, words);
        }
        if self.mode.phase != from.phase {
            self.events.push(VehicleEvent::PhaseChanged { from: from.phase, to: self.mode.phase });
        }
        None
    }

    fn say(&mut self, severity: Severity, text: String) {
        self.events.push(VehicleEvent::Text { severity, text });
    }

    /// This vehicle carries no parachute: no height is above its commit height.
    fn abort_event(&self) -> Event {
        let gate_open = self.mode.phase.in_descent() && arming::all_passed(&self.gate_checks());
        Event::AbortRequested { above_commit_height: false, gate_open }
    }

    fn plans_a_landing(&self) -> bool {
        self.output.as_ref().is_none_or(|output| output.level != ControlLevel::Stabiliser)
    }

    fn impact_m_s(&self) -> f64 {
        let state = self.plant.state();
        let params = PlanarParams::from_profile(&self.profile);
        let terminal_m_s = libm::sqrt(params.gravity_m_s2 / params.drag_per_m);
        fall_ends_m_s(state.z_m, state.ground_velocity_m_s().1, terminal_m_s, params.gravity_m_s2)
    }

    fn advance_frame(&mut self, stopwatch: &mut dyn FnMut() -> Duration) -> Vec<VehicleEvent> {
        self.run_frame(stopwatch);
        std::mem::take(&mut self.events)
    }

    fn snapshot(&self) -> Snapshot {
        self.state_now()
    }

    fn log(&self, changed: bool) -> Vec<Record> {
        // The waiting vehicle does not move: once a second and at every change of phase is enough to see that.
        let moving = !self.mode.phase.on_pad() && !self.is_over();
        if moving || changed || (self.time_s().fract() < 0.015) {
            vec![Record::PlantTruth(Box::new(self.truth()))]
        } else {
            Vec::new()
        }
    }

    fn judged(&self) -> Option<Judged> {
        self.verdict
    }
}

impl Vehicle {
    fn take_effect(&mut self, effect: Effect) {
        match effect {
            Effect::IgniteLandingMotor => {
                self.plant.ignite();
                self.ignition_sample = Some(self.frame.div_ceil(self.frames_per_sample));
            }
            Effect::FinsOpen => self.fin_command_rad = [self.profile.fins.deployed_rad(); 4],
            _ => {}
        }
        if let Some((severity, words)) = words_of(effect, self.profile.start.countdown_s) {
            self.say(severity, words);
        }
    }

    fn truth(&self) -> v1::PlantTruth {
        let (gimbal_rad, fins_rad) = (self.plant.gimbal_rad(), self.plant.fins_rad());
        v1::PlantTruth {
            time_s: self.time_s(),
            phase: u32::from(self.mode.phase.index()),
            state: tick_log::state_to_log(&self.plant.state()),
            gimbal_commanded_rad: gimbal_rad.0,
            gimbal_actual_rad: gimbal_rad.1,
            fin_commanded_rad: fins_rad.0.to_vec(),
            fin_actual_rad: fins_rad.1.to_vec(),
            thrust_n: self.plant.thrust_n(),
            mass_kg: self.plant.mass_kg(),
            in_contact: self.plant.in_contact(),
        }
    }
}
