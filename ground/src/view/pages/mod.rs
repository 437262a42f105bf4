//! The pages: of panels, or of lines.

pub mod checks;
pub mod flight;
pub mod link;
pub mod lists;
pub mod pad;
pub mod plot;
pub mod review;

use std::time::Duration;

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect, Spacing};
use ratatui::symbols::merge::MergeStrategy;
use ratatui::text::Line;
use ratatui::widgets::{Block, Borders};

use super::band::Room;
use super::{TextRole, Theme, draw_lines};
use crate::model::{Model, Page};

/// Draws the present page between the top lines and the alarm line. Returns where the pictures of a flight are.
pub fn draw(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) -> Option<Rect> {
    let page = model.page();
    match page {
        Page::Ascent | Page::Descent | Page::Landing => {
            return Some(flight::draw_flying(model, theme, now, frame, area));
        }
        Page::Pad if model.vehicle.as_foreign().is_none() => pad::draw_pad(model, theme, now, frame, area),
        Page::Review => review::draw_review(model, theme, now, frame, area),
        Page::Plot => plot::draw_plot_page(model, theme, now, frame, area),
        _ => {
            let inside = titled(page.name(), theme, frame, area);
            draw_lines(frame, inside, &lines(model, theme, now, inside));
        }
    }
    None
}

/// A page of lines, which also a small terminal shows; instead of a page of panels the newest events.
pub fn lines(model: &Model, theme: Theme, now: Duration, area: Rect) -> Vec<Line<'static>> {
    let (columns, rows) = (usize::from(area.width), usize::from(area.height));
    match model.page() {
        Page::Pad if let Some(vehicle) = model.vehicle.as_foreign() => {
            pad::foreign_lines(model, vehicle, theme, now, (columns, rows))
        }
        Page::Link => link::lines(model, theme, now, columns, rows),
        Page::Messages => lists::messages_lines(model, theme, columns, rows),
        Page::Log => lists::log_lines(model, theme, now),
        Page::Alarms => lists::alarms_lines(model, theme, now, columns, rows),
        Page::Find => checks::find_lines(model, theme, now),
        Page::Checks => checks::checks_lines(model, theme, now, columns),
        Page::Help => lists::help_lines(model, theme, now),
        _ => super::lists::events(model, theme, columns, rows),
    }
}

/// Draws a title with a rule and returns the area below it.
pub fn titled(title: &str, theme: Theme, frame: &mut Frame, area: Rect) -> Rect {
    let title = theme.line(format!(" {title} "), TextRole::Title);
    let block = Block::new().borders(Borders::TOP).border_style(theme.style(TextRole::Label)).title(title);
    let inside = block.inner(area);
    frame.render_widget(block, area.intersection(frame.area()));
    inside
}

/// Splits an area into panels beside each other, which share a border.
fn columns<const N: usize>(area: Rect, columns: [Constraint; N]) -> [Rect; N] {
    area.layout(&Layout::horizontal(columns).spacing(Spacing::Overlap(1)))
}

/// Splits an area into panels above each other, which share a border.
fn rows<const N: usize>(area: Rect, rows: [Constraint; N]) -> [Rect; N] {
    area.layout(&Layout::vertical(rows).spacing(Spacing::Overlap(1)))
}

/// Draws the border of a panel with its title, and what stands at the right end of it. Returns its inside.
pub fn framed(title: &str, right: Line<'static>, theme: Theme, frame: &mut Frame, area: Rect) -> Rect {
    let title = theme.line(format!(" {title} "), TextRole::Title);
    let block =
        Block::bordered().border_style(theme.border()).merge_borders(MergeStrategy::Exact).title(title);
    let block = if right.width() == 0 { block } else { block.title(right.right_aligned()) };
    let inside = block.inner(area);
    frame.render_widget(block, area.intersection(frame.area()));
    inside
}

/// A panel with the newest events.
fn events(model: &Model, theme: Theme, frame: &mut Frame, area: Rect) {
    let inside = framed("events", Line::default(), theme, frame, area);
    let lines = super::lists::events(model, theme, usize::from(inside.width), usize::from(inside.height));
    draw_lines(frame, inside, &lines);
}

/// A panel with lines.
fn table(title: &str, lines: &[Line], theme: Theme, frame: &mut Frame, area: Rect) {
    let inside = framed(title, Line::default(), theme, frame, area);
    // The most important first; the rest is on the page of all values.
    draw_lines(frame, inside, &lines[..lines.len().min(usize::from(inside.height))]);
}

/// This many lines from a start line on.
fn window(lines: Vec<Line<'static>>, start: usize, rows: usize) -> Vec<Line<'static>> {
    lines.into_iter().skip(start).take(rows).collect()
}
