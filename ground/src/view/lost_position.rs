//! The panel of the predicted position after the link is lost in flight.

use std::time::Duration;

use ratatui::text::{Line, Span};

use super::number::{fixed, seconds};
use super::theme::{TextRole, Theme};
use crate::model::Model;
use crate::model::dead_reckoning::{Basis, is_unheard, predict_position};

/// Whether the position of a vehicle in flight is stale.
pub fn is_lost(model: &Model, now: Duration) -> bool {
    is_unheard(&model.vehicle, now)
}

/// The rows of the prediction; none while the vehicle is heard.
pub fn rows(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    if !is_lost(model, now) {
        return Vec::new();
    }
    let Some(at) = predict_position(&model.vehicle, now) else {
        return vec![
            Line::styled(" position unknown:", theme.style(TextRole::Alarm)),
            Line::styled(" not heard since the pad", theme.style(TextRole::Caution)),
        ];
    };
    let row = |label: &str, value: f64| {
        Line::from(vec![
            Span::styled(format!(" {label:<6}pred"), theme.style(TextRole::Label)),
            Span::styled(
                theme.either_side(&format!("{:>7} ±{} m", fixed(value, 1), fixed(at.error_m, 1))),
                theme.style(TextRole::Stale),
            ),
        ])
    };
    let source = match at.basis {
        Basis::Plan => "along the last plan",
        Basis::LastThrust => "last acceleration",
        Basis::FallThenBurn => "fall, then the burn",
        Basis::Fall => "fall, last drag",
        Basis::FreeFall => "free fall; no plan",
    };
    let across = if model.vehicle.in_space {
        vec![row("north", at.x_m), row("east", at.y_m)]
    } else {
        vec![row("x", at.x_m)]
    };
    let mut rows = vec![row("alt", at.altitude_m)];
    rows.extend(across);
    rows.extend([
        Line::styled(format!(" {source}"), theme.style(TextRole::Label)),
        Line::styled(format!(" last heard {} ago", seconds(at.age)), theme.style(TextRole::Caution)),
    ]);
    rows
}
