//! What each page shows largest: on the pad GO or NO-GO, in flight phase, height, speed and time, in the burn the time
//! to touchdown and the predicted speed, at the end the verdict.

use std::time::Duration;

use protocol::dialect::TdPhase;

use super::banner;
use super::headline::Item;
use super::number::{STALE_MARK, age_mark, fixed};
use super::theme::TextRole;
use crate::model::Model;
use crate::model::dead_reckoning::{is_unheard, predict_position};
use crate::model::ending::Ending;
use crate::model::motor::hold_words;
use crate::model::permits::{why_nothing_moves, why_other_mission};
use crate::model::vehicle::{Sample, is_on_pad};

/// The most letters of a word on the pad, as in `NO DATA`.
const PAD_LETTERS: u16 = 8;

/// Whether the vehicle may be armed; on the way to the start, how far it is.
pub fn pad(model: &Model, now: Duration) -> Vec<Item> {
    if banner::of(model, now).is_some() {
        return Vec::new();
    }
    let (word, role) = pad_word(model, now);
    vec![Item { label: String::new(), text: [word.clone(), word], letters: [PAD_LETTERS; 2], role }]
}

fn pad_word(model: &Model, now: Duration) -> (String, TextRole) {
    let vehicle = &model.vehicle;
    let word = |text: &str, role| (text.to_owned(), role);
    if vehicle.as_foreign().is_some() {
        return word("NOT OURS", TextRole::Alarm);
    }
    let Some(status) = vehicle.status.as_ref().filter(|status| !status.is_stale(now)) else {
        return word("NO DATA", TextRole::Caution);
    };
    if !is_on_pad(status.value.phase) {
        return word("FLIGHT", TextRole::Title);
    }
    if hold_words(vehicle, model.link.uplink.armed_by_us).is_some() {
        return word("HOLD", TextRole::Alarm);
    }
    if let Some(left) = vehicle.countdown_s().filter(|left| left.value > 0.0) {
        return (format!("T-{}", fixed(left.value, 1)), TextRole::Alarm);
    }
    if vehicle.armed().is_some_and(|armed| armed.value) {
        return word("ARMED", TextRole::Alarm);
    }
    let other_mission = why_other_mission(model).is_some() || why_nothing_moves(model, now).is_some();
    let unsigned = model.why_checklist(now).is_some() || model.why_no_log(now).is_some();
    if other_mission
        || unsigned
        || !status.value.checks_failed.is_empty()
        || !model.link.uplink.is_proven(now)
    {
        return word("NO-GO", TextRole::Caution);
    }
    word("GO", TextRole::Good)
}

/// After a loss of the link in flight: the predicted height instead of an old one, its error, and the silence.
fn lost(model: &Model, now: Duration) -> Vec<Item> {
    let at = predict_position(&model.vehicle, now);
    let sample = |value: f64| Some(Sample::new(value, now));
    let silence_s = model.vehicle.best_motion().map(|motion| motion.age(now).as_secs_f64());
    vec![
        Item {
            label: "link".to_owned(),
            text: ["LOST".to_owned(), "LOST".to_owned()],
            letters: [5, 5],
            role: TextRole::Alarm,
        },
        number("PREDICTED m up", at.and_then(|at| sample(at.altitude_m)), [0, 0], [5, 4], now),
        number("error m", at.and_then(|at| sample(at.error_m)), [0, 0], [5, 4], now),
        number("silent s", silence_s.and_then(sample), [0, 0], [4, 4], now),
    ]
}

/// Phase, height, vertical speed and time since release.
pub fn flight(model: &Model, now: Duration) -> Vec<Item> {
    if banner::of(model, now).is_some() {
        return Vec::new();
    }
    let vehicle = &model.vehicle;
    if is_unheard(vehicle, now) {
        return lost(model, now);
    }
    let phase = vehicle.phase();
    let (mark, role) = phase.map_or((" ", TextRole::Label), |phase| age_mark(&phase, now));
    let word = phase.map_or("--", |phase| phase_word(phase.value));
    let role = if role == TextRole::Stale { role } else { TextRole::Title };
    vec![
        Item {
            label: format!("{}phase", mark.trim()),
            text: [word.to_owned(), word.to_owned()],
            letters: [8, 7],
            role,
        },
        number("height m", vehicle.height_m(), [1, 0], [5, 4], now),
        number("vertical m/s", vehicle.vertical_m_s(), [1, 0], [6, 4], now),
        number("T s", vehicle.countdown_s().map(|left| left.map(|s| -s)), [1, 0], [5, 3], now),
    ]
}

