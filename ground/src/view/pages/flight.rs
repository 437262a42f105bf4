//! The pages of ascent, descent and burn: the band, height over time with what is to come, the place from above, the vehicle from two
//! sides; on a larger screen values, fins and events below.

use std::time::Duration;

use protocol::dialect::{TD_DESCENT_DATA, TdAbortEffect, TdBooster, TdChute, TdPhase};
use ratatui::Frame;
use ratatui::layout::Constraint::{Fill, Length, Percentage};
use ratatui::layout::Rect;
use ratatui::text::Line;

use super::{Room, Side, attitude, columns, events, framed, rows, table};
use crate::model::{Model, Motion, Page, Sample, words};
use crate::view::pictures::height::draw_height;
use crate::view::pictures::map::draw_map;
use crate::view::{TextRole, Theme, age_mark, bars, fixed, headline, panels, row, text_row};

/// Columns of the vehicle from one side at 80 columns.
const SIDE_COLUMNS: u16 = 18;
/// The same for its predicted position.
const LOST_COLUMNS: u16 = 28;
/// From this width on a title has a legend beside it.
const LEGEND_COLUMNS: u16 = 34;
/// Columns and rows of the six limits with their borders.
const LIMIT_COLUMNS: u16 = 32;
pub const LIMIT_ROWS: u16 = 8;
/// Rows of the panels under the pictures, with their borders.
const BELOW_ROWS: u16 = 11;

/// Draws the page of the ascent, of the descent or of the burn.
pub fn draw_flying(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let (title, values) = match model.page() {
        Page::Ascent => ("ascent", ascent_values(model, theme, now)),
        Page::Landing => ("touchdown", vec![panels::burn_row(model, theme, now)]),
        _ => ("descent", descent_values(model, theme, now)),
    };
    let burns = model.page() == Page::Landing;
    let room = Room::of(frame.area());
    // What the newest report means, under the number.
    let below = values.first().cloned().unwrap_or_default();
    let area = headline::draw_flight_band(model, below, theme, now, frame, area);
    if room == Room::Small {
        let side = Length(if panels::is_lost(model, now) { LOST_COLUMNS } else { SIDE_COLUMNS });
        let (left, place, side) = if burns {
            let [left, side, right] = columns(area, [Fill(1), side, Length(LIMIT_COLUMNS)]);
            let [limits, place] = rows(right, [Length(LIMIT_ROWS), Fill(1)]);
            bars::draw_limits(model, theme, now, frame, limits);
            (left, place, side)
        } else {
            let [left, place, side] = columns(area, [Fill(5), Fill(3), side]);
            (left, place, side)
        };
        height(model, theme, now, frame, left);
        map(model, theme, now, frame, place);
        return side_or_lost(model, Side::South, theme, now, frame, side);
    }
    let [above, below] = rows(area, [Fill(1), Length(BELOW_ROWS)]);
    let [left, sides, right] = columns(above, [Percentage(40), Percentage(32), Fill(1)]);
    height(model, theme, now, frame, left);
    both_sides_or_lost(model, theme, now, frame, sides);
    map(model, theme, now, frame, right);
    let [left, middle, right] = columns(below, [Percentage(40), Percentage(30), Fill(1)]);
    if burns {
        bars::draw_limits(model, theme, now, frame, left);
    } else {
        table(title, &values, theme, frame, left);
    }
    bars::draw_surfaces(model, theme, now, frame, middle);
    events(model, theme, frame, right);
}

/// A panel with the height over time.
pub fn height(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let legend = if area.width < LEGEND_COLUMNS { Line::default() } else { bars::flown_legend(theme) };
    let inside = framed("height m", legend, theme, frame, area);
    draw_height(model, theme, now, frame, inside);
}

/// A panel with the place from above.
pub fn map(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let inside = framed("from above", Line::default(), theme, frame, area);
    draw_map(model, theme, now, frame, inside);
}

/// The vehicle from a side; after the loss of the link its predicted position instead.
fn side_or_lost(model: &Model, side: Side, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    if panels::is_lost(model, now) {
        table("PREDICTED", &panels::lost_rows(model, theme, now), theme, frame, area);
    } else {
        attitude(model, side, theme, now, frame, area);
    }
}

/// The vehicle from both sides; after the loss of the link its predicted position instead.
fn both_sides_or_lost(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    if panels::is_lost(model, now) {
        return side_or_lost(model, Side::South, theme, now, frame, area);
    }
    let [south, east] = columns(area, [Fill(1), Fill(1)]);
    attitude(model, Side::South, theme, now, frame, south);
    attitude(model, Side::East, theme, now, frame, east);
}

// The ascent page.

/// The values, the most important first.
fn ascent_values(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    let mut lines = vec![motor(model, theme, now)];
    let of = |pick| model.vehicle.of_descent(pick);
    lines.push(row(theme, "apogee at", of(|d| d.apogee_m), 0, "m", now));
    lines.push(row(theme, "apogee in", of(|d| d.time_to_apogee_s), 1, "s", now));
    lines.push(row(theme, "tilt", model.vehicle.tilt_deg(), 1, "deg", now));
    lines.push(booster(model, theme, now));
    lines.push(row(theme, "horizontal", model.vehicle.of_motion(Motion::horizontal_m_s), 1, "m/s", now));
    lines.push(row(theme, "distance", model.vehicle.of_motion(Motion::distance_m), 1, "m", now));
    lines.push(row(theme, "lands N", of(|d| d.touchdown_x_m), 0, "m", now));
    lines.push(row(theme, "lands E", of(|d| d.touchdown_y_m), 0, "m", now));
    lines
}

