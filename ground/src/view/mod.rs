//! Draws the screen: one pure function from the model and the time to a frame.
//!
//! Every page has the same frame: [`top_lines`] (identity, link, recording; the state and what an
//! abort would do in the colour of the danger), the page, and [`footer`] (the flight along its
//! time, the keys). [`pages`] has the pages; they consist of [`panels`], [`pictures`], [`lists`]
//! and [`widgets`]. From 80x22 on, the panels are side by side; on smaller terminals there are
//! plain lines: state, abort, alarm and messages, and the pages that are lines. For terminals
//! without Unicode, [`theme`] converts the result.

pub mod band;
pub mod bars;
pub mod dialog;
pub mod footer;
pub mod headline;
pub mod lists;
pub mod pages;
pub mod panels;
pub mod pictures;
pub mod shared;
pub mod status_lines;
pub mod theme;
pub mod top_lines;
pub mod widgets;

use std::time::Duration;

use ratatui::Frame;
use ratatui::layout::Constraint::{Fill, Length};
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Paragraph, Wrap};

use crate::model::{Model, Page};
pub use theme::{Ink, TextRole, Theme};
use top_lines::ABORT_LABEL;
use widgets::{STALE_MARK, age_mark, fixed, quantity_row, seconds, shortest, text_row};

/// The smallest screen with panels: 80x24 without the lines of a multiplexer.
const WIDE_COLUMNS: u16 = 80;
const WIDE_ROWS: u16 = 22;

