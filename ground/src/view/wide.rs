//! The layout from 80x22 on: identity, top lines, pinned numbers, the page, the bar of the flight, the alarm line, the
//! page names.

use std::time::Duration;

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::text::{Line, Span};

use super::theme::{TextRole, Theme};
use super::{alarm_line, banner, dialog, draw_line, flight_bar, identity, pages, palette, pins, top_lines};
use crate::model::Model;
use crate::model::act::Act;
use crate::model::page::Page;
use crate::model::recall::LookBack;

/// From this width on every page is named; below, those with a letter are not.
const EVERY_NAME_COLUMNS: u16 = 100;

pub fn draw(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let bar_rows = u16::from(flight_bar::is_shown(model));
    // The top lines, dialogs and the alarm line always show the present.
    let past = model.past();
    let (shown, shown_at) = past.as_ref().map_or((model, now), |(past, at)| (past, *at));
    let past_rows = u16::from(past.is_some());
    let pinned_rows = u16::from(!model.pages.pinned.is_empty());
    let [identity, status, abort, command, past_mark, pinned, body, bar, alarm, names] =
        area.layout(&Layout::vertical([
            Constraint::Length(1),
            Constraint::Length(1),
            Constraint::Length(1),
            Constraint::Length(1),
            Constraint::Length(past_rows),
            Constraint::Length(pinned_rows),
            Constraint::Fill(1),
            Constraint::Length(bar_rows),
            Constraint::Length(1),
            Constraint::Length(1),
        ]));
    identity::draw(model, theme, now, frame, identity);
    draw_status(model, theme, now, frame, status);
    draw_line(frame, abort, top_lines::abort(model, theme, now));
    draw_line(frame, command, top_lines::command(model, theme, now));
    if let Some(looks) = model.look_back.filter(|_| past.is_some()) {
        draw_line(frame, past_mark, past_line(looks, shown_at, theme, now));
    }
    draw_line(frame, pinned, pins::line(shown, theme, shown_at));
    // Also over the past: whether people may approach is a matter of the present.
    let body = banner::of(model, now).map_or(body, |words| banner::draw(&words, theme, frame, body));
    pages::draw(shown, theme, shown_at, frame, body);
    flight_bar::draw(model, theme, (now, shown_at), frame, bar);
    alarm_line::draw(model, theme, now, frame, alarm);
    draw_line(frame, names, names_line(model, theme, names.width));
    palette::draw(model, theme, frame, body);
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
    draw_line(frame, phase, top_lines::phase(model, theme, now).into());
    draw_line(frame, armed, top_lines::armed(model, theme, now).into());
    draw_line(frame, countdown, top_lines::countdown(model, theme, now).into());
    draw_line(frame, link, top_lines::link(model, theme, now));
    draw_line(frame, abort, Line::styled(top_lines::abort_key(model), theme.style(TextRole::Key)));
}

/// Says that the page shows the past, and for how long.
fn past_line(looks: LookBack, shown_at: Duration, theme: Theme, now: Duration) -> Line<'static> {
    let ago_s = now.saturating_sub(shown_at).as_secs_f64();
    let left_s = looks.until.saturating_sub(now).as_secs();
    let words = format!(
        " PAST: {ago_s:.1} s ago. Live again in {left_s} s, on any alarm, or with 0. Left Right move"
    );
    Line::styled(words, theme.style(TextRole::Alarm))
}

/// Keys and names of the pages, the shown one in brackets, and whether it is held.
fn names_line(model: &Model, theme: Theme, columns: u16) -> Line<'static> {
    let shown = model.page();
    let every = columns >= EVERY_NAME_COLUMNS;
    let lettered = Page::LETTERED.contains(&shown);
    let mut spans = Vec::new();
    for page in Page::all() {
        let is_shown = page == shown.keyed();
        if !every && !is_shown && Page::LETTERED.contains(&page) {
            continue;
        }
        let (left, right, role) =
            if is_shown { ("[", "]", TextRole::Key) } else { (" ", "", TextRole::Label) };
        // Ascent and descent share a key.
        let name = if is_shown { shown.name() } else { page.name() };
        let key = model.settings.keys.name(Act::Show(page));
        spans.push(Span::styled(format!("{left}{key}{name}{right}"), theme.style(role)));
    }
    if every || !lettered {
        let key = model.settings.keys.name(Act::Palette);
        spans.push(Span::styled(format!(" {key}more"), theme.style(TextRole::Label)));
    }
    let (word, role) = match model.pages.held {
        Some(_) if every || !lettered => (" HELD 0", TextRole::Caution),
        Some(_) => (" HELD", TextRole::Caution),
        None => (" auto", TextRole::Good),
    };
    spans.push(Span::styled(word, theme.style(role)));
    Line::from(spans)
}
