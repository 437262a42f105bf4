//! The pages of ascent and descent, and their shared layout: the headline, the height gauge, the values, the pictures.

use std::time::Duration;

use protocol::dialect::{TD_DESCENT_DATA, TdAbortEffect, TdBooster, TdChute, TdPhase};
use ratatui::Frame;
use ratatui::layout::Constraint::{Fill, Length};
use ratatui::layout::Rect;
use ratatui::text::Line;

use super::{is_roomy, titled};
use crate::model::{Model, Motion, Sample, words};
use crate::view::pictures::FlightPart;
use crate::view::{
    TextRole, Theme, age_mark, draw_line, draw_lines, fixed, headline, panels, pictures, row, side_by_side,
    stacked, status_lines, text_row, widgets,
};

/// Columns of the height gauge and of the values at 80 columns, and on a larger screen. At 80 columns they are those of
/// the landing page: what stands in the same place costs a slow line nothing at ignition.
const NARROW_COLUMNS: [u16; 2] = [33, 28];
const ROOMY_COLUMNS: [u16; 2] = [30, 40];
/// Columns of the picture of the fins.
const FIN_COLUMNS: u16 = 27;

/// Draws a page with these values; the picture of the fins is drawn if they steer.
pub fn draw_flying(
    model: &Model,
    (title, values): (&str, Vec<Line<'static>>),
    fins_steer: bool,
    theme: Theme,
    now: Duration,
    frame: &mut Frame,
    area: Rect,
) {
    let roomy = is_roomy(area);
    let area = headline::draw_headline(
        &headline::headline(model, now, headline::flight_headline),
        theme,
        frame,
        area,
    );
    let [gauge_columns, value_columns] = if roomy { ROOMY_COLUMNS } else { NARROW_COLUMNS };
    let [gauge_area, middle, right] =
        side_by_side(area, [Length(gauge_columns), Length(value_columns), Fill(1)]);
    let inside = titled("Height, m", theme, frame, gauge_area);
    draw_lines(frame, inside, &widgets::gauge_lines(model, theme, now, usize::from(inside.height)));
    let title = if panels::is_lost(model, now) { panels::LOST_TITLE } else { title };
    draw_values(model, (title, values, roomy), theme, now, frame, middle);
    draw_pictures(model, fins_steer && roomy, theme, now, frame, right);
}

/// The values, the most important first; those that do not fit are on the page of all values.
fn draw_values(
    model: &Model,
    (title, mut values, roomy): (&str, Vec<Line<'static>>, bool),
    theme: Theme,
    now: Duration,
    frame: &mut Frame,
    area: Rect,
) {
    let rows = u16::try_from(values.len() + 1).unwrap_or(u16::MAX).min(area.height);
    let [numbers, below] = stacked(area, [Length(rows), Fill(1)]);
    let inside = titled(title, theme, frame, numbers);
    values.truncate(usize::from(inside.height));
    draw_lines(frame, inside, &values);
    if roomy {
        let [link, lines] = stacked(below, [Length(2), Fill(1)]);
        draw_line(frame, link, status_lines::link_line(model, theme, now, usize::from(link.width)));
        let names = ["vertical speed", "height", "tilt", "horizontal speed", "distance", "link rate"];
        widgets::draw_sparklines(&names, model, theme, now, frame, lines);
    }
}

fn draw_pictures(model: &Model, with_fins: bool, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let [upper, sides] =
        stacked(area, [if with_fins { Length(pictures::FIN_PICTURE_ROWS + 1) } else { Length(0) }, Fill(1)]);
    if with_fins {
        let [fin_area, above] = side_by_side(upper, [Length(FIN_COLUMNS), Fill(1)]);
        let inside = titled(&pictures::fins_title(model, now), theme, frame, fin_area);
        pictures::draw_fins(model, theme, now, frame, inside);
        let inside = titled("From above", theme, frame, above);
        pictures::draw_top_view(model, theme, now, frame, inside);
    }
    for (from, title, area) in pictures::side_views(sides) {
        let inside = titled(title, theme, frame, area);
        pictures::draw_side_view(model, (FlightPart::Whole, from), theme, now, frame, inside);
    }
}

/// Adds height and vertical speed before the second value. After the loss of the link the prediction shows them.
pub fn insert_height(lines: &mut Vec<Line<'static>>, model: &Model, theme: Theme, now: Duration) {
    if panels::is_lost(model, now) {
        return;
    }
    lines.insert(1, row(theme, "height", model.vehicle.height_m(), 1, "m", now));
    lines.insert(2, row(theme, "vertical", model.vehicle.vertical_m_s(), 1, "m/s", now));
}

// The ascent page: height gauge with the expected apogee, speed, tilt and booster, side views.

pub fn draw_ascent(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let values = ascent_values(model, theme, now);
    draw_flying(model, ("Ascent", values), false, theme, now, frame, area);
}

/// For small screens: the values, with height and speed, which have no headline there.
pub fn ascent_lines(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    let mut lines = ascent_values(model, theme, now);
    insert_height(&mut lines, model, theme, now);
    lines
}

/// The values, the most important first.
fn ascent_values(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    let mut lines = panels::lost_rows(model, theme, now);
    let of = |pick| model.vehicle.of_descent(pick);
    lines.push(motor(model, theme, now));
    lines.push(row(theme, "apogee at", of(|d| d.apogee_m), 0, "m", now));
    lines.push(row(theme, "apogee in", of(|d| d.time_to_apogee_s), 1, "s", now));
    lines.push(row(theme, "tilt", model.vehicle.tilt_deg(), 1, "deg", now));
    lines.push(booster(model, theme, now));
    lines.push(row(theme, "horizontal", model.vehicle.of_motion(Motion::horizontal_m_s), 1, "m/s", now));
    lines.push(row(theme, "distance", model.vehicle.of_motion(Motion::distance_m), 1, "m", now));
    lines.push(row(theme, "down north", of(|d| d.touchdown_x_m), 0, "m", now));
    lines.push(row(theme, "down east", of(|d| d.touchdown_y_m), 0, "m", now));
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

// The descent page: height gauge with the ignition band, values of the descent, fins from above, side view.

pub fn draw_descent(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let values = descent_values(model, theme, now);
    draw_flying(model, ("Descent", values), true, theme, now, frame, area);
}

/// For small screens: the values, with height and speed, which have no headline there.
pub fn descent_lines(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    let mut lines = descent_values(model, theme, now);
    insert_height(&mut lines, model, theme, now);
    lines
}

/// The values, the most important first.
fn descent_values(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    let mut lines = panels::lost_rows(model, theme, now);
    let of = |pick| model.vehicle.of_descent(pick);
    let of_motion = |pick| model.vehicle.of_motion(pick).filter(|sample| !sample.value.is_nan());
    let lights = |sample: Option<Sample<f64>>| sample.filter(|_| model.vehicle.may_light());
    lines.push(band_word(model, theme, now));
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
