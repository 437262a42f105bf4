//! The bar of the whole flight: its phases along time, warnings and errors, and the shown moment.

use std::time::Duration;

use protocol::dialect::TdPhase;
use protocol::log::record::EventLevel;
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::Modifier;
use ratatui::text::{Line, Span};

use super::draw_line;
use super::theme::{TextRole, Theme};
use crate::model::Model;
use crate::model::vehicle::is_on_pad;
use crate::model::words;

/// How long the bar of a flight in progress is, so that it is rarely drawn anew, s.
const LENGTHS_S: [f64; 8] = [30.0, 60.0, 120.0, 300.0, 600.0, 1_800.0, 7_200.0, 36_000.0];
/// The mark of the shown moment, of a warning or an error, and of the time that has passed.
const NOW: char = '•';
const EVENT: char = '!';
const PASSED: char = '─';

/// A part of the flight that the bar shows.
struct Shown {
    from: Duration,
    length_s: f64,
}

/// Whether there is a flight to show.
pub fn is_shown(model: &Model) -> bool {
    model.playing.is_some() || first(model).is_some()
}

/// When the flight began.
fn first(model: &Model) -> Option<Duration> {
    model.history.timeline.iter().find(|(phase, _)| !is_on_pad(*phase)).map(|(_, at)| *at)
}

/// Draws the bar up to the present, with a mark at the shown moment.
pub fn draw(
    model: &Model,
    theme: Theme,
    (now, shown_at): (Duration, Duration),
    frame: &mut Frame,
    area: Rect,
) {
    if area.height > 0 && is_shown(model) {
        draw_line(frame, area, line(model, theme, (now, shown_at), usize::from(area.width)));
    }
}

fn line(model: &Model, theme: Theme, (now, shown_at): (Duration, Duration), columns: usize) -> Line<'static> {
    let columns = columns.saturating_sub(2).max(1);
    let (phases, span): (&[(TdPhase, Duration)], Shown) = if let Some(playing) = &model.playing {
        let length_s = playing.length.as_secs_f64().max(1.0);
        (&playing.phases, Shown { from: Duration::ZERO, length_s })
    } else {
        let from = first(model).unwrap_or(now);
        let passed_s = now.saturating_sub(from).as_secs_f64();
        let length_s = LENGTHS_S.into_iter().find(|length_s| passed_s < *length_s).unwrap_or(passed_s);
        (&model.history.timeline, Shown { from, length_s })
    };
    let column = |at: Duration| {
        let share = at.saturating_sub(span.from).as_secs_f64() / span.length_s;
        ((share * columns as f64) as usize).min(columns.saturating_sub(1))
    };
    let mut cells = vec![' '; columns];
    for cell in cells.iter_mut().take(column(now) + 1) {
        *cell = PASSED;
    }
    let mut free_from = 0;
    for (phase, at) in phases.iter().filter(|(phase, at)| !is_on_pad(*phase) || *at >= span.from) {
        let begin = column(*at);
        let name = words::phase(*phase);
        if begin < free_from || begin + name.len() >= columns {
            continue;
        }
        for (cell, letter) in cells[begin..].iter_mut().zip(name.chars()) {
            *cell = letter;
        }
        free_from = begin + name.len() + 1;
    }
    for event in model.events.newest(usize::MAX) {
        let cell = &mut cells[column(event.at).min(columns.saturating_sub(1))];
        if event.level != EventLevel::Info && event.at >= span.from && (*cell == PASSED || *cell == ' ') {
            *cell = EVENT;
        }
    }
    let here = column(shown_at);
    if let Some(cell) = cells.get_mut(here).filter(|cell| !cell.is_alphabetic()) {
        *cell = NOW;
    }
    let part = |cells: &[char], role| Span::styled(cells.iter().collect::<String>(), theme.style(role));
    let (before, rest) = cells.split_at(here);
    Line::from(vec![
        Span::raw(" "),
        part(before, TextRole::Plain),
        part(&rest[..1], TextRole::Key).patch_style(Modifier::REVERSED),
        part(&rest[1..], TextRole::Plain),
    ])
}
