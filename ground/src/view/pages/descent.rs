//! The descent page: height gauge with the ignition band, values of the descent, fins from above, side view.

use std::time::Duration;

use protocol::dialect::{TD_DESCENT_DATA, TdAbortEffect, TdChute, TdPhase};
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::text::Line;

use super::flying::{self, of_descent};
use crate::model::motion::Motion;
use crate::model::vehicle::Sample;
use crate::model::{Model, words};
use crate::view::lost_position;
use crate::view::number::{age_mark, fixed, row, text_row};
use crate::view::theme::{TextRole, Theme};

pub fn draw(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let values = values(model, theme, now);
    flying::draw(model, ("Descent", values), true, theme, now, frame, area);
}

/// For small screens: the values, with height and speed, which have no headline there.
pub fn lines(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    let mut lines = values(model, theme, now);
    flying::insert_height(&mut lines, model, theme, now);
    lines
}

/// The values, the most important first.
fn values(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    let mut lines = lost_position::rows(model, theme, now);
    let motion = model.vehicle.best_motion();
    let of = |pick| of_descent(model, pick);
    let of_motion = |pick: fn(&Motion) -> f64| {
        motion.map(|motion| motion.map(pick)).filter(|sample| !sample.value.is_nan())
    };
    let lights = |sample: Option<Sample<f64>>| sample.filter(|_| model.vehicle.may_light());
    lines.push(band_word(model, theme, now));
    lines.push(row(theme, "ignite in", model.vehicle.ignition_in_s(now), 1, "s", now));
    lines.push(row(theme, "ignite at", lights(of(|d| d.chosen_height_m)), 1, "m", now));
    lines.push(band(model.vehicle.descent.as_ref(), theme, now));
    lines.push(row(theme, "commit at", of(|d| d.commit_height_m), 1, "m", now));
    lines.push(chute(model.vehicle.descent.as_ref(), theme, now));
    let tilt = model.vehicle.attitude.map(|attitude| attitude.map(|a| a.tilt_rad.to_degrees()));
    lines.push(row(theme, "distance", of_motion(Motion::distance_m), 1, "m", now));
    lines.push(row(theme, "horizontal", of_motion(Motion::horizontal_m_s), 1, "m/s", now));
    lines.push(row(theme, "tilt", tilt, 1, "deg", now));
    lines.push(row(theme, "wind", wind_speed(model.vehicle.descent.as_ref()), 1, "m/s", now));
    lines.push(row(theme, "wind from", wind_from(model.vehicle.descent.as_ref()), 0, "deg", now));
    lines.push(row(theme, "drag x", of(|d| d.drag_scale), 3, "", now));
    lines.push(row(theme, "down north", of(|d| d.touchdown_x_m), 1, "m", now));
    lines.push(row(theme, "down east", of(|d| d.touchdown_y_m), 1, "m", now));
    lines
}

/// The heights from which a burn lands.
fn band(descent: Option<&Sample<TD_DESCENT_DATA>>, theme: Theme, now: Duration) -> Line<'static> {
    let known = descent.filter(|d| d.value.band_low_m.is_finite() && d.value.band_high_m.is_finite());
    let Some(descent) = known else { return text_row(theme, "band", " ", "--", TextRole::Label, "m") };
    let (mark, role) = age_mark(descent, now);
    let (low_m, high_m) = (f64::from(descent.value.band_low_m), f64::from(descent.value.band_high_m));
    text_row(theme, "band", mark, &format!("{}..{}", fixed(low_m, 0), fixed(high_m, 0)), role, "m")
}

/// Compares the height with the ignition band and the commit height, in words.
fn band_word(model: &Model, theme: Theme, now: Duration) -> Line<'static> {
    if model.vehicle.in_flight() && model.vehicle.interlocks().is_some() && !model.vehicle.may_light() {
        return Line::styled(" NO BURN: motor inhibited", theme.style(TextRole::Alarm));
    }
    let Some(descent) = model.vehicle.descent.as_ref() else {
        return Line::styled(" ignition band: no data", theme.style(TextRole::Caution));
    };
    let (mark, stale) = age_mark(descent, now);
    let d = &descent.value;
    let height_m = model.vehicle.height_m().map_or(f64::NAN, |height| height.value);
    let (low_m, high_m) = (f64::from(d.band_low_m), f64::from(d.band_high_m));
    let (words, role) = if !(height_m.is_finite() && low_m.is_finite() && high_m.is_finite()) {
        ("band not known", TextRole::Caution)
    } else if low_m > high_m {
        ("NO HEIGHT LANDS", TextRole::Alarm)
    } else if height_m < low_m {
        ("BELOW the band", TextRole::Alarm)
    } else if height_m > high_m {
        ("above the band", TextRole::Plain)
    } else {
        ("INSIDE the band", TextRole::Good)
    };
    let committed = height_m < f64::from(d.commit_height_m) && !parachute_may_fly(model, d.chute);
    let commit = if committed { ", committed" } else { "" };
    let role = if stale == TextRole::Stale { stale } else { role };
    Line::styled(format!("{mark}{words}{commit}"), theme.style(role))
}

/// Whether the parachute is out, or an abort would still throw it out. Then the vehicle is not committed to a burn.
fn parachute_may_fly(model: &Model, chute: TdChute) -> bool {
    let out = matches!(chute, TdChute::TD_CHUTE_FIRED | TdChute::TD_CHUTE_OPEN);
    let ordered = model.vehicle.phase().is_some_and(|phase| phase.value == TdPhase::TD_PHASE_CHUTE);
    let now = TdAbortEffect::TD_ABORT_EFFECT_CHUTE_NOW;
    out || ordered || model.vehicle.status.as_ref().is_some_and(|status| status.value.abort_effect == now)
}

fn chute(descent: Option<&Sample<TD_DESCENT_DATA>>, theme: Theme, now: Duration) -> Line<'static> {
    let Some(descent) = descent else { return text_row(theme, "chute", " ", "no data", TextRole::Label, "") };
    let (mark, stale) = age_mark(descent, now);
    let text = words::lower_case(&descent.value.chute, "TD_CHUTE_");
    let role = match descent.value.chute {
        TdChute::TD_CHUTE_FIRED | TdChute::TD_CHUTE_OPEN => TextRole::Caution,
        _ => TextRole::Plain,
    };
    text_row(theme, "chute", mark, &text, if stale == TextRole::Stale { stale } else { role }, "")
}

fn wind_speed(descent: Option<&Sample<TD_DESCENT_DATA>>) -> Option<Sample<f64>> {
    let descent = descent?;
    let speed = libm::hypot(f64::from(descent.value.wind_x_m_s), f64::from(descent.value.wind_y_m_s));
    speed.is_finite().then(|| Sample::new(speed, descent.received_at))
}

/// The direction that the wind comes from, as in weather reports: 0 is north, 90 is east.
fn wind_from(descent: Option<&Sample<TD_DESCENT_DATA>>) -> Option<Sample<f64>> {
    let descent = descent?;
    let (north, east) = (f64::from(descent.value.wind_x_m_s), f64::from(descent.value.wind_y_m_s));
    let from_deg = libm::atan2(-east, -north).to_degrees().rem_euclid(360.0);
    let known = from_deg.is_finite() && (north != 0.0 || east != 0.0);
    known.then(|| Sample::new(from_deg, descent.received_at))
}
