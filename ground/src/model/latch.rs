//! Why the landing motor is inhibited for good.

use std::time::Duration;

use protocol::dialect::{TdInterlock, TdLatch};
use protocol::log::record::EventLevel;

use super::Model;
use super::command::CommandKind;
use super::events::Speaker;
use super::vehicle::Vehicle;

/// A text of the vehicle this long before its latch is still about it: the text waits for the radio.
const TEXT_APART: Duration = Duration::from_secs(2);
/// How many of the newest events are searched for the text.
const TEXTS_SEARCHED: usize = 100;

/// The cause that the vehicle tells; `None` if it tells none, or says it in a text only.
pub fn cause(vehicle: &Vehicle) -> Option<&'static str> {
    Some(match vehicle.status.as_ref()?.value.latch {
        TdLatch::TD_LATCH_NONE | TdLatch::TD_LATCH_OTHER => return None,
        TdLatch::TD_LATCH_COMMANDED => "commanded by the crew",
        TdLatch::TD_LATCH_UNCOMMANDED_LIFTOFF => "uncommanded lift-off",
        TdLatch::TD_LATCH_UNCOMMANDED_RELEASE => "uncommanded release",
        TdLatch::TD_LATCH_NO_SEPARATION => "the booster stayed on",
        TdLatch::TD_LATCH_GATE => "the ignition gate did not open in time",
        TdLatch::TD_LATCH_NO_LIGHT => "the motor gave no thrust",
    })
}

/// The latch in words, with its cause; `None` while nothing is latched. A motor that did not light has words of its own.
pub fn words(model: &Model) -> Option<String> {
    let vehicle = &model.vehicle;
    let aborted = vehicle.interlocks()?.contains(TdInterlock::TD_INTERLOCK_ABORT_LATCHED);
    let cause = cause(vehicle);
    let no_light =
        vehicle.status.as_ref().is_some_and(|status| status.value.latch == TdLatch::TD_LATCH_NO_LIGHT);
    let word = match (aborted, cause) {
        (true, _) => "ABORT LATCHED",
        (false, Some(_)) if !no_light => "MOTOR INHIBITED",
        (false, _) => return None,
    };
    let ours = model.commands.of(CommandKind::Abort).map(|_| "commanded from here");
    let cause = cause.or(ours).map(str::to_owned).or_else(|| text_of_the_latch(model));
    Some(cause.map_or_else(|| word.to_owned(), |cause| format!("{word}: {cause}")))
}

/// The first grave text of the vehicle about the time of its latch, because an older vehicle tells no cause: what follows is
/// about the consequences.
fn text_of_the_latch(model: &Model) -> Option<String> {
    let since = model.outcome.aborted_at?.saturating_sub(TEXT_APART);
    let mut events = model.events.newest(TEXTS_SEARCHED);
    let found = events.find(|event| {
        let grave = matches!(event.level, EventLevel::Error | EventLevel::Fatal);
        event.speaker == Speaker::Vehicle && grave && event.at >= since && event.at <= since + 2 * TEXT_APART
    });
    found.map(|event| event.text.clone())
}
