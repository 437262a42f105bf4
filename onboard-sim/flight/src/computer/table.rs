//! The phase table as the flight computer uses it: every event of a vehicle goes through here once.
//! Also what an abort would do now.

use alloc::borrow::ToOwned as _;
use alloc::string::String;
use alloc::vec::Vec;
use serde::Serialize;

use super::Computer;
use super::news::{CrewMessage, Severity, words_of, words_of_landing_here};
use crate::guidance::powered::ControlLevel;
use crate::rules::phase::{Effect, Effects, Event, Latch, Mode, Phase, Refusal, transition};

/// Phase and latches, and the reports of this frame.
#[derive(Debug, Clone, Serialize)]
pub struct PhaseTable {
    mode: Mode,
    /// What latched first. It follows from the events and decides nothing, so no digest holds it.
    #[serde(skip)]
    latch: Option<Latch>,
    /// Vehicle time of this frame, s.
    #[serde(skip)]
    time_s: f64,
    #[serde(skip)]
    news: Vec<CrewMessage>,
}

impl PhaseTable {
    /// The table at power-up.
    pub(super) fn new(time_s: f64) -> Self {
        Self { mode: Mode::power_up(time_s), latch: None, time_s, news: Vec::new() }
    }

    /// Takes up a mode after a reset. Nothing happens: its effects were carried out before.
    pub(super) fn go_on(&mut self, mode: Mode, latch: Option<Latch>) {
        (self.mode, self.latch) = (mode, latch);
    }

    /// Begins a frame.
    pub(super) fn begin(&mut self, time_s: f64) {
        self.time_s = time_s;
    }

    /// Phase, latches, countdown and motor.
    pub fn mode(&self) -> &Mode {
        &self.mode
    }

    /// Why the landing motor is inhibited for good.
    pub fn latch(&self) -> Option<Latch> {
        self.latch
    }

    /// Vehicle time of this frame, s.
    pub(super) fn time_s(&self) -> f64 {
        self.time_s
    }

    /// Applies an event. The caller carries out its effects; the crew is told of them here.
    ///
    /// # Errors
    /// The table refuses the event, and nothing has changed.
    pub(crate) fn happen(&mut self, event: Event) -> Result<Effects, Refusal> {
        let before = self.mode;
        let next = transition(&before, event, self.time_s);
        if let Some(refusal) = next.refusal {
            return Err(refusal);
        }
        self.mode = next.mode;
        self.latch = self.latch.or_else(|| Latch::of(&event, before.interlocks, next.mode.interlocks));
        let countdown_s =
            if let Event::StartRequested { countdown_s, .. } = event { countdown_s } else { 0.0 };
        for effect in next.effects.iter() {
            // At touchdown, the motor may have been inhibited long before: it is not reported
            // again.
            let known = effect == Effect::InhibitLandingMotor && before.interlocks.landing_motor_inhibited;
            if let Some((severity, words)) = words_of(effect, countdown_s).filter(|_| !known) {
                self.say(severity, words);
            }
        }
        if let Some((severity, words)) = words_of_landing_here(before.interlocks, &self.mode) {
            self.say(severity, words.to_owned());
        }
        if self.mode.phase != before.phase {
            self.news.push(CrewMessage::PhaseChanged { from: before.phase, to: self.mode.phase });
        }
        Ok(next.effects)
    }

    /// Sends a message to the crew.
    pub(crate) fn say(&mut self, severity: Severity, words: String) {
        self.news.push(CrewMessage::Said { severity, words });
    }

    /// Takes the reports of this frame, in order.
    pub(super) fn take_news(&mut self) -> Vec<CrewMessage> {
        core::mem::take(&mut self.news)
    }
}

// The consequence for the vehicle if the crew aborted now.

/// What an abort would do now.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AbortEffect {
    /// Nothing is left to abort.
    None,
    /// Disarm and inhibit on the pad.
    SafeOnPad,
    /// Inhibit the landing motor, parachute at apogee.
    ChuteAtApogee,
    /// Inhibit the landing motor, parachute now.
    ChuteNow,
    /// Too low for a parachute, and the gate is open: light the landing motor at its height and
    /// land on the ground below.
    Burn,
    /// Too low for a parachute, and the gate is shut or the motor has not lit: inhibit the landing
    /// motor.
    Impact {
        /// Speed at the ground, rounded up, m/s.
        m_s: u8,
    },
    /// The motor burns and has no cut-off: land on the ground below instead of at the pad.
    LandInPlace,
    /// As `LandInPlace`, but no plan is available: hold upright.
    LandUpright,
}

impl Computer {
    /// Applies an event of the crew. In the air the pilot takes note of what it does.
    ///
    /// # Errors
    /// The table refuses it, and nothing has changed.
    pub(super) fn happen(&mut self, event: Event) -> Result<Effects, Refusal> {
        let before = self.table.mode().phase;
        let effects = match self.flown() {
            Some(input) => self.pilot.apply(&mut self.table, event, input.time_s),
            None => self.table.happen(event),
        }?;
        if before == Phase::Boost && self.table.mode().phase.on_pad() {
            let words = "the ascent motor's igniter is off; it had current: the motor may still light";
            self.table.say(Severity::Critical, words.into());
        }
        Ok(effects)
    }

    /// The event that an abort would be now, from the findings of the last frame.
    pub(super) fn abort_event(&self) -> Event {
        if self.release.is_none() {
            return Event::AbortRequested { lifted_off: false, above_commit_height: false, gate_open: false };
        }
        self.pilot.abort_event(self.table.mode(), self.flown().as_ref(), &self.sensors)
    }

    /// What an abort would do now. The phase table itself is asked, so the text beside the abort
    /// key cannot differ from it.
    pub fn abort_effect(&self) -> AbortEffect {
        let mode = self.table.mode();
        let next = transition(mode, self.abort_event(), self.table.time_s());
        let does = |effect| next.effects.contains(effect);
        // Rounded up to be on the safe side; 254 is the largest value reported, 255 would mean
        // "unknown".
        let fallen_m_s = self.pilot.impact_m_s().unwrap_or(0.0);
        let impact = || AbortEffect::Impact { m_s: libm::ceil(fallen_m_s).clamp(0.0, 254.0) as u8 };
        // The motor was commanded to light and has not.
        let unlit = mode.phase == Phase::Ignition && mode.interlocks.no_light_latched;
        if next.refusal.is_some() {
            AbortEffect::None
        } else if does(Effect::ShowPadWait) {
            AbortEffect::SafeOnPad
        } else if does(Effect::DeployChute) {
            AbortEffect::ChuteNow
        } else if does(Effect::RecordLoss) {
            impact()
        } else if !next.mode.interlocks.lands_in_place {
            AbortEffect::ChuteAtApogee
        } else if mode.phase.in_descent() {
            AbortEffect::Burn
        } else if unlit {
            impact()
        } else if self.pilot.report().level != ControlLevel::Stabiliser {
            // It can be planned, or was not tried yet.
            AbortEffect::LandInPlace
        } else {
            AbortEffect::LandUpright
        }
    }
}
