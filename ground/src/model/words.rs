//! Numbers of the dialect in an operator's words.

use std::fmt::Debug;

use protocol::dialect::{TdAbortEffect, TdPhase};

/// The arming checks by their bit in `checks_failed`, in the vehicle's order.
pub const ARMING_CHECKS: [&str; 13] = [
    "abort latch",
    "pin",
    "self-test",
    "tilt from vertical",
    "rotation",
    "speed",
    "estimator",
    "fins answering",
    "igniter continuity",
    "log",
    "log space",
    "controller warm",
    "predicted touchdown",
];

/// The phase's name, as in `PAD_IDLE`.
pub fn phase(phase: TdPhase) -> String {
    without_prefix(&phase, "TD_PHASE_")
}

/// A dialect's enum value as words: `TD_SOLVER_STATUS_NOT_RUN` without its prefix is `not run`.
pub fn lower_case(value: &impl Debug, prefix: &str) -> String {
    without_prefix(value, prefix).to_lowercase().replace('_', " ")
}

fn without_prefix(value: &impl Debug, prefix: &str) -> String {
    let name = format!("{value:?}");
    name.strip_prefix(prefix).unwrap_or(&name).to_owned()
}

/// What an abort would do now, honestly.
pub fn abort_effect(effect: TdAbortEffect) -> &'static str {
    match effect {
        TdAbortEffect::TD_ABORT_EFFECT_NONE => "nothing is left to abort",
        TdAbortEffect::TD_ABORT_EFFECT_SAFE_ON_PAD => "disarm and inhibit on the pad",
        TdAbortEffect::TD_ABORT_EFFECT_CHUTE_AT_APOGEE => "inhibit landing motor, chute at apogee",
        TdAbortEffect::TD_ABORT_EFFECT_CHUTE_NOW => "inhibit motor, fins open, chute NOW",
        TdAbortEffect::TD_ABORT_EFFECT_BURN_OR_INHIBIT => "too low for a chute: burn if the gate is open",
        TdAbortEffect::TD_ABORT_EFFECT_UPRIGHT_ONLY => "NO CUT-OFF EXISTS: only holds upright at full thrust",
    }
}

/// The failing checks' names, or `None` if all pass.
pub fn failed_checks(bits: u16) -> Vec<String> {
    (0..16)
        .filter(|bit| bits & (1 << bit) != 0)
        .map(|bit| {
            ARMING_CHECKS.get(bit).map_or_else(|| format!("check {}", bit + 1), |name| (*name).to_owned())
        })
        .collect()
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
    fn unknown_checks_are_numbered() {
        assert_eq!(failed_checks(0b10), ["pin"]);
        assert_eq!(failed_checks(1 << 15), ["check 16"]);
    }
}
