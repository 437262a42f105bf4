//! What the crew may ask of a craft, and what it answers.

use flight::arming::{self, Uplink};
use flight::phase::{Event, HoldCause, Phase, Refusal};
use protocol::identity::Address;

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
    /// Hold the countdown.
    Hold,
    /// Abort, irreversibly.
    Abort,
}

/// Who asks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Asker {
    /// The station; `None` for the vehicle's own programme.
    pub station: Option<Address>,
    /// How well it is heard.
    pub uplink: Uplink,
}

impl Asker {
    /// The vehicle's own programme.
    pub const NO_STATION: Self = Self { station: None, uplink: Uplink::NotNeeded };
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
pub(super) fn answer<C: Craft + ?Sized>(craft: &mut C, request: Request, asker: Asker) -> Answer {
    let mode = *craft.mode();
    let locks = mode.interlocks;
    // What is so already is accepted: a repeated request must not frighten the crew.
    let already = match request {
        Request::Arm => locks.armed && mode.phase == Phase::PadArmed,
        Request::Disarm => {
            !locks.armed && matches!(mode.phase, Phase::PadIdle | Phase::Touchdown | Phase::Safed)
        }
        Request::Start => locks.armed && mode.countdown_end_s.is_some(),
        Request::Hold => mode.hold.is_some(),
        // Repeated, an abort may mean more than the first time: the phase table decides.
        Request::Abort => false,
    };
    if already {
        return Answer::accepted();
    }
    // By the uplink of the station that asks, which need not be the one that is heard best.
    let heard_best = core::mem::replace(craft.uplink(), asker.uplink);
    let checks = craft.arming_checks();
    *craft.uplink() = heard_best;
    let event = match request {
        Request::Arm => Event::ArmRequested { checks_passed: arming::all_passed(&checks) },
        Request::Disarm => Event::DisarmRequested,
        Request::Start => Event::StartRequested { countdown_s: craft.countdown_s() },
        Request::Hold => Event::Hold { cause: HoldCause::Commanded },
        Request::Abort => craft.abort_event(),
    };
    if let (Request::Hold, Some(_), Some(Address { system_id, component_id })) =
        (request, mode.countdown_end_s, asker.station)
    {
        craft.say(Severity::Notice, format!("station {system_id}/{component_id} asks for a hold"));
    }
    match craft.happen(event) {
        None | Some(Refusal::AlreadyAborted) => Answer::accepted(),
        // Its first answer may have been lost: also under the parachute and on the ground an abort that is latched is so.
        Some(_) if request == Request::Abort && locks.abort_latched => Answer::accepted(),
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
