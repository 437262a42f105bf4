//! The panel of the touchdown, predicted or reached, with its limits.

use std::time::Duration;

use ratatui::text::{Line, Span};

use super::limit_bar;
use super::limit_rows::{LimitRow, decimals, limit_rows};
use super::number::{age_mark, fixed};
use super::theme::{TextRole, Theme};
use crate::model::Model;
use crate::model::judgement::{LEGS, Standard};
use crate::model::touchdown::Touchdown;

/// Title and rows: the verdict once there is one, before that the prediction.
pub fn panel(model: &Model, theme: Theme, now: Duration) -> (&'static str, Vec<Line<'static>>) {
    if let Some(verdict) = model.vehicle.verdict {
        let mut rows = limit_lines(model, &verdict.value.touchdown, theme, " ", TextRole::Plain);
        let (word, role) = verdict_word(verdict.value.landed);
        rows.push(Line::styled(word, theme.style(role)));
        let title = match model.vehicle.limits.as_ref().and_then(Standard::of) {
            Some(standard) if standard == LEGS => "Verdict by the legs",
            Some(_) => "Verdict by Table 2",
            None => "Verdict",
        };
        return (title, rows);
    }
    let Some(prediction) = model.vehicle.prediction else {
        return ("Touchdown predicted", vec![Line::styled("no prediction", theme.style(TextRole::Label))]);
    };
    let (mark, role) = age_mark(&prediction, now);
    let mut rows = limit_lines(model, &prediction.value.touchdown, theme, mark, role);
    let in_s = model.vehicle.touchdown_in_s(now);
    let in_s = in_s.map_or_else(|| "--".to_owned(), |left| fixed(left.value, 1));
    rows.push(Line::from(vec![
        Span::styled("in      ", theme.style(TextRole::Label)),
        Span::styled(format!("{mark}{in_s:>6}"), theme.style(role)),
        Span::styled(" s", theme.style(TextRole::Label)),
    ]));
    rows.push(match prediction.value.touchdown.violations() {
        None => Line::styled("inside every limit", theme.style(TextRole::Good)),
        Some(names) => Line::styled(format!("OUTSIDE {names}"), theme.style(TextRole::Alarm)),
    });
    ("Touchdown predicted", rows)
}

/// The same with a bar for each limit that says how much of it is used, where there is room beside the rows.
pub fn panel_with_bars(
    model: &Model,
    theme: Theme,
    now: Duration,
    columns: usize,
) -> (&'static str, Vec<Line<'static>>) {
    let (title, mut rows) = panel(model, theme, now);
    let vehicle = &model.vehicle;
    let judged = vehicle.verdict.map(|verdict| verdict.value.touchdown);
    let touchdown = judged.or_else(|| vehicle.prediction.map(|prediction| prediction.value.touchdown));
    let (Some(touchdown), Some(limits)) = (touchdown, vehicle.limits.as_ref()) else { return (title, rows) };
    let used = limit_bar::used(&touchdown, limits);
    let widest = rows.iter().take(used.len()).map(Line::width).max().unwrap_or(0);
    let room = columns.saturating_sub(widest);
    if room >= limit_bar::COLUMNS_MIN {
        for (row, used) in rows.iter_mut().zip(used) {
            let gap = widest - row.width();
            row.spans.push(Span::raw(" ".repeat(gap)));
            row.spans.push(limit_bar::bar(used, room, theme));
        }
    }
    (title, rows)
}

pub fn verdict_word(landed: bool) -> (&'static str, TextRole) {
    if landed { ("LANDED inside every limit", TextRole::Good) } else { ("NOT LANDED", TextRole::Alarm) }
}

fn limit_lines(
    model: &Model,
    touchdown: &Touchdown,
    theme: Theme,
    mark: &'static str,
    role: TextRole,
) -> Vec<Line<'static>> {
    let rows = limit_rows(touchdown, model.vehicle.limits.as_ref());
    let line = |row: &LimitRow| {
        let (word, word_role) = if row.kept { ("ok", TextRole::Good) } else { ("NO", TextRole::Alarm) };
        Line::from(vec![
            Span::styled(word, theme.style(word_role)),
            Span::styled(format!(" {:<5}", row.name), theme.style(TextRole::Label)),
            Span::styled(format!("{mark}{:>6}", fixed(row.value, decimals(row.value))), theme.style(role)),
            Span::styled(
                format!(" {} {}", theme.either_side(&row.limit), row.unit),
                theme.style(TextRole::Label),
            ),
        ])
    };
    rows.iter().map(line).collect()
}
