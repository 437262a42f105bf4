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
const FRONT_COLUMNS: usize = 9;

/// How long the reason why a step was not signed stands below the steps.
const REFUSAL_SHOWN: Duration = Duration::from_secs(15);

/// How far the checklist is, as a title.
pub fn title(model: &Model, now: Duration) -> String {
    let (done, all) = model.steps_done(now).unwrap_or_default();
    let keys = &model.settings.keys;
    let [sign, void] = [Act::SignStep, Act::VoidStep].map(|act| keys.name(act));
    format!("Checklist {done} of {all}: {sign} signs, {void} voids")
}

/// The steps around the chosen one, on at most this many rows; below them who signs the chosen one, or who did.
pub fn rows(
    model: &Model,
    theme: Theme,
    now: Duration,
    (columns, rows): (usize, usize),
) -> Vec<Line<'static>> {
    let (Some(list), Some(chosen)) = (&model.checklist, model.chosen_step(now)) else { return Vec::new() };
    let steps: Vec<Vec<Line>> = list
        .steps
        .iter()
        .enumerate()
        .map(|(place, step)| row(model, (place, step), place == chosen, theme, now, columns))
        .collect();
    let room = rows.saturating_sub(1);
    // Before the chosen step at most half of the rows, unless the end of the list leaves more.
    let mut first = chosen;
    let taken = |from: usize, to: usize| steps[from..to].iter().map(Vec::len).sum::<usize>();
    while first > 0
        && taken(first - 1, chosen + 1) <= room
        && (taken(first - 1, chosen) <= room / 2 || taken(first - 1, steps.len()) <= room)
    {
        first -= 1;
    }
    let mut lines: Vec<Line> = Vec::new();
    for step in steps.into_iter().skip(first) {
        if lines.len() + step.len() > room {
            break;
        }
        lines.extend(step);
    }
    let refused = model.sign_refused.as_ref().filter(|(_, at)| now.saturating_sub(*at) < REFUSAL_SHOWN);
    lines.push(match refused {
        Some((why, _)) => Line::styled(format!(" {why}"), theme.style(TextRole::Caution)),
        None => Line::styled(format!(" {}", below(&list.steps[chosen])), theme.style(TextRole::Label)),
    });
    lines
}

/// A step; long words continue on further lines.
fn row(
    model: &Model,
    (place, step): (usize, &Step),
    is_chosen: bool,
    theme: Theme,
    now: Duration,
    columns: usize,
) -> Vec<Line<'static>> {
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
    let room = columns.saturating_sub(FRONT_COLUMNS + value.chars().count()).max(1);
    let mut parts = wrapped(&step.words, room).into_iter();
    let first = parts.next().unwrap_or_default();
    let mark = if is_chosen { ">" } else { " " };
    let words_style = theme.style(if is_chosen { TextRole::Title } else { TextRole::Plain });
    let front = Line::from(vec![
        Span::styled(format!("{mark}{word} "), theme.style(role)),
        Span::styled(format!("{:>2} {first:<room$}", place + 1), words_style),
        Span::styled(value, theme.style(TextRole::Plain)),
    ]);
    let more = parts.map(|part| Line::styled(format!("{:FRONT_COLUMNS$}{part}", ""), words_style));
    std::iter::once(front).chain(more).collect()
}

/// The words on lines of at most this many columns; only a longer word is split.
pub fn wrapped(words: &str, room: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in words.split_whitespace() {
        for part in word.chars().collect::<Vec<_>>().chunks(room) {
            let part: String = part.iter().collect();
            let line = lines
                .last_mut()
                .filter(|line| line.is_empty() || line.chars().count() + 1 + part.chars().count() <= room);
            match line {
                Some(line) if line.is_empty() => line.push_str(&part),
                Some(line) => {
                    line.push(' ');
                    line.push_str(&part);
                }
                None => lines.push(part),
            }
        }
    }
    lines
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
