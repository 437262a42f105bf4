//! After the loss of the link in flight: where the vehicle probably is, marked as a prediction.

use std::time::Duration;

use ratatui::text::{Line, Span};

use super::number::{fixed, seconds};
use super::theme::{Role, Theme};
use crate::model::Model;
use crate::model::reckoning::reckon;

/// Whether only a prediction is left of the flight.
pub fn is_lost(model: &Model, now: Duration) -> bool {
    reckon(&model.vehicle, now).is_some()
}

/// The prediction's rows.
pub fn rows(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    let Some(at) = reckon(&model.vehicle, now) else { return Vec::new() };
    let row = |label: &str, value: f64| {
        Line::from(vec![
            Span::styled(format!(" {label:<6}"), theme.style(Role::Label)),
            Span::styled(
                format!("?{:>7} ±{} m", fixed(value, 1), fixed(at.error_m, 1)),
                theme.style(Role::Stale),
            ),
        ])
    };
    let source = if at.by_plan { "along the last plan" } else { "free fall; no plan" };
    vec![
        row("alt", at.altitude_m),
        row("x", at.x_m),
        Line::styled(format!(" {source}"), theme.style(Role::Label)),
        Line::styled(format!(" last heard {} ago", seconds(at.age)), theme.style(Role::Caution)),
    ]
}
