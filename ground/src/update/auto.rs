//! The automatic mode: arms and starts without a hand, once each, for runs without a crew.

use std::time::Duration;

use protocol::dialect::TdPhase;

use super::commands;
use crate::model::command::CommandKind;
use crate::model::{AutoStep, Model};

/// Failing checks may still pass for this long after the vehicle was first heard; then the arming is
/// asked for anyway, and the vehicle refuses it in words.
const PATIENCE: Duration = Duration::from_secs(10);

pub(super) fn step(model: &mut Model, now: Duration) {
    if !model.settings.auto || !model.link.state(now).carries() {
        return;
    }
    let armed = model.vehicle.armed().is_some_and(|armed| armed.value);
    let phase = model.vehicle.phase().map(|phase| phase.value);
    match model.auto_step {
        AutoStep::WaitForReady => match phase {
            Some(TdPhase::TD_PHASE_PAD_ARMED) if armed => start(model, now),
            Some(TdPhase::TD_PHASE_SAFE | TdPhase::TD_PHASE_PAD_IDLE) => {
                let ready =
                    model.vehicle.status.as_ref().is_some_and(|status| status.value.checks_failed.is_empty());
                if (ready && phase == Some(TdPhase::TD_PHASE_PAD_IDLE)) || now >= PATIENCE {
                    model.info(now, "automatic mode: arming");
                    model.auto_step = AutoStep::WaitForArmed;
                    commands::submit(model, CommandKind::Arm, now);
                }
            }
            // Flying or flown already: there is nothing to start.
            Some(phase) if phase != TdPhase::TD_PHASE_PAD_ARMED => model.auto_step = AutoStep::Done,
            _ => {}
        },
        AutoStep::WaitForArmed => {
            if armed && phase == Some(TdPhase::TD_PHASE_PAD_ARMED) {
                start(model, now);
            }
        }
        AutoStep::Done => {}
    }
}

fn start(model: &mut Model, now: Duration) {
    model.info(now, "automatic mode: starting");
    model.auto_step = AutoStep::Done;
    if model.vehicle.countdown_s().is_none() {
        commands::submit(model, CommandKind::Start, now);
    }
}
