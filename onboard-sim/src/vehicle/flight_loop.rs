//! One frame of the flight computer.

use std::time::Duration;

use flight::arming::Check;
use flight::controller::{self, ControlLevel, ControllerInput};
use flight::dynamics::PlanarParams;
use flight::phase::{Event, Motor, NO_THRUST_TIMEOUT_S, Phase, StartPoint};
use flight::thrust_estimate::ThrustSample;
use flight::verdict::LandingVerdict;

use super::{DeadlinePolicy, REHEARSAL_PERIOD_S, Severity, THRUST_CONFIRM_S, Tick, Vehicle, VehicleEvent};
use crate::craft::{Craft as _, Judged, TestStep, self_test_failed};
use crate::plant::Impact;

impl Vehicle {
    pub(super) fn run_frame(&mut self, stopwatch: &mut dyn FnMut() -> Duration) {
        if self.frame.is_multiple_of(self.frames_per_sample) {
            self.run_sample(stopwatch);
        }
        for _ in 0..self.substeps_per_frame {
            if let Some(impact) = self.plant.step() {
                self.touch(impact);
            }
        }
        self.frame += 1;
        self.look_around();
        self.keep_time();
    }

    /// The part that falls on a controller sample: actuators first, then phases, then the controller.
    fn run_sample(&mut self, stopwatch: &mut dyn FnMut() -> Duration) {
        let time_s = self.time_s();
        if self.mode.phase != Phase::Safe {
            self.gimbal_applied_rad = self.next_gimbal_rad;
            self.plant.command(self.gimbal_applied_rad, self.fin_command_rad);
        }

        if self.mode.phase == Phase::Safe {
            self.test_itself(time_s);
        }
        if self.mode.countdown_remaining_s(time_s).is_some_and(|left_s| left_s <= 0.0)
            && self.happen(Event::ReleasedAt(StartPoint::Ignition)).is_none()
        {
            self.plant.release(self.draw.release);
        }
        let sample = self.frame / self.frames_per_sample;
        if self.controller_is_due(sample) {
            self.run_controller(sample, stopwatch);
            self.complain_of_readiness();
        }
        // After the controller: the gate judges a plan from where the vehicle is now, not a rehearsal.
        if self.mode.phase == Phase::LandArmed {
            self.evaluate_gate();
        }
    }

    /// Every sample in flight; on the pad when there is no rehearsal yet and then once in a while.
    fn controller_is_due(&self, sample: u64) -> bool {
        let between = (REHEARSAL_PERIOD_S / self.profile.nmpc.sample_time_s).round().max(1.0) as u64;
        match self.mode.phase {
            _ if self.is_over() => false,
            phase if phase.on_pad() => {
                let rehearsed =
                    self.output.as_ref().is_some_and(|output| output.level == ControlLevel::Rehearsal);
                sample.is_multiple_of(between) || (phase != Phase::Safe && !rehearsed)
            }
            _ => true,
        }
    }

    fn complain_of_readiness(&mut self) {
        if self.mode.phase == Phase::PadIdle
            && let Some(words) = self.readiness.news(&self.arming_checks())
        {
            self.say(Severity::Warning, words);
        }
    }

    fn test_itself(&mut self, time_s: f64) {
        let closed_rad = self.profile.fins.closed_rad();
        match self.self_test.step(self.actuators_answer(), time_s) {
            TestStep::Command(angle_rad) => self.plant.command(angle_rad, [closed_rad + angle_rad; 4]),
            TestStep::Passed => {
                self.happen(Event::SelfTestPassed);
            }
            TestStep::Failed => {
                let fins = self.fins_answering().iter().filter(|answers| **answers).count();
                self.say(Severity::Error, self_test_failed(fins));
            }
            TestStep::Wait => {}
        }
    }

    fn evaluate_gate(&mut self) {
        let checks = self.gate_checks();
        let failing = checks.iter().find(|check| !check.passed);
        let open = failing.is_none();
        // Said when the reason changes, not ten times a second over a radio.
        let complaint = failing.map(|check| check.name);
        if complaint != self.gate_complaint
            && let Some(reason) = failing.and_then(Check::refusal)
        {
            self.say(Severity::Critical, format!("ignition gate closed: {reason}"));
        }
        if let Some(refusal) = self.happen(Event::IgnitionGate { open })
            && complaint != self.gate_complaint
        {
            self.say(Severity::Critical, format!("no ignition: {}", refusal.reason()));
        }
        self.gate_complaint = complaint;
    }

