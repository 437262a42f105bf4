//! What the crew may ask of a craft, and what it answers.

use flight::arming;
use flight::phase::{Event, Phase, Refusal};

use super::{Craft, Severity};

/// Something asked by radio.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Request {
    /// Arm.
    Arm,
    /// Disarm; cancels a countdown.
    Disarm,
    /// Start the countdown.
    Start,
    /// Abort, irreversibly.
    Abort,
}

/// How a request ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Result {
    /// Done, or already so.
    Accepted,
    /// Not now: the reason can be mended.
    NotNow,
    /// Not in this phase or state.
    Denied,
    /// Understood and impossible.
    Failed,
}

/// An answer with its reason.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Answer {
    /// How it ended.
    pub result: Result,
    /// Why, if not accepted.
    pub reason: Option<String>,
}

impl Answer {
    fn accepted() -> Self {
        Self { result: Result::Accepted, reason: None }
    }
}

/// Answers a request, and has the craft act on it.
pub(super) fn answer<C: Craft + ?Sized>(craft: &mut C, request: Request) -> Answer {
    let mode = *craft.mode();
    let locks = mode.interlocks;
    // What is so already is accepted: a repeated request must not frighten the crew.
    let already = match request {
        Request::Arm => locks.armed && mode.phase == Phase::PadArmed,
        Request::Disarm => !locks.armed && matches!(mode.phase, Phase::PadIdle | Phase::Safed),
        Request::Start => locks.armed && mode.countdown_end_s.is_some(),
        // Repeated, an abort may mean more than the first time: the phase table decides.
        Request::Abort => false,
    };
    if already {
        return Answer::accepted();
    }
    let checks = craft.arming_checks();
    let event = match request {
        Request::Arm => Event::ArmRequested { checks_passed: arming::all_passed(&checks) },
        Request::Disarm => Event::DisarmRequested,
        Request::Start => Event::StartRequested { countdown_s: craft.countdown_s() },
        Request::Abort => craft.abort_event(),
    };
    match craft.happen(event) {
        None | Some(Refusal::AlreadyAborted) => Answer::accepted(),
        Some(refusal) => {
            let reason = match refusal {
                Refusal::ChecksFailed => arming::first_refusal(&checks).unwrap_or_else(|| refusal.reason()),
                other => other.reason(),
            };
            let result = match (request, refusal) {
                (Request::Abort, _) => Result::Failed,
                (_, Refusal::ChecksFailed | Refusal::PinIn) => Result::NotNow,
                _ => Result::Denied,
            };
            craft.say(Severity::Warning, format!("{} refused: {reason}", event.name()));
            Answer { result, reason: Some(reason) }
        }
    }
}
