//! The screen: one pure function from the model and the time to a frame.
//!
//! Who sits where ([`identity`]) is the first line. The top lines (phase, armed, countdown, link, abort key and what an abort would do) stand in the
//! same place on every screen and under every dialog; so do the alarm line and the screens' names. One room
//! a screen is in [`pages`]. From 80x24 on the panels are laid out side by side ([`wide`]); on anything
//! smaller the same facts come as lines, the most important first ([`compact`]). A terminal without Unicode
//! gets the same cells in ASCII ([`ascii`]).

pub mod actuators;
pub mod alarms;
pub mod ascii;
pub mod big;
pub mod compact;
pub mod controller;
pub mod dialog;
pub mod fins;
pub mod flight;
pub mod gauge;
pub mod happenings;
pub mod identity;
pub mod lost;
pub mod next;
pub mod number;
pub mod pages;
pub mod side;
pub mod theme;
pub mod top;
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

/// Draws everything.
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

/// Draws lines from the top of an area; what does not fit is not drawn.
fn draw_lines(frame: &mut Frame, area: Rect, lines: &[Line]) {
    let area = area.intersection(frame.area());
    for (line, y) in lines.iter().zip(area.y..area.bottom()) {
        frame.render_widget(line, Rect { y, height: 1, ..area });
    }
}