/// Draws the screen. Returns where the pictures of a flight are, which may be older than the
/// numbers above them.
pub fn draw(model: &Model, theme: Theme, now: Duration, frame: &mut Frame) -> Option<Rect> {
    let area = frame.area();
    frame.buffer_mut().set_style(area, theme.ground());
    let is_wide = area.width >= WIDE_COLUMNS && area.height >= WIDE_ROWS;
    let pictures = if is_wide { draw_wide(model, theme, now, frame, area) } else { None };
    if !is_wide {
        draw_small(model, theme, now, frame, area);
    }
    if theme.ascii {
        theme::flatten(frame.buffer_mut());
    }
    pictures
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

/// Splits an area into columns.
fn side_by_side<const N: usize>(area: Rect, columns: [Constraint; N]) -> [Rect; N] {
    area.layout(&Layout::horizontal(columns))
}

/// Splits an area into rows.
fn stacked<const N: usize>(area: Rect, rows: [Constraint; N]) -> [Rect; N] {
    area.layout(&Layout::vertical(rows))
}

/// Draws one line.
fn draw_line(frame: &mut Frame, area: Rect, line: Line) {
    draw_lines(frame, Rect { height: area.height.min(1), ..area }, &[line]);
}

// The layout from 80x22 on, the same on every page: who and what is seen; the state in the colour
// of its danger; the words on approaching; the page; the flight along its time, or an alarm; the
// keys.

fn draw_wide(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) -> Option<Rect> {
    let banner = headline::banner(model, now);
    let messages = footer::message_rows(model, theme, now, area.width);
    let state_rows = if area.width < top_lines::ONE_ROW_COLUMNS { 2 } else { 1 };
    let has_surfaces =
        !matches!(model.page(), Page::Help | Page::Find) && model.vehicle.as_foreign().is_none();
    let [identity, state, words, body, surfaces, message, keys] = stacked(
        area,
        [
            Length(1),
            Length(state_rows),
            Length(banner.is_some().into()),
            Fill(1),
            Length(has_surfaces.into()),
            Length(messages.len() as u16),
            Length(1),
        ],
    );
    for raised in [identity, keys] {
        frame.buffer_mut().set_style(raised, theme.raised());
    }
    top_lines::draw_identity(model, theme, now, frame, identity);
    top_lines::draw_state(model, theme, now, frame, state);
    let mut body = body;
    if let Some(banner) = &banner {
        // In letters as large as the room allows, on the colour of the danger.
        let level = theme.level(top_lines::level(model, now));
        frame.buffer_mut().set_style(words, level);
        draw_line(frame, words, Line::from(banner.reason()));
        let rows = band::draw_word(&band::word("", banner.words, banner.role), theme, frame, body);
        frame.buffer_mut().set_style(Rect { height: rows, ..body }, level);
        body = Rect { y: body.y + rows, height: body.height - rows, ..body };
    }
    let pictures = pages::draw(model, theme, now, frame, body);
    draw_line(frame, surfaces, bars::surfaces_line(model, theme, now));
    draw_lines(frame, message, &messages);
    footer::draw_keys(model, theme, now, frame, keys);
    dialog::draw_palette(model, theme, now, frame, body);
    dialog::draw_dialog(model, theme, now, frame, body);
    let is_covered = model.pages.entry.is_some() || dialog::dialog_lines(model, theme, now).is_some();
    pictures.filter(|_| !is_covered)
}

// The layout for terminals smaller than 80x22: plain lines, the most important first. Of a page of
// panels nothing is left.

/// With fewer rows an open dialog replaces the line of countdown and link.
const DIALOG_ROWS: u16 = 8;
/// From this many rows on, the last one has the keys.
const KEYS_ROWS: u16 = 10;

fn draw_small(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let columns = usize::from(area.width);
    let banner = headline::banner(model, now);
    let mut lines = vec![top_lines::identity(model, theme, now)];
    lines.extend(banner.map(|words| theme.line(format!(" {}", words.sentence()), words.role)));
    let (phase, armed) = (top_lines::phase(model, theme, now), top_lines::armed(model, theme, now));
    lines.push(Line::from(vec![phase, Span::raw(" "), armed]));
    let open = dialog::dialog_lines(model, theme, now);
    if open.is_none() || area.height >= DIALOG_ROWS {
        let mut line = Line::from(vec![top_lines::countdown(model, theme, now), Span::raw(" ")]);
        let link = top_lines::link(model, theme, now);
        line.extend(link.spans.into_iter().map(|span| span.patch_style(link.style)));
        lines.push(line);
    }
    let mut abort = top_lines::abort(model, theme, now, columns);
    let commands = model.settings.role.why_not_command().is_none();
    if let Some(label) = abort.spans.first_mut().filter(|label| label.content == ABORT_LABEL && commands) {
        *label = theme.key(" ^X^X ABORT: ");
    }
    lines.push(abort);
    if open.is_none() {
        let hands_off = top_lines::hands_off(model, theme, now);
        let message = top_lines::message(model, theme, now, columns).filter(|_| hands_off.is_none());
        let next = status_lines::next_event(model, now, false);
        let ready = top_lines::readiness(model, now).filter(|_| next.is_none());
        let ready = ready.map(|(words, role)| theme.line(format!(" {words}"), role));
        lines.extend(hands_off);
        lines.extend(next.map(|words| theme.line(words, TextRole::Title)));
        if model.vehicle.in_flight() {
            let (main, others) = headline::of_flight(model, now);
            let number = |item: &band::Item| format!(" {} {} ", item.label, item.text.trim());
            let numbers: String = std::iter::once(&main).chain(&others).map(number).collect();
            lines.push(theme.line(status_lines::cut(&numbers, columns), TextRole::Title));
        }
        lines
            .extend(status_lines::alarm_text(model, theme, now, columns).filter(|_| model.playing.is_none()));
        lines.extend(message.or(ready));
    }
    let keys = u16::from(open.is_none() && area.height >= KEYS_ROWS);
    let [top, page, keys] = stacked(area, [Length(lines.len() as u16), Fill(1), Length(keys)]);
    draw_lines(frame, top, &lines);
    if let Some((_, text)) = open {
        return frame.render_widget(Paragraph::new(text).wrap(Wrap { trim: false }), page);
    }
    let palette = dialog::palette_lines(model, theme, now, usize::from(page.height).saturating_sub(1));
    let lines = if palette.is_empty() { pages::lines(model, theme, now, page) } else { palette };
    draw_lines(frame, page, &lines);
    footer::draw_keys(model, theme, now, frame, keys);
}
