//! The layout from 80x24 on: identity, top lines, the page, the alarm line, the page names.

use std::time::Duration;

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::text::{Line, Span};

use super::theme::{TextRole, Theme};
use super::{alarm_line, dialog, identity, pages, top_lines};
use crate::model::Model;
use crate::model::page::Page;

pub fn draw(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let [identity, status, abort, command, body, alarm, names] = area.layout(&Layout::vertical([
        Constraint::Length(1),
        Constraint::Length(1),
        Constraint::Length(1),
        Constraint::Length(1),
        Constraint::Fill(1),
        Constraint::Length(1),
        Constraint::Length(1),
    ]));
    identity::draw(model, theme, frame, identity);
    draw_status(model, theme, now, frame, status);
    frame.render_widget(top_lines::abort(model, theme, now), abort);
    frame.render_widget(top_lines::command(model, theme, now), command);
    pages::draw(model, theme, now, frame, body);
    alarm_line::draw(model, theme, now, frame, alarm);
    frame.render_widget(names_line(model, theme), names);
    dialog::draw(model, theme, now, frame, body);
}

fn draw_status(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let [phase, armed, countdown, link, abort] = area.layout(&Layout::horizontal([
        Constraint::Length(14),
        Constraint::Length(11),
        Constraint::Length(11),
        Constraint::Fill(1),
        Constraint::Length(20),
    ]));
    frame.render_widget(top_lines::phase(model, theme, now), phase);
    frame.render_widget(top_lines::armed(model, theme, now), armed);
    frame.render_widget(top_lines::countdown(model, theme, now), countdown);
    frame.render_widget(top_lines::link(model, theme, now), link);
    frame.render_widget(Line::styled(top_lines::abort_key(model), theme.style(TextRole::Key)), abort);
}

/// Digits and names of the pages, the shown one in brackets, and whether it is held.
fn names_line(model: &Model, theme: Theme) -> Line<'static> {
    let shown = model.page();
    let mut spans = Vec::new();
    for page in Page::ALL.into_iter().chain([Page::Help]) {
        let (left, right, role) =
            if page.key() == shown.key() { ("[", "]", TextRole::Key) } else { (" ", "", TextRole::Label) };
        // Ascent and descent share a key.
        let name = if page.key() == shown.key() { shown.name() } else { page.name() };
        spans.push(Span::styled(format!("{left}{}{name}{right}", page.key()), theme.style(role)));
    }
    let (word, role) =
        if model.pages.held.is_some() { (" HELD 0", TextRole::Caution) } else { (" auto", TextRole::Good) };
    spans.push(Span::styled(word, theme.style(role)));
    Line::from(spans)
}
