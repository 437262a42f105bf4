//! Which exit code a run is given.

pub use protocol::program::Exit;

use crate::model::FlightSoFar;

/// The exit code for an outcome; `interactive` if a person closed the program.
pub fn decide(outcome: &FlightSoFar, interactive: bool) -> Exit {
    match outcome.verdict {
        _ if outcome.error.is_some() => Exit::Error,
        _ if outcome.aborted_at.is_some() => Exit::RefusedOrAborted,
        Some((stands, _)) => Exit::of(stands),
        // At rest without a verdict: the vehicle came down under a parachute or without a landing
        // burn.
        None if outcome.started && outcome.safed_at.is_some() => Exit::No,
        None if outcome.started => Exit::NotSeen,
        None if outcome.refusal.is_some() => Exit::RefusedOrAborted,
        None if interactive => Exit::Yes,
        None => Exit::NotSeen,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn each_ending_has_its_code() {
        let at = Some(Duration::ZERO);
        let none = FlightSoFar::default();
        let landed = FlightSoFar { started: true, verdict: Some((true, Duration::ZERO)), ..none.clone() };
        let cases = [
            (landed.clone(), false, Exit::Yes),
            (FlightSoFar { verdict: Some((false, Duration::ZERO)), ..landed.clone() }, false, Exit::No),
            (FlightSoFar { aborted_at: at, ..landed.clone() }, false, Exit::RefusedOrAborted),
            (FlightSoFar { error: Some("socket".to_owned()), ..landed }, false, Exit::Error),
            (FlightSoFar { started: true, ..none.clone() }, true, Exit::NotSeen),
            (FlightSoFar { started: true, safed_at: at, ..none.clone() }, false, Exit::No),
            (
                FlightSoFar { refusal: Some(("ARM denied".to_owned(), Duration::ZERO)), ..none.clone() },
                false,
                Exit::RefusedOrAborted,
            ),
            (none.clone(), true, Exit::Yes),
            (none, false, Exit::NotSeen),
        ];
        for (outcome, interactive, expected) in cases {
            assert_eq!(decide(&outcome, interactive), expected, "{outcome:?}");
        }
    }
}
