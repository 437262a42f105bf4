//! The frame of every screen from 80x24 on: who sits where, the top lines, the screen itself, the alarm line, the names.

use std::time::Duration;

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::text::{Line, Span};

use super::theme::{Role, Theme};
use super::{alarms, dialog, identity, pages, top};
use crate::model::Model;
use crate::model::page::Page;

/// Draws everything.
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
    frame.render_widget(top::abort(model, theme, now), abort);
    frame.render_widget(top::command(model, theme, now), command);
    pages::draw(model, theme, now, frame, body);
    alarms::draw(model, theme, now, frame, alarm);
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
    frame.render_widget(top::phase(model, theme, now), phase);
    frame.render_widget(top::armed(model, theme, now), armed);
    frame.render_widget(top::countdown(model, theme, now), countdown);
    frame.render_widget(top::link(model, theme, now), link);
    frame.render_widget(Line::styled(top::abort_key(model), theme.style(Role::Key)), abort);
}

/// The screens' digits and names, the shown one in brackets, and whether it is held.
fn names_line(model: &Model, theme: Theme) -> Line<'static> {
    let shown = model.page();
    let mut spans = Vec::new();
    for page in Page::ALL.into_iter().chain([Page::Help]) {
        let (left, right, role) = if page == shown { ("[", "]", Role::Key) } else { (" ", "", Role::Label) };
        spans.push(Span::styled(format!("{left}{}{}{right}", page.key(), page.name()), theme.style(role)));
    }
    let (word, role) =
        if model.pages.held.is_some() { (" HELD 0", Role::Caution) } else { (" auto", Role::Good) };
    spans.push(Span::styled(word, theme.style(role)));
    Line::from(spans)
}
