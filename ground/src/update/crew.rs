//! Holds a countdown that this station's crew started when no commanding screen is left.

use std::time::Duration;

use protocol::dialect::{COMMAND_LONG_DATA, MavCmd, MavMessage, TdPhase};
use protocol::identity::Address;
use protocol::log::record::EventLevel;

use super::Action;
use crate::model::Model;
use crate::model::command::CommandKind;
use crate::model::crew::UNATTENDED_MAX;
use crate::model::events::Speaker;
use crate::model::seat::Seat;

/// How often the hold is sent; the countdown itself shows whether it worked.
const HOLD_EVERY: Duration = Duration::from_millis(100);
/// Half of the tick period: ticks are not exact to the millisecond.
const HALF_A_TICK: Duration = Duration::from_millis(50);

pub(super) fn step(model: &mut Model, now: Duration) {
    let alone = !model.settings.auto && model.crew.is_gone(now);
    if !(alone && counts_down(model) && armed_here(model)) {
        if model.crew.hold_due.take().is_some() && !std::mem::take(&mut model.crew.too_late_told) {
            let why = if alone { "the countdown has ended" } else { "a commanding screen is back" };
            model.info(now, format!("the hold is no longer sent: {why}"));
        }
        return;
    }
    let too_late = model.vehicle.is_past_hold(now);
    if model.crew.hold_due.is_none() || (too_late && !model.crew.too_late_told) {
        model.crew.too_late_told = too_late;
        let nobody = format!("no commanding screen for {} s in the countdown", UNATTENDED_MAX.as_secs());
        let what = if too_late { "TOO LATE for a hold, only an abort ends it" } else { "HOLD" };
        let text = format!("{nobody}: {what}");
        model.record_operator(now, "hold", &Seat::default(), &text);
        model.tell(now, Speaker::Ground, EventLevel::Warning, text);
    }
    let due = model.crew.hold_due.unwrap_or(now);
    if too_late {
        model.crew.hold_due = Some(due);
    } else if now + HALF_A_TICK >= due {
        model.outbox.push(Action::send(hold(model.settings.vehicle)));
        model.crew.hold_due = Some(now + HOLD_EVERY);
    }
}

fn counts_down(model: &Model) -> bool {
    let on_pad = model.vehicle.phase().is_some_and(|phase| phase.value == TdPhase::TD_PHASE_PAD_ARMED);
    on_pad && model.vehicle.countdown_s().is_some()
}

/// Whether this station armed the vehicle; a countdown of another station is not held. The vehicle knows it; an older one does
/// not tell it.
fn armed_here(model: &Model) -> bool {
    if model.link.uplink.is_told() {
        return model.link.uplink.armed_by_us;
    }
    let arm = model.commands.of(CommandKind::Arm);
    arm.is_some_and(|track| track.accepted() || track.observed_at.is_some())
}

fn hold(vehicle: Address) -> MavMessage {
    MavMessage::COMMAND_LONG(COMMAND_LONG_DATA {
        command: MavCmd::MAV_CMD_DO_PAUSE_CONTINUE,
        target_system: vehicle.system_id,
        target_component: vehicle.component_id,
        ..COMMAND_LONG_DATA::default()
    })
}
