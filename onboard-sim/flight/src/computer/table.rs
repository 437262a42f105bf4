//! The phase table in the flight computer: every event is applied here, once. Also predicts the
//! effect of an abort.

use core::fmt::Display;

use arrayvec::ArrayVec;
use serde::Serialize;

use super::Computer;
use super::messages::{CrewMessage, Severity, words_of, words_of_landing_here};
use crate::guidance::powered::ControlLevel;
use crate::rules::phase::{Effect, Effects, Event, Latch, Mode, Phase, Refusal, transition};
use crate::text::text;

/// Messages of a frame, in order: three at most in a nominal flight. One without room is left out.
pub type Messages = ArrayVec<CrewMessage, 16>;

/// Phase, latches, and the messages of this frame.
#[derive(Debug, Clone, Serialize)]
pub struct PhaseTable {
    mode: Mode,
    /// The first latch. It follows from the events and decides nothing, so it is not part of the
    /// digest.
    #[serde(skip)]
    latch: Option<Latch>,
    /// Vehicle time of this frame, s.
    #[serde(skip)]
    pub(super) time_s: f64,
    #[serde(skip)]
    messages: Messages,
}

impl PhaseTable {
    /// The table at power-up.
    pub(super) fn new(time_s: f64) -> Self {
        Self { mode: Mode::power_up(time_s), latch: None, time_s, messages: Messages::new_const() }
    }

    /// Restores a mode after a reset. Its effects were carried out before, and are not repeated.
    pub(super) fn go_on(&mut self, mode: Mode, latch: Option<Latch>) {
        (self.mode, self.latch) = (mode, latch);
    }

    /// Phase, latches, countdown and motor.
    pub fn mode(&self) -> &Mode {
        &self.mode
    }

    /// Why the landing motor is permanently inhibited.
    pub fn latch(&self) -> Option<Latch> {
        self.latch
    }

    /// Applies an event and reports its effects to the crew. The caller carries the effects out.
    ///
    /// # Errors
    /// The table refuses the event; the mode is unchanged.
    pub(crate) fn apply(&mut self, event: Event) -> Result<Effects, Refusal> {
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
            // The motor may have been inhibited long before touchdown: that is not reported again.
            let known = effect == Effect::InhibitLandingMotor && before.interlocks.landing_motor_inhibited;
            if let Some((severity, words)) = words_of(effect, countdown_s).filter(|_| !known) {
                self.report(severity, words);
            }
        }
        if let Some((severity, words)) = words_of_landing_here(before.interlocks, &self.mode) {
            self.report(severity, words);
        }
        if self.mode.phase != before.phase {
            let changed = CrewMessage::PhaseChanged { from: before.phase, to: self.mode.phase };
            let _ = self.messages.try_push(changed);
        }
        Ok(next.effects)
    }

    /// Sends a message to the crew.
    pub(crate) fn report(&mut self, severity: Severity, words: impl Display) {
        let _ = self.messages.try_push(CrewMessage::Text { severity, text: text!("{words}") });
    }

    /// Takes the messages of this frame, in order.
    pub(super) fn take_messages(&mut self) -> Messages {
        core::mem::take(&mut self.messages)
    }
}

// The effect of an abort at this moment.

/// Effect of an abort at this moment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AbortEffect {
    /// Nothing left to abort.
    None,
    /// Disarm and inhibit on the pad.
    SafeOnPad,
    /// Inhibit the landing motor, parachute at apogee.
    ChuteAtApogee,
    /// Inhibit the landing motor, parachute now.
    ChuteNow,
    /// Too low for a parachute, and ignition is permitted: ignite the landing motor at its height
    /// and land on the ground below.
    Burn,
    /// Too low for a parachute, and ignition is inhibited or the motor has not ignited: inhibit the
    /// landing motor.
    Impact {
        /// Speed at the ground, rounded up, m/s.
        m_s: u8,
    },
    /// The motor burns and cannot be cut off: land on the ground below instead of at the pad.
    LandInPlace,
    /// As `LandInPlace`, but no plan is available: hold upright.
    LandUpright,
}

impl Computer {
    /// Applies a crew event. In the air it goes through the pilot, which records its effects.
    ///
    /// # Errors
    /// The table refuses the event; the mode is unchanged.
    pub(super) fn apply(&mut self, event: Event) -> Result<Effects, Refusal> {
        let before = self.table.mode().phase;
        let effects = match self.flown() {
            Some(input) => self.pilot.apply(&mut self.table, event, input.time_s),
            None => self.table.apply(event),
        }?;
        if before == Phase::Boost && self.table.mode().phase.on_pad() {
            let words = "the ascent motor's igniter is off; it had current: the motor may still light";
            self.table.report(Severity::Critical, words);
        }
        Ok(effects)
    }

    /// The event of an abort at this moment, from the findings of the last frame.
    pub(super) fn abort_event(&self) -> Event {
        if self.release.is_none() {
            return Event::AbortRequested { lifted_off: false, above_commit_height: false, gate_open: false };
        }
        self.pilot.abort_event(self.table.mode(), self.flown().as_ref(), &self.sensors)
    }

    /// Predicts the effect of an abort at this moment. It evaluates the phase table itself, so the
    /// text beside the abort key cannot differ from the effect.
    pub fn abort_effect(&self) -> AbortEffect {
        let mode = self.table.mode();
        let next = transition(mode, self.abort_event(), self.table.time_s);
        let does = |effect| next.effects.contains(effect);
        // Rounded up to be conservative; 254 is the largest reported value, 255 would mean
        // "unknown".
        let fallen_m_s = self.pilot.impact_m_s().unwrap_or(0.0);
        let impact = || AbortEffect::Impact { m_s: libm::ceil(fallen_m_s).clamp(0.0, 254.0) as u8 };
        // Ignition was commanded, and the motor has not ignited.
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
            // A plan exists, or none was tried yet.
            AbortEffect::LandInPlace
        } else {
            AbortEffect::LandUpright
        }
    }
}
