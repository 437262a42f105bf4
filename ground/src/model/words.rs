//! Turns values of the dialect into words for the crew.

use std::fmt::Debug;

use protocol::dialect::{TD_FLIGHT_STATUS_DATA, TdAbortEffect, TdCheck, TdPhase};

use super::telemetry::phase_from_number;

/// The phase's name, as in `PAD_IDLE`.
pub fn phase(phase: TdPhase) -> String {
    without_prefix(&phase, "TD_PHASE_")
}

/// A boot number as eight hexadecimal digits.
pub fn boot(number: u32) -> String {
    format!("{number:08X}")
}

/// The phase with this name, in upper or lower case.
pub fn phase_from_name(name: &str) -> Option<TdPhase> {
    (0..=u32::from(u8::MAX))
        .map_while(phase_from_number)
        .find(|known| phase(*known).eq_ignore_ascii_case(name))
}

/// An enum value of the dialect as words: `TD_SOLVER_STATUS_NOT_RUN` without its prefix is `not run`.
pub fn lower_case(value: &impl Debug, prefix: &str) -> String {
    without_prefix(value, prefix).to_lowercase().replace('_', " ")
}

fn without_prefix(value: &impl Debug, prefix: &str) -> String {
    let name = format!("{value:?}");
    name.strip_prefix(prefix).unwrap_or(&name).to_owned()
}

/// What an abort would do now, the consequence first.
pub fn abort_effect(status: &TD_FLIGHT_STATUS_DATA) -> String {
    let words = match status.abort_effect {
        TdAbortEffect::TD_ABORT_EFFECT_NONE => "nothing is left to abort",
        TdAbortEffect::TD_ABORT_EFFECT_SAFE_ON_PAD => "disarm and inhibit on the pad",
        TdAbortEffect::TD_ABORT_EFFECT_CHUTE_AT_APOGEE => "parachute at apogee, landing motor inhibited",
        TdAbortEffect::TD_ABORT_EFFECT_CHUTE_NOW => "parachute NOW, landing motor inhibited",
        // Sent by older vehicles, which do not distinguish the two.
        TdAbortEffect::TD_ABORT_EFFECT_BURN_OR_INHIBIT => "too low for a chute: burn if the gate is open",
        TdAbortEffect::TD_ABORT_EFFECT_UPRIGHT_ONLY => "TOO LATE: no cut-off exists, only stays upright",
        TdAbortEffect::TD_ABORT_EFFECT_LAND_HERE => "lands here, no cut-off exists",
        TdAbortEffect::TD_ABORT_EFFECT_BURN => "burns and lands here, too low for a chute",
        TdAbortEffect::TD_ABORT_EFFECT_IMPACT => return impact(status.abort_impact_m_s),
    };
    words.to_owned()
}

/// An impact, with its speed if known.
fn impact(speed_m_s: u8) -> String {
    let speed = if speed_m_s == u8::MAX { String::new() } else { format!(" at about {speed_m_s} m/s") };
    format!("IMPACT{speed}, too low for a chute")
}

/// The name of an arming check. The vehicle's log is named as such, because the station has one of its own.
pub fn check(name: &str) -> String {
    let words = name.trim_start_matches("TD_CHECK_").to_lowercase().replace('_', " ");
    if words.starts_with("log") { format!("vehicle {words}") } else { words }
}

/// The names of the failing checks.
pub fn failed_checks(checks: TdCheck) -> Vec<String> {
    checks.iter_names().map(|(name, _)| check(name)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::dialect::TdSolverStatus;

    #[test]
    fn names_come_from_the_dialect() {
        assert_eq!(phase(TdPhase::TD_PHASE_PAD_IDLE), "PAD_IDLE");
        assert_eq!(lower_case(&TdSolverStatus::TD_SOLVER_STATUS_NOT_RUN, "TD_SOLVER_STATUS_"), "not run");
    }

    #[test]
    fn an_abort_is_described_by_its_consequence() {
        let words = |effect, abort_impact_m_s| {
            let status = TD_FLIGHT_STATUS_DATA {
                abort_effect: effect,
                abort_impact_m_s,
                ..TD_FLIGHT_STATUS_DATA::default()
            };
            abort_effect(&status)
        };
        for (effect, consequence) in [
            (TdAbortEffect::TD_ABORT_EFFECT_CHUTE_NOW, "parachute"),
            (TdAbortEffect::TD_ABORT_EFFECT_LAND_HERE, "lands here"),
            (TdAbortEffect::TD_ABORT_EFFECT_BURN, "burns and lands here"),
        ] {
            assert!(words(effect, 0).starts_with(consequence), "{}", words(effect, 0));
        }
        let impact = TdAbortEffect::TD_ABORT_EFFECT_IMPACT;
        assert_eq!(words(impact, 37), "IMPACT at about 37 m/s, too low for a chute");
        assert_eq!(words(impact, u8::MAX), "IMPACT, too low for a chute", "unknown is no speed");
    }

    #[test]
    fn failing_checks_are_named() {
        let failing = TdCheck::TD_CHECK_PIN | TdCheck::TD_CHECK_LOG_SPACE;
        assert_eq!(failed_checks(failing), ["pin", "vehicle log space"]);
        assert!(failed_checks(TdCheck::empty()).is_empty());
    }
}
