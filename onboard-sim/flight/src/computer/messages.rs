//! Messages of the flight computer: phase changes, and texts to the crew.

use serde::Serialize;

use crate::rules::arming::{Check, UPLINK_CHECK};
use crate::rules::phase::{
    Effect, HOLD_LIMIT_S, Interlocks, MISFIRE_WAIT_S, MOTOR_HOT_S, Mode, MotorStatus, Phase,
};
use crate::text::{Text, text};

/// Severity of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Nominal.
    Info,
    /// Nominal, but worth noticing.
    Notice,
    /// Off-nominal.
    Warning,
    /// A failure, or a refusal because of a fault.
    Error,
    /// The vehicle is in danger.
    Critical,
}

/// One message of the flight computer.
#[derive(Debug, Clone, PartialEq, Eq)]
#[expect(clippy::large_enum_variant, reason = "a frame allocates nothing")]
pub enum CrewMessage {
    /// Text for the crew.
    Text {
        severity: Severity,
        text: Text,
    },
    PhaseChanged {
        from: Phase,
        to: Phase,
    },
}

/// The message for an effect; `None` if the phase change already reports it.
pub(super) fn words_of(effect: Effect, countdown_s: f64) -> Option<(Severity, Text)> {
    use Effect as E;
    let severity = match effect {
        E::FinsOpen => return None,
        E::CancelCountdown => Severity::Warning,
        E::HoldCountdown | E::ShowPadWait | E::RecordLoss | E::DeployChute => Severity::Critical,
        _ => Severity::Notice,
    };
    let words = effect.name();
    Some((
        severity,
        match effect {
            E::StartCountdown => text!("{words}: release in {countdown_s} s"),
            E::HoldCountdown => text!("{words}; start again or it disarms in {HOLD_LIMIT_S} s"),
            _ => text!("{words}"),
        },
    ))
}

/// The message for an abort that lands on the motor, if the abort was applied between these two
/// modes.
pub(super) fn words_of_landing_here(before: Interlocks, mode: &Mode) -> Option<(Severity, &'static str)> {
    let after = mode.interlocks;
    let words = if after.no_light_latched {
        "ABORT: the landing motor has not ignited"
    } else if mode.phase.in_descent() {
        "ABORT: too low for the parachute; the motor lights at its height, landing on the ground below"
    } else {
        "ABORT: no cut-off exists; landing on the ground below"
    };
    (after.lands_in_place && !before.lands_in_place).then_some((Severity::Critical, words))
}

/// Time after which a failing check is reported and holds the countdown, s. A bouncing contact or
/// one lost sample is shorter, and a sensor failure shows its nature within this time.
const FAILS_FOR_S: f64 = 0.1;

/// The failing arming check last reported on the pad, and the time since when one fails, s.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub(super) struct Readiness {
    last_check: Option<&'static str>,
    since_s: Option<f64>,
}

impl Readiness {
    /// Returns why the vehicle may not be armed or started, and whether this is still to be
    /// reported: the first check that has failed for [`FAILS_FOR_S`]. The uplink check is left out.
    /// It changes with every lost heartbeat, and each station gets a report of its uplink anyway.
    pub(super) fn failing(&mut self, checks: &[Check], time_s: f64) -> Option<(Text, bool)> {
        let Some(check) = checks.iter().find(|check| !check.passed && check.name != UPLINK_CHECK) else {
            *self = Self::default();
            return None;
        };
        if time_s - *self.since_s.get_or_insert(time_s) < FAILS_FOR_S {
            return None;
        }
        let unreported = self.last_check.replace(check.name) != Some(check.name);
        check.refusal().map(|reason| (reason, unreported))
    }
}

// Reports each change of the landing motor's state to the crew: the safety of anyone who approaches
// the vehicle depends on it.

/// Monitors the landing motor's state: the state last reported to the crew.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub(super) struct MotorWatch {
    status: MotorStatus,
    /// On the ground after the flight.
    landed: bool,
    /// The vehicle is safe to approach without a wait.
    free: bool,
}

impl Default for MotorWatch {
    /// A vehicle at power-up, with its pin in.
    fn default() -> Self {
        Self { status: MotorStatus::PinIn, landed: false, free: true }
    }
}

