//! After the loss of the link in flight: where the vehicle probably is, marked as a prediction.

use std::time::Duration;

use ratatui::text::{Line, Span};

use super::number::{fixed, seconds};
use super::theme::{Role, Theme};
use crate::model::Model;
use crate::model::reckoning::{By, is_unheard, reckon};

/// Whether only a prediction is left of the flight, or not even that.
pub fn is_lost(model: &Model, now: Duration) -> bool {
    is_unheard(&model.vehicle, now)
}

/// The prediction's rows.
pub fn rows(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    if !is_lost(model, now) {
        return Vec::new();
    }
    let Some(at) = reckon(&model.vehicle, now) else {
        return vec![
            Line::styled(" position unknown:", theme.style(Role::Alarm)),
            Line::styled(" not heard since the pad", theme.style(Role::Caution)),
        ];
    };
    let row = |label: &str, value: f64| {
        Line::from(vec![
            Span::styled(format!(" {label:<6}pred"), theme.style(Role::Label)),
            Span::styled(
                theme.either_side(&format!("{:>7} ±{} m", fixed(value, 1), fixed(at.error_m, 1))),
                theme.style(Role::Stale),
            ),
        ])
    };
    let source = match at.by {
        By::Plan => "along the last plan",
        By::LastThrust => "by the last thrust",
        By::FallThenBurn => "fall, then the burn",
        By::Fall => "fall, drag as last",
        By::FreeFall => "free fall; no plan",
    };
    let across = if model.vehicle.in_space {
        vec![row("north", at.x_m), row("east", at.y_m)]
    } else {
        vec![row("x", at.x_m)]
    };
    let mut rows = vec![row("alt", at.altitude_m)];
    rows.extend(across);
    rows.extend([
        Line::styled(format!(" {source}"), theme.style(Role::Label)),
        Line::styled(format!(" last heard {} ago", seconds(at.age)), theme.style(Role::Caution)),
    ]);
    rows
}
