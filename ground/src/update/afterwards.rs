//! After the flight: the flight again on this screen, and its report.

use std::time::Duration;

use super::{Action, Request};
use crate::model::{Model, Role};

/// Why neither is possible now.
fn why_not(model: &Model) -> Option<&'static str> {
    if model.settings.role == Role::Replaying {
        return Some("this is a replay");
    }
    if model.is_at_risk() {
        return Some("the vehicle is armed or in flight");
    }
    if model.settings.log_path.is_none() {
        return Some("there is no log (--log none)");
    }
    (!model.outcome.started).then_some("no flight has been flown yet")
}

pub(super) fn replay(model: &mut Model, now: Duration) {
    match why_not(model) {
        None => model.outbox.push(Action::ReplayFlight),
        Some(why) => model.info(now, format!("no replay: {why}")),
    }
}

/// Has the report written, by the station.
pub(super) fn report(model: &mut Model, now: Duration) {
    match (why_not(model), model.settings.role) {
        (Some(why), _) => model.info(now, format!("no report: {why}")),
        (None, Role::Attached) => model.outbox.push(Action::Request(Request::Report)),
        (None, Role::Station) => {
            model.info(now, "the report is being written");
            model.outbox.push(Action::WriteReport);
        }
        (None, Role::Watching | Role::Replaying) => model.info(now, "no report: this screen only watches"),
    }
}

/// The report is written, or is not.
pub(super) fn on_report(model: &mut Model, written: Result<String, String>, now: Duration) {
    match written {
        Ok(path) => model.info(now, format!("the report is written: {path}")),
        Err(why) => model.warn(now, format!("the report is not written: {why}")),
    }
}
