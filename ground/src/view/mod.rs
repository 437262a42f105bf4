//! Draws the screen: one pure function from the model and the time to a frame.
//!
//! Every page has the same frame: [`identity`] is the first line, [`top_lines`] follow (phase, armed, countdown,
//! link, what an abort would do), and [`alarm_line`] and the page names are at the bottom. [`pages`] has one module
//! per page; the other modules are panels and helpers of the pages. From 80x22 on, [`wide`] lays the panels out side
//! by side; on smaller terminals [`compact`] shows plain lines, the most important first. For terminals without
//! Unicode, [`ascii`] converts the result.

pub mod actuators;
pub mod alarm_line;
pub mod ascii;
pub mod banner;
pub mod checklist;
pub mod compact;
pub mod controller;
pub mod dialog;
pub mod event_list;
pub mod filter;
pub mod fins;
pub mod flight;
pub mod flight_bar;
pub mod foremost;
pub mod gauge;
pub mod headline;
pub mod identity;
pub mod limit_bar;
pub mod limit_rows;
pub mod link_line;
pub mod lost_position;
pub mod next_event;
pub mod number;
pub mod pages;
pub mod palette;
pub mod pins;
pub mod side_view;
pub mod sparkline;
pub mod theme;
pub mod ticks;
pub mod top_lines;
pub mod top_view;
pub mod touchdown;
pub mod wide;

use std::time::Duration;

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::text::Line;

use crate::model::Model;
use theme::Theme;

/// The smallest screen with panels: 80x24 without the lines of a multiplexer.
const WIDE_COLUMNS: u16 = 80;
const WIDE_ROWS: u16 = 22;

pub fn view(model: &Model, theme: Theme, now: Duration, frame: &mut Frame) {
    let area = frame.area();
    frame.buffer_mut().set_style(area, theme.ground());
    if area.width >= WIDE_COLUMNS && area.height >= WIDE_ROWS {
        wide::draw(model, theme, now, frame, area);
    } else {
        compact::draw(model, theme, now, frame, area);
    }
    if theme.ascii {
        ascii::flatten(frame.buffer_mut());
    }
}

/// The last cell of a line that is cut.
pub const CUT_MARK: char = '…';

/// Draws lines from the top of an area, as many as fit. What is cut is marked.
fn draw_lines(frame: &mut Frame, area: Rect, lines: &[Line]) {
    let area = area.intersection(frame.area());
    if area.is_empty() {
        return;
    }
    let rows = usize::from(area.height);
    for (row, (line, y)) in lines.iter().zip(area.y..area.bottom()).enumerate() {
        frame.render_widget(line, Rect { y, height: 1, ..area });
        if line.width() > usize::from(area.width) || (row + 1 == rows && lines.len() > rows) {
            frame.buffer_mut()[(area.right() - 1, y)].set_char(CUT_MARK);
        }
    }
}

/// Draws one line.
fn draw_line(frame: &mut Frame, area: Rect, line: Line) {
    draw_lines(frame, Rect { height: area.height.min(1), ..area }, &[line]);
}
