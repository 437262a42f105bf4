//! The requests of a crew: those that the screens of a station make, and its own.

use std::time::Duration;

use protocol::log::record::EventLevel;

use super::{commands, pad, vehicle_changes};
use crate::model::{Action, AlarmKind, CommandKind, Model, Request, Seat, why_nothing_flown};

/// Does what a screen of the station requests, after every step of its dialog.
pub(super) fn on_request(model: &mut Model, request: Request, by: Seat, now: Duration) {
    if request == Request::Command(CommandKind::Abort) {
        model.link.abort_requested_at = None;
    }
    match request {
        Request::Command(kind) => commands::command(model, kind, &by, now),
        Request::Acknowledge(kind) => acknowledge(model, kind, now),
        Request::Report => {
            if let Some(why) = why_nothing_flown(model) {
                return model.info(now, format!("no report: {why}"));
            }
            model.info(now, "the report is being written");
            model.outbox.push(Action::WriteReport);
        }
        Request::Choose(boot) => vehicle_changes::choose(model, boot, &by, now),
        Request::RangeTest => pad::begin_range_test(model, by, now),
        Request::WithoutLog => commands::without_log(model, &by, now),
        Request::Untested => commands::untested(model, &by, now),
        Request::Sign { step, void } => pad::sign(model, (step.into(), void), &by, now),
        Request::Note(text) => {
            model.log_act(now, "note", &by, EventLevel::Info, format!("note{}: {text}", by.in_brackets()));
        }
    }
}

pub(super) fn acknowledge(model: &mut Model, kind: AlarmKind, now: Duration) {
    if kind == AlarmKind::AbortBefore {
        model.abort_before = None;
    }
    if let Some(text) = model.alarms.acknowledge(kind) {
        model.info(now, format!("alarm acknowledged: {text}"));
    }
}
