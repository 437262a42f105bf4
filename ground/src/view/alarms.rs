//! The alarm line: always in the same place, above the names of the screens.

use std::time::Duration;

use protocol::log::record::EventLevel;
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::text::{Line, Span};

use super::number::shortest;
use super::theme::{Role, Theme};
use crate::model::alarm::Alarm;
use crate::model::{Model, Playing};

/// The key that acknowledges the alarm of the line.
const KEY: &str = " Space: seen ";
/// Narrower than this, there is room for the alarm alone.
const KEY_FROM_COLUMNS: usize = 40;
/// Less of its text would say nothing.
const TEXT_COLUMNS_MIN: usize = 12;

/// Draws the foremost alarm; without one, what happened last. The key has a place of its own, which no text takes.
pub fn draw(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    if let Some(playing) = model.playing {
        return frame.render_widget(replay(playing, theme), area);
    }
    if let Some(alarm) = alarm(model, theme, now, usize::from(area.width)) {
        return frame.render_widget(alarm, area);
    }
    let last = model.events.newest(1).next().map_or_else(Line::default, |event| {
        let role = if event.level == EventLevel::Info { Role::Label } else { Role::Plain };
        let head = format!(" {:.1} ", event.at.as_secs_f64());
        Line::styled(format!("{head}{}{}", event.mark().trim_start(), event.text), theme.style(role))
    });
    frame.render_widget(last, area);
}

/// Where a replay is, and its keys.
pub fn replay(playing: Playing, theme: Theme) -> Line<'static> {
    let (at, of) = (playing.position.as_secs_f64(), playing.length.as_secs_f64());
    let state = if playing.paused { "PAUSED" } else { "plays" };
    Line::styled(
        format!(
            " REPLAY {state} {at:.1} of {of:.1} s x{}  Space  Left Right 5 s  [ ] phase  + -",
            shortest(playing.speed)
        ),
        theme.style(Role::Title),
    )
}

/// The foremost alarm, its age and how many more there are. The text is cut to what they leave; while it is new, the key that
/// acknowledges it stands at the end of the line, cut by nothing.
pub fn alarm(model: &Model, theme: Theme, now: Duration, columns: usize) -> Option<Line<'static>> {
    let alarm = model.alarms.foremost()?;
    let more = match model.alarms.list().len() {
        1 => String::new(),
        count => format!(" (+{})", count - 1),
    };
    let key = if alarm.acknowledged || columns < KEY_FROM_COLUMNS { "" } else { KEY };
    let State { word, age, role } = state(alarm, now);
    let taken = 1 + word.len() + 1 + 1 + age.len() + more.len() + key.len();
    // On the narrowest screens the words come before their age.
    let room = columns.saturating_sub(taken).max(TEXT_COLUMNS_MIN);
    let text = cut(&alarm.text, room);
    let line = format!(" {word} {text} {age}{more}");
    let columns = columns.saturating_sub(key.len());
    let mut spans = vec![Span::styled(format!("{line:<columns$}"), theme.style(role))];
    if !key.is_empty() {
        spans.push(Span::styled(key, theme.style(Role::Key)));
    }
    Some(Line::from(spans))
}

/// What is true of an alarm now.
pub struct State {
    /// Whether it holds, and whether a person has seen it.
    pub word: &'static str,
    /// For how long, or since when no more. Whole seconds: nobody reads tenths of them here.
    pub age: String,
    /// How it looks.
    pub role: Role,
}

/// What is true of an alarm now, in words.
pub fn state(alarm: &Alarm, now: Duration) -> State {
    let since = |at: Duration| now.saturating_sub(at).as_secs();
    let (word, role) = match alarm.ended_at {
        None if alarm.acknowledged => ("alarm seen:", Role::Caution),
        None => ("ALARM", Role::Alarm),
        Some(_) if alarm.past => ("past alarm:", Role::Caution),
        Some(_) => ("ended alarm:", Role::Caution),
    };
    let age = match alarm.ended_at {
        None => format!("{} s", since(alarm.raised_at)),
        Some(at) => format!("ended {} s ago", since(at)),
    };
    State { word, age, role }
}

/// So many columns of a text; what is cut ends in a mark.
pub fn cut(text: &str, columns: usize) -> String {
    if text.chars().count() <= columns {
        return text.to_owned();
    }
    let kept: String = text.chars().take(columns.saturating_sub(2)).collect();
    format!("{kept}..")
}
