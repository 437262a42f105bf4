//! Signs and voids the steps of the checklist, and opens them again for the next flight.

use std::time::Duration;

use protocol::log::record::EventLevel;

use super::{Action, Request};
use crate::model::checklist::{ChecklistEntry, Mark, Signature};
use crate::model::dialog::Dialog;
use crate::model::events::Speaker;
use crate::model::seat::Seat;
use crate::model::two_person::role_name;
use crate::model::{Model, Role};

/// Opens the dialog that signs or voids the chosen step.
pub(super) fn open_dialog(model: &mut Model, void: bool, now: Duration) {
    let Some(step) = model.chosen_step(now) else {
        return model.info(now, "there is no checklist (--checklist)");
    };
    model.pages.checklist = true;
    if model.settings.role == Role::Station
        && let seat = model.settings.seat.clone()
        && let Err(why) = signature(model, (step, void), &seat, now)
    {
        return refuse(model, (step, void), &seat, &why, now);
    }
    model.dialog = Dialog::sign(step, void, now);
}

/// The dialog is complete: signs here, or asks the station to.
pub(super) fn ask(model: &mut Model, (step, void): (usize, bool), now: Duration) {
    match model.settings.role {
        Role::Attached => {
            let step = u8::try_from(step).unwrap_or(u8::MAX);
            model.outbox.push(Action::Request(Request::Sign { step, void }));
        }
        Role::Station => sign(model, (step, void), &model.settings.seat.clone(), now),
        Role::Watching | Role::Replaying => {}
    }
    // The next step that is open is chosen.
    model.pages.step = None;
}

/// Signs or voids a step for a person at a screen of this station, unless the step or the person does not fit.
pub(super) fn sign(model: &mut Model, (step, void): (usize, bool), by: &Seat, now: Duration) {
    match signature(model, (step, void), by, now) {
        Ok(signature) => {
            model.sign_refused = None;
            let entry = if void {
                ChecklistEntry::Voided { step, signature: signature.clone() }
            } else {
                ChecklistEntry::Signed { step, signature: signature.clone() }
            };
            change(model, entry);
            let verb = if void { "voided" } else { "signed" };
            let text = words(model, step, &signature, verb, by);
            model.record_operator(now, verb, by, &text);
            let level = if void { EventLevel::Warning } else { EventLevel::Info };
            model.tell(now, Speaker::Ground, level, text);
        }
        Err(why) => refuse(model, (step, void), by, &why, now),
    }
}

fn refuse(model: &mut Model, (step, void): (usize, bool), by: &Seat, why: &str, now: Duration) {
    let what = if void { "voided" } else { "signed" };
    let text = format!("step {} is not {what}: {why}{}", step + 1, by.in_brackets());
    model.record_operator(now, "not signed", by, &text);
    model.outbox.push(Action::RefuseSignature(text.clone()));
    on_refused(model, text, now);
}

/// The station has refused a signature: every screen says why.
pub(super) fn on_refused(model: &mut Model, why: String, now: Duration) {
    model.tell(now, Speaker::Ground, EventLevel::Warning, why.clone());
    model.sign_refused = Some((why, now));
}

fn words(model: &Model, step: usize, signature: &Signature, verb: &str, by: &Seat) -> String {
    let role = signature.role.map_or_else(String::new, |role| format!("{} ", role_name(role)));
    let who = if signature.by.is_empty() { by.to_string() } else { signature.by.clone() };
    let step_words = model.checklist.as_ref().and_then(|list| list.steps.get(step)).map(|step| {
        let found = signature.found.zip(step.value.as_ref());
        let found = found.map_or_else(String::new, |(found, limits)| {
            format!(": {found:.*} {}", limits.quantity.decimals, limits.quantity.unit)
        });
        format!("{}{found}", step.words)
    });
    format!("checklist step {} {verb} by {role}{who}: {}", step + 1, step_words.unwrap_or_default())
}

/// What a signature would hold.
fn signature(
    model: &Model,
    (number, void): (usize, bool),
    by: &Seat,
    now: Duration,
) -> Result<Signature, String> {
    let step = model.checklist.as_ref().and_then(|list| list.steps.get(number));
    let step = step.ok_or("there is no such step")?;
    let role = model.may_sign(&by.operator)?;
    let signature = Signature {
        by: by.operator.clone(),
        role,
        unix_s: model.settings.start_unix_s + now.as_secs(),
        found: None,
    };
    match (&step.mark, void) {
        (Mark::Signed(_), false) => return Err("it is signed already".to_owned()),
        (Mark::Open | Mark::Voided(_), true) => return Err("it is not signed".to_owned()),
        // Anybody who may sign at all may take a signature back.
        (Mark::Signed(_), true) => return Ok(signature),
        (Mark::Open | Mark::Voided(_), false) => {}
    }
    if let (Some(wanted), Some(role)) = (step.role, role)
        && wanted != role
    {
        return Err(format!("{} signs it, {} is {}", role_name(wanted), by.operator, role_name(role)));
    }
    let Some(limits) = &step.value else { return Ok(signature) };
    let (name, unit) = (limits.quantity.name, limits.quantity.unit);
    match model.fresh(limits, now) {
        None => Err(format!("the vehicle does not send its {name} now")),
        Some(found) if !limits.hold(found) => {
            let decimals = limits.quantity.decimals;
            Err(format!("{name} is {found:.decimals$} {unit}, not {}", limits.words()))
        }
        found => Ok(Signature { found, ..signature }),
    }
}

/// The vehicle has left the pad: every step is open again.
pub(super) fn on_liftoff(model: &mut Model, now: Duration) {
    let touched = model.checklist.as_ref().is_some_and(super::super::model::checklist::Checklist::is_touched);
    if model.settings.role == Role::Station && touched {
        change(model, ChecklistEntry::Flown { unix_s: model.settings.start_unix_s + now.as_secs() });
        model.info(now, "the checklist is open again, for the next flight");
    }
}

fn change(model: &mut Model, entry: ChecklistEntry) {
    if let Some(list) = &mut model.checklist
        && list.apply(&entry)
    {
        model.outbox.push(Action::KeepChecklist(entry));
    }
}
