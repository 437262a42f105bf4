//! The headlines: the words on approaching and of a flight that deviates from its plan, and the
//! large number or word of each phase.

use std::time::Duration;

use super::band::{Item, number, word};
use super::panels::ending_role;
use super::pictures::map::comes_down;
use super::top_lines::readiness;
use super::{STALE_MARK, TextRole};
use crate::model::dead_reckoning::{is_silent, may_have_left, predict_position};
use crate::model::{
    AlarmKind, Approach, Ending, Model, Sample, Spot, hold_words, is_burning, is_liftoff_by_itself,
    is_on_pad, why_not_here,
};
use protocol::dialect::{TdInterlock, TdPhase};

// The largest words of every page, when people may be in danger or wait for permission: DO NOT
// APPROACH, ONE PERSON: PIN IN, MAY BE APPROACHED, LIFT-OFF, MAY BE IN THE AIR, LOST. While they
// are shown, no page shows its own headline.

/// The words for an uncommanded lift-off.
const LIFT_OFF: &str = "LIFT-OFF";
/// A landing motor that was commanded and gave no thrust.
const NO_LIGHT: &str = "NO LIGHT";
/// The words for an abort that its station has not sent.
const NOT_SENT: &str = "ABORT NOT SENT";
/// The words for a vehicle that may have left the pad in silence.
pub const MAY_FLY: &str = "MAY BE IN THE AIR";

/// The words, and a line that gives the reason.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Banner {
    pub words: &'static str,
    /// The beginning of the line: how the flight ended, and the words as text.
    lead: String,
    /// Its end: for how long, and why.
    rest: String,
    pub role: TextRole,
}

/// The present words; `None` on the pad and in flight, as long as all is as planned.
pub fn banner(model: &Model, now: Duration) -> Option<Banner> {
    let vehicle = &model.vehicle;
    let ending = Ending::of(vehicle, now);
    if let Some(approach) = Approach::of(vehicle, now) {
        let stale = vehicle.status.as_ref().is_some_and(|status| status.is_stale(now));
        let mark = if stale { STALE_MARK } else { " " };
        let ending = ending.map_or_else(String::new, |ending| format!("{}; ", ending.word()));
        let role = match approach {
            Approach::Away(away) if away.is_for_the_pin() => TextRole::Caution,
            Approach::Away(_) => TextRole::Alarm,
            Approach::May(_) => TextRole::Good,
        };
        let words = approach.headline();
        let lead = format!("{mark}{ending}{}", words.to_lowercase());
        return Some(Banner { words, lead, rest: approach.reason(), role });
    }
    let uncommanded = || ", uncommanded: TAKE COVER, look up".to_owned();
    Some(match ending {
        _ if let Some(why) = model.link.why_abort_not_sent(now) => {
            Banner::alarm(NOT_SENT, format!(": {why}"))
        }
        None if may_have_left(vehicle, now).is_some() => may_fly(model),
        _ if is_liftoff_by_itself(vehicle) => Banner::alarm(LIFT_OFF, uncommanded()),
        None if vehicle.in_flight() && vehicle.shows(TdInterlock::TD_INTERLOCK_NO_LIGHT) => {
            let chute = vehicle.phase_now() == Some(TdPhase::TD_PHASE_CHUTE);
            let then = if chute { "parachute commanded" } else { "no parachute commanded" };
            Banner::alarm(NO_LIGHT, format!(": the landing motor gave no thrust; {then}"))
        }
        Some(Ending::Lost) => {
            let rest = format!("{}: do not approach", Ending::Lost.detail(vehicle));
            Banner::alarm(Ending::Lost.word(), rest)
        }
        _ => return None,
    })
}

/// The banner of MAY BE IN THE AIR: since when, and where it should come down. The time is fixed;
/// the clock in the line above runs.
fn may_fly(model: &Model) -> Banner {
    let left_s = model.vehicle.countdown_s().map_or(0.0, |left| left.value);
    let place = match model.intended_touchdown() {
        Some(Spot { north_m, east_m, error_m }) if libm::hypot(north_m, east_m) < 1.0 => {
            format!("should land within {error_m:.0} m")
        }
        Some(Spot { north_m, east_m, error_m }) => {
            format!("should land {north_m:.0} m N, {east_m:.0} m E, within {error_m:.0} m")
        }
        None => "no fence reported".to_owned(),
    };
    Banner::alarm(MAY_FLY, format!(" since T-0, silent since T-{left_s:.1} s; {place}"))
}

impl Banner {
    fn alarm(words: &'static str, rest: String) -> Self {
        Self { words, lead: format!(" {words}"), rest, role: TextRole::Alarm }
    }

    /// The line above the large words, which repeats them as text.
    pub fn reason(&self) -> String {
        format!("{}{}", self.lead, self.rest)
    }

    /// The words and the reason in one line, for small screens and without a screen.
    pub fn sentence(&self) -> String {
        format!("{}{}", self.words, self.rest)
    }
}

// The large number or word of each phase.

/// Whether the vehicle may be armed; after that, the step towards the start.
pub fn pad(model: &Model, now: Duration) -> Item {
    let (text, role) = pad_word(model, now);
    word("", &text, role)
}