/// Time to touchdown and its predicted speed; height and vertical speed.
pub fn burn(model: &Model, now: Duration) -> Vec<Item> {
    if banner::of(model, now).is_some() {
        return Vec::new();
    }
    let vehicle = &model.vehicle;
    if is_unheard(vehicle, now) {
        return lost(model, now);
    }
    vec![
        number("touchdown in s", vehicle.touchdown_in_s(now), [1, 1], [4, 4], now),
        number("lands at m/s", vehicle.predicted_speed_m_s(), [2, 1], [5, 4], now),
        number("height m", vehicle.height_m(), [1, 1], [5, 5], now),
        number("vertical m/s", vehicle.vertical_m_s(), [1, 1], [5, 5], now),
    ]
}

/// The verdict.
pub fn verdict(model: &Model, now: Duration) -> Vec<Item> {
    if banner::of(model, now).is_some() {
        return Vec::new();
    }
    let (word, role) = match Ending::of(&model.vehicle, now) {
        Some(Ending::Landed) => ("LANDED", TextRole::Good),
        Some(Ending::UnderParachute) => ("PARACHUTE", TextRole::Caution),
        Some(Ending::Hard) => ("HARD", TextRole::Alarm),
        Some(Ending::Lost) => ("LOST", TextRole::Alarm),
        None => ("NO VERDICT", TextRole::Caution),
    };
    vec![Item { label: String::new(), text: [word.to_owned(), word.to_owned()], letters: [10; 2], role }]
}

/// One word for what the vehicle does; its exact phase is in the top lines.
fn phase_word(phase: TdPhase) -> &'static str {
    match phase {
        TdPhase::TD_PHASE_SAFE | TdPhase::TD_PHASE_SAFED => "SAFE",
        TdPhase::TD_PHASE_PAD_IDLE => "PAD",
        TdPhase::TD_PHASE_PAD_ARMED => "ARMED",
        TdPhase::TD_PHASE_BOOST => "BOOST",
        TdPhase::TD_PHASE_COAST => "COAST",
        TdPhase::TD_PHASE_DEPLOY => "FINS",
        TdPhase::TD_PHASE_AERO_DESCENT | TdPhase::TD_PHASE_LAND_ARMED => "DESCENT",
        TdPhase::TD_PHASE_IGNITION => "IGNITE",
        TdPhase::TD_PHASE_POWERED => "BURN",
        TdPhase::TD_PHASE_TOUCHDOWN => "DOWN",
        TdPhase::TD_PHASE_CHUTE => "CHUTE",
    }
}

/// A number with its name and unit; the name of a stale one is marked.
fn number(
    label: &str,
    sample: Option<Sample<f64>>,
    decimals: [usize; 2],
    letters: [u16; 2],
    now: Duration,
) -> Item {
    let (mark, role) = match sample {
        None => ("", TextRole::Label),
        Some(sample) if sample.is_stale(now) => (STALE_MARK, TextRole::Stale),
        Some(_) => ("", TextRole::Title),
    };
    let text = |form: usize| {
        let text = sample.map_or_else(|| "--".to_owned(), |sample| fixed(sample.value, decimals[form]));
        // A number too long for its place loses its decimals, never its first digits.
        if text.len() <= usize::from(letters[form]) {
            return text;
        }
        let whole = sample.map_or_else(String::new, |sample| fixed(sample.value, 0));
        if whole.len() <= usize::from(letters[form]) { whole } else { "many".to_owned() }
    };
    Item { label: format!("{mark}{label}"), text: [text(0), text(1)], letters, role }
}
