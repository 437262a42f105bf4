//! The layout for terminals smaller than 80x22: plain lines, the most important first.

use std::time::Duration;

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::text::{Line, Span};
use ratatui::widgets::{Paragraph, Wrap};

use super::theme::{TextRole, Theme};
use super::{alarm_line, banner, dialog, draw_lines, identity, next_event, pages, palette, top_lines};
use crate::model::Model;
use crate::model::act::Act;
use crate::model::command::CommandKind;
use crate::model::page::TextEntry;

/// With fewer rows an open dialog replaces the line of countdown and link.
const DIALOG_ROWS: u16 = 8;
/// From this many rows on, the page name has a line of its own.
const NAMED_ROWS: u16 = 10;

/// Draws the lines that fit.
pub fn draw(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let mut lines = vec![identity::line(model, theme, now)];
    lines.extend(
        banner::of(model, now)
            .map(|words| Line::styled(format!(" {}", words.sentence()), theme.style(words.role))),
    );
    lines.push(Line::from(vec![
        top_lines::phase(model, theme, now),
        Span::raw(" "),
        top_lines::armed(model, theme, now),
    ]));
    let open = dialog::lines(model, theme, now);
    if open.is_none() || area.height >= DIALOG_ROWS {
        let mut line = vec![top_lines::countdown(model, theme, now), Span::raw(" ")];
        let link = top_lines::link(model, theme, now);
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
    lines.extend(top_lines::hands_off(model, theme, now));
    lines.extend(next_event::line(model, theme, now));
    lines.extend(model.playing.as_ref().map(|playing| alarm_line::replay(playing, theme)));
    if model.playing.is_none() {
        lines.extend(alarm_line::alarm(model, theme, now, usize::from(area.width)));
    }
    let page = model.page();
    let named = u16::from(area.height >= NAMED_ROWS);
    let taken = u16::try_from(lines.len()).unwrap_or(u16::MAX).saturating_add(named);
    let room = Rect { height: area.height.saturating_sub(taken), ..area };
    let mut body = pages::lines(model, page, theme, now, room);
    body.truncate(usize::from(room.height));
    lines.extend(if matches!(model.pages.entry, Some(TextEntry::Palette { .. })) {
        palette::lines(model, theme, usize::from(room.height).saturating_sub(1))
    } else {
        body
    });
    draw_lines(frame, area, &lines);
    if named > 0 {
        let held = if model.pages.held.is_some() { "HELD, 0 follows" } else { "auto" };
        let key = model.settings.keys.name(Act::Show(page.keyed()));
        let text = format!(" [{key}{}] 1-9 {held}  ? help", page.name());
        let last = Rect { y: area.bottom().saturating_sub(1), height: 1, ..area };
        frame.render_widget(Line::styled(text, theme.style(TextRole::Label)), last);
    }
}

fn abort(model: &Model, theme: Theme, now: Duration) -> Line<'static> {
    let line = top_lines::abort(model, theme, now);
    if model.abort_chord.is_begun(now) || model.link.abort_unsent {
        return line;
    }
    if let Some(track) = model.commands.of(CommandKind::Abort) {
        return top_lines::command_facts_short(track, theme, now);
    }
    let key = if model.settings.role.why_not_command().is_none() { " ^X^X ABORT:" } else { " abort:" };
    let mut spans = vec![Span::styled(key, theme.style(TextRole::Key))];
    spans.extend(line.spans.into_iter().skip(1).flat_map(|span| [Span::raw(" "), span]));
    Line::from(spans)
}
