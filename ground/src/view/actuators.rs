//! The panels of fins and gimbal: commanded and measured angles.

use std::time::Duration;

use ratatui::text::{Line, Span};

use super::number::{age_mark, fixed, row, shortest};
use super::theme::{TextRole, Theme};
use crate::model::Model;
use crate::model::vehicle::{Deflection, Gimbal, Sample};

/// The scale of the gimbal bar until the vehicle has reported the limit of its gimbal.
const DEFAULT_SCALE_DEG: f64 = 20.0;
/// Columns of the bar; odd, so that zero has a column.
const BAR_COLUMNS: usize = 21;

/// One row for each of the four fins.
pub fn fin_rows(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    let fins = model.vehicle.fins;
    let (mark, role) = fins.map_or((" ", TextRole::Label), |fins| age_mark(&fins, now));
    (0..4)
        .map(|k| {
            let degrees = |pick: fn(&Deflection) -> f64| {
                fins.map_or_else(|| "--".to_owned(), |fins| fixed(pick(&fins.value[k]).to_degrees(), 1))
            };
            Line::from(vec![
                Span::styled(format!(" fin {} ", k + 1), theme.style(TextRole::Label)),
                Span::styled(
                    format!(
                        "{mark}{:>6} | {:>5}",
                        degrees(|fin| fin.commanded_rad),
                        degrees(|fin| fin.measured_rad)
                    ),
                    theme.style(role),
                ),
                Span::styled(" deg", theme.style(TextRole::Label)),
            ])
        })
        .collect()
}

/// The rows of the gimbal: command, measured angle, and a bar with both. In space the gimbal has two planes, with a
/// row of numbers and a bar each.
pub fn gimbal_rows(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    let gimbal = model.vehicle.gimbal;
    let limit = model.vehicle.limits.as_ref().map(|limits| f64::from(limits.gimbal_limit_rad).to_degrees());
    let limit = limit.filter(|limit| limit.is_finite() && *limit > 0.0);
    if model.vehicle.in_space {
        let plane = |name, pick: fn(&Gimbal) -> Deflection| {
            plane_rows(name, gimbal.map(|gimbal| gimbal.map(pick)), limit, theme, now)
        };
        return [plane("pitch", |g| g.pitch), plane("yaw", |g| g.yaw)].concat();
    }
    let angle = |pick: fn(&Deflection) -> f64| gimbal.map(|g| g.map(|g| pick(&g.pitch).to_degrees()));
    let commanded = angle(|deflection| deflection.commanded_rad);
    let measured = angle(|deflection| deflection.measured_rad);
    let role = gimbal.map_or(TextRole::Label, |gimbal| age_mark(&gimbal, now).1);
    let value = |sample: Option<Sample<f64>>| sample.map(|sample| sample.value);
    vec![
        row(theme, "command o", commanded, 2, "deg", now),
        row(theme, "actual  #", measured, 2, "deg", now),
        Line::styled(
            format!(" {}", bar(value(commanded), value(measured), limit.unwrap_or(DEFAULT_SCALE_DEG))),
            theme.style(role),
        ),
        Line::styled(scale(limit), theme.style(TextRole::Label)),
    ]
}

fn plane_rows(
    name: &str,
    angles: Option<Sample<Deflection>>,
    limit_deg: Option<f64>,
    theme: Theme,
    now: Duration,
) -> Vec<Line<'static>> {
    let (mark, role) = angles.map_or((" ", TextRole::Label), |angles| age_mark(&angles, now));
    let degrees = |pick: fn(&Deflection) -> f64| angles.map(|angles| pick(&angles.value).to_degrees());
    let (commanded, measured) = (degrees(|d| d.commanded_rad), degrees(|d| d.measured_rad));
    let text = |value: Option<f64>| value.map_or_else(|| "--".to_owned(), |value| fixed(value, 1));
    let stop =
        limit_deg.map_or_else(String::new, |limit| theme.either_side(&format!(" ±{}", shortest(limit))));
    vec![
        Line::from(vec![
            Span::styled(format!(" {name:<5}"), theme.style(TextRole::Label)),
            Span::styled(format!("{mark}o{:>6} #{:>6}", text(commanded), text(measured)), theme.style(role)),
            Span::styled(" deg", theme.style(TextRole::Label)),
        ]),
        Line::from(vec![
            Span::styled(
                format!(" {}", bar(commanded, measured, limit_deg.unwrap_or(DEFAULT_SCALE_DEG))),
                theme.style(role),
            ),
            Span::styled(stop, theme.style(TextRole::Label)),
        ]),
    ]
}

/// The labels at the ends of the bar; without numbers while the limit is unknown.
fn scale(limit_deg: Option<f64>) -> String {
    let (left, right) = limit_deg.map(shortest).map_or_else(
        || ("-".to_owned(), "+".to_owned()),
        |limit| (format!("-{limit}"), format!("+{limit} deg")),
    );
    format!(" {left:<10}0{right:>10}")
}

/// A mark beyond the scale is drawn at its end.
fn bar(commanded_deg: Option<f64>, measured_deg: Option<f64>, scale_deg: f64) -> String {
    let mut cells = ['-'; BAR_COLUMNS];
    cells[BAR_COLUMNS / 2] = '|';
    let cell = |deg: f64| {
        let share = (deg.clamp(-scale_deg, scale_deg) + scale_deg) / (2.0 * scale_deg);
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
        assert_eq!(bar(None, None, 20.0), "----------|----------");
        assert_eq!(bar(Some(-20.0), Some(0.0), 20.0), "o---------#----------");
        assert_eq!(bar(Some(90.0), Some(f64::NAN), 20.0), "----------|---------o");
        assert_eq!(bar(Some(-5.0), Some(2.5), 5.0), "o---------|----#-----");
    }

    #[test]
    fn the_scale_shows_the_vehicles_limit_or_no_numbers() {
        assert_eq!(scale(Some(f64::from(0.261_799_4_f32).to_degrees())), " -15       0   +15 deg");
        assert_eq!(scale(None), " -         0         +");
    }
}
