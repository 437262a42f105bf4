//! The alarm line: always in the same place, above the names of the screens.

use std::time::Duration;

use protocol::log::record::EventLevel;
use ratatui::text::Line;

use super::number::{seconds, shortest};
use super::theme::{Role, Theme};
use crate::model::{Model, Playing};

/// The foremost alarm; without one, what happened last.
pub fn line(model: &Model, theme: Theme, now: Duration) -> Line<'static> {
    if let Some(playing) = model.playing {
        return replay(playing, theme);
    }
    if let Some(alarm) = alarm(model, theme, now) {
        return alarm;
    }
    model.events.newest(1).next().map_or_else(Line::default, |event| {
        let role = if event.level == EventLevel::Info { Role::Label } else { Role::Plain };
        let head = format!(" {:.1} ", event.at.as_secs_f64());
        Line::styled(format!("{head}{}{}", event.mark().trim_start(), event.text), theme.style(role))
    })
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

/// The foremost alarm, how many more there are, and the key that acknowledges them.
pub fn alarm(model: &Model, theme: Theme, now: Duration) -> Option<Line<'static>> {
    let alarm = model.alarms.foremost()?;
    let more = match model.alarms.list().len() {
        1 => String::new(),
        count => format!(" (+{} more)", count - 1),
    };
    let age = seconds(now.saturating_sub(alarm.raised_at));
    let line = if alarm.past && !alarm.acknowledged {
        let text = format!(" past alarm: {}, raised {age} ago{more}  Space: seen", alarm.text);
        Line::styled(text, theme.style(Role::Caution))
    } else if alarm.acknowledged {
        Line::styled(format!(" alarm seen: {} {age}{more}", alarm.text), theme.style(Role::Caution))
    } else {
        let over = if alarm.active { "" } else { ", over" };
        let text = format!(" ALARM {}{over} {age}{more}  Space: seen", alarm.text);
        Line::styled(text, theme.style(Role::Alarm))
    };
    Some(line)
}
