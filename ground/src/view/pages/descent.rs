//! The descent page: height gauge with the ignition band, values of the descent, fins from above, side view.

use std::time::Duration;

use protocol::dialect::{TD_DESCENT_DATA, TdChute};
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::text::Line;

use super::titled;
use crate::model::vehicle::Sample;
use crate::model::{Model, words};
use crate::view::number::{age_mark, row, text_row};
use crate::view::theme::{TextRole, Theme};
use crate::view::{draw_lines, fins, gauge, link_line, lost_position, side_view};

/// Columns of the height gauge.
const GAUGE_COLUMNS: u16 = 27;
/// Columns of the values.
const NUMBER_COLUMNS: u16 = 28;
/// Rows of the values, with their title.
const NUMBER_ROWS: u16 = 18;

/// Draws the gauge on the left, the values in the middle, fins and side view on the right.
pub fn draw(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let [gauge_area, middle, right] = area.layout(&Layout::horizontal([
        Constraint::Length(GAUGE_COLUMNS),
        Constraint::Length(NUMBER_COLUMNS),
        Constraint::Fill(1),
    ]));
    let inside = titled("Height, m", theme, frame, gauge_area);
    draw_lines(frame, inside, &gauge::lines(model, theme, now, usize::from(inside.height)));
    let [numbers, below] =
        middle.layout(&Layout::vertical([Constraint::Length(NUMBER_ROWS), Constraint::Fill(1)]));
    let title = if lost_position::is_lost(model, now) { "PREDICTED, not heard" } else { "Descent" };
    let inside = titled(title, theme, frame, numbers);
    draw_lines(frame, inside, &lines(model, theme, now));
    draw_lines(frame, below, &[link_line::link(model, theme, now, usize::from(below.width))]);
    let [fin_area, picture] =
        right.layout(&Layout::vertical([Constraint::Length(fins::ROWS + 1), Constraint::Fill(1)]));
    let inside = titled(&fins::title(model, now), theme, frame, fin_area);
    fins::draw(model, theme, now, frame, inside);
    for (from, title, area) in side_view::pictures(model, picture) {
        let inside = titled(title, theme, frame, area);
        side_view::draw(model, (side_view::FlightPart::Whole, from), theme, now, frame, inside);
    }
}

/// The values, the most important first.
pub fn lines(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    let mut lines = lost_position::rows(model, theme, now);
    let descent = model.vehicle.descent.as_ref();
    let motion = model.vehicle.best_motion();
    let of = |pick: fn(&TD_DESCENT_DATA) -> f32| {
        descent
            .map(|d| Sample { value: f64::from(pick(&d.value)), received_at: d.received_at })
            .filter(|sample| sample.value.is_finite())
    };
    let of_motion = |value: Option<f64>| {
        value.zip(motion.map(|motion| motion.received_at)).map(|(value, at)| Sample::new(value, at))
    };
    lines.push(band_word(model, theme, now));
    // A prediction is shown above; a second height would be another value for the same quantity.
    if !lost_position::is_lost(model, now) {
        lines.push(row(theme, "height", model.vehicle.height_m(), 1, "m", now));
        lines.push(row(theme, "vertical", model.vehicle.vertical_m_s(), 1, "m/s", now));
    }
    let lights = |sample: Option<Sample<f64>>| sample.filter(|_| model.vehicle.may_light());
    lines.push(row(theme, "ignite in", model.vehicle.ignition_in_s(now), 1, "s", now));
    lines.push(row(theme, "ignite at", lights(of(|d| d.chosen_height_m)), 1, "m", now));
    lines.push(row(theme, "band high", of(|d| d.band_high_m), 1, "m", now));
    lines.push(row(theme, "band low", of(|d| d.band_low_m), 1, "m", now));
    lines.push(row(theme, "commit at", of(|d| d.commit_height_m), 1, "m", now));
    lines.push(chute(descent, theme, now));
    let attitude = model.vehicle.attitude;
    let tilt = attitude.map(|attitude| attitude.map(|a| a.tilt_rad.to_degrees()));
    lines.push(row(theme, "horizontal", of_motion(motion.map(|m| m.value.horizontal_m_s())), 1, "m/s", now));
    lines.push(row(theme, "distance", of_motion(motion.map(|m| m.value.distance_m())), 1, "m", now));
    lines.push(row(theme, "tilt", tilt, 1, "deg", now));
    lines.push(row(theme, "wind", wind_speed(descent), 1, "m/s", now));
    lines.push(row(theme, "wind from", wind_from(descent), 0, "deg", now));
    lines.push(row(theme, "drag x", of(|d| d.drag_scale), 3, "", now));
    lines.push(row(theme, "down north", of(|d| d.touchdown_x_m), 1, "m", now));
    lines.push(row(theme, "down east", of(|d| d.touchdown_y_m), 1, "m", now));
    lines
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
    let committed = height_m < f64::from(d.commit_height_m);
    let commit = if committed { ", committed" } else { "" };
    let role = if stale == TextRole::Stale { stale } else { role };
    Line::styled(format!("{mark}{words}{commit}"), theme.style(role))
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
