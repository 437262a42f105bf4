//! The panel of the landing controller (NMPC).

use std::time::Duration;

use protocol::dialect::{TdControlLevel, TdSolverStatus};
use ratatui::text::{Line, Span};

use super::number::{age_mark, row};
use super::theme::{TextRole, Theme};
use crate::model::Model;
use crate::model::vehicle::Sample;
use crate::model::words;

/// The panel's rows.
pub fn rows(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    let controller = model.vehicle.controller.as_ref();
    let number = |value: Option<f64>| {
        value
            .zip(controller.map(|controller| controller.received_at))
            .map(|(value, received_at)| Sample { value, received_at })
    };
    let data = controller.map(|controller| &controller.value);
    let (mark, age_role) = controller.map_or((" ", TextRole::Label), |controller| age_mark(controller, now));
    let wide_text = |label: &str, text: String, role: TextRole| {
        let role = if age_role == TextRole::Stale { age_role } else { role };
        Line::from(vec![
            Span::styled(format!(" {label:<6}"), theme.style(TextRole::Label)),
            Span::styled(format!("{mark}{text:>17.17}"), theme.style(role)),
        ])
    };
    let level = data.map_or_else(|| "--".to_owned(), |d| words::lower_case(&d.level, "TD_CONTROL_LEVEL_"));
    let status =
        data.map_or_else(|| "--".to_owned(), |d| words::lower_case(&d.solver_status, "TD_SOLVER_STATUS_"));
    let kkt = data
        .map_or_else(|| "--".to_owned(), |d| format!("{:.1e} {:.1e}", d.kkt_stationarity, d.kkt_feasibility));
    let missed = data.is_some_and(|d| d.deadline_margin_us < 0);
    let margin = number(data.map(|d| f64::from(d.deadline_margin_us) / 1_000.0));
    vec![
        wide_text("level", level, data.map_or(TextRole::Label, |d| level_role(d.level))),
        wide_text("solver", status, data.map_or(TextRole::Label, |d| status_role(d.solver_status))),
        row(theme, "iterations", number(data.map(|d| f64::from(d.iterations))), 0, "", now),
        row(theme, "solve time", number(data.map(|d| f64::from(d.solve_time_us) / 1_000.0)), 2, "ms", now),
        row(theme, if missed { "MISSED BY" } else { "margin" }, margin, 2, "ms", now),
        row(theme, "cost", number(data.map(|d| f64::from(d.cost))), 1, "", now),
        wide_text("KKT", kkt, TextRole::Plain),
        row(theme, "thrust x", number(data.map(|d| f64::from(d.thrust_scale))), 3, "", now),
    ]
}

fn level_role(level: TdControlLevel) -> TextRole {
    match level {
        TdControlLevel::TD_CONTROL_LEVEL_CONVERGED => TextRole::Good,
        TdControlLevel::TD_CONTROL_LEVEL_BEST_FEASIBLE | TdControlLevel::TD_CONTROL_LEVEL_SHIFTED_PLAN => {
            TextRole::Caution
        }
        TdControlLevel::TD_CONTROL_LEVEL_STABILISER => TextRole::Alarm,
        _ => TextRole::Plain,
    }
}

fn status_role(status: TdSolverStatus) -> TextRole {
    match status {
        TdSolverStatus::TD_SOLVER_STATUS_CONVERGED => TextRole::Good,
        TdSolverStatus::TD_SOLVER_STATUS_NOT_RUN => TextRole::Plain,
        _ => TextRole::Caution,
    }
}
