//! The rocket as its run loop and its crew meet it.

use std::time::Duration;

use campaign::sortie::Sortie;
use flight::arming::{ArmingInput, Check, Uplink, arming_checks};
use flight::controller::ControlLevel;
use flight::phase::{Event, Mode, Phase, Refusal, StartPoint, transition};
use flight::profile::StateWeights;
use protocol::log::record::Record;
use protocol::log::v1;

use super::{Air, FRAME_S, Rocket};
use crate::craft::{
    Craft, Judged, LogState, MotorWatch, Radio, Severity, Snapshot, TestStep, VehicleEvent, self_test_failed,
    words_of,
};
use crate::streams::{FROM_APOGEE, Standard};
use crate::{from_apogee, pilot_log};

impl Craft for Rocket {
    /// A product rather than a sum, so that it does not drift.
    fn time_s(&self) -> f64 {
        self.frame as f64 * FRAME_S
    }

    fn frame_s(&self) -> f64 {
        FRAME_S
    }

    fn mode(&self) -> &Mode {
        &self.mode
    }

    fn is_over(&self) -> bool {
        let landed = self.air.as_ref().is_some_and(|air| air.over || air.given_up);
        landed || (self.mode.phase.on_pad() && self.aborted())
    }

    fn standard(&self) -> &'static [Standard] {
        &FROM_APOGEE
    }

    fn weights(&self) -> &StateWeights {
        &self.flight.order.mission.powered.weights
    }

    fn arming_checks(&self) -> Vec<Check> {
        let found = self.pad.found();
        let attitude = found.and_then(|found| found.world_from_body);
        let rehearsed = self.rehearsal.over();
        let locks = &self.mode.interlocks;
        let input = ArmingInput {
            pin_out: locks.pin_out,
            abort_latched: locks.abort_latched,
            tilt_rad: attitude.map_or(f64::NAN, |_| self.pad.believed().tilt_rad()),
            rotation_rad_s: found.map_or(f64::NAN, |found| found.rotation_rad_s),
            speed_m_s: found.map_or(f64::NAN, |found| found.velocity_m_s.norm()),
            self_test_passed: self.mode.phase != Phase::Safe,
            estimator_converged: attitude.is_some(),
            fins_answering: self.pad.fins_answering(),
            igniter_continuity: self.air.is_none(),
            log_running: self.log.running,
            log_space_bytes: self.log.space_bytes,
            controller_warm: rehearsed.is_some_and(|rehearsed| rehearsed.warm),
            controller_found: rehearsed
                .map_or_else(|| "no rehearsal yet".to_owned(), |rehearsed| rehearsed.found.clone()),
            predicted_landing: rehearsed.and_then(|rehearsed| rehearsed.landing),
            uplink: self.uplink,
        };
        arming_checks(&self.flight.order.mission.arming, &input)
    }

    /// The rehearsal of a long flight takes its time.
    fn ready_within_s(&self) -> f64 {
        10.0
    }

    fn countdown_s(&self) -> f64 {
        self.flight.order.mission.start.countdown_s
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

    /// In the air the flight computer moves through the table itself: of what is put to it from outside, it takes the
    /// abort, at its next frame.
    fn happen(&mut self, event: Event) -> Option<Refusal> {
        let time_s = self.time_s();
        let from = self.mode;
        let next = transition(&self.mode, event, time_s);
        if next.refusal.is_some() {
            return next.refusal;
        }
        if let (Some(air), Event::AbortRequested { .. }) = (&mut self.air, event) {
            air.sortie.abort();
            return None;
        }
        self.mode = next.mode;
        let countdown_s = self.countdown_s();
        for effect in next.effects.iter() {
            if let Some((severity, words)) = words_of(effect, countdown_s) {
                self.say(severity, words);
            }
        }
        if self.mode.phase != from.phase {
            self.events.push(VehicleEvent::PhaseChanged { from: from.phase, to: self.mode.phase });
        }
        None
    }

    fn say(&mut self, severity: Severity, text: String) {
        self.events.push(VehicleEvent::Text { severity, text });
    }

    /// By the last frame; the flight computer looks again in the next one.
    fn abort_event(&self) -> Event {
        let on_the_pad = Event::AbortRequested { above_commit_height: false, gate_open: false };
        let flight = self.air.as_ref().map(|air| air.sortie.flight());
        flight.map_or(on_the_pad, |flight| flight.pilot().abort_event(flight.input()))
    }

    fn plans_a_landing(&self) -> bool {
        let pilot = self.air.as_ref().map(|air| air.sortie.flight().pilot());
        pilot.is_none_or(|pilot| pilot.report().level != ControlLevel::Stabiliser)
    }

    fn impact_m_s(&self) -> f64 {
        self.air.as_ref().and_then(|air| air.sortie.flight().pilot().impact_m_s()).unwrap_or(0.0)
    }

    fn advance_frame(&mut self, stopwatch: &mut dyn FnMut() -> Duration) -> Vec<VehicleEvent> {
        self.frame += 1;
        if self.air.is_some() {
            self.fly_frame(stopwatch);
        } else {
            self.wait_on_the_pad();
        }
        self.keep_time();
        core::mem::take(&mut self.events)
    }

    fn snapshot(&self) -> Snapshot {
        self.state_now()
    }

    fn log(&self, changed: bool) -> Vec<Record> {
        let Some(air) = &self.air else { return Vec::new() };
        let flight = air.sortie.flight();
        match () {
            () if air.flown => pilot_log::frame(flight),
            // Let go in this frame: the first frame of the flight is the next one.
            () if changed && flight.frame() == 0 => vec![pilot_log::start(flight)],
            () => Vec::new(),
        }
    }

    /// By what the legs take.
    fn judged(&self) -> Option<Judged> {
        Some(self.air.as_ref()?.judged?.0)
    }

    fn judged_by_table_2(&self) -> Option<Judged> {
        Some(self.air.as_ref()?.judged?.1)
    }

    /// In the words of every flight from apogee; its time counts from there, as that of the frames.
    fn verdict_record(&self) -> Option<v1::LandingVerdict> {
        from_apogee::verdict(self.air.as_ref()?.sortie.flight())
    }

    fn radio(&self) -> Radio {
        self.air.as_ref().map_or_else(Radio::default, |air| {
            let radio = *air.sortie.flight().radio();
            Radio { silent: radio.silent || air.computer_is_dead(), ..radio }
        })
    }
}

