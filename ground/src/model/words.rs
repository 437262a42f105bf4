//! Turns values of the dialect, and numbers, into words for the crew. A number has a bounded width
//! for every value.

use std::borrow::Cow;
use std::fmt::Debug;

use protocol::dialect::{TD_FLIGHT_STATUS_DATA, TdAbortEffect, TdPhase};

use super::{is_aborted, is_on_pad, telemetry::phase_from_number};

/// A text from outside, made printable and shortened to this many characters.
pub fn printable(text: &str, characters: usize) -> String {
    protocol::text::printable(text.as_bytes()).chars().take(characters).collect()
}

/// The phase's name, as in `PAD_IDLE`.
pub fn phase(phase: TdPhase) -> String {
    without_prefix(&phase, "TD_PHASE_")
}

/// The text of an event for the crew; `None` if other events or the state show the same. The log
/// stores the original.
pub fn of_event(text: &str) -> Option<Cow<'_, str>> {
    if let Some(phases) = text.strip_prefix("phase ") {
        // The vehicle reports ignitions itself, and on the pad the crew commands the phase.
        let to = phase_from_name(phases.rsplit(' ').next()?)?;
        return (to != TdPhase::TD_PHASE_BOOST && !is_on_pad(to)).then(|| phase(to).into());
    }
    match text.strip_prefix("controller level ") {
        Some("CONVERGED") => None,
        Some(level) => Some(format!("burn {}", steered(level)).into()),
        None => Some(text.trim_end_matches(" (HEARTBEAT)").into()),
    }
}

