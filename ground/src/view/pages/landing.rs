//! The landing page: flight, controller, touchdown, actuators, events and side view.

use std::time::Duration;

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::text::{Line, Span};

use super::{is_roomy, titled};
use crate::model::Model;
use crate::model::motion::{BodySpeed, Motion};
use crate::model::vehicle::Sample;
use crate::view::number::{STALE_MARK, fixed, row};
use crate::view::theme::{TextRole, Theme};
use crate::view::{
    actuators, controller, draw_lines, event_list, flight, foremost, headline, link_line, lost_position,
    side_view, top_lines, touchdown,
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
pub fn draw(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let first = if model.vehicle.verdict.is_some() {
        foremost::verdict(model, now)
    } else {
        foremost::burn(model, now)
    };
    let roomy = is_roomy(area);
    let area = headline::draw(&first, theme, frame, area);
    let (left, right) = if roomy {
        let [panels, below] =
            area.layout(&Layout::vertical([Constraint::Length(PANEL_ROWS + 1), Constraint::Fill(1)]));
        let [flight, landing, actuators] = panels.layout(&Layout::horizontal([Constraint::Fill(1); 3]));
        draw_flight(model, theme, now, frame, flight);
        draw_touchdown(model, theme, now, frame, landing);
        draw_actuators(model, theme, now, frame, actuators);
        let [events, right] = below.layout(&Layout::horizontal([Constraint::Fill(2), Constraint::Fill(3)]));
        // On a middling screen the newest are enough: a change of page should not fill a slow line.
        let rows = if events.height < TALL_ROWS { EVENT_ROWS } else { events.height };
        (Rect { height: events.height.min(rows), ..events }, right)
    } else {
        let [left, right] =
            area.layout(&Layout::horizontal([Constraint::Length(LEFT_COLUMNS), Constraint::Fill(1)]));
        let [panels, events] =
            left.layout(&Layout::vertical([Constraint::Length(PANEL_ROWS), Constraint::Fill(1)]));
        let [landing, flight] =
            panels.layout(&Layout::horizontal([Constraint::Length(TOUCHDOWN_COLUMNS), Constraint::Fill(1)]));
        draw_touchdown(model, theme, now, frame, landing);
        draw_essentials(model, theme, now, frame, flight);
        (events, right)
    };
    let inside = titled("Events", theme, frame, left);
    let lines = event_list::events(model, theme, usize::from(inside.width), usize::from(inside.height));
    draw_lines(frame, inside, &lines);
    draw_pictures(model, theme, now, frame, right);
}

fn draw_pictures(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let shows = if lost_position::is_lost(model, now) { "PREDICTION +" } else { "flown, plan" };
    for (from, title, area) in side_view::pictures(model, area) {
        let shows = if from == side_view::Viewpoint::South { "flown" } else { shows };
        let whole = format!("{title}: {shows}");
        // With a blank on either side, one column and some rule.
        let title = if whole.len() + 4 > usize::from(area.width) { title.to_owned() } else { whole };
        let inside = titled(&title, theme, frame, area);
        side_view::draw(model, (side_view::FlightPart::Burn, from), theme, now, frame, inside);
    }
}

/// Altitude, speeds and attitude; after the loss of the link the predicted position.
fn draw_flight(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    if lost_position::is_lost(model, now) {
        let inside = titled("PREDICTED, not heard", theme, frame, area);
        draw_lines(frame, inside, &lost_position::rows(model, theme, now));
    } else {
        let inside = titled("Flight", theme, frame, area);
        let mut rows = controller::rows(model, theme, now);
        rows.truncate(1);
        rows.extend(flight::rows(model, theme, now));
        draw_lines(frame, inside, &rows);
    }
}

fn draw_touchdown(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let (title, rows) = touchdown::panel_with_bars(model, theme, now, usize::from(area.width));
    let inside = titled(title, theme, frame, area);
    draw_lines(frame, inside, &rows);
}

/// Who steers, how upright, and the gimbal against its limit.
fn draw_essentials(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    if lost_position::is_lost(model, now) {
        return draw_flight(model, theme, now, frame, area);
    }
    let inside = titled("Steering", theme, frame, area);
    let mut lines: Vec<Line> = controller::rows(model, theme, now).into_iter().take(1).collect();
    let vehicle = &model.vehicle;
    let tilt = vehicle.attitude.map(|attitude| attitude.map(|a| a.tilt_rad.to_degrees()));
    lines.push(row(theme, "tilt", tilt, 2, "deg", now));
    let motion = vehicle.best_motion();
    lines.push(row(theme, "horizontal", motion.map(|m| m.map(Motion::horizontal_m_s)), 2, "m/s", now));
    lines.push(row(theme, "distance", motion.map(|m| m.map(Motion::distance_m)), 1, "m", now));
    lines.extend(actuators::gimbal_rows(model, theme, now));
    draw_lines(frame, inside, &lines);
}

fn draw_actuators(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let [fins, gimbal] = area.layout(&Layout::vertical([Constraint::Length(FIN_ROWS), Constraint::Fill(1)]));
    let inside = titled("Fins command|actual", theme, frame, fins);
    draw_lines(frame, inside, &actuators::fin_rows(model, theme, now));
    let inside = titled("Gimbal", theme, frame, gimbal);
    draw_lines(frame, inside, &actuators::gimbal_rows(model, theme, now));
}

/// The same content as lines, the most important first.
pub fn lines(model: &Model, theme: Theme, now: Duration, columns: usize, rows: usize) -> Vec<Line<'static>> {
    let mut lines = vec![motion(model, theme, now)];
    if lost_position::is_lost(model, now) {
        lines = lost_position::rows(model, theme, now);
    }
    // The newest event comes before everything else.
    lines.extend(newest_event(model, theme));
    // An abort is shown in the top lines.
    if let Some(track) = top_lines::open_command(model, now) {
        lines.push(top_lines::command_facts_short(track, theme, now));
    }
    lines.push(attitude(model, theme, now));
    let (title, touchdown) = touchdown::panel(model, theme, now);
    let mut verdict = Line::styled(format!(" {title}: "), theme.style(TextRole::Label));
    verdict.spans.extend(touchdown.into_iter().next_back().into_iter().flat_map(|line| {
        let style = line.style;
        line.spans.into_iter().map(move |span| span.patch_style(style))
    }));
    lines.push(verdict);
    lines.extend(controller::rows(model, theme, now).into_iter().take(2));
    // For a planar vehicle command and measurement; in space one row of each gimbal plane.
    let gimbal = actuators::gimbal_rows(model, theme, now).into_iter();
    lines.extend(gimbal.step_by(if model.vehicle.in_space { 2 } else { 1 }).take(2));
    lines.extend(actuators::fin_rows(model, theme, now));
    lines.push(link_line::link(model, theme, now, columns));
    let room = rows.saturating_sub(lines.len());
    lines.extend(event_list::events(model, theme, columns, room));
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
    vec![
        Span::styled(format!(" {label} "), theme.style(TextRole::Label)),
        Span::styled(format!("{mark}{text}"), theme.style(role)),
    ]
}

