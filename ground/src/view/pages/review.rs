//! The review page after a flight: verdict, limits, greatest values and timeline.

use std::time::Duration;

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::text::{Line, Span};

use super::{is_roomy, path, titled};
use crate::model::link_state::RED_AFTER;
use crate::model::{Model, words};
use crate::view::number::fixed;
use crate::view::theme::{TextRole, Theme};
use crate::view::{draw_lines, event_list, foremost, headline, touchdown};

/// Columns of the predicted touchdown beside the greatest values.
const PLAN_COLUMNS: usize = 37;
/// Columns of the greatest values.
const MAXIMA_COLUMNS: usize = 34;
/// Columns of a phase with its time.
const TIMELINE_COLUMNS: usize = 24;
/// Rows of verdict, limits and timeline on a larger screen.
const TABLE_ROWS: u16 = 17;
/// Columns of them on a larger screen; the events are beside them.
const TABLE_COLUMNS: u16 = 80;

/// Draws the verdict in large letters, then the lines; on a larger screen the flight in pictures below.
pub fn draw(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let roomy = is_roomy(area);
    let area = headline::draw(&foremost::verdict(model, now), theme, frame, area);
    let columns = if roomy { TABLE_COLUMNS } else { area.width };
    let mut lines = lines(model, theme, now, usize::from(columns));
    if !roomy {
        // The bar of the flight below shows the phases too.
        lines.truncate(usize::from(area.height));
        return draw_lines(frame, area, &lines);
    }
    let [table, pictures] =
        area.layout(&Layout::vertical([Constraint::Length(TABLE_ROWS), Constraint::Fill(1)]));
    let [left, right] =
        table.layout(&Layout::horizontal([Constraint::Length(TABLE_COLUMNS), Constraint::Fill(1)]));
    draw_lines(frame, left, &lines);
    let inside = titled("Events", theme, frame, right);
    let events = event_list::events(model, theme, usize::from(inside.width), usize::from(inside.height));
    draw_lines(frame, inside, &events);
    path::draw(model, theme, now, frame, pictures);
}

/// The verdict, then limits and greatest values, then the timeline.
pub fn lines(model: &Model, theme: Theme, now: Duration, columns: usize) -> Vec<Line<'static>> {
    let (title, mut limits) = touchdown::panel_with_bars(model, theme, now, PLAN_COLUMNS);
    if model.vehicle.verdict.is_some() {
        // In the first line it has more room.
        limits.pop();
    }
    let (words, role) = match touchdown::ending(model, now) {
        Some((ending, role)) => (ending.sentence(&model.vehicle), role),
        None => ("no verdict received yet".to_owned(), TextRole::Caution),
    };
    let head = Line::styled(format!(" {words}"), theme.style(role));
    limits.insert(0, Line::styled(title, theme.style(TextRole::Title)));
    let limit_columns = PLAN_COLUMNS;
    let mut lines = vec![head];
    let maxima = maxima(model, theme, now);
    if columns > limit_columns + MAXIMA_COLUMNS {
        lines.extend(beside(limits, limit_columns + 1, maxima));
    } else {
        lines.extend(limits);
        lines.extend(maxima);
    }
    lines.push(Line::styled(" Timeline", theme.style(TextRole::Title)));
    lines.extend(timeline(model, theme, columns));
    lines
}

fn beside(left: Vec<Line<'static>>, columns: usize, right: Vec<Line<'static>>) -> Vec<Line<'static>> {
    let rows = left.len().max(right.len());
    let (mut left, mut right) = (left.into_iter(), right.into_iter());
    (0..rows)
        .map(|_| {
            let line = left.next().unwrap_or_default();
            let gap = columns.saturating_sub(line.width() + 1);
            let mut spans = vec![Span::raw(" ")];
            let style = line.style;
            spans.extend(line.spans.into_iter().map(|span| span.patch_style(style)));
            spans.push(Span::raw(" ".repeat(gap)));
            let line = right.next().unwrap_or_default();
            let style = line.style;
            spans.extend(line.spans.into_iter().map(|span| span.patch_style(style)));
            Line::from(spans)
        })
        .collect()
}

fn maxima(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    let most = &model.history.maxima;
    let lost = most.silence_s.filter(|silence_s| *silence_s > RED_AFTER.as_secs_f64());
    // What happened in the silence is not known.
    let title = if lost.is_some() { " Greatest values heard" } else { " Greatest values in flight" };
    let mut lines = vec![Line::styled(title, theme.style(TextRole::Title))];
    lines.extend(lost.map(|silence_s| {
        let unheard = model.vehicle.in_flight() && !model.link.state(now).carries();
        let words = if unheard {
            " link LOST before touchdown".to_owned()
        } else {
            format!(" silent for {} s of the flight", fixed(silence_s, 1))
        };
        Line::styled(words, theme.style(TextRole::Caution))
    }));
    let row = |label: &str, value: Option<f64>, decimals: usize, unit: &'static str| {
        let text = value.map_or_else(|| "--".to_owned(), |value| fixed(value, decimals));
        Line::from(vec![
            Span::styled(format!(" {label:<18}"), theme.style(TextRole::Label)),
            Span::styled(format!("{text:>9}"), theme.style(TextRole::Plain)),
            Span::styled(format!(" {unit}"), theme.style(TextRole::Label)),
        ])
    };
    let milliseconds = |seconds: Option<f64>| seconds.map(|s| 1_000.0 * s);
    lines.extend([
        row("altitude", most.altitude_m, 2, "m"),
        row("descent speed", most.descent_m_s, 2, "m/s"),
        row("distance", most.distance_m, 1, "m"),
        row("tilt", most.tilt_rad.map(f64::to_degrees), 2, "deg"),
        row("turn rate", most.turn_rate_rad_s.map(f64::to_degrees), 2, "deg/s"),
        row("gimbal", most.gimbal_rad.map(f64::to_degrees), 2, "deg"),
        row("solve time", milliseconds(most.solve_time_s), 2, "ms"),
        row("least margin", milliseconds(most.margin_min_s), 2, "ms"),
        row("silence", most.silence_s, 1, "s"),
    ]);
    lines
}

/// Each phase and when it began, several on a line.
fn timeline(model: &Model, theme: Theme, columns: usize) -> Vec<Line<'static>> {
    let entries: Vec<String> = model
        .history
        .timeline
        .iter()
        .map(|(phase, at)| format!("{:>8.1} {:<14}", at.as_secs_f64(), words::phase(*phase)))
        .collect();
    if entries.is_empty() {
        return vec![Line::styled("  nothing heard", theme.style(TextRole::Label))];
    }
    entries
        .chunks((columns / TIMELINE_COLUMNS).max(1))
        .map(|chunk| Line::styled(chunk.concat(), theme.style(TextRole::Plain)))
        .collect()
}