/// What steers the burn, by the name of its level, as in `SHIFTED_PLAN`.
pub fn steered(level: &str) -> String {
    match level {
        "IDLE" => "no plan yet".to_owned(),
        "CONVERGED" => "on its plan".to_owned(),
        "BEST_FEASIBLE" => "near its plan".to_owned(),
        "SHIFTED_PLAN" => "on its last plan".to_owned(),
        "STABILISER" => "UPRIGHT, NO PLAN".to_owned(),
        other => other.to_lowercase().replace('_', " "),
    }
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

/// An enum value of the dialect as words: `TD_SOLVER_STATUS_NOT_RUN` without its prefix is `not
/// run`.
pub fn lower_case(value: &impl Debug, prefix: &str) -> String {
    without_prefix(value, prefix).to_lowercase().replace('_', " ")
}

pub(crate) fn without_prefix(value: &impl Debug, prefix: &str) -> String {
    let name = format!("{value:?}");
    name.strip_prefix(prefix).unwrap_or(&name).to_owned()
}

/// What an abort would do now, the consequence first.
pub fn abort_effect(status: &TD_FLIGHT_STATUS_DATA) -> String {
    let up = matches!(status.phase, TdPhase::TD_PHASE_BOOST | TdPhase::TD_PHASE_COAST);
    let words = match status.abort_effect {
        TdAbortEffect::TD_ABORT_EFFECT_NONE if up && is_aborted(status.interlocks) => {
            "ABORTED already: parachute at apogee"
        }
        TdAbortEffect::TD_ABORT_EFFECT_NONE => "nothing is left to abort",
        TdAbortEffect::TD_ABORT_EFFECT_SAFE_ON_PAD => "disarm and inhibit on the pad",
        TdAbortEffect::TD_ABORT_EFFECT_CHUTE_AT_APOGEE => "parachute at apogee, landing motor inhibited",
        TdAbortEffect::TD_ABORT_EFFECT_CHUTE_NOW => "parachute NOW, landing motor inhibited",
        TdAbortEffect::TD_ABORT_EFFECT_LAND_UPRIGHT => "TOO LATE: no cut-off exists, only stays upright",
        TdAbortEffect::TD_ABORT_EFFECT_LAND_IN_PLACE => "lands here, no cut-off exists",
        TdAbortEffect::TD_ABORT_EFFECT_BURN => "burns and lands here, too low for a chute",
        TdAbortEffect::TD_ABORT_EFFECT_IMPACT if status.abort_impact_m_s == u8::MAX => {
            "IMPACT, too low for a chute"
        }
        TdAbortEffect::TD_ABORT_EFFECT_IMPACT => {
            return format!("IMPACT at about {} m/s, too low for a chute", status.abort_impact_m_s);
        }
    };
    words.to_owned()
}

/// The name of an arming check. The vehicle's log is named as such, because the station has one of
/// its own.
pub fn check(name: &str) -> String {
    let words = lower_case_name(name);
    if words.starts_with("log") { format!("vehicle {words}") } else { words }
}

/// The name of a check in the words of the vehicle.
pub fn lower_case_name(name: &str) -> String {
    name.trim_start_matches("TD_CHECK_").to_lowercase().replace('_', " ")
}

/// A number with fixed decimals; `--` for NaN and infinity.
pub fn fixed(value: f64, decimals: usize) -> String {
    if !value.is_finite() {
        "--".to_owned()
    } else if value.abs() >= 1e6 {
        format!("{value:.1e}")
    } else {
        // A value that rounds to zero has no minus sign.
        let text = format!("{value:.decimals$}");
        match text.strip_prefix('-') {
            Some(digits) if digits.chars().all(|c| matches!(c, '0' | '.')) => digits.to_owned(),
            _ => text,
        }
    }
}

/// A number without unneeded digits: `20`, `0.1`, `82.5`. Rounding to three decimals hides the
/// error of an `f32`.
pub fn shortest(value: f64) -> String {
    let text = fixed(value, 3);
    match text.split_once('.') {
        Some((_, decimals)) if decimals.bytes().all(|digit| digit.is_ascii_digit()) => {
            text.trim_end_matches('0').trim_end_matches('.').to_owned()
        }
        _ => text,
    }
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
            (TdAbortEffect::TD_ABORT_EFFECT_LAND_IN_PLACE, "lands here"),
            (TdAbortEffect::TD_ABORT_EFFECT_BURN, "burns and lands here"),
        ] {
            assert!(words(effect, 0).starts_with(consequence), "{}", words(effect, 0));
        }
        let impact = TdAbortEffect::TD_ABORT_EFFECT_IMPACT;
        assert_eq!(words(impact, 37), "IMPACT at about 37 m/s, too low for a chute");
        assert_eq!(words(impact, u8::MAX), "IMPACT, too low for a chute", "unknown is no speed");
    }

    #[test]
    fn an_event_has_the_words_of_the_crew_or_none() {
        for (text, words) in [
            ("phase DEPLOY -> AERO_DESCENT", Some("AERO_DESCENT")),
            ("phase SAFED", Some("SAFED")),
            ("phase PAD_IDLE -> PAD_ARMED", None),
            ("phase PAD_ARMED -> BOOST", None),
            ("controller level CONVERGED", None),
            ("controller level SHIFTED_PLAN", Some("burn on its last plan")),
            ("disarmed (HEARTBEAT)", Some("disarmed")),
            ("phase 3 of the moon", None),
            ("landing motor commanded to light", Some("landing motor commanded to light")),
        ] {
            assert_eq!(of_event(text).as_deref(), words, "{text}");
        }
    }

    #[test]
    fn checks_are_named() {
        assert_eq!(["TD_CHECK_PIN", "TD_CHECK_LOG_SPACE"].map(check), ["pin", "vehicle log space"]);
    }
}

#[cfg(test)]
mod number_tests {
    use super::*;

    #[test]
    fn numbers_never_grow_wide() {
        let wild = [0.0, -0.0, -0.001, 1.0, f64::MAX, f64::MIN, f64::NAN, f64::INFINITY, -999_999.99];
        for value in wild {
            assert!(fixed(value, 2).len() <= 10, "{value} became {}", fixed(value, 2));
        }
        assert_eq!(fixed(-0.001, 2), "0.00");
        assert_eq!(fixed(-0.01, 2), "-0.01");
    }

    #[test]
    fn numbers_have_no_unneeded_digits() {
        let cases = [(20.0, "20"), (f64::from(0.1_f32), "0.1"), (82.5, "82.5"), (0.0, "0"), (f64::NAN, "--")];
        for (value, expected) in cases {
            assert_eq!(shortest(value), expected);
        }
        assert_eq!(shortest(1e9), "1.0e9");
    }
}
