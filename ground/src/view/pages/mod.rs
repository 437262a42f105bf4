//! One module per page. Each gives its content as lines for small terminals; pages with panels also draw them.

pub mod alarms;
pub mod ascent;
pub mod checks;
pub mod descent;
pub mod find;
pub mod flying;
pub mod foreign;
pub mod help;
pub mod landing;
pub mod link;
pub mod log;
pub mod messages;
pub mod pad;
pub mod parameters;
pub mod path;
pub mod plot;
pub mod review;
pub mod values;

use std::time::Duration;

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::text::Line;
use ratatui::widgets::{Block, Borders};

use super::draw_lines;
use super::theme::{TextRole, Theme};
use crate::model::Model;
use crate::model::page::Page;

/// Draws the present page between the top lines and the alarm line.
pub fn draw(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    match model.page() {
        Page::Pad if model.vehicle.as_foreign().is_none() => pad::draw(model, theme, now, frame, area),
        Page::Ascent => ascent::draw(model, theme, now, frame, area),
        Page::Descent => descent::draw(model, theme, now, frame, area),
        Page::Landing => landing::draw(model, theme, now, frame, area),
        Page::Review => review::draw(model, theme, now, frame, area),
        Page::Path => path::draw(model, theme, now, frame, area),
        Page::Values => values::draw(model, theme, now, frame, area),
        Page::Plot => plot::draw(model, theme, now, frame, area),
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
            Some(vehicle) => foreign::lines(model, vehicle, theme, now, (columns, rows)),
            None => pad::lines(model, theme, now),
        },
        Page::Ascent => ascent::lines(model, theme, now),
        Page::Descent => descent::lines(model, theme, now),
        Page::Landing => landing::lines(model, theme, now, columns, rows),
        Page::Review => review::lines(model, theme, now, columns),
        Page::Link => link::lines(model, theme, now, columns, rows),
        Page::Messages => messages::lines(model, theme, columns, rows),
        Page::Parameters => parameters::lines(model, theme, rows),
        Page::Log => log::lines(model, theme, now),
        Page::Alarms => alarms::lines(model, theme, now, columns, rows),
        Page::Path => path::lines(model, theme, now),
        Page::Find => find::lines(model, theme, now),
        Page::Checks => checks::lines(model, theme, now, columns),
        Page::Values => values::lines(model, theme, now),
        Page::Plot => plot::lines(model, theme, now),
        Page::Help => help::lines(model, theme, now),
    }
}

/// Draws a title with a rule and returns the area below it.
pub fn titled(title: &str, theme: Theme, frame: &mut Frame, area: Rect) -> Rect {
    let title = Line::styled(format!(" {title} "), theme.style(TextRole::Title));
    let block = Block::new().borders(Borders::TOP).border_style(theme.style(TextRole::Label)).title(title);
    let inside = block.inner(area);
    frame.render_widget(block, area.intersection(frame.area()));
    inside
}

/// From this size on a page has room for more than the essentials.
fn is_roomy(area: Rect) -> bool {
    area.width >= 120 && area.height >= 24
}

/// This many lines from a start line on.
fn window(lines: Vec<Line<'static>>, start: usize, rows: usize) -> Vec<Line<'static>> {
    lines.into_iter().skip(start).take(rows).collect()
}
