//! The page of all values: flight, descent, controller with its residuals, actuators, link.

use std::time::Duration;

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::text::Line;

use super::flying::of_descent;
use super::{is_roomy, titled};
use crate::model::Model;
use crate::model::quantity;
use crate::view::number::row;
use crate::view::theme::{TextRole, Theme};
use crate::view::{actuators, controller, draw_lines, fins, flight, lost_position, sparkline};

/// Rows of the controller's panel and of the fins', with their titles.
const CONTROLLER_ROWS: u16 = 9;
const FIN_ROWS: u16 = 5;
/// The columns of every panel on a larger screen.
const PANEL_COLUMNS: u16 = 30;

/// Draws three columns of panels; on a larger screen sparklines of every quantity beside them.
pub fn draw(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let roomy = is_roomy(area);
    let (panels, lines) = if roomy {
        let [panels, lines] =
            area.layout(&Layout::horizontal([Constraint::Length(3 * PANEL_COLUMNS), Constraint::Fill(1)]));
        (panels, lines)
    } else {
        (area, Rect::default())
    };
    let [left, middle, right] = panels.layout(&Layout::horizontal([Constraint::Fill(1); 3]));
    let half = Constraint::Length(CONTROLLER_ROWS);
    let [flight_area, below_flight] = left.layout(&Layout::vertical([half, Constraint::Fill(1)]));
    let [controller_area, below_controller] = middle.layout(&Layout::vertical([half, Constraint::Fill(1)]));
    let lost = lost_position::is_lost(model, now);
    let (title, rows) = if lost {
        ("PREDICTED, not heard", lost_position::rows(model, theme, now))
    } else {
        ("Flight", flight::rows(model, theme, now))
    };
    panel(title, &rows, theme, frame, flight_area);
    panel("Fins command|actual", &actuators::fin_rows(model, theme, now), theme, frame, below_flight);
    panel("Controller (NMPC)", &controller::rows(model, theme, now), theme, frame, controller_area);
    panel("Gimbal", &actuators::gimbal_rows(model, theme, now), theme, frame, below_controller);
    panel("Descent", &descent_rows(model, theme, now), theme, frame, right);
    if roomy {
        let below = Rect {
            y: flight_area.bottom() + FIN_ROWS + 1,
            height: below_flight.height.saturating_sub(FIN_ROWS + 1),
            ..left
        };
        let inside = titled(&fins::title(model, now), theme, frame, below);
        fins::draw(model, theme, now, frame, inside);
        let names: Vec<&str> = quantity::ALL.iter().map(|quantity| quantity.name).collect();
        sparkline::draw_all(&names, model, theme, now, frame, lines);
    }
}

/// The same as lines.
pub fn lines(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    let mut lines = lost_position::rows(model, theme, now);
    lines.extend(flight::rows(model, theme, now));
    lines.extend(controller::rows(model, theme, now));
    lines.extend(descent_rows(model, theme, now));
    lines.extend(actuators::fin_rows(model, theme, now));
    lines.extend(actuators::gimbal_rows(model, theme, now));
    lines
}

fn panel(title: &str, rows: &[Line<'static>], theme: Theme, frame: &mut Frame, area: Rect) {
    let inside = titled(title, theme, frame, area);
    draw_lines(frame, inside, rows);
}

/// The estimates behind the descent.
fn descent_rows(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    let of = |pick| of_descent(model, pick);
    let line = |label, value, decimals, unit| row(theme, label, value, decimals, unit, now);
    let mut rows = vec![
        line("band high", of(|d| d.band_high_m), 1, "m"),
        line("band low", of(|d| d.band_low_m), 1, "m"),
        line("ignite at", of(|d| d.chosen_height_m), 1, "m"),
        line("ignite in", model.vehicle.ignition_in_s(now), 1, "s"),
        line("commit at", of(|d| d.commit_height_m), 1, "m"),
        line("apogee at", of(|d| d.apogee_m), 0, "m"),
        line("wind north", of(|d| d.wind_x_m_s), 1, "m/s"),
        line("wind east", of(|d| d.wind_y_m_s), 1, "m/s"),
        line("drag x", of(|d| d.drag_scale), 3, ""),
        line("thrust x", of(|d| d.thrust_scale), 3, ""),
        line("down north", of(|d| d.touchdown_x_m), 1, "m"),
        line("down east", of(|d| d.touchdown_y_m), 1, "m"),
    ];
    if model.vehicle.descent.is_none() {
        rows.insert(0, Line::styled(" no data", theme.style(TextRole::Caution)));
    }
    rows
}
