//! The pages. Each gives its content as lines for small terminals; pages with panels also draw them.

pub mod checks;
pub mod flight;
pub mod landing;
pub mod link;
pub mod lists;
pub mod pad;
pub mod plots;

use std::time::Duration;

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::text::Line;
use ratatui::widgets::{Block, Borders};

use super::{TextRole, Theme, draw_lines};
use crate::model::{Model, Page};

/// Draws the present page between the top lines and the alarm line.
pub fn draw(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    match model.page() {
        Page::Pad if model.vehicle.as_foreign().is_none() => pad::draw_pad(model, theme, now, frame, area),
        Page::Ascent => flight::draw_ascent(model, theme, now, frame, area),
        Page::Descent => flight::draw_descent(model, theme, now, frame, area),
        Page::Landing => landing::draw_landing(model, theme, now, frame, area),
        Page::Review => landing::draw_review(model, theme, now, frame, area),
        Page::Path => plots::draw_path(model, theme, now, frame, area),
        Page::Values => plots::draw_values(model, theme, now, frame, area),
        Page::Plot => plots::draw_plot_page(model, theme, now, frame, area),
        page => {
            let inside = titled(page.name(), theme, frame, area);
            draw_lines(frame, inside, &lines(model, page, theme, now, inside));
        }
    }
}

/// The page as lines, the most important first.
pub fn lines(model: &Model, page: Page, theme: Theme, now: Duration, area: Rect) -> Vec<Line<'static>> {
    let (columns, rows) = (usize::from(area.width), usize::from(area.height));
    match page {
        Page::Pad => match model.vehicle.as_foreign() {
            Some(vehicle) => pad::foreign_lines(model, vehicle, theme, now, (columns, rows)),
            None => pad::pad_lines(model, theme, now),
        },
        Page::Ascent => flight::ascent_lines(model, theme, now),
        Page::Descent => flight::descent_lines(model, theme, now),
        Page::Landing => landing::landing_lines(model, theme, now, columns, rows),
        Page::Review => landing::review_lines(model, theme, now, columns),
        Page::Link => link::lines(model, theme, now, columns, rows),
        Page::Messages => lists::messages_lines(model, theme, columns, rows),
        Page::Parameters => lists::parameters_lines(model, theme, rows),
        Page::Log => lists::log_lines(model, theme, now),
        Page::Alarms => lists::alarms_lines(model, theme, now, columns, rows),
        Page::Path => plots::path_lines(model, theme, now),
        Page::Find => checks::find_lines(model, theme, now),
        Page::Checks => checks::checks_lines(model, theme, now, columns),
        Page::Values => plots::values_lines(model, theme, now),
        Page::Plot => plots::plot_lines(model, theme, now),
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

/// Draws lines with a title and a rule above them.
fn panel(title: &str, lines: &[Line], theme: Theme, frame: &mut Frame, area: Rect) {
    let inside = titled(title, theme, frame, area);
    draw_lines(frame, inside, lines);
}

/// From this size on a page has room for more than the essentials.
fn is_roomy(area: Rect) -> bool {
    area.width >= 120 && area.height >= 24
}

/// This many lines from a start line on.
fn window(lines: Vec<Line<'static>>, start: usize, rows: usize) -> Vec<Line<'static>> {
    lines.into_iter().skip(start).take(rows).collect()
}
