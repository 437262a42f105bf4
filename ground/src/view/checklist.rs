//! The checklist as rows: which step counts, who signed it, and the value found.

use std::time::Duration;

use ratatui::text::{Line, Span};

use super::number::fixed;
use super::theme::{TextRole, Theme};
use crate::model::Model;
use crate::model::act::Act;
use crate::model::checklist::{Mark, Step, StepState};
use crate::model::two_person::role_name;

/// Columns of the mark and the number.
const FRONT_COLUMNS: usize = 10;

/// How far the checklist is, as a title.
pub fn title(model: &Model, now: Duration) -> String {
    let (done, all) = model.steps_done(now).unwrap_or_default();
    let keys = &model.settings.keys;
    let [sign, void] = [Act::SignStep, Act::VoidStep].map(|act| keys.name(act));
    format!("Checklist {done} of {all}: {sign} signs, {void} voids")
}

/// The steps around the chosen one, at most this many; below them who signs the chosen one, or who did.
pub fn rows(
    model: &Model,
    theme: Theme,
    now: Duration,
    (columns, rows): (usize, usize),
) -> Vec<Line<'static>> {
    let (Some(list), Some(chosen)) = (&model.checklist, model.chosen_step(now)) else { return Vec::new() };
    let shown = rows.saturating_sub(1).max(1);
    let first = chosen.saturating_sub(shown / 2).min(list.steps.len().saturating_sub(shown));
    let steps = list.steps.iter().enumerate().skip(first).take(shown);
    let mut lines: Vec<Line> =
        steps.map(|(place, step)| row(model, (place, step), place == chosen, theme, now, columns)).collect();
    lines.push(Line::styled(format!(" {}", below(&list.steps[chosen])), theme.style(TextRole::Label)));
    lines
}

fn row(
    model: &Model,
    (place, step): (usize, &Step),
    is_chosen: bool,
    theme: Theme,
    now: Duration,
    columns: usize,
) -> Line<'static> {
    let (word, role) = match model.step_state(step, now) {
        StepState::Done => ("OK  ", TextRole::Good),
        StepState::Open => ("open", TextRole::Caution),
        StepState::Voided => ("VOID", TextRole::Alarm),
        StepState::Outside => ("NO  ", TextRole::Alarm),
        StepState::Unknown => ("?   ", TextRole::Alarm),
    };
    let value = step.value.as_ref().map_or_else(String::new, |limits| {
        let found = model.fresh(limits, now);
        let found = found.map_or_else(|| "--".to_owned(), |found| fixed(found, limits.quantity.decimals));
        format!(" {found} {}", limits.quantity.unit)
    });
    let room = columns.saturating_sub(FRONT_COLUMNS + value.chars().count());
    let words = cut(&step.words, room);
    let mark = if is_chosen { ">" } else { " " };
    let (words_role, number) = (if is_chosen { TextRole::Title } else { TextRole::Plain }, place + 1);
    Line::from(vec![
        Span::styled(format!("{mark}{word} "), theme.style(role)),
        Span::styled(format!("{number:>2} {words:<room$}"), theme.style(words_role)),
        Span::styled(value, theme.style(TextRole::Plain)),
    ])
}

fn cut(words: &str, room: usize) -> String {
    if words.chars().count() <= room {
        return words.to_owned();
    }
    words.chars().take(room.saturating_sub(1)).chain([super::CUT_MARK]).collect()
}

/// Who signs the step, or who did.
fn below(step: &Step) -> String {
    let limits = step
        .value
        .as_ref()
        .map_or_else(String::new, |limits| format!(": {} {}", limits.quantity.name, limits.words()));
    let who = step.role.map_or("anybody", role_name);
    match &step.mark {
        Mark::Open => format!("{who} signs{limits}"),
        Mark::Signed(signature) => format!("signed by {}, {}", name(&signature.by), clock(signature.unix_s)),
        Mark::Voided(signature) => {
            format!("voided by {}, {}; {who} signs", name(&signature.by), clock(signature.unix_s))
        }
    }
}

fn name(by: &str) -> &str {
    if by.is_empty() { "somebody" } else { by }
}

/// Hours and minutes of the day, UTC.
fn clock(unix_s: u64) -> String {
    format!("{:02}:{:02} UTC", unix_s / 3_600 % 24, unix_s / 60 % 60)
}
