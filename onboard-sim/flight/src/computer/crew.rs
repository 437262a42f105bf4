//! What the crew may ask for by radio, and how the flight computer answers.

use alloc::format;
use alloc::string::String;

use crate::rules::arming::{self, Check, Uplink};
use crate::rules::operator::Operator;
use crate::rules::phase::{Event, HoldCause, Mode, Phase, Refusal, StartPoint};
use crate::rules::two_person::Station;

use super::news::Severity;
use super::table::PhaseTable;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Asked {
    Arm,
    /// Disarm; cancels a countdown.
    Disarm,
    /// Start the countdown.
    Start,
    /// Hold the countdown.
    Hold,
    /// Abort, irreversibly.
    Abort,
    /// A tap in the countdown: whoever confirmed the start is still there.
    Tap,
    /// Take the command from a station that is silent.
    TakeCommand,
    /// Check the vehicle on its pad: surfaces, sensors, switches, battery and storage.
    Check,
    /// The same, but nothing moves.
    CheckStill,
    /// End the running check.
    EndCheck,
}

impl Asked {
    /// As in `abort refused`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Arm => "arm",
            Self::Disarm => "disarm",
            Self::Start => "start",
            Self::Hold => "hold",
            Self::Abort => "abort",
            Self::Tap => "tap",
            Self::TakeCommand => "take-over",
            Self::Check | Self::CheckStill => "check",
            Self::EndCheck => "end of the check",
        }
    }
}

/// How many people an arming and a start take. Without one of these there are no operators, and whoever is heard
/// commands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum People {
    /// Every operator alone.
    One,
    /// Two of different roles.
    Two {
        /// Number of the first ask since power-up, another one at each boot: a confirmation from before it names none.
        first_ask: u16,
    },
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Request {
    pub asked: Asked,
    /// How well the requesting station is heard. [`Uplink::NotNeeded`] for the vehicle's own programme.
    pub uplink: Uplink,
    /// `None` for the vehicle's own programme.
    pub station: Option<Station>,
    /// Whose key has signed it; `None` for the key that all stations share, or none.
    pub by: Option<Operator>,
    /// The number of the ask that it confirms.
    pub confirms: Option<u16>,
}

impl Request {
    /// A request of the vehicle's own programme.
    pub fn of_the_programme(asked: Asked) -> Self {
        Self { asked, uplink: Uplink::NotNeeded, station: None, by: None, confirms: None }
    }
}

/// How a request ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ending {
    /// Done, or already in that state.
    Accepted,
    /// Not now: the cause can be fixed.
    NotNow,
    /// Not in this phase or state.
    Denied,
    /// Understood, but impossible.
    Failed,
    /// Noted: a second person has to confirm it.
    Asked,
}

/// The answer to a request, with the reason if it was not accepted.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Answer {
    pub ending: Ending,
    pub reason: Option<String>,
}

impl Answer {
    pub(super) const ACCEPTED: Self = Self { ending: Ending::Accepted, reason: None };
}

/// Whether the vehicle is already in the requested state. A repeated request is accepted: a refusal would alarm the
/// crew.
pub(super) fn is_so_already(mode: &Mode, asked: Asked) -> bool {
    let locks = mode.interlocks;
    match asked {
        Asked::Arm => locks.armed && mode.phase == Phase::PadArmed,
        Asked::Disarm => {
            !locks.armed && matches!(mode.phase, Phase::PadIdle | Phase::Touchdown | Phase::Safed)
        }
        Asked::Start => locks.armed && mode.countdown_end_s.is_some(),
        Asked::Hold => mode.hold.is_some(),
        // A second abort may do more than the first: the phase table decides.
        Asked::Abort
        | Asked::Tap
        | Asked::TakeCommand
        | Asked::Check
        | Asked::CheckStill
        | Asked::EndCheck => false,
    }
}

/// The event for a request; `None` for one that is no matter of the phase table. A countdown is of this length, before a
/// flight that starts there, and `abort` is the event that an abort would be now.
pub(super) fn event_of(
    asked: Asked,
    checks: &[Check],
    (countdown_s, start): (f64, StartPoint),
    abort: Event,
) -> Option<Event> {
    Some(match asked {
        Asked::Arm => Event::ArmRequested { checks_passed: arming::all_passed(checks) },
        Asked::Disarm => Event::DisarmRequested,
        Asked::Start => Event::StartRequested { countdown_s },
        Asked::Hold => Event::Hold { cause: HoldCause::Commanded, start },
        Asked::Abort => abort,
        Asked::Tap | Asked::TakeCommand | Asked::Check | Asked::CheckStill | Asked::EndCheck => return None,
    })
}

/// The answer to a request whose event the table has refused; the crew is told the reason.
pub(super) fn refused(
    table: &mut PhaseTable,
    asked: Asked,
    event: Event,
    refusal: Refusal,
    checks: &[Check],
) -> Answer {
    // The first answer may have been lost: a latched abort is accepted again, also under the parachute and on the
    // ground.
    let latched = asked == Asked::Abort && table.mode().interlocks.abort_latched;
    if latched || refusal == Refusal::AlreadyAborted {
        return Answer::ACCEPTED;
    }
    let reason = match refusal {
        Refusal::ChecksFailed => arming::first_refusal(checks).unwrap_or_else(|| refusal.reason()),
        other => other.reason(),
    };
    let ending = match (asked, refusal) {
        (Asked::Abort, _) => Ending::Failed,
        (_, Refusal::ChecksFailed | Refusal::PinIn) => Ending::NotNow,
        _ => Ending::Denied,
    };
    table.say(Severity::Warning, format!("{} refused: {reason}", event.name()));
    Answer { ending, reason: Some(reason) }
}
