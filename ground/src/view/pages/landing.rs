//! The landing page (flight, controller, touchdown, actuators, events and side view) and the review page after it.

use std::time::Duration;

use ratatui::Frame;
use ratatui::layout::Constraint::{Fill, Length};
use ratatui::layout::Rect;
use ratatui::text::{Line, Span};

use super::{is_roomy, panel, plots, titled};
use crate::model::{BodySpeed, Model, Motion, RED_AFTER, Sample, words};
use crate::view::{
    STALE_MARK, TextRole, Theme, draw_lines, fixed, headline, lists, panels, pictures, row, side_by_side,
    stacked, status_lines, styled, top_lines,
};

/// Rows of the panels, with their title.
const PANEL_ROWS: u16 = 9;
/// Columns left of the side view at 80 columns.
const LEFT_COLUMNS: u16 = 61;
/// Of those, columns of the touchdown: its widest row has 26 or 27, and then a bar of each limit.
const TOUCHDOWN_COLUMNS: u16 = 33;
/// Rows of the events on a larger screen, with their title, if fewer than the second number are left.
const EVENT_ROWS: u16 = 8;
const TALL_ROWS: u16 = 24;
/// Rows of the fins on a larger screen, with their title.
const FIN_ROWS: u16 = 5;

/// Draws the headline, the panels, the events and the side view.
pub fn draw_landing(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let first = if model.vehicle.verdict().is_some() {
        headline::headline(model, now, headline::verdict_headline)
    } else {
        headline::headline(model, now, headline::burn_headline)
    };
    let roomy = is_roomy(area);
    let area = headline::draw_headline(&first, theme, frame, area);
    let (left, right) = if roomy {
        let [panels, below] = stacked(area, [Length(PANEL_ROWS + 1), Fill(1)]);
        let [flight, landing, actuators] = side_by_side(panels, [Fill(1); 3]);
        draw_flight(model, theme, now, frame, flight);
        draw_touchdown(model, theme, now, frame, landing);
        draw_actuators(model, theme, now, frame, actuators);
        let [events, right] = side_by_side(below, [Fill(2), Fill(3)]);
        // On a middling screen the newest are enough: a change of page should not fill a slow line.
        let rows = if events.height < TALL_ROWS { EVENT_ROWS } else { events.height };
        (Rect { height: events.height.min(rows), ..events }, right)
    } else {
        let [left, right] = side_by_side(area, [Length(LEFT_COLUMNS), Fill(1)]);
        let [panels, events] = stacked(left, [Length(PANEL_ROWS), Fill(1)]);
        let [landing, flight] = side_by_side(panels, [Length(TOUCHDOWN_COLUMNS), Fill(1)]);
        draw_touchdown(model, theme, now, frame, landing);
        draw_essentials(model, theme, now, frame, flight);
        (events, right)
    };
    let inside = titled("Events", theme, frame, left);
    let lines = lists::events(model, theme, usize::from(inside.width), usize::from(inside.height));
    draw_lines(frame, inside, &lines);
    draw_pictures(model, theme, now, frame, right);
}

fn draw_pictures(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let shows = if panels::is_lost(model, now) { "PREDICTION +" } else { "flown, plan" };
    for (from, title, area) in pictures::side_views(area) {
        let shows = if from == pictures::Viewpoint::South { "flown" } else { shows };
        let whole = format!("{title}: {shows}");
        // With a blank on either side, one column and some rule.
        let title = if whole.len() + 4 > usize::from(area.width) { title.to_owned() } else { whole };
        let inside = titled(&title, theme, frame, area);
        pictures::draw_side_view(model, (pictures::FlightPart::Burn, from), theme, now, frame, inside);
    }
}

/// Altitude, speeds and attitude; after the loss of the link the predicted position.
fn draw_flight(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let (title, mut rows) = panels::flight_panel(model, theme, now);
    if !panels::is_lost(model, now) {
        rows.splice(0..0, panels::controller_rows(model, theme, now).into_iter().take(1));
    }
    panel(title, &rows, theme, frame, area);
}

