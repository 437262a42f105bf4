//! The panel of the touchdown, predicted or reached, with its limits.

use std::time::Duration;

use ratatui::text::{Line, Span};

use super::limit_bar;
use super::limit_rows::{LimitRow, decimals, limit_rows};
use super::number::{age_mark, fixed};
use super::theme::{TextRole, Theme};
use crate::model::Model;
use crate::model::ending::Ending;
use crate::model::touchdown::{Touchdown, are_of_legs};

/// Title and rows: the verdict once there is one, before that the prediction. The last row says it in words.
pub fn panel(model: &Model, theme: Theme, now: Duration) -> (&'static str, Vec<Line<'static>>) {
    if let Some(verdict) = model.vehicle.verdict {
        let mut rows = limit_lines(model, &verdict.value.touchdown, theme, " ", TextRole::Plain);
        rows.extend(ending(model, now).map(|(ending, role)| Line::styled(ending.word(), theme.style(role))));
        let by_legs = model.vehicle.limits.as_ref().is_some_and(are_of_legs);
        return (if by_legs { "Verdict by the legs" } else { "Verdict" }, rows);
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

/// How the flight ended.
pub fn ending(model: &Model, now: Duration) -> Option<(Ending, TextRole)> {
    let ending = Ending::of(&model.vehicle, now)?;
    let role = match ending {
        Ending::Landed => TextRole::Good,
        Ending::UnderParachute => TextRole::Caution,
        Ending::Hard | Ending::Lost => TextRole::Alarm,
    };
    Some((ending, role))
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
            Span::styled(format!(" {:<8}", row.name), theme.style(TextRole::Label)),
            Span::styled(format!("{mark}{:>5}", fixed(row.value, decimals(row.value))), theme.style(role)),
            Span::styled(
                format!(" {} {}", theme.either_side(&row.limit), row.unit),
                theme.style(TextRole::Label),
            ),
        ])
    };
    rows.iter().map(line).collect()
}
