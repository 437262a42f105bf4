//! After the flight: the flight again on this screen, its report, and the log that the vehicle has written itself.

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

/// Has the vehicle's own log fetched, by the station. Whether it gives it out is the vehicle's decision; this one only
/// spares a vehicle in flight the question.
pub(super) fn download(model: &mut Model, now: Duration) {
    let why = match model.settings.role {
        Role::Replaying => Some("this is a replay"),
        Role::Watching => Some("this screen only watches"),
        Role::Station | Role::Attached if model.is_at_risk() => Some("the vehicle is armed or in flight"),
        Role::Station | Role::Attached if model.vehicle.heartbeat.is_none() => {
            Some("no vehicle has been heard")
        }
        Role::Station | Role::Attached => None,
    };
    match (why, model.settings.role) {
        (Some(why), _) => model.info(now, format!("no download: {why}")),
        (None, Role::Attached) => model.outbox.push(Action::Request(Request::Download)),
        (None, _) => {
            model.info(now, "the vehicle is asked for its log");
            model.outbox.push(Action::FetchLog);
        }
    }
}

/// The log is on its way, is here, or does not come.
pub(super) fn on_download(model: &mut Model, told: Result<String, String>, now: Duration) {
    match told {
        Ok(words) => model.info(now, words),
        Err(why) => model.warn(now, format!("the vehicle's log is not fetched: {why}")),
    }
}
