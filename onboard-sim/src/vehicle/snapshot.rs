//! The vehicle's state at one instant, for telemetry.

use flight::controller::ControllerOutput;
use flight::dynamics::PlanarState;
use flight::phase::{Effect, Interlocks, Phase, transition};
use flight::verdict::{LandingVerdict, TouchdownLimits};

use super::Vehicle;
use crate::plant::Impact;

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
    /// Too low for a parachute: burn if the gate passes, else inhibit.
    BurnOrInhibit,
    /// No cut-off exists: hold upright.
    UprightOnly,
}

/// Everything telemetry is made of.
#[derive(Debug, Clone, PartialEq)]
pub struct Snapshot {
    /// Time since power-up, s.
    pub time_s: f64,
    /// Phase.
    pub phase: Phase,
    /// Latches.
    pub interlocks: Interlocks,
    /// Time to release, s, while a countdown runs.
    pub countdown_s: Option<f64>,
    /// Time since ignition, s; stands still after touchdown.
    pub since_ignition_s: Option<f64>,
    /// Time before the pad may be approached, s.
    pub pad_wait_s: Option<f64>,
    /// Bit k: arming check k fails now. Nought off the pad.
    pub checks_failed: u16,
    /// What an abort would do.
    pub abort_effect: AbortEffect,
    /// State estimate.
    pub state: PlanarState,
    /// Gimbal angle commanded and actual, rad.
    pub gimbal_rad: (f64, f64),
    /// Fin angles commanded and actual, rad.
    pub fins_rad: ([f64; 4], [f64; 4]),
    /// True thrust, N, and mass, kg.
    pub thrust_n: f64,
    /// Mass, kg.
    pub mass_kg: f64,
    /// On the ground.
    pub in_contact: bool,
    /// The last tick's output.
    pub output: Option<ControllerOutput>,
    /// How long it took, s.
    pub solve_time_s: f64,
    /// How long it may take, s.
    pub deadline_s: f64,
    /// Estimated thrust over nominal.
    pub thrust_scale: f64,
    /// What counts as a landing.
    pub limits: TouchdownLimits,
    /// Mechanical stop of the gimbal on either side, rad.
    pub gimbal_limit_rad: f64,
    /// Limits that the end of the plan violates, one bit each in the verdict's order.
    pub predicted_violations: u16,
    /// The verdict, once touched down.
    pub verdict: Option<(Impact, LandingVerdict)>,
}

impl Vehicle {
    /// The state now.
    pub fn snapshot(&self) -> Snapshot {
        let time_s = self.time_s();
        let on_pad = self.mode.phase.on_pad();
        let planned = self.output.as_ref().filter(|output| output.plan.len > 0);
        Snapshot {
            time_s,
            phase: self.mode.phase,
            interlocks: self.mode.interlocks,
            countdown_s: self.mode.countdown_remaining_s(time_s),
            // The flight's clock stops when the flight does.
            since_ignition_s: self.ignition_sample.map(|sample| {
                let until_s = self.verdict.map_or(time_s, |(impact, _)| impact.time_s);
                until_s - sample as f64 * self.profile.nmpc.sample_time_s
            }),
            pad_wait_s: self.mode.pad_wait_remaining_s(time_s),
            checks_failed: if on_pad {
                bits(self.arming_checks().iter().map(|check| !check.passed))
            } else {
                0
            },
            abort_effect: self.abort_effect(),
            state: self.plant.state(),
            gimbal_rad: self.plant.gimbal_rad(),
            fins_rad: self.plant.fins_rad(),
            thrust_n: self.plant.thrust_n(),
            mass_kg: self.plant.mass_kg(),
            in_contact: self.plant.in_contact(),
            solve_time_s: self.solve_time_s,
            deadline_s: self.profile.nmpc.sample_time_s,
            thrust_scale: self.thrust.scale(),
            limits: self.limits,
            gimbal_limit_rad: self.profile.gimbal.limit_rad(),
            predicted_violations: planned.map_or(0, |output| {
                let verdict = LandingVerdict::judge_plan(&self.limits, &output.predicted_touchdown.state);
                violations(&verdict)
            }),
            output: self.output.clone(),
            verdict: self.verdict,
        }
    }

    /// Whether nothing more will happen in this flight.
    pub fn is_over(&self) -> bool {
        self.mode.phase == Phase::Safed || (self.mode.phase.on_pad() && self.aborted())
    }

    /// Asked of the phase table itself, so that the words beside the abort key are what it would do.
    fn abort_effect(&self) -> AbortEffect {
        let next = transition(&self.mode, self.abort_event(), self.time_s());
        let does = |effect| next.effects.contains(effect);
        match () {
            () if next.refusal.is_some() => AbortEffect::None,
            () if does(Effect::ShowPadWait) => AbortEffect::SafeOnPad,
            () if does(Effect::DeployChute) => AbortEffect::ChuteNow,
            () if next.mode.interlocks.degraded => AbortEffect::UprightOnly,
            () if does(Effect::IgniteLandingMotor) || does(Effect::RecordLoss) => AbortEffect::BurnOrInhibit,
            () => AbortEffect::ChuteAtApogee,
        }
    }
}

/// One bit per broken limit, in the verdict's order.
pub(crate) fn violations(verdict: &LandingVerdict) -> u16 {
    bits(verdict.results.iter().map(|result| !result.passed))
}

fn bits(flags: impl Iterator<Item = bool>) -> u16 {
    flags.take(16).enumerate().fold(0, |bits, (place, set)| bits | (u16::from(set) << place))
}
