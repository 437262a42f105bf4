//! The alarm line above the page names, with the foremost alarm or the newest event.

use std::time::Duration;

use protocol::log::record::EventLevel;
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::text::{Line, Span};

use super::draw_line;
use super::number::shortest;
use super::theme::{TextRole, Theme};
use crate::model::alarm::Alarm;
use crate::model::{Model, Playback};

/// The key that acknowledges the shown alarm.
const KEY: &str = " Space: seen ";
/// On a narrower line the key is left out.
const KEY_FROM_COLUMNS: usize = 40;
/// The shortest useful part of a text.
const TEXT_COLUMNS_MIN: usize = 12;

/// Draws the foremost alarm; without one, the newest event.
pub fn draw(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    if let Some(playing) = &model.playing {
        return draw_line(frame, area, replay(playing, theme));
    }
    if let Some(alarm) = alarm(model, theme, now, usize::from(area.width)) {
        return draw_line(frame, area, alarm);
    }
    let last = model.events.newest(1).next().map_or_else(Line::default, |event| {
        let role = if event.level == EventLevel::Info { TextRole::Label } else { TextRole::Plain };
        let head = format!(" {:.1} ", event.at.as_secs_f64());
        Line::styled(format!("{head}{}{}", event.mark().trim_start(), event.text), theme.style(role))
    });
    draw_line(frame, area, last);
}

/// The position of a replay, and its keys.
pub fn replay(playing: &Playback, theme: Theme) -> Line<'static> {
    let (at, of) = (playing.position.as_secs_f64(), playing.length.as_secs_f64());
    let state = if playing.paused { "PAUSED" } else { "plays" };
    Line::styled(
        format!(
            " REPLAY {state} {at:.1} of {of:.1} s x{}  Space  Left Right 5 s  [ ] phase  + -",
            shortest(playing.speed)
        ),
        theme.style(TextRole::Title),
    )
}

/// The foremost alarm, its age and the number of further alarms. Only the text of the alarm is shortened; the key
/// that acknowledges a new alarm is never cut.
pub fn alarm(model: &Model, theme: Theme, now: Duration, columns: usize) -> Option<Line<'static>> {
    let alarm = model.alarms.foremost()?;
    let more = match model.alarms.list().len() {
        1 => String::new(),
        count => format!(" (+{})", count - 1),
    };
    let key = if alarm.acknowledged || columns < KEY_FROM_COLUMNS { "" } else { KEY };
    let State { word, age, role } = state(alarm, now);
    let taken = 1 + word.len() + 1 + 1 + age.len() + more.len() + key.len();
    // On the narrowest screens the text is more important than its age.
    let room = columns.saturating_sub(taken).max(TEXT_COLUMNS_MIN);
    let text = cut(&alarm.text, room);
    let line = format!(" {word} {text} {age}{more}");
    let columns = columns.saturating_sub(key.len());
    let mut spans = vec![Span::styled(format!("{line:<columns$}"), theme.style(role))];
    if !key.is_empty() {
        spans.push(Span::styled(key, theme.style(TextRole::Key)));
    }
    Some(Line::from(spans))
}

/// The present state of an alarm, for showing.
pub struct State {
    /// Says whether the alarm holds and whether a person has seen it.
    pub word: &'static str,
    /// How long the alarm has held, or how long ago it ended; in whole seconds.
    pub age: String,
    pub role: TextRole,
}

/// Describes the present state of an alarm.
pub fn state(alarm: &Alarm, now: Duration) -> State {
    let since = |at: Duration| now.saturating_sub(at).as_secs();
    let (word, role) = match alarm.ended_at {
        None if alarm.acknowledged => ("alarm seen:", TextRole::Caution),
        None => ("ALARM", TextRole::Alarm),
        Some(_) if alarm.past => ("past alarm:", TextRole::Caution),
        Some(_) => ("ended alarm:", TextRole::Caution),
    };
    let age = match alarm.ended_at {
        None => format!("{} s", since(alarm.raised_at)),
        Some(at) => format!("ended {} s ago", since(at)),
    };
    State { word, age, role }
}

/// Shortens a text to this many columns; a shortened text ends in `..`. Whole words are kept, unless that would lose more
/// than a third of what fits.
pub fn cut(text: &str, columns: usize) -> String {
    if text.chars().count() <= columns {
        return text.to_owned();
    }
    let room = columns.saturating_sub(2);
    let fits: String = text.chars().take(room).collect();
    let ends_a_word = text.chars().nth(room).is_none_or(|next| next == ' ');
    let words = fits.rsplit_once(' ').map(|(words, _)| words).filter(|_| !ends_a_word);
    let kept = words.filter(|words| 3 * words.chars().count() >= 2 * room).unwrap_or(&fits);
    format!("{}..", kept.trim_end())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_is_cut_behind_a_whole_word() {
        let text = "LINK LOST: the vehicle is not heard";
        assert_eq!(cut(text, 35), text);
        assert_eq!(cut(text, 34), "LINK LOST: the vehicle is not..");
        assert_eq!(cut(text, 31), "LINK LOST: the vehicle is not..");
        assert_eq!(cut(text, 30), "LINK LOST: the vehicle is..");
        assert_eq!(cut("ABORT LATCHED on the vehicle", 12), "ABORT LATC..");
        assert_eq!(cut("no-whole-word-fits", 12), "no-whole-w..");
        assert_eq!(cut("a no-whole-word-fits", 12), "a no-whole..");
    }
}
