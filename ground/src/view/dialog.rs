//! The text of the open dialog, and its box.

use std::time::Duration;

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::text::Line;
use ratatui::widgets::{Block, Clear};

use super::draw_lines;
use super::theme::{TextRole, Theme};
use crate::model::dialog::{ARM_WORD, Dialog, QUIT_WORD, START_WORD};
use crate::model::words;
use crate::model::{Model, Role};

const BOX_COLUMNS: u16 = 68;
const ANY_OTHER_KEY: &str = "Any other key cancels. Nothing is sent before Enter.";

/// Title and lines of the open dialog; `None` if none is open.
pub fn lines(model: &Model, theme: Theme, now: Duration) -> Option<(&'static str, Vec<Line<'static>>)> {
    let left = model.dialog.until().map_or(0.0, |until| until.saturating_sub(now).as_secs_f64());
    let plain = |text: String| Line::styled(text, theme.style(TextRole::Plain));
    let strong = |text: String| Line::styled(text, theme.style(TextRole::Caution));
    let dialog = match &model.dialog {
        Dialog::Closed => return None,
        Dialog::Arm { typed, .. } => {
            let mut lines = vec![
                strong(format!("Type {ARM_WORD} and Enter within {left:.0} s:  [{typed:<3}]")),
                plain(ANY_OTHER_KEY.to_owned()),
            ];
            lines.extend(checks(model, theme));
            ("ARM, step 2 of 2", lines)
        }
        Dialog::Start { typed, .. } => (
            "START the countdown",
            vec![
                strong(format!("Type {START_WORD} and Enter within {left:.0} s:  [{typed:<5}]")),
                plain(ANY_OTHER_KEY.to_owned()),
            ],
        ),
        Dialog::Disarm { .. } => (
            "DISARM",
            vec![
                strong(format!("Enter within {left:.0} s disarms.")),
                plain("Any other key cancels.".to_owned()),
            ],
        ),
        Dialog::Quit { typed, .. } => {
            let goes_on = match model.settings.role {
                Role::Station if model.settings.demonstration => "Quitting ends the demonstration.",
                Role::Station => "The station continues without a screen: `ground attach` shows it.",
                _ => "The station continues; a countdown is held once nobody can command.",
            };
            (
                "QUIT although armed or in flight",
                vec![
                    strong(format!("Type {QUIT_WORD} and Enter within {left:.0} s:  [{typed:<4}]")),
                    plain(goes_on.to_owned()),
                    plain("Quitting neither disarms nor aborts. Any other key cancels.".to_owned()),
                ],
            )
        }
    };
    Some(dialog)
}

fn checks(model: &Model, theme: Theme) -> Vec<Line<'static>> {
    let Some(status) = model.vehicle.status.as_ref() else {
        return vec![Line::styled(
            "The vehicle has not reported its checks.",
            theme.style(TextRole::Caution),
        )];
    };
    let failing = words::failed_checks(status.value.checks_failed);
    if failing.is_empty() {
        return vec![Line::styled("Every arming check passes.", theme.style(TextRole::Good))];
    }
    let mut lines =
        vec![Line::styled("Failing checks; the vehicle will refuse:", theme.style(TextRole::Alarm))];
    lines.extend(
        failing.into_iter().map(|name| Line::styled(format!("  NO {name}"), theme.style(TextRole::Caution))),
    );
    lines
}

/// Draws the open dialog in the middle of an area.
pub fn draw(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let Some((title, lines)) = lines(model, theme, now) else { return };
    let width = BOX_COLUMNS.min(area.width);
    let height = u16::try_from(lines.len()).unwrap_or(u16::MAX).saturating_add(2).min(area.height);
    let at =
        Rect { x: area.x + (area.width - width) / 2, y: area.y + (area.height - height) / 2, width, height }
            .intersection(frame.area());
    let block = Block::bordered().title(Line::styled(format!(" {title} "), theme.style(TextRole::Title)));
    let inside = block.inner(at);
    frame.render_widget(Clear, at);
    frame.buffer_mut().set_style(at, theme.ground());
    frame.render_widget(block, at);
    let padded = Rect { x: inside.x + 1, width: inside.width.saturating_sub(2), ..inside };
    draw_lines(frame, padded, &lines);
}