fn motion(model: &Model, theme: Theme, now: Duration) -> Line<'static> {
    let motion = model.vehicle.best_motion();
    let altitude = motion.map(|motion| motion.map(|m| m.altitude_m));
    let climb = motion.map(|motion| motion.map(|m| m.climb_m_s));
    let mut spans = value(theme, "alt", altitude, 1, now);
    spans.extend(value(theme, "vz", climb, 1, now));
    Line::from(spans)
}

fn attitude(model: &Model, theme: Theme, now: Duration) -> Line<'static> {
    let vehicle = &model.vehicle;
    let (body, attitude) = (vehicle.body_speed(), vehicle.attitude);
    let axial = body.map(|body| body.map(|b| b.u_m_s));
    let mut spans;
    if vehicle.in_space {
        spans = value(theme, "tilt", attitude.map(|a| a.map(|a| a.tilt_rad.to_degrees())), 1, now);
        spans.extend(value(theme, "u", axial, 1, now));
        spans.extend(value(theme, "lat", body.map(|body| body.map(BodySpeed::lateral_m_s)), 2, now));
    } else {
        spans = value(theme, "pitch", attitude.map(|a| a.map(|a| a.pitch_rad.to_degrees())), 1, now);
        spans.extend(value(theme, "u", axial, 1, now));
        spans.extend(value(theme, "w", body.map(|body| body.map(|b| b.w_m_s)), 2, now));
    }
    Line::from(spans)
}

fn newest_event(model: &Model, theme: Theme) -> Option<Line<'static>> {
    let event = model.events.newest(1).next()?;
    Some(Line::styled(format!(" {}{}", event.mark().trim_start(), event.text), theme.style(TextRole::Plain)))
}
