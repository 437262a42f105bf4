//! The newest events, wrapped to the width of the list.

use protocol::log::record::EventLevel;
use ratatui::text::{Line, Span};

use super::CUT_MARK;
use super::theme::{TextRole, Theme};
use crate::model::Model;
use crate::model::events::Event;

/// Columns before the text of an event: time, speaker and mark.
const BEFORE_TEXT: usize = 18;
/// Narrower than this, a text is cut rather than wrapped.
const WRAP_COLUMNS_MIN: usize = 20;

/// The newest events, oldest first, in this many lines of this width. Long texts wrap, because the end of a refusal
/// is its reason.
pub fn events(model: &Model, theme: Theme, columns: usize, rows: usize) -> Vec<Line<'static>> {
    chosen(model, |_| true, theme, columns, rows)
}

/// The same of those that the crew's filter lets pass, by their text or their speaker.
pub fn filtered(model: &Model, theme: Theme, columns: usize, rows: usize) -> Vec<Line<'static>> {
    let pages = &model.pages;
    let passes = |event: &Event| pages.lets_pass(&event.text) || pages.lets_pass(event.speaker.name());
    chosen(model, passes, theme, columns, rows)
}

fn chosen(
    model: &Model,
    passes: impl Fn(&Event) -> bool,
    theme: Theme,
    columns: usize,
    rows: usize,
) -> Vec<Line<'static>> {
    let text_columns = columns.saturating_sub(BEFORE_TEXT);
    let of_events: Vec<Vec<Line>> = model
        .events
        .newest(rows)
        .filter(|event| passes(event))
        .map(|event| {
            let role = match event.level {
                EventLevel::Info => TextRole::Plain,
                EventLevel::Warning => TextRole::Caution,
                EventLevel::Error | EventLevel::Fatal => TextRole::Alarm,
            };
            let head = format!("{:>7.1} {:<7} ", event.at.as_secs_f64(), event.speaker.name());
            let mark = event.mark();
            let mut pieces = wrap(&event.text, text_columns).into_iter();
            let first = pieces.next().unwrap_or_default();
            let first = Line::from(vec![
                Span::styled(head, theme.style(TextRole::Label)),
                Span::styled(format!("{mark}{first}"), theme.style(role)),
            ]);
            let rest = pieces.map(move |piece| {
                Line::from(vec![Span::raw(" ".repeat(BEFORE_TEXT)), Span::styled(piece, theme.style(role))])
            });
            std::iter::once(first).chain(rest).collect()
        })
        .collect();
    newest_lines(of_events, columns, rows)
}

/// As many of the last lines as there are rows. If the newest event alone has more, its beginning stays, with a mark where it
/// is cut.
fn newest_lines(mut events: Vec<Vec<Line<'static>>>, columns: usize, rows: usize) -> Vec<Line<'static>> {
    if let Some(newest) = events.last_mut().filter(|newest| newest.len() > rows) {
        newest.truncate(rows);
        let cut = newest.last_mut().map(|line| (line.width(), line.spans.last_mut()));
        if let Some((width, Some(text))) = cut {
            let mut words = text.content.to_string();
            if width >= columns {
                words.pop();
            }
            words.push(CUT_MARK);
            text.content = words.into();
        }
    }
    let mut lines = events.concat();
    lines.drain(..lines.len().saturating_sub(rows));
    lines
}

/// Breaks a text at spaces; a word longer than a line is broken at the end of the line.
fn wrap(text: &str, columns: usize) -> Vec<String> {
    if columns < WRAP_COLUMNS_MIN {
        return vec![text.to_owned()];
    }
    let mut lines = Vec::new();
    let (mut line, mut used) = (String::new(), 0);
    for word in text.split(' ') {
        let length = word.chars().count();
        if used > 0 && used + 1 + length > columns {
            lines.push(std::mem::take(&mut line));
            used = 0;
        } else if used > 0 {
            line.push(' ');
            used += 1;
        }
        for c in word.chars() {
            if used == columns {
                lines.push(std::mem::take(&mut line));
                used = 0;
            }
            line.push(c);
            used += 1;
        }
    }
    lines.push(line);
    lines
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::model::Settings;
    use crate::model::events::Speaker;
    use crate::view::theme::Palette;

    #[test]
    fn the_newest_event_keeps_its_beginning() {
        let mut model = Model::new(Settings::on_screen("udpin:127.0.0.1:14550"));
        let at = Duration::from_secs(7);
        model.events.push(at, Speaker::Vehicle, EventLevel::Info, "SAFED".to_owned());
        let text = "arming refused: pin: found in the vehicle".to_owned();
        model.events.push(at, Speaker::Vehicle, EventLevel::Warning, text);
        let theme = Theme { palette: Palette::None, ascii: false };
        let shown = |rows| -> Vec<String> {
            events(&model, theme, BEFORE_TEXT + 20, rows).iter().map(Line::to_string).collect()
        };
        let gap = " ".repeat(BEFORE_TEXT);
        let whole = ["    7.0 vehicle ! arming refused: pin:", &format!("{gap}found in the vehicle")];
        assert_eq!(shown(0), [""; 0]);
        assert_eq!(shown(1), ["    7.0 vehicle ! arming refused: pin…"]);
        assert_eq!(shown(2), whole);
        assert_eq!(shown(3), ["    7.0 vehicle   SAFED", whole[0], whole[1]]);
    }

    #[test]
    fn texts_wrap_at_spaces_and_keep_every_character() {
        assert_eq!(wrap("one two", 20), ["one two"]);
        assert_eq!(wrap("arming refused: pin: found in", 20), ["arming refused: pin:", "found in"]);
        assert_eq!(wrap(&"x".repeat(45), 20).concat().len(), 45);
        assert_eq!(wrap("", 20), [""]);
    }
}
