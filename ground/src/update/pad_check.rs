//! The checks on the pad: the radio range test, and what goes into the book.

use std::time::Duration;

use protocol::dialect::{MavMessage, TIMESYNC_DATA, TdPadCheckState};
use protocol::log::record::EventLevel;

use super::Action;
use crate::model::events::Speaker;
use crate::model::pad_check::{CheckedValue, PadCheck};
use crate::model::permits::why_not_check;
use crate::model::range_test::RangeTest;
use crate::model::seat::Seat;
use crate::model::{Model, words};

/// Begins the radio range test; one that runs goes on.
pub(super) fn begin_range_test(model: &mut Model, by: Seat, now: Duration) {
    if let Some(why) = why_not_check(model, now) {
        return model.warn(now, format!("no radio range test: {why}"));
    }
    if model.range_test.as_ref().is_some_and(RangeTest::is_running) {
        return model.info(now, "the radio range test runs already");
    }
    let counts = model.link.stats.counts(model.settings.vehicle);
    let text = format!("radio range test begins: 30 s, nothing is commanded{}", by.in_brackets());
    model.record_operator(now, "radio range test", &by, &text);
    model.tell(now, Speaker::Ground, EventLevel::Info, text);
    model.range_test = Some(RangeTest::begin(by, counts, now));
}

/// Lets time pass: questions are sent, and the test ends.
pub(super) fn pass(model: &mut Model, now: Duration) {
    let armed = model.vehicle.armed().is_some_and(|armed| armed.value) || model.vehicle.in_flight();
    let counts = model.link.stats.counts(model.settings.vehicle);
    let Some(test) = model.range_test.as_mut().filter(|test| test.is_running()) else { return };
    if armed {
        test.stop("the vehicle is armed");
    }
    let question = test.pass(counts, now);
    let ended = test.found.map(|found| (found, test.by.clone()));
    if let Some(ts1) = question {
        model.outbox.push(Action::send(MavMessage::TIMESYNC(TIMESYNC_DATA {
            tc1: 0,
            ts1,
            target_system: model.settings.vehicle.system_id,
            target_component: model.settings.vehicle.component_id,
        })));
    }
    if let Some((found, by)) = ended {
        let level = if found.passed() { EventLevel::Info } else { EventLevel::Warning };
        model.record_operator(now, "radio range test", &by, &found.words());
        model.tell(now, Speaker::Ground, level, found.words());
    }
}

/// Enters a check that is over, once every value of it has arrived, with the first values outside their limits.
pub(super) fn enter(model: &mut Model, now: Duration) {
    let Some(check) = model.vehicle.pad_check.as_ref().filter(|check| check.is_whole()) else { return };
    let which = (model.vehicle.boot.number().unwrap_or(0), check.run);
    if model.check_entered == Some(which) {
        return;
    }
    let (text, passed) = (words_of(check), check.state == TdPadCheckState::TD_PAD_CHECK_STATE_PASSED);
    let who = if check.asked_by > 0 { model.operator(check.asked_by) } else { String::new() };
    model.check_entered = Some(which);
    model.enter("check of the vehicle", &who, &text);
    let level = if passed { EventLevel::Info } else { EventLevel::Warning };
    model.tell(now, Speaker::Ground, level, text);
}

fn words_of(check: &PadCheck) -> String {
    let state = words::lower_case(&check.state, "TD_PAD_CHECK_STATE_").to_uppercase();
    let mut text = format!("check {} {state}: {} values", check.run, check.found);
    let failing: Vec<String> = check.failing().map(in_words).collect();
    if !failing.is_empty() {
        text = format!("{text}, outside: {}", failing.join("; "));
    }
    text
}

/// A value with its limit, as in `fin 2 range 0.0 deg (least 87.7)`.
fn in_words(value: &CheckedValue) -> String {
    let (name, unit, factor, decimals) = value.shown();
    let number = |number: f64| crate::view::number::fixed(factor * number, decimals);
    let mut text = format!("{name} {} {unit}", number(value.value));
    for (word, limit) in [("least", value.least), ("most", value.most)] {
        if limit.is_finite() {
            text = format!("{text} ({word} {})", number(limit));
        }
    }
    text
}
