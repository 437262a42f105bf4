//! The touchdown, predicted or reached, against its limits.

use std::time::Duration;

use ratatui::text::{Line, Span};

use super::number::{age_mark, fixed};
use super::theme::{Role, Theme};
use super::verdict;
use crate::limits::Touchdown;
use crate::model::Model;
use crate::model::judgement::LEGS;

/// The panel's title and rows: the verdict once there is one, the prediction before.
pub fn panel(model: &Model, theme: Theme, now: Duration) -> (&'static str, Vec<Line<'static>>) {
    if let Some(verdict) = model.vehicle.verdict {
        let mut rows = limit_rows(model, &verdict.value.touchdown, theme, " ", Role::Plain);
        let (word, role) = verdict_word(verdict.value.landed);
        rows.push(Line::styled(word, theme.style(role)));
        let title = match verdict::own(model.vehicle.limits.as_ref()) {
            Some(standard) if standard == LEGS => "Verdict by the legs",
            Some(_) => "Verdict by Table 2",
            None => "Verdict",
        };
        return (title, rows);
    }
    let Some(prediction) = model.vehicle.prediction else {
        return ("Touchdown predicted", vec![Line::styled("no prediction", theme.style(Role::Label))]);
    };
    let (mark, role) = age_mark(&prediction, now);
    let mut rows = limit_rows(model, &prediction.value.touchdown, theme, mark, role);
    let in_s = model.vehicle.touchdown_in_s(now);
    let in_s = in_s.map_or_else(|| "--".to_owned(), |left| fixed(left.value, 1));
    rows.push(Line::from(vec![
        Span::styled("in      ", theme.style(Role::Label)),
        Span::styled(format!("{mark}{in_s:>6}"), theme.style(role)),
        Span::styled(" s", theme.style(Role::Label)),
    ]));
    rows.push(match prediction.value.touchdown.violations() {
        None => Line::styled("inside every limit", theme.style(Role::Good)),
        Some(names) => Line::styled(format!("OUTSIDE {names}"), theme.style(Role::Alarm)),
    });
    ("Touchdown predicted", rows)
}

/// The verdict in the words that decide.
pub fn verdict_word(landed: bool) -> (&'static str, Role) {
    if landed { ("LANDED inside every limit", Role::Good) } else { ("NOT LANDED", Role::Alarm) }
}

/// Six characters with the sign, whatever the size: three decimals decide about a speed, two about an angle.
pub(super) fn decimals(value: f64) -> usize {
    match value.abs() {
        0.0..10.0 => 3,
        10.0..100.0 => 2,
        _ => 1,
    }
}

fn limit_rows(
    model: &Model,
    touchdown: &Touchdown,
    theme: Theme,
    mark: &'static str,
    role: Role,
) -> Vec<Line<'static>> {
    let rows = touchdown.rows(model.vehicle.limits.as_ref());
    let line = |row: &crate::limits::LimitRow| {
        let (word, word_role) = if row.kept { ("ok", Role::Good) } else { ("NO", Role::Alarm) };
        Line::from(vec![
            Span::styled(word, theme.style(word_role)),
            Span::styled(format!(" {:<5}", row.name), theme.style(Role::Label)),
            Span::styled(format!("{mark}{:>6}", fixed(row.value, decimals(row.value))), theme.style(role)),
            Span::styled(
                format!(" {} {}", theme.either_side(&row.limit), row.unit),
                theme.style(Role::Label),
            ),
        ])
    };
    rows.iter().map(line).collect()
}