/// The name of the check for which the countdown is held, or the armed vehicle is NO-GO: it stands
/// beside the word.
pub fn pad_check(model: &Model) -> Option<Item> {
    let (name, _) = model.vehicle.held_for().or_else(|| model.vehicle.unfit_while_armed())?;
    Some(word("", &name, TextRole::Alarm))
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
    let taps =
        model.tapping(now).is_some_and(|(by, _)| by == model.seat_key()) && why_not_here(model).is_none();
    let left = vehicle.countdown_s().filter(|left| left.value > 0.0);
    // A vehicle that was reset while it was armed may do it again.
    let at_work = model.rebooted.is_some_and(|(did, _)| !did.is_empty());
    match readiness(model, now) {
        _ if !is_on_pad(status.value.phase) => word("FLIGHT", TextRole::Title),
        _ if hold_words(model).is_some() => word("HOLD", TextRole::Alarm),
        _ if taps => word("TAP", TextRole::Alarm),
        _ if let Some(left) = left => (format!("T-{}", super::fixed(left.value, 1)), TextRole::Title),
        _ if vehicle.unfit_while_armed().is_some() => word("NO-GO", TextRole::Alarm),
        _ if vehicle.is_armed() => word("ARMED", TextRole::Caution),
        _ if at_work && model.alarms.is_unseen(AlarmKind::Rebooted) => word("RESET", TextRole::Alarm),
        Some((_, TextRole::Good)) => word("GO", TextRole::Good),
        _ => word("NO-GO", TextRole::Caution),
    }
}

/// After a loss of the link in flight: the predicted height instead of an old one, its error, and
/// the silence.
fn lost(model: &Model, now: Duration) -> (Item, Vec<Item>) {
    let at = predict_position(&model.vehicle, now);
    let sample = |value: f64| Some(Sample::new(value, now));
    let silence_s = model.vehicle.best_motion().map(|motion| motion.age(now).as_secs_f64());
    let others = vec![
        number("PREDICTED m up", at.and_then(|at| sample(at.altitude_m)), 0, 4, now).predicted(),
        number("error m", at.and_then(|at| sample(at.spot.error_m)), 0, 4, now).predicted(),
    ];
    (number("LINK LOST, silent s", silence_s.and_then(sample), 0, 4, now), others)
}

/// The number of the present phase, and two or three others.
pub fn of_flight(model: &Model, now: Duration) -> (Item, Vec<Item>) {
    use TdPhase as P;
    let vehicle = &model.vehicle;
    if is_silent(vehicle, now) {
        return lost(model, now);
    }
    let phase = vehicle.phase_now();
    let height = || number("height m", vehicle.height_m(), 0, 3, now);
    let vertical = vehicle.vertical_m_s();
    let sink = || number("sink m/s", vertical.map(|up| up.map(|m_s| -m_s)), 0, 3, now);
    let climb = || number("climb m/s", vertical, 0, 3, now);
    let tilt = || number("tilt deg", vehicle.tilt_deg(), 0, 3, now);
    let off_pad = comes_down(model, now).map(|at| Sample::new(libm::hypot(at.east_m, at.north_m), now));
    let fence_m = vehicle.fence_m();
    let lands_off = || {
        let mut lands = number("lands off pad m", off_pad, 0, 3, now).predicted();
        if off_pad.zip(fence_m).is_some_and(|(off_pad, fence_m)| off_pad.value > fence_m) {
            (lands.label, lands.role) = ("LANDS PAST FENCE".to_owned(), TextRole::Caution);
        }
        lands
    };
    let apogee_s =
        vehicle.of_descent(|d| d.time_to_apogee_s).map(|left| left.map(|s| s - left.age(now).as_secs_f64()));
    match phase {
        Some(phase) if is_burning(phase) => {
            let lands = number("lands at m/s", vehicle.predicted_speed_m_s(), 1, 3, now).predicted();
            let main = number("s to touchdown", vehicle.touchdown_in_s(now), 1, 4, now).predicted();
            (main, vec![lands, height(), sink()])
        }
        Some(P::TD_PHASE_AERO_DESCENT | P::TD_PHASE_LAND_ARMED) if vehicle.may_light() => (
            number("s to ignition", vehicle.ignition_in_s(now), 1, 4, now).predicted(),
            vec![height(), sink(), lands_off()],
        ),
        Some(P::TD_PHASE_COAST) if apogee_s.is_some_and(|left| left.value > 0.0) => {
            (number("s to apogee", apogee_s, 1, 4, now).predicted(), vec![height(), climb(), tilt()])
        }
        Some(P::TD_PHASE_BOOST | P::TD_PHASE_COAST) => {
            (number("height m", vehicle.height_m(), 0, 4, now), vec![climb(), tilt()])
        }
        _ => (number("height m", vehicle.height_m(), 0, 4, now), vec![sink(), lands_off()]),
    }
}

/// The verdict.
pub fn verdict(model: &Model, now: Duration) -> Item {
    let ended = ending_role(model, now).map(|(ending, role)| (ending.words()[1], role));
    let settles = model.vehicle.phase_now() == Some(TdPhase::TD_PHASE_TOUCHDOWN);
    let none = match settles {
        true => ("DOWN, SETTLING", TextRole::Title),
        false if model.vehicle.in_flight() => ("IN FLIGHT", TextRole::Title),
        false => ("NO VERDICT", TextRole::Caution),
    };
    let (text, role) = ended.unwrap_or(none);
    word("", text, role)
}
