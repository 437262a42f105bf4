//! Draws the screen: one pure function from the model and the time to a frame.
//!
//! Every page has the same frame: [`identity`] is the first line, [`top_lines`] follow (phase, armed, countdown,
//! link, what an abort would do), and [`alarm_line`] and the page names are at the bottom. [`pages`] has one module
//! per page; the other modules are panels and helpers of the pages. From 80x24 on, [`wide`] lays the panels out side
//! by side; on smaller terminals [`compact`] shows plain lines, the most important first. For terminals without
//! Unicode, [`ascii`] converts the result.

pub mod actuators;
pub mod alarm_line;
pub mod ascii;
pub mod big_letters;
pub mod compact;
pub mod controller;
pub mod dialog;
pub mod event_list;
pub mod fins;
pub mod flight;
pub mod gauge;
pub mod identity;
pub mod limit_rows;
pub mod link_line;
pub mod lost_position;
pub mod next_event;
pub mod number;
pub mod pages;
pub mod side_view;
pub mod theme;
pub mod top_lines;
pub mod touchdown;
pub mod verdict;
pub mod wide;

use std::time::Duration;

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::text::Line;

use crate::model::Model;
use theme::Theme;

/// The smallest screen with panels.
const WIDE_COLUMNS: u16 = 80;
const WIDE_ROWS: u16 = 24;

pub fn view(model: &Model, theme: Theme, now: Duration, frame: &mut Frame) {
    let area = frame.area();
    if area.width >= WIDE_COLUMNS && area.height >= WIDE_ROWS {
        wide::draw(model, theme, now, frame, area);
    } else {
        compact::draw(model, theme, now, frame, area);
    }
    if theme.ascii {
        ascii::flatten(frame.buffer_mut());
    }
}

/// Draws lines from the top of an area, as many as fit.
fn draw_lines(frame: &mut Frame, area: Rect, lines: &[Line]) {
    let area = area.intersection(frame.area());
    for (line, y) in lines.iter().zip(area.y..area.bottom()) {
        frame.render_widget(line, Rect { y, height: 1, ..area });
    }
}
