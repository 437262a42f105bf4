//! The four fins from above: how far each is open, measured, and where that is not what was commanded.

use std::time::Duration;

use ratatui::text::{Line, Span};

use super::number::{age_mark, fixed};
use super::theme::{Role, Theme};
use crate::model::Model;
use crate::model::vehicle::Deflection;

/// Rows of the picture.
pub const ROWS: u16 = 9;
/// A fin further from its command than this is marked.
const APART_DEG: f64 = 3.0;
/// Cells of an arm for a fin that is fully open, across and up; a cell is twice as high as wide.
const ARM_ACROSS: usize = 6;
const ARM_UP: usize = 3;

/// The picture: fin 1 ahead, 2 right, 3 behind, 4 left. `!` marks a fin that is not where it was commanded.
pub fn lines(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    let Some(fins) = model.vehicle.fins else {
        return vec![Line::styled(" no data", theme.style(Role::Label))];
    };
    let (stale_mark, role) = age_mark(&fins, now);
    let angle = |fin: &Deflection| {
        let apart = (fin.commanded_rad - fin.measured_rad).abs().to_degrees() > APART_DEG;
        format!("{stale_mark}{}{}", fixed(fin.measured_rad.to_degrees(), 0), if apart { "!" } else { " " })
    };
    let open = |fin: &Deflection, cells: usize| {
        let share = (fin.measured_rad / std::f64::consts::FRAC_PI_2).clamp(0.0, 1.0);
        (share * cells as f64).round() as usize
    };
    let [ahead, right, behind, left] = &fins.value;
    let style = theme.style(role);
    let middle = " ".repeat(12);
    let mut lines = vec![Line::styled(format!("{middle}1{}", angle(ahead)), style)];
    for row in (1..=ARM_UP).rev() {
        lines.push(Line::styled(
            format!("{middle}{}", if open(ahead, ARM_UP) >= row { "|" } else { "." }),
            style,
        ));
    }
    let arm = |fin: &Deflection| {
        let cells = open(fin, ARM_ACROSS);
        ("-".repeat(cells), ".".repeat(ARM_ACROSS - cells))
    };
    let ((left_open, left_shut), (right_open, right_shut)) = (arm(left), arm(right));
    lines.push(Line::from(vec![
        Span::styled(format!("{:<5}", format!("4{}", angle(left))), style),
        Span::styled(format!("{left_shut}{left_open}(O){right_open}{right_shut}"), style),
        Span::styled(format!("2{}", angle(right)), style),
    ]));
    for row in 1..=ARM_UP {
        lines.push(Line::styled(
            format!("{middle}{}", if open(behind, ARM_UP) >= row { "|" } else { "." }),
            style,
        ));
    }
    lines.push(Line::styled(format!("{middle}3{}", angle(behind)), style));
    lines
}
