//! The screen from 80x24 on.

use std::time::Duration;

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::text::Line;
use ratatui::widgets::{Block, Borders};

use super::theme::{Role, Theme};
use super::{actuators, big, controller, dialog, draw_lines, flight, happenings, side, top, touchdown};
use crate::model::Model;

/// Rows of the three panels at the top, their title included.
const PANEL_ROWS: u16 = 9;
/// Rows of the actuators, their title included.
const ACTUATOR_ROWS: u16 = 5;
/// Columns left of the side view at 80 columns.
const LEFT_COLUMNS: u16 = 54;

/// Draws everything.
pub fn draw(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let [status, abort, command, panels, below, keys] = area.layout(&Layout::vertical([
        Constraint::Length(1),
        Constraint::Length(1),
        Constraint::Length(1),
        Constraint::Length(PANEL_ROWS),
        Constraint::Fill(1),
        Constraint::Length(1),
    ]));
    draw_status(model, theme, now, frame, status);
    frame.render_widget(top::abort(model, theme, now), abort);
    frame.render_widget(top::command(model, theme, now), command);
    draw_panels(model, theme, now, frame, panels);
    let left_columns = LEFT_COLUMNS.max(area.width * 3 / 5);
    let [left, right] =
        below.layout(&Layout::horizontal([Constraint::Length(left_columns), Constraint::Fill(1)]));
    draw_left(model, theme, now, frame, left);
    let inside = titled("Side view: flown, plan", theme, frame, right);
    side::draw(model, theme, frame, inside);
    frame.render_widget(happenings::keys(theme), keys);
    let middle = Rect { height: panels.height + below.height, ..panels };
    dialog::draw(model, theme, now, frame, middle);
}

fn draw_status(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let [phase, armed, countdown, link, abort] = area.layout(&Layout::horizontal([
        Constraint::Length(14),
        Constraint::Length(11),
        Constraint::Length(11),
        Constraint::Fill(1),
        Constraint::Length(20),
    ]));
    frame.render_widget(top::phase(model, theme, now), phase);
    frame.render_widget(top::armed(model, theme, now), armed);
    frame.render_widget(top::countdown(model, theme, now), countdown);
    frame.render_widget(top::link(model, theme, now), link);
    frame.render_widget(Line::styled(format!("ABORT {}", top::ABORT_KEY), theme.style(Role::Key)), abort);
}

fn draw_panels(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let [first, second, third] =
        area.layout(&Layout::horizontal([Constraint::Fill(27), Constraint::Fill(26), Constraint::Fill(27)]));
    let inside = titled("Flight", theme, frame, first);
    draw_lines(frame, inside, &flight::rows(model, theme, now));
    let inside = titled("NMPC", theme, frame, second);
    draw_lines(frame, inside, &controller::rows(model, theme, now));
    let (title, rows) = touchdown::panel(model, theme, now);
    let inside = titled(title, theme, frame, third);
    draw_lines(frame, inside, &rows);
}

fn draw_left(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let [actuators, link, events] = area.layout(&Layout::vertical([
        Constraint::Length(ACTUATOR_ROWS),
        Constraint::Length(1),
        Constraint::Fill(1),
    ]));
    if let Some(verdict) = model.vehicle.verdict {
        draw_verdict(verdict.value.landed, theme, frame, actuators);
    } else {
        let [fins, gimbal] =
            actuators.layout(&Layout::horizontal([Constraint::Fill(1), Constraint::Fill(1)]));
        let inside = titled("Fins command|actual", theme, frame, fins);
        draw_lines(frame, inside, &actuators::fin_rows(model, theme, now));
        let inside = titled("Gimbal", theme, frame, gimbal);
        draw_lines(frame, inside, &actuators::gimbal_rows(model, theme, now));
    }
    frame.render_widget(happenings::link(model, theme, now, usize::from(link.width)), link);
    let inside = titled("Events", theme, frame, events);
    draw_lines(
        frame,
        inside,
        &happenings::events(model, theme, usize::from(inside.width), usize::from(inside.height)),
    );
}

fn draw_verdict(landed: bool, theme: Theme, frame: &mut Frame, area: Rect) {
    let word = if landed { "LANDED" } else { "NOT LANDED" };
    let role = if landed { Role::Good } else { Role::Caution };
    let lines = big::word(word).map(|line| Line::styled(format!(" {line}"), theme.style(role)));
    let below = Rect { y: area.y + 1, height: area.height.saturating_sub(1), ..area };
    draw_lines(frame, below, &lines);
}

/// Draws a title with a rule and returns the area below it.
fn titled(title: &str, theme: Theme, frame: &mut Frame, area: Rect) -> Rect {
    let title = Line::styled(format!(" {title} "), theme.style(Role::Title));
    let block = Block::new().borders(Borders::TOP).border_style(theme.style(Role::Label)).title(title);
    let inside = block.inner(area);
    frame.render_widget(block, area);
    inside
}
