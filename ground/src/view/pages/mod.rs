//! The pages: of panels, or of lines, which also a small terminal shows.

pub mod checks;
pub mod flight;
pub mod landing;
pub mod link;
pub mod lists;
pub mod pad;
pub mod plots;

use std::time::Duration;

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect, Spacing};
use ratatui::symbols::merge::MergeStrategy;
use ratatui::text::Line;
use ratatui::widgets::{Block, Borders};

use super::band::Room;
use super::pictures::attitude::{Side, draw_attitude, tilt_words};
use super::{TextRole, Theme, draw_lines, panels};
use crate::model::{Model, Page};

/// Draws the present page between the top lines and the alarm line. Returns where the pictures of a flight are.
pub fn draw(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) -> Option<Rect> {
    match model.page() {
        Page::Ascent | Page::Descent => return Some(flight::draw_flying(model, theme, now, frame, area)),
        Page::Landing => return Some(landing::draw_landing(model, theme, now, frame, area)),
        Page::Pad if model.vehicle.as_foreign().is_none() => pad::draw_pad(model, theme, now, frame, area),
        Page::Review => landing::draw_review(model, theme, now, frame, area),
        Page::Path => plots::draw_path(model, theme, now, frame, area),
        Page::Values => plots::draw_values(model, theme, now, frame, area),
        Page::Plot => plots::draw_plot_page(model, theme, now, frame, area),
        page => {
            let inside = titled(page.name(), theme, frame, area);
            draw_lines(frame, inside, &lines(model, page, theme, now, inside));
        }
    }
    None
}

/// The page as lines. Of a page of panels it is what must be seen where there is no room for them.
pub fn lines(model: &Model, page: Page, theme: Theme, now: Duration, area: Rect) -> Vec<Line<'static>> {
    let (columns, rows) = (usize::from(area.width), usize::from(area.height));
    match page {
        Page::Pad if let Some(vehicle) = model.vehicle.as_foreign() => {
            pad::foreign_lines(model, vehicle, theme, now, (columns, rows))
        }
        Page::Pad if model.pages.checklist && model.checklist.is_some() => {
            super::lists::checklist_rows(model, theme, now, (columns, rows))
        }
        Page::Pad => pad::checks(model, theme, now),
        Page::Review => landing::review_lines(model, theme, now, columns),
        Page::Link => link::lines(model, theme, now, columns, rows),
        Page::Messages => lists::messages_lines(model, theme, columns, rows),
        Page::Log => lists::log_lines(model, theme, now),
        Page::Alarms => lists::alarms_lines(model, theme, now, columns, rows),
        Page::Find => checks::find_lines(model, theme, now),
        Page::Checks => checks::checks_lines(model, theme, now, columns),
        Page::Ascent | Page::Descent | Page::Landing | Page::Path | Page::Values | Page::Plot => {
            panels::flight_panel(model, theme, now).1
        }
        Page::Help => lists::help_lines(model, theme, now),
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

/// A panel with the vehicle from a side.
fn attitude(model: &Model, side: Side, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let tilt = if side == Side::South { tilt_words(model, now) } else { String::new() };
    // A narrow panel has room for the number.
    let tilt = if area.width < 21 { tilt.trim_start_matches("tilt ").to_owned() } else { tilt };
    let right =
        if tilt.is_empty() { Line::default() } else { theme.line(format!(" {tilt} "), TextRole::Plain) };
    let inside = framed(side.title(), right, theme, frame, area);
    draw_attitude(model, side, theme, now, frame, inside);
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

/// Draws lines with a title and a rule above them.
fn panel(title: &str, lines: &[Line], theme: Theme, frame: &mut Frame, area: Rect) {
    let inside = titled(title, theme, frame, area);
    draw_lines(frame, inside, lines);
}

/// This many lines from a start line on.
fn window(lines: Vec<Line<'static>>, start: usize, rows: usize) -> Vec<Line<'static>> {
    lines.into_iter().skip(start).take(rows).collect()
}