fn draw_touchdown(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let (title, rows) = panels::touchdown_panel_with_bars(model, theme, now, usize::from(area.width));
    panel(title, &rows, theme, frame, area);
}

/// Who steers, how upright, and the gimbal against its limit.
fn draw_essentials(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    if panels::is_lost(model, now) {
        return draw_flight(model, theme, now, frame, area);
    }
    let inside = titled("Steering", theme, frame, area);
    let mut lines: Vec<Line> = panels::controller_rows(model, theme, now).into_iter().take(1).collect();
    let vehicle = &model.vehicle;
    lines.push(row(theme, "tilt", vehicle.tilt_deg(), 2, "deg", now));
    lines.push(row(theme, "horizontal", vehicle.of_motion(Motion::horizontal_m_s), 2, "m/s", now));
    lines.push(row(theme, "distance", vehicle.of_motion(Motion::distance_m), 1, "m", now));
    lines.extend(panels::gimbal_rows(model, theme, now));
    draw_lines(frame, inside, &lines);
}

fn draw_actuators(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let [fins, gimbal] = stacked(area, [Length(FIN_ROWS), Fill(1)]);
    panel("Fins command|actual", &panels::fin_rows(model, theme, now), theme, frame, fins);
    panel("Gimbal", &panels::gimbal_rows(model, theme, now), theme, frame, gimbal);
}

/// The same content as lines, the most important first.
pub fn landing_lines(
    model: &Model,
    theme: Theme,
    now: Duration,
    columns: usize,
    rows: usize,
) -> Vec<Line<'static>> {
    let mut lines = vec![motion(model, theme, now)];
    if panels::is_lost(model, now) {
        lines = panels::lost_rows(model, theme, now);
    }
    // The newest event comes before everything else.
    lines.extend(newest_event(model, theme));
    // An abort is shown in the top lines.
    if let Some(track) = top_lines::open_command(model, now) {
        lines.push(top_lines::command_facts_short(track, theme, now));
    }
    lines.push(attitude(model, theme, now));
    let (title, touchdown) = panels::touchdown_panel(model, theme, now);
    let mut verdict = theme.line(format!(" {title}: "), TextRole::Label);
    verdict.spans.extend(touchdown.into_iter().next_back().into_iter().flat_map(styled));
    lines.push(verdict);
    lines.extend(panels::controller_rows(model, theme, now).into_iter().take(2));
    // The numbers of each plane, without its bar.
    let gimbal = panels::gimbal_rows(model, theme, now).into_iter();
    lines.extend(gimbal.step_by(2));
    lines.extend(panels::fin_rows(model, theme, now));
    lines.push(status_lines::link_line(model, theme, now, columns));
    let room = rows.saturating_sub(lines.len());
    lines.extend(lists::events(model, theme, columns, room));
    lines
}

fn value(
    theme: Theme,
    label: &str,
    sample: Option<Sample<f64>>,
    decimals: usize,
    now: Duration,
) -> Vec<Span<'static>> {
    let text = sample.map_or_else(|| "--".to_owned(), |sample| fixed(sample.value, decimals));
    let stale = sample.is_some_and(|sample| sample.is_stale(now));
    let mark = if stale { STALE_MARK } else { "" };
    let role = if stale { TextRole::Stale } else { TextRole::Plain };
    vec![theme.label(format!(" {label} ")), theme.span(format!("{mark}{text}"), role)]
}

fn motion(model: &Model, theme: Theme, now: Duration) -> Line<'static> {
    let mut spans = value(theme, "alt", model.vehicle.of_motion(|m| m.altitude_m), 1, now);
    spans.extend(value(theme, "vz", model.vehicle.of_motion(|m| m.climb_m_s), 1, now));
    Line::from(spans)
}

fn attitude(model: &Model, theme: Theme, now: Duration) -> Line<'static> {
    let body = model.vehicle.body_speed();
    let mut spans = value(theme, "tilt", model.vehicle.tilt_deg(), 1, now);
    spans.extend(value(theme, "u", body.map(|body| body.map(|b| b.u_m_s)), 1, now));
    spans.extend(value(theme, "lat", body.map(|body| body.map(BodySpeed::lateral_m_s)), 2, now));
    Line::from(spans)
}

