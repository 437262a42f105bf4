//! The ascent page: height gauge with the expected apogee, speed, tilt and booster, side views.

use std::time::Duration;

use protocol::dialect::{TD_DESCENT_DATA, TdBooster, TdPhase};
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::text::Line;

use super::titled;
use crate::model::motion::Motion;
use crate::model::vehicle::Sample;
use crate::model::{Model, words};
use crate::view::number::{age_mark, row, text_row};
use crate::view::theme::{TextRole, Theme};
use crate::view::{draw_lines, gauge, link_line, lost_position, side_view};

/// Columns of the height gauge.
const GAUGE_COLUMNS: u16 = 27;
/// Columns of the values.
const NUMBER_COLUMNS: u16 = 28;

/// Draws the gauge on the left, the values in the middle, the side views on the right.
pub fn draw(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let [gauge_area, middle, right] = area.layout(&Layout::horizontal([
        Constraint::Length(GAUGE_COLUMNS),
        Constraint::Length(NUMBER_COLUMNS),
        Constraint::Fill(1),
    ]));
    let inside = titled("Height, m", theme, frame, gauge_area);
    draw_lines(frame, inside, &gauge::lines(model, theme, now, usize::from(inside.height)));
    let [numbers, below] = middle.layout(&Layout::vertical([Constraint::Fill(1), Constraint::Length(1)]));
    let title = if lost_position::is_lost(model, now) { "PREDICTED, not heard" } else { "Ascent" };
    let inside = titled(title, theme, frame, numbers);
    draw_lines(frame, inside, &lines(model, theme, now));
    draw_lines(frame, below, &[link_line::link(model, theme, now, usize::from(below.width))]);
    for (from, title, area) in side_view::pictures(model, right) {
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
    lines.push(motor(model, theme, now));
    // A prediction is shown above; a second height would be another value for the same quantity.
    if !lost_position::is_lost(model, now) {
        lines.push(row(theme, "height", model.vehicle.height_m(), 1, "m", now));
        lines.push(row(theme, "vertical", model.vehicle.vertical_m_s(), 1, "m/s", now));
    }
    lines.push(row(theme, "apogee at", of(|d| d.apogee_m), 0, "m", now));
    lines.push(row(theme, "apogee in", of(|d| d.time_to_apogee_s), 1, "s", now));
    let tilt = model.vehicle.attitude.map(|attitude| attitude.map(|a| a.tilt_rad.to_degrees()));
    lines.push(row(theme, "tilt", tilt, 1, "deg", now));
    lines.push(booster(descent, theme, now));
    let horizontal = motion.map(|motion| motion.map(Motion::horizontal_m_s));
    let distance = motion.map(|motion| motion.map(Motion::distance_m));
    lines.push(row(theme, "horizontal", horizontal, 1, "m/s", now));
    lines.push(row(theme, "distance", distance, 1, "m", now));
    lines.push(row(theme, "down north", of(|d| d.touchdown_x_m), 0, "m", now));
    lines.push(row(theme, "down east", of(|d| d.touchdown_y_m), 0, "m", now));
    lines
}

/// What carries the vehicle up, in words.
fn motor(model: &Model, theme: Theme, now: Duration) -> Line<'static> {
    let Some(phase) = model.vehicle.phase() else {
        return Line::styled(" no data", theme.style(TextRole::Caution));
    };
    let (mark, role) = age_mark(&phase, now);
    let text = match phase.value {
        TdPhase::TD_PHASE_BOOST => "ascent motor: no cut-off",
        TdPhase::TD_PHASE_COAST => "coasting",
        _ => "not rising",
    };
    Line::styled(format!("{mark}{text}"), theme.style(role))
}

fn booster(descent: Option<&Sample<TD_DESCENT_DATA>>, theme: Theme, now: Duration) -> Line<'static> {
    let Some(descent) = descent else {
        return text_row(theme, "booster", " ", "no data", TextRole::Label, "");
    };
    let (mark, stale) = age_mark(descent, now);
    let text = words::lower_case(&descent.value.booster, "TD_BOOSTER_");
    let role = match descent.value.booster {
        TdBooster::TD_BOOSTER_SEPARATING => TextRole::Caution,
        TdBooster::TD_BOOSTER_SEPARATED => TextRole::Good,
        TdBooster::TD_BOOSTER_NONE | TdBooster::TD_BOOSTER_ATTACHED => TextRole::Plain,
    };
    text_row(theme, "booster", mark, &text, if stale == TextRole::Stale { stale } else { role }, "")
}
