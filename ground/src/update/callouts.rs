//! What is called out: as a line of text to the crew's voice, or as bells without one.

use std::time::Duration;

use protocol::dialect::TdPhase;

use super::Action;
use crate::model::callouts::Amount;
use crate::model::ending::Ending;
use crate::model::link_state::LinkState;
use crate::model::motor::Approach;
use crate::model::vehicle::is_on_pad;
use crate::model::{Model, words};

/// Heights are called out in these steps, m: above the limit, and below it.
const HIGH_STEP_M: f64 = 50.0;
const LOW_STEP_M: f64 = 10.0;
const LOW_BELOW_M: f64 = 50.0;
/// Bells of a callout without a voice: for an event, for an event to watch, for something wrong.
const EVENT: u8 = 1;
const WATCH: u8 = 2;
const WRONG: u8 = 3;

/// Compares the present state with what was called out.
pub(super) fn watch(model: &mut Model, now: Duration) {
    phase(model);
    height(model, now);
    readiness(model, now);
    link(model, now);
    ending(model, now);
    approach(model, now);
}

/// Rings a bell that is still to ring; bells apart from each other can be counted.
pub(super) fn ring(model: &mut Model) {
    if model.called.bells_left > 0 {
        model.called.bells_left -= 1;
        model.outbox.push(Action::Bell);
    }
}

fn call(model: &mut Model, amount: Amount, text: impl Into<String>, bells: u8) {
    let talk = model.settings.talk;
    // A screen that attaches late is told the past, and does not repeat it.
    if amount > talk.amount || model.alarms.are_in_history() {
        return;
    }
    if talk.has_voice {
        model.outbox.push(Action::Say(text.into()));
    } else if amount == Amount::Few {
        model.called.bells_left = model.called.bells_left.max(bells);
    }
}

fn ending(model: &mut Model, now: Duration) {
    let ending = Ending::of(&model.vehicle, now);
    if std::mem::replace(&mut model.called.ending, ending) == ending {
        return;
    }
    if let Some(ending) = ending {
        let bells = if ending == Ending::Landed { EVENT } else { WRONG };
        call(model, Amount::Few, ending.word().to_lowercase(), bells);
    }
}

fn approach(model: &mut Model, now: Duration) {
    let headline = Approach::of(&model.vehicle, now).map(|approach| approach.headline());
    if std::mem::replace(&mut model.called.approach, headline) == headline {
        return;
    }
    if let Some(headline) = headline {
        call(model, Amount::Few, headline.to_lowercase(), EVENT);
    }
}

fn phase(model: &mut Model) {
    let Some(phase) = model.vehicle.phase().map(|phase| phase.value) else { return };
    let Some(before) = model.called.phase.replace(phase).filter(|before| *before != phase) else { return };
    let climbed = matches!(before, TdPhase::TD_PHASE_BOOST | TdPhase::TD_PHASE_COAST);
    match phase {
        TdPhase::TD_PHASE_BOOST => call(model, Amount::Few, "liftoff", WATCH),
        TdPhase::TD_PHASE_CHUTE => call(model, Amount::Few, "parachute", WRONG),
        TdPhase::TD_PHASE_IGNITION => call(model, Amount::Few, "ignition", WATCH),
        TdPhase::TD_PHASE_TOUCHDOWN => call(model, Amount::Few, "touchdown", WATCH),
        TdPhase::TD_PHASE_DEPLOY | TdPhase::TD_PHASE_AERO_DESCENT if climbed => {
            call(model, Amount::Few, "apogee", EVENT);
        }
        other => call(model, Amount::Normal, words::phase(other).to_lowercase().replace('_', " "), 0),
    }
    if is_on_pad(phase) {
        model.called.height_m = None;
    }
}

/// Calls out the last step of the height that was passed.
fn height(model: &mut Model, now: Duration) {
    let fresh = model.vehicle.height_m().filter(|height| !height.is_stale(now) && height.value.is_finite());
    let Some(height_m) = fresh.filter(|_| model.vehicle.in_flight()).map(|height| height.value) else {
        return;
    };
    let Some(before_m) = model.called.height_m.replace(height_m) else { return };
    let low = height_m.min(before_m) < LOW_BELOW_M;
    let (step_m, amount) = if low { (LOW_STEP_M, Amount::All) } else { (HIGH_STEP_M, Amount::Normal) };
    let steps_below = |height_m: f64| libm::floor(height_m / step_m) as i64;
    if steps_below(before_m) == steps_below(height_m) {
        return;
    }
    let passed_m =
        if height_m > before_m { libm::floor(height_m / step_m) } else { libm::ceil(height_m / step_m) };
    let passed_m = passed_m * step_m;
    // 50 m is a step of both.
    let amount = if passed_m % HIGH_STEP_M == 0.0 { Amount::Normal } else { amount };
    let wait = model.settings.talk.height_every;
    let waits = model.called.height_at.is_some_and(|at| now.saturating_sub(at) < wait);
    if passed_m > 0.0 && !waits && amount <= model.settings.talk.amount {
        model.called.height_at = Some(now);
        call(model, amount, format!("{passed_m:.0} metres"), 0);
    }
}

/// GO and NO-GO on the pad, once the vehicle has reported its checks.
fn readiness(model: &mut Model, now: Duration) {
    let status = model.vehicle.status.as_ref().filter(|status| !status.is_stale(now));
    let Some(status) = status.filter(|status| is_on_pad(status.value.phase)) else { return };
    let failing = words::failed_checks(status.value.checks_failed);
    let no_log = model.why_no_log(now);
    let go = failing.is_empty() && no_log.is_none() && model.link.uplink.is_proven(now);
    let Some(before) = model.called.go.replace(go).filter(|before| *before != go) else { return };
    if before {
        let why = match no_log {
            _ if !failing.is_empty() => failing.join(", "),
            Some(_) => "station log".to_owned(),
            None => "uplink".to_owned(),
        };
        call(model, Amount::Few, format!("no go: {why}"), WRONG);
    } else {
        call(model, Amount::Normal, "go", 0);
    }
}

fn link(model: &mut Model, now: Duration) {
    let lost = matches!(model.link.state(model.link.known_until(now)), LinkState::Lost(_));
    if std::mem::replace(&mut model.called.lost, lost) == lost {
        return;
    }
    if lost {
        // The alarm of the lost link rings by itself.
        call(model, Amount::Few, "link lost", 0);
    } else {
        call(model, Amount::Normal, "link restored", 0);
    }
}
