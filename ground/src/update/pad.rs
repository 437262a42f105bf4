//! The crew's actions on the pad: signing and voiding steps of the checklist, the radio test, the
//! vehicle's check.

use std::time::Duration;

use protocol::dialect::{TD_PAD_CHECK_DATA, TdPadCheckState};
use protocol::log::record::EventLevel;

use crate::model::{
    Action, ChecklistEntry, Mark, Model, PadCheck, Prompt, RangeTest, Role, Seat, Signature, Speaker,
    role_name, shown, why_not_check, words,
};

/// Opens the dialog that signs or voids the chosen step.
pub(super) fn open_sign_dialog(model: &mut Model, void: bool, now: Duration) {
    let none = "there is no checklist (--checklist)";
    let Some(step) = model.chosen_step(now) else { return model.info(now, none) };
    model.pages.checklist = true;
    if model.settings.role == Role::Station
        && let seat = model.settings.seat.clone()
        && let Err(why) = signed(model, (step, void), &seat, now)
    {
        return refuse_signature(model, (step, void), &seat, &why, now);
    }
    model.dialog = Some(Prompt::Sign { step, void }.open(now));
}

/// Signs or voids a step for a person at a screen of this station, unless the step or the person
/// does not fit.
pub(super) fn sign(model: &mut Model, (step, void): (usize, bool), by: &Seat, now: Duration) {
    match signed(model, (step, void), by, now) {
        Ok(signature) => {
            model.sign_refused = None;
            let mark = if void { Mark::Voided(signature.clone()) } else { Mark::Signed(signature.clone()) };
            change_checklist(model, ChecklistEntry::Marked { step, mark });
            let verb = if void { "voided" } else { "signed" };
            let text = signature_words(model, step, &signature, verb, by);
            let level = if void { EventLevel::Warning } else { EventLevel::Info };
            model.log_act(now, verb, by, level, text);
        }
        Err(why) => refuse_signature(model, (step, void), by, &why, now),
    }
}

fn refuse_signature(model: &mut Model, (step, void): (usize, bool), by: &Seat, why: &str, now: Duration) {
    let what = if void { "voided" } else { "signed" };
    let text = format!("step {} is not {what}: {why}{}", step + 1, by.in_brackets());
    model.record_operator(now, "not signed", by, &text);
    model.outbox.push(Action::RefuseSignature(text.clone()));
    on_sign_refused(model, text, now);
}

/// The station has refused a signature: every screen shows the reason.
pub(super) fn on_sign_refused(model: &mut Model, why: String, now: Duration) {
    model.list_event(now, Speaker::Ground, EventLevel::Warning, why.clone());
    model.sign_refused = Some((why, now));
}

fn signature_words(model: &Model, step: usize, signature: &Signature, verb: &str, by: &Seat) -> String {
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

/// The signature that would be stored.
fn signed(model: &Model, (step, void): (usize, bool), by: &Seat, now: Duration) -> Result<Signature, String> {
    let step = model.checklist.as_ref().and_then(|list| list.steps.get(step));
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
        // Anyone who may sign at all may take a signature back.
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
pub(super) fn reopen_checklist(model: &mut Model, now: Duration) {
    let touched = model.checklist.as_ref().is_some_and(crate::model::Checklist::is_touched);
    if model.settings.role == Role::Station && touched {
        let unix_s = model.settings.start_unix_s + now.as_secs();
        change_checklist(model, ChecklistEntry::Flown { unix_s });
        model.info(now, "the checklist is open again, for the next flight");
    }
}

fn change_checklist(model: &mut Model, entry: ChecklistEntry) {
    if let Some(list) = &mut model.checklist
        && list.apply(&entry)
    {
        model.outbox.push(Action::StoreChecklist(entry));
    }
}

// The checks on the pad: the radio range test, and the entries of the book.

/// Begins the radio range test; a running one continues.
pub(super) fn begin_range_test(model: &mut Model, by: Seat, now: Duration) {
    if let Some(why) = why_not_check(model, now) {
        return model.warn(now, format!("no radio range test: {why}"));
    }
    if model.range_test.as_ref().is_some_and(RangeTest::is_running) {
        return model.info(now, "the radio range test runs already");
    }
    let counts = model.link.stats.counts(model.settings.vehicle);
    let text = format!("radio range test begins: 30 s, nothing is commanded{}", by.in_brackets());
    model.log_act(now, "radio range test", &by, EventLevel::Info, text);
    model.range_test = Some(RangeTest::begin(by, counts, now));
}

/// Lets time pass: sends requests, and ends the test. Stops it for the reason `spoiled`, or because
/// the vehicle is armed.
pub(super) fn pass_range_test(model: &mut Model, spoiled: Option<&'static str>, now: Duration) {
    let armed = model.vehicle.is_armed() || model.vehicle.in_flight();
    let counts = model.link.stats.counts(model.settings.vehicle);
    let Some(test) = model.range_test.as_mut().filter(|test| test.is_running()) else { return };
    if let Some(why) = spoiled.or(armed.then_some("the vehicle is armed")) {
        test.stop(why);
    }
    let question = test.pass(counts, now);
    let ended = test.found.map(|found| (found, test.by.clone()));
    if let Some(ts1) = question {
        model.request_time(ts1);
    }
    if let Some((found, by)) = ended {
        let level = if found.passed() { EventLevel::Info } else { EventLevel::Warning };
        model.log_act(now, "radio range test", &by, level, found.words());
    }
}

/// Enters a check that is over, once every value of it has arrived, with the first values outside
/// their limits.
pub(super) fn enter_check(model: &mut Model, now: Duration) {
    let Some(check) = model.vehicle.pad_check.as_ref().filter(|check| check.is_complete()) else { return };
    let which = (model.vehicle.boot.number().unwrap_or(0), check.report.run);
    if model.check_entered == Some(which) {
        return;
    }
    let (text, passed) =
        (check_words(check), check.report.state == TdPadCheckState::TD_PAD_CHECK_STATE_PASSED);
    let who = if check.report.asked_by > 0 { model.operator(check.report.asked_by) } else { String::new() };
    model.check_entered = Some(which);
    model.enter("check of the vehicle", &who, &text);
    let level = if passed { EventLevel::Info } else { EventLevel::Warning };
    model.list_event(now, Speaker::Ground, level, text);
}

fn check_words(check: &PadCheck) -> String {
    let state = words::lower_case(&check.report.state, "TD_PAD_CHECK_STATE_").to_uppercase();
    let failing: Vec<String> = check.failing().map(value_words).collect();
    let outside =
        if failing.is_empty() { String::new() } else { format!(", outside: {}", failing.join("; ")) };
    format!("check {} {state}: {} values{outside}", check.report.run, check.report.found)
}

/// A value with its limit, as in `fin 2 range 0.0 deg (least 87.7)`.
fn value_words(value: &TD_PAD_CHECK_DATA) -> String {
    let (name, unit, number) = shown(value);
    let mut text = format!("{name} {} {unit}", number(value.value));
    for (word, limit) in [("least", value.least), ("most", value.most)] {
        if limit.is_finite() {
            text = format!("{text} ({word} {})", number(limit));
        }
    }
    text
}