/// What carries the vehicle up, in words.
fn motor(model: &Model, theme: Theme, now: Duration) -> Line<'static> {
    let Some(phase) = model.vehicle.phase() else {
        return theme.line(" no data", TextRole::Caution);
    };
    let (mark, role) = age_mark(&phase, now);
    let text = match phase.value {
        TdPhase::TD_PHASE_BOOST => "ascent motor: no cut-off",
        TdPhase::TD_PHASE_COAST => "coasting",
        _ => "not rising",
    };
    theme.line(format!("{mark}{text}"), role)
}

fn booster(model: &Model, theme: Theme, now: Duration) -> Line<'static> {
    let Some(descent) = model.vehicle.descent() else { return no_state("booster", theme) };
    let role = match descent.value.booster {
        TdBooster::TD_BOOSTER_SEPARATING => TextRole::Caution,
        TdBooster::TD_BOOSTER_SEPARATED => TextRole::Good,
        TdBooster::TD_BOOSTER_NONE | TdBooster::TD_BOOSTER_ATTACHED => TextRole::Plain,
    };
    let text = words::lower_case(&descent.value.booster, "TD_BOOSTER_");
    state_row("booster", &descent, &text, role, theme, now)
}

fn no_state(label: &str, theme: Theme) -> Line<'static> {
    text_row(theme, label, " ", "no data", TextRole::Label, "")
}

fn state_row(
    label: &str,
    descent: &Sample<TD_DESCENT_DATA>,
    text: &str,
    role: TextRole,
    theme: Theme,
    now: Duration,
) -> Line<'static> {
    let (mark, stale) = age_mark(descent, now);
    text_row(theme, label, mark, text, if stale == TextRole::Stale { stale } else { role }, "")
}

// The descent page.

/// The values, the most important first.
fn descent_values(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    let mut lines = vec![band_word(model, theme, now)];
    let of = |pick| model.vehicle.of_descent(pick);
    let of_motion = |pick| model.vehicle.of_motion(pick).filter(|sample| !sample.value.is_nan());
    let lights = |sample: Option<Sample<f64>>| sample.filter(|_| model.vehicle.may_light());
    lines.push(row(theme, "ignite in", model.vehicle.ignition_in_s(now), 1, "s", now));
    lines.push(row(theme, "ignite at", lights(of(|d| d.chosen_height_m)), 1, "m", now));
    lines.push(band(model.vehicle.descent().as_ref(), theme, now));
    lines.push(row(theme, "commit at", of(|d| d.commit_height_m), 1, "m", now));
    lines.push(chute(model, theme, now));
    lines.push(row(theme, "distance", of_motion(Motion::distance_m), 1, "m", now));
    lines.push(row(theme, "horizontal", of_motion(Motion::horizontal_m_s), 1, "m/s", now));
    lines.push(row(theme, "tilt", model.vehicle.tilt_deg(), 1, "deg", now));
    let (wind, from) = wind(model);
    lines.push(row(theme, "wind", wind, 1, "m/s", now));
    lines.push(row(theme, "wind from", from, 0, "deg", now));
    lines.push(row(theme, "drag", of(|d| d.drag_scale), 2, "x", now));
    lines.push(row(theme, "lands N", of(|d| d.touchdown_x_m), 1, "m", now));
    lines.push(row(theme, "lands E", of(|d| d.touchdown_y_m), 1, "m", now));
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
        return theme.line(" NO BURN: motor inhibited", TextRole::Alarm);
    }
    let Some(descent) = model.vehicle.descent() else {
        return theme.line(" ignition band: no data", TextRole::Caution);
    };
    let (mark, stale) = age_mark(&descent, now);
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
    theme.line(format!("{mark}{words}{commit}"), role)
}

/// Whether the parachute is out, or an abort would still throw it out. Then the vehicle is not committed to a burn.
fn parachute_may_fly(model: &Model, chute: TdChute) -> bool {
    let out = matches!(chute, TdChute::TD_CHUTE_FIRED | TdChute::TD_CHUTE_OPEN);
    let ordered = model.vehicle.phase_now() == Some(TdPhase::TD_PHASE_CHUTE);
    let now = TdAbortEffect::TD_ABORT_EFFECT_CHUTE_NOW;
    out || ordered || model.vehicle.status.as_ref().is_some_and(|status| status.value.abort_effect == now)
}

fn chute(model: &Model, theme: Theme, now: Duration) -> Line<'static> {
    let Some(descent) = model.vehicle.descent() else { return no_state("chute", theme) };
    let role = match descent.value.chute {
        TdChute::TD_CHUTE_FIRED | TdChute::TD_CHUTE_OPEN => TextRole::Caution,
        _ => TextRole::Plain,
    };
    state_row("chute", &descent, &words::lower_case(&descent.value.chute, "TD_CHUTE_"), role, theme, now)
}

/// The wind's speed, and the direction that it comes from, as in weather reports: 0 is north, 90 is east.
fn wind(model: &Model) -> (Option<Sample<f64>>, Option<Sample<f64>>) {
    let (north, east) =
        (model.vehicle.of_descent(|d| d.wind_x_m_s), model.vehicle.of_descent(|d| d.wind_y_m_s));
    let Some((north, Sample { value: east, received_at })) = north.zip(east) else { return (None, None) };
    let from_deg = libm::atan2(-east, -north.value).to_degrees().rem_euclid(360.0);
    let speed = libm::hypot(north.value, east);
    let sample = |value| Sample { value, received_at };
    (Some(sample(speed)), (speed > 0.0).then(|| sample(from_deg)))
}
