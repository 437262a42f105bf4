//! Fins and gimbal: what was commanded and where they are.

use std::time::Duration;

use ratatui::text::{Line, Span};

use super::number::{age_mark, fixed, row};
use super::theme::{Role, Theme};
use crate::model::Model;
use crate::model::vehicle::{Deflection, Sample};

/// The scale of the gimbal's bar; beyond it the mark stays at the end.
const GIMBAL_SCALE_DEG: f64 = 20.0;
/// Columns of the bar; odd, so that zero has one.
const BAR_COLUMNS: usize = 21;

/// The four fins' rows.
pub fn fin_rows(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    let fins = model.vehicle.fins;
    let (mark, role) = fins.map_or((" ", Role::Label), |fins| age_mark(&fins, now));
    (0..4)
        .map(|k| {
            let degrees = |pick: fn(&Deflection) -> f64| {
                fins.map_or_else(|| "--".to_owned(), |fins| fixed(pick(&fins.value[k]).to_degrees(), 1))
            };
            Line::from(vec![
                Span::styled(format!(" fin {} ", k + 1), theme.style(Role::Label)),
                Span::styled(
                    format!(
                        "{mark}{:>6} | {:>5}",
                        degrees(|fin| fin.commanded_rad),
                        degrees(|fin| fin.measured_rad)
                    ),
                    theme.style(role),
                ),
                Span::styled(" deg", theme.style(Role::Label)),
            ])
        })
        .collect()
}

/// The gimbal's rows: command, measured angle, both on a bar.
pub fn gimbal_rows(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    let gimbal = model.vehicle.gimbal;
    let angle = |pick: fn(&Deflection) -> f64| {
        gimbal.map(|g| Sample { value: pick(&g.value.pitch).to_degrees(), received_at: g.received_at })
    };
    let commanded = angle(|deflection| deflection.commanded_rad);
    let measured = angle(|deflection| deflection.measured_rad);
    let role = gimbal.map_or(Role::Label, |gimbal| age_mark(&gimbal, now).1);
    vec![
        row(theme, "command o", commanded, 2, "deg", now),
        row(theme, "actual  #", measured, 2, "deg", now),
        Line::styled(
            format!(" {}", bar(commanded.map(|angle| angle.value), measured.map(|angle| angle.value))),
            theme.style(role),
        ),
        Line::styled(format!(" {:<10}0{:>10}", -GIMBAL_SCALE_DEG, "+20 deg"), theme.style(Role::Label)),
    ]
}

fn bar(commanded_deg: Option<f64>, measured_deg: Option<f64>) -> String {
    let mut cells = ['-'; BAR_COLUMNS];
    cells[BAR_COLUMNS / 2] = '|';
    let cell = |deg: f64| {
        let share =
            (deg.clamp(-GIMBAL_SCALE_DEG, GIMBAL_SCALE_DEG) + GIMBAL_SCALE_DEG) / (2.0 * GIMBAL_SCALE_DEG);
        ((share * (BAR_COLUMNS - 1) as f64).round() as usize).min(BAR_COLUMNS - 1)
    };
    for (angle, mark) in [(commanded_deg, 'o'), (measured_deg, '#')] {
        if let Some(deg) = angle.filter(|deg| deg.is_finite()) {
            cells[cell(deg)] = mark;
        }
    }
    cells.iter().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bar_marks_command_and_measurement() {
        assert_eq!(bar(None, None), "----------|----------");
        assert_eq!(bar(Some(-20.0), Some(0.0)), "o---------#----------");
        assert_eq!(bar(Some(90.0), Some(f64::NAN)), "----------|---------o");
    }
}