fn newest_event(model: &Model, theme: Theme) -> Option<Line<'static>> {
    let event = model.events.newest(1).next()?;
    Some(theme.line(format!(" {}{}", event.mark().trim_start(), event.text), TextRole::Plain))
}

// The review page after a flight: verdict, limits, greatest values and timeline.

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
pub fn draw_review(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let roomy = is_roomy(area);
    let area = headline::draw_headline(
        &headline::headline(model, now, headline::verdict_headline),
        theme,
        frame,
        area,
    );
    let columns = if roomy { TABLE_COLUMNS } else { area.width };
    let mut lines = review_lines(model, theme, now, usize::from(columns));
    if !roomy {
        // The bar of the flight below shows the phases too.
        lines.truncate(usize::from(area.height));
        return draw_lines(frame, area, &lines);
    }
    let [table, pictures] = stacked(area, [Length(TABLE_ROWS), Fill(1)]);
    let [left, right] = side_by_side(table, [Length(TABLE_COLUMNS), Fill(1)]);
    draw_lines(frame, left, &lines);
    let inside = titled("Events", theme, frame, right);
    let events = lists::events(model, theme, usize::from(inside.width), usize::from(inside.height));
    draw_lines(frame, inside, &events);
    plots::draw_path(model, theme, now, frame, pictures);
}

/// The verdict, then limits and greatest values, then the timeline.
pub fn review_lines(model: &Model, theme: Theme, now: Duration, columns: usize) -> Vec<Line<'static>> {
    let (title, mut limits) = panels::touchdown_panel_with_bars(model, theme, now, PLAN_COLUMNS);
    if model.vehicle.verdict().is_some() {
        // In the first line it has more room.
        limits.pop();
    }
    let (words, role) = match panels::ending_role(model, now) {
        Some((ending, role)) => (ending.sentence(&model.vehicle), role),
        None => ("no verdict received yet".to_owned(), TextRole::Caution),
    };
    let head = theme.line(format!(" {words}"), role);
    limits.insert(0, theme.line(title, TextRole::Title));
    let limit_columns = PLAN_COLUMNS;
    let mut lines = vec![head];
    let maxima = maxima(model, theme, now);
    if columns > limit_columns + MAXIMA_COLUMNS {
        lines.extend(beside(limits, limit_columns + 1, maxima));
    } else {
        lines.extend(limits);
        lines.extend(maxima);
    }
    lines.push(theme.line(" Timeline", TextRole::Title));
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
            spans.extend(styled(line));
            spans.push(Span::raw(" ".repeat(gap)));
            spans.extend(styled(right.next().unwrap_or_default()));
            Line::from(spans)
        })
        .collect()
}

fn maxima(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    let most = &model.history.maxima;
    let lost = most.silence_s.filter(|silence_s| *silence_s > RED_AFTER.as_secs_f64());
    // What happened in the silence is not known.
    let title = if lost.is_some() { " Greatest values heard" } else { " Greatest values in flight" };
    let mut lines = vec![theme.line(title, TextRole::Title)];
    lines.extend(lost.map(|silence_s| {
        let unheard = model.vehicle.in_flight() && !model.link.state(now).carries();
        let words = if unheard {
            " link LOST before touchdown".to_owned()
        } else {
            format!(" silent for {} s of the flight", fixed(silence_s, 1))
        };
        theme.line(words, TextRole::Caution)
    }));
    let row = |label: &str, value: Option<f64>, decimals: usize, unit: &'static str| {
        let text = value.map_or_else(|| "--".to_owned(), |value| fixed(value, decimals));
        Line::from(vec![
            theme.label(format!(" {label:<18}")),
            theme.plain(format!("{text:>9}")),
            theme.label(format!(" {unit}")),
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
        return vec![theme.line("  nothing heard", TextRole::Label)];
    }
    entries
        .chunks((columns / TIMELINE_COLUMNS).max(1))
        .map(|chunk| theme.line(chunk.concat(), TextRole::Plain))
        .collect()
}
