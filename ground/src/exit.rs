//! The exit codes and how a run is given one.

use crate::model::FlightSoFar;

/// How a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Exit {
    /// It stands undamaged, or closed by the crew before a flight began.
    Landed = 0,
    /// Something failed: a file, a socket, the simulator.
    Error = 1,
    /// The command line was not understood.
    Usage = 2,
    /// The flight ended otherwise.
    NotLanded = 3,
    /// Arming or start was refused, or the flight was aborted.
    RefusedOrAborted = 4,
    /// The end of the flight was not seen: link lost, nothing heard, time limit, or closed in flight.
    NotSeen = 5,
}

/// Examples and exit codes as `--help` shows them.
pub const HELP: &str = "\
Examples:
  ground
  ground --connect serial:/dev/ttyUSB0:57600 --key touchdown.key
  ground --replay last

Exit codes:
  0  it stands undamaged (full screen: also when closed before any flight began)
  1  an error: a file, a socket, the simulator
  2  the command line was not understood
  3  the flight ended otherwise
  4  arming or start was refused, or the flight was aborted
  5  the end of the flight was not seen: link lost, nothing heard, time-out, or closed in flight";

/// The exit code for an outcome; `interactive` if a person closed the program.
pub fn decide(outcome: &FlightSoFar, interactive: bool) -> Exit {
    if outcome.error.is_some() {
        Exit::Error
    } else if outcome.aborted_at.is_some() {
        Exit::RefusedOrAborted
    } else if let Some((stands, _)) = outcome.verdict {
        if stands { Exit::Landed } else { Exit::NotLanded }
    } else if outcome.started {
        // At rest without a verdict: the vehicle came down under a parachute or without a landing burn.
        if outcome.safed_at.is_some() { Exit::NotLanded } else { Exit::NotSeen }
    } else if outcome.refusal.is_some() {
        Exit::RefusedOrAborted
    } else if interactive {
        Exit::Landed
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
            (landed.clone(), false, Exit::Landed),
            (
                FlightSoFar { verdict: Some((false, Duration::ZERO)), ..landed.clone() },
                false,
                Exit::NotLanded,
            ),
            (FlightSoFar { aborted_at: at, ..landed.clone() }, false, Exit::RefusedOrAborted),
            (FlightSoFar { error: Some("socket".to_owned()), ..landed }, false, Exit::Error),
            (FlightSoFar { started: true, ..none.clone() }, true, Exit::NotSeen),
            (FlightSoFar { started: true, safed_at: at, ..none.clone() }, false, Exit::NotLanded),
            (
                FlightSoFar { refusal: Some(("ARM denied".to_owned(), Duration::ZERO)), ..none.clone() },
                false,
                Exit::RefusedOrAborted,
            ),
            (none.clone(), true, Exit::Landed),
            (none, false, Exit::NotSeen),
        ];
        for (outcome, interactive, expected) in cases {
            assert_eq!(decide(&outcome, interactive), expected, "{outcome:?}");
        }
    }

    #[test]
    fn the_help_names_every_code() {
        for exit in
            [Exit::Landed, Exit::Error, Exit::Usage, Exit::NotLanded, Exit::RefusedOrAborted, Exit::NotSeen]
        {
            assert!(HELP.contains(&format!("\n  {}  ", exit as u8)));
        }
    }
}
