//! Which exit code a run is given.

pub use protocol::program::Exit;

use crate::model::FlightSoFar;

/// The exit code for an outcome; `interactive` if a person closed the program.
pub fn decide(outcome: &FlightSoFar, interactive: bool) -> Exit {
    if outcome.error.is_some() {
        Exit::Error
    } else if outcome.aborted_at.is_some() {
        Exit::RefusedOrAborted
    } else if let Some((stands, _)) = outcome.verdict {
        Exit::of(stands)
    } else if outcome.started {
        // At rest without a verdict: the vehicle came down under a parachute or without a landing burn.
        if outcome.safed_at.is_some() { Exit::No } else { Exit::NotSeen }
    } else if outcome.refusal.is_some() {
        Exit::RefusedOrAborted
    } else if interactive {
        Exit::Yes
    } else {
        Exit::NotSeen
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
