//! The consequence for the vehicle if the crew aborted now.

use super::Computer;
use crate::guidance::powered::ControlLevel;
use crate::rules::phase::{Effect, Event, Phase, transition};

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
    /// Too low for a parachute, and the gate is open: light the landing motor and land on the ground below.
    Burn,
    /// Too low for a parachute, and the gate is shut or the motor has not lit: inhibit the landing motor.
    Impact {
        /// Speed at the ground, rounded up, m/s.
        m_s: u8,
    },
    /// The motor burns and has no cut-off: land on the ground below instead of at the pad.
    LandHere,
    /// As `LandHere`, but no plan is available: hold upright.
    UprightOnly,
}

impl Computer {
    /// The event that an abort would be now, from the findings of the last frame.
    pub(super) fn abort_event(&self) -> Event {
        if self.release.is_none() {
            return Event::AbortRequested { above_commit_height: false, gate_open: false };
        }
        self.pilot.abort_event(self.table.mode(), self.flown.as_ref().map(|(input, _)| input))
    }

    /// Whether a landing under thrust can be planned; true until the first attempt.
    fn plans_a_landing(&self) -> bool {
        self.pilot.report().level != ControlLevel::Stabiliser
    }

    /// Speed at the ground after a fall from here without thrust, m/s, falling positive.
    fn impact_m_s(&self) -> f64 {
        self.pilot.impact_m_s().unwrap_or(0.0)
    }

    /// What an abort would do now. The phase table itself is asked, so the text beside the abort key cannot differ from
    /// it.
    pub fn abort_effect(&self) -> AbortEffect {
        let mode = self.table.mode();
        let next = transition(mode, self.abort_event(), self.table.time_s());
        let does = |effect| next.effects.contains(effect);
        // Rounded up to be on the safe side; 254 is the largest value reported, 255 would mean "unknown".
        let impact = || AbortEffect::Impact { m_s: libm::ceil(self.impact_m_s()).clamp(0.0, 254.0) as u8 };
        match () {
            () if next.refusal.is_some() => AbortEffect::None,
            () if does(Effect::ShowPadWait) => AbortEffect::SafeOnPad,
            () if does(Effect::DeployChute) => AbortEffect::ChuteNow,
            () if does(Effect::IgniteLandingMotor) => AbortEffect::Burn,
            () if does(Effect::RecordLoss) => impact(),
            () if next.mode.interlocks.lands_here => match () {
                // It was commanded to light and has not.
                () if mode.phase == Phase::Ignition && mode.interlocks.no_light_latched => impact(),
                () if self.plans_a_landing() => AbortEffect::LandHere,
                () => AbortEffect::UprightOnly,
            },
            () => AbortEffect::ChuteAtApogee,
        }
    }
}