impl Rocket {
    fn wait_on_the_pad(&mut self) {
        let time_s = self.time_s();
        if let Some(measurements) = self.pad.step() {
            self.watch.take(&measurements, self.frame);
        }
        if self.mode.phase == Phase::Safe {
            match self.pad.test_itself(time_s) {
                TestStep::Passed => {
                    self.happen(Event::SelfTestPassed);
                }
                TestStep::Failed => {
                    let fins = self.pad.fins_answering().iter().filter(|answers| **answers).count();
                    self.say(Severity::Error, self_test_failed(fins));
                }
                TestStep::Command(_) | TestStep::Wait => {}
            }
        } else {
            self.rehearsal.step(&self.limits);
        }
        if self.mode.phase == Phase::PadIdle
            && self.rehearsal.over().is_some()
            && let Some(words) = self.readiness.news(&self.arming_checks())
        {
            self.say(Severity::Warning, words);
        }
        if self.mode.countdown_remaining_s(time_s).is_some_and(|left_s| left_s <= 0.0) {
            self.let_go(time_s);
        }
    }

    /// The simulation goes on at apogee.
    fn let_go(&mut self, time_s: f64) {
        // Set up once on the pad already, as the rehearsal; what can be wrong about it was found then.
        let sortie = match Sortie::new(&self.flight.order, self.flight.number) {
            Ok(sortie) => sortie,
            Err(error) => {
                self.say(Severity::Error, format!("not started: {error}"));
                self.happen(Event::DisarmRequested);
                return;
            }
        };
        if self.happen(Event::ReleasedAt(StartPoint::Apogee)).is_none() {
            let height_m = sortie.flight().world().height_m();
            self.air = Some(Air::new(sortie, time_s));
            let words = format!("the simulation goes on at apogee, {height_m:.0} m up; no ascent is flown");
            self.say(Severity::Notice, words);
        }
    }
}