    fn run_controller(&mut self, sample: u64, stopwatch: &mut dyn FnMut() -> Duration) {
        let deadline_s = self.profile.nmpc.sample_time_s;
        let since_ignition_s =
            self.ignition_sample.map_or(0.0, |ignition| (sample - ignition) as f64 * deadline_s);
        let input = ControllerInput {
            tick: self.tick,
            time_s: self.time_s(),
            phase: self.mode.phase,
            time_since_ignition_s: since_ignition_s,
            state: self.plant.state(),
            gimbal_applied_rad: self.gimbal_applied_rad,
            thrust_scale: self.thrust.scale(),
            degraded: false,
            lands_here: self.mode.interlocks.lands_here,
            deadline_missed: self.misses > 0,
        };
        let began = stopwatch();
        let output = controller::step(&mut self.controller, &input);
        let solve_time_s = stopwatch().saturating_sub(began).as_secs_f64();

        let level_before = self.output.as_ref().map(|output| output.level);
        if self.mode.phase.in_landing_burn() && level_before != Some(output.level) {
            self.say(Severity::Notice, format!("controller level {}", output.level.name()));
        }
        let late = solve_time_s > deadline_s && self.policy == DeadlinePolicy::Enforce;
        self.next_gimbal_rad = if late {
            self.misses += 1;
            self.say(Severity::Warning, format!("deadline missed by {:.3} s", solve_time_s - deadline_s));
            let before = self.in_time.as_ref();
            before.map_or(0.0, |before| before.command_after_misses_rad(self.misses))
        } else {
            self.misses = 0;
            self.in_time = Some(output.clone());
            output.gimbal_command_rad
        };
        if !self.mode.phase.on_pad() {
            self.fin_command_rad = output.fin_command_rad;
        }
        self.tick += 1;
        self.solve_time_s = solve_time_s;
        self.events.push(VehicleEvent::Tick(Box::new(Tick {
            input,
            output: output.clone(),
            state_digest: self.controller.digest(),
            solve_time_s,
            deadline_s,
        })));
        self.output = Some(output);
    }

    /// What the flight computer senses between samples.
    fn look_around(&mut self) {
        let time_s = self.time_s();
        self.weigh_the_motor(time_s);
        let in_phase_s = time_s - self.mode.entered_at_s;
        let thrust_confirmed = self.thrust_is_confirmed(time_s);
        match self.mode.phase {
            Phase::Ignition if thrust_confirmed => {
                self.happen(Event::ThrustConfirmed);
            }
            Phase::Ignition
                if in_phase_s >= NO_THRUST_TIMEOUT_S && !self.mode.interlocks.no_light_latched =>
            {
                self.happen(Event::NoThrustTimeout);
            }
            Phase::Powered | Phase::Touchdown
                if self.mode.motor == Motor::Burning && self.plant.thrust_n() <= 0.0 =>
            {
                self.happen(Event::Burnout);
            }
            _ => {}
        }
        let airborne =
            !self.mode.phase.on_pad() && !matches!(self.mode.phase, Phase::Touchdown | Phase::Safed);
        if airborne && self.plant.in_contact() {
            let thrust_below_weight = self.plant.thrust_below_weight();
            if self.happen(Event::Contact { thrust_below_weight }).is_none() {
                self.judge();
            }
        }
    }

    /// Whether the accelerometer, since ignition, has felt at least half the nominal thrust for long enough.
    fn thrust_is_confirmed(&mut self, time_s: f64) -> bool {
        let half_m_s2 = 0.5 * self.profile.motor.thrust_n / self.profile.vehicle.mass_kg;
        let lit = self.mode.phase == Phase::Ignition && !self.plant.in_contact();
        if !lit || self.plant.axial_specific_force_m_s2() < half_m_s2 {
            self.thrust_felt_since_s = None;
            return false;
        }
        time_s - *self.thrust_felt_since_s.get_or_insert(time_s) >= THRUST_CONFIRM_S
    }

    /// Learns the motor's strength, once thrust is confirmed and until contact.
    fn weigh_the_motor(&mut self, time_s: f64) {
        let Some(ignition) = self.ignition_sample.filter(|_| self.mode.phase == Phase::Powered) else {
            return;
        };
        let since_ignition_s = time_s - ignition as f64 * self.profile.nmpc.sample_time_s;
        let sample = ThrustSample {
            axial_specific_force_m_s2: self.plant.axial_specific_force_m_s2(),
            state: self.plant.state(),
            gimbal_rad: self.plant.gimbal_rad().1,
            // In contact the ground pushes too.
            nominal_thrust_n: if self.plant.in_contact() {
                0.0
            } else {
                self.profile.motor.thrust_at_n(since_ignition_s)
            },
            interval_s: self.frame_s(),
        };
        self.thrust.update(&PlanarParams::from_profile(&self.profile), &sample);
    }

    fn touch(&mut self, impact: Impact) {
        let vertical_m_s = impact.state.ground_velocity_m_s().1;
        self.say(Severity::Notice, format!("ground contact at {vertical_m_s:.2} m/s"));
        self.impacts.push(impact);
    }

    /// A landing is as good as its worst contact: a bounce does not wash off a hard one.
    fn judge(&mut self) {
        let judged: Vec<_> = self
            .impacts
            .iter()
            .map(|impact| (*impact, LandingVerdict::judge(&self.limits, &impact.state)))
            .collect();
        let worst = judged.iter().find(|(_, verdict)| !verdict.landed()).or(judged.first());
        if let Some((impact, verdict)) = worst.copied() {
            let landed = verdict.landed();
            self.verdict = Some(Judged { impact, verdict, landed });
            self.events.push(VehicleEvent::Verdict { impact, verdict: Box::new(verdict) });
        }
    }
}
