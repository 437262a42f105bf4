//! The screen below 80x24, down to 20x5 and less: lines, the most important first.

use std::time::Duration;

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::text::{Line, Span};
use ratatui::widgets::{Paragraph, Wrap};

use super::theme::{Role, Theme};
use super::{alarms, dialog, draw_lines, identity, next, pages, top};
use crate::model::Model;
use crate::model::command::CommandKind;

/// Below this many rows an open dialog takes the place of countdown and link.
const DIALOG_ROWS: u16 = 8;
/// Rows from which the screen's name and number have a line of their own.
const NAMED_ROWS: u16 = 10;

/// Draws everything that fits.
pub fn draw(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let mut lines = vec![
        identity::line(model, theme),
        Line::from(vec![top::phase(model, theme, now), Span::raw(" "), top::armed(model, theme, now)]),
    ];
    let open = dialog::lines(model, theme, now);
    if open.is_none() || area.height >= DIALOG_ROWS {
        let mut line = vec![top::countdown(model, theme, now), Span::raw(" ")];
        let link = top::link(model, theme, now);
        line.extend(link.spans.into_iter().map(|span| span.patch_style(link.style)));
        lines.push(Line::from(line));
    }
    lines.push(abort(model, theme, now));
    if let Some((_, text)) = open {
        draw_lines(frame, area, &lines);
        let fixed = u16::try_from(lines.len()).unwrap_or(u16::MAX).min(area.height);
        let below = Rect { y: area.y + fixed, height: area.height - fixed, ..area };
        frame.render_widget(Paragraph::new(text).wrap(Wrap { trim: false }), below);
        return;
    }
    lines.extend(top::keep_away(model, theme, now));
    lines.extend(next::line(model, theme, now));
    lines.extend(model.playing.map(|playing| alarms::replay(playing, theme)));
    if model.playing.is_none() {
        lines.extend(alarms::alarm(model, theme, now, usize::from(area.width)));
    }
    let page = model.page();
    let named = u16::from(area.height >= NAMED_ROWS);
    let taken = u16::try_from(lines.len()).unwrap_or(u16::MAX).saturating_add(named);
    let room = Rect { height: area.height.saturating_sub(taken), ..area };
    let mut body = pages::lines(model, page, theme, now, room);
    body.truncate(usize::from(room.height));
    lines.extend(body);
    draw_lines(frame, area, &lines);
    if named > 0 {
        let held = if model.pages.held.is_some() { "HELD, 0 follows" } else { "auto" };
        let text = format!(" [{}{}] 1-9 {held}  ? help", page.key(), page.name());
        let last = Rect { y: area.bottom().saturating_sub(1), height: 1, ..area };
        frame.render_widget(Line::styled(text, theme.style(Role::Label)), last);
    }
}

fn abort(model: &Model, theme: Theme, now: Duration) -> Line<'static> {
    let line = top::abort(model, theme, now);
    if model.abort_chord.is_begun(now) {
        return line;
    }
    if let Some(track) = model.commands.of(CommandKind::Abort) {
        return top::facts_short(track, theme, now);
    }
    let key = if model.settings.role.why_not_command().is_none() { " ^X^X ABORT:" } else { " abort:" };
    let mut spans = vec![Span::styled(key, theme.style(Role::Key))];
    spans.extend(line.spans.into_iter().skip(1).flat_map(|span| [Span::raw(" "), span]));
    Line::from(spans)
}