impl MotorWatch {
    /// Returns a message if the state has changed.
    pub(super) fn update(&mut self, mode: &Mode, time_s: f64) -> Option<(Severity, Text)> {
        use MotorStatus as M;
        let now = Self {
            status: mode.motor_status(time_s),
            landed: matches!(mode.phase, Phase::Touchdown | Phase::Safed),
            free: mode.approach_wait_s(time_s) == Some(0.0),
        };
        let before = core::mem::replace(self, now);
        if now == before {
            return None;
        }
        let (severity, words) = match now {
            Self { status: M::Live, landed: true, free: false } => {
                let words = text!("LIVE MOTOR: do not approach for {MISFIRE_WAIT_S} s, then pin first");
                return Some((Severity::Critical, words));
            }
            Self { status: M::Live, landed: true, free: true } => {
                (Severity::Critical, "LIVE MOTOR: the wait is over; put the pin in before anything else")
            }
            // Every other state is reported once, when the status changes.
            _ if now.status == before.status => return None,
            Self { status: M::Hot, .. } => {
                return Some((Severity::Notice, text!("burn-out: motor hot for {MOTOR_HOT_S} s")));
            }
            Self { status: M::Live, landed: false, .. } if mode.phase.on_pad() => {
                (Severity::Info, "pin out: landing motor live")
            }
            Self { status: M::Live, landed: false, .. } => {
                (Severity::Critical, "landing motor live: no light")
            }
            Self { status: M::PinIn, .. } => (Severity::Notice, "pin in: the igniter line is cut"),
            Self { status: M::Burnt, .. } => (Severity::Notice, "landing motor burnt out and cooled"),
            // Reported at the ignition command.
            Self { status: M::Burning, .. } => return None,
        };
        Some((severity, text!("{words}")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rules::phase::{Interlocks, Motor};

    fn mode(phase: Phase, motor: Motor, pin_out: bool) -> Mode {
        let interlocks = Interlocks { pin_out, ..Interlocks::default() };
        Mode { phase, interlocks, motor, ..Mode::power_up(0.0) }
    }

    #[test]
    fn the_wait_at_a_live_motor_and_its_end_are_reported() {
        let mut watch = MotorWatch::default();
        let live = mode(Phase::Touchdown, Motor::Unlit, true);
        let (severity, words) = watch.update(&live, 1.0).unwrap();
        assert_eq!((severity, words.contains("do not approach for 60 s")), (Severity::Critical, true));
        assert_eq!(watch.update(&live, 59.9), None, "once");
        let (severity, words) = watch.update(&live, 60.0).unwrap();
        assert_eq!((severity, words.contains("put the pin in")), (Severity::Critical, true));
        let pinned = mode(Phase::Touchdown, Motor::Unlit, false);
        assert!(watch.update(&pinned, 61.0).unwrap().1.starts_with("pin in"));
        assert_eq!(watch.update(&mode(Phase::Safed, Motor::Unlit, false), 61.1), None);
    }

    #[test]
    fn each_change_of_the_motor_in_a_flight_is_reported_once() {
        let mut watch = MotorWatch::default();
        let mut message = |phase, motor, time_s| {
            watch.update(&mode(phase, motor, true), time_s).map_or_else(Text::new, |(_, words)| words)
        };
        assert_eq!(message(Phase::PadIdle, Motor::Unlit, 1.0).as_str(), "pin out: landing motor live");
        assert_eq!(message(Phase::PadArmed, Motor::Unlit, 2.0).as_str(), "");
        assert_eq!(message(Phase::LandArmed, Motor::Unlit, 3.0).as_str(), "");
        assert_eq!(message(Phase::Powered, Motor::Burning, 4.0).as_str(), "");
        let burnt_out = Motor::BurntOut { at_s: 9.0 };
        assert_eq!(message(Phase::Powered, burnt_out, 9.0).as_str(), "burn-out: motor hot for 60 s");
        assert_eq!(message(Phase::Touchdown, burnt_out, 10.0).as_str(), "");
        assert_eq!(message(Phase::Touchdown, burnt_out, 69.0).as_str(), "landing motor burnt out and cooled");
        assert_eq!(message(Phase::Safed, burnt_out, 69.1).as_str(), "");
    }
}
