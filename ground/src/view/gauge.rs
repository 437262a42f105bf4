//! The height gauge: a scale from the pad upwards with the ignition band and the vehicle.

use std::time::Duration;

use ratatui::text::{Line, Span};

use super::number::{age_mark, fixed};
use super::theme::{TextRole, Theme};
use crate::model::Model;
use crate::model::dead_reckoning::{is_unheard, predict_position};

/// The least height of the scale, m.
const TOP_MIN_M: f64 = 25.0;
/// The steps of the scale within a decade (Renard series R10, ISO 3), so that the scale does not change with every
/// frame.
const STEPS: [f64; 10] = [1.0, 1.25, 1.6, 2.0, 2.5, 3.15, 4.0, 5.0, 6.3, 8.0];

/// One line per row, the greatest height first.
pub fn lines(model: &Model, theme: Theme, now: Duration, rows: usize) -> Vec<Line<'static>> {
    if rows < 3 {
        return Vec::new();
    }
    let descent = model.vehicle.descent.as_ref();
    // If the motor will not be lit there is no ignition band.
    let to_light = descent.filter(|_| model.vehicle.may_light());
    let finite = |height: f64| Some(height).filter(|height| height.is_finite() && *height >= 0.0);
    let band = to_light
        .and_then(|d| finite(f64::from(d.value.band_low_m)).zip(finite(f64::from(d.value.band_high_m))));
    let chosen = to_light.and_then(|d| finite(f64::from(d.value.chosen_height_m)));
    let apogee = descent.and_then(|d| finite(f64::from(d.value.apogee_m)).filter(|apogee_m| *apogee_m > 0.0));
    let commit = descent.and_then(|d| finite(f64::from(d.value.commit_height_m)));
    let lost = predict_position(&model.vehicle, now);
    let (height, mark, role) = match (lost, model.vehicle.height_m()) {
        (Some(at), _) => (finite(at.altitude_m), "pred ", TextRole::Stale),
        (None, Some(height)) if !is_unheard(&model.vehicle, now) => {
            let (mark, role) = age_mark(&height, now);
            (finite(height.value.max(0.0)), mark, role)
        }
        // The position is unknown.
        (None, _) => (None, " ", TextRole::Label),
    };
    let marks = [height, band.map(|band| band.1), chosen, commit, apogee];
    let top = top_m(marks.into_iter().flatten().fold(0.0, f64::max));
    let per_row = top / (rows - 1) as f64;
    (0..rows)
        .rev()
        .map(|row| {
            let (low, high) = ((row as f64 - 0.5) * per_row, (row as f64 + 0.5) * per_row);
            let here = |height: Option<f64>| height.is_some_and(|height| (low..high).contains(&height));
            let inside = band.is_some_and(|(bottom, top)| bottom < high && top >= low);
            let mut spans = vec![
                Span::styled(format!("{:>6} ", fixed(row as f64 * per_row, 0)), theme.style(TextRole::Label)),
                Span::styled(if inside { "▐█▌" } else { " │ " }, theme.style(TextRole::Plain)),
            ];
            if here(height) {
                let text = height.map_or_else(String::new, |height| fixed(height, 1));
                let role = if role == TextRole::Stale { role } else { TextRole::Title };
                spans.push(Span::styled(format!("<{mark}{text} "), theme.style(role)));
            }
            for (at, name) in [(chosen, "IGNITE"), (commit, "commit"), (apogee, "apogee")] {
                if here(at) {
                    let text = at.map_or_else(String::new, |height| fixed(height, 0));
                    spans.push(Span::styled(format!("-{name} {text} "), theme.style(TextRole::Caution)));
                }
            }
            Line::from(spans)
        })
        .collect()
}

/// The smallest step of the scale at or above a height, m.
fn top_m(highest_m: f64) -> f64 {
    let highest_m = highest_m.clamp(TOP_MIN_M, 1e6);
    let decade = libm::exp10(libm::floor(libm::log10(highest_m)));
    STEPS.into_iter().map(|step| step * decade).find(|top| *top >= highest_m).unwrap_or(10.0 * decade)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scale_has_fixed_steps() {
        for (highest_m, top) in
            [(0.0, 25.0), (25.0, 25.0), (26.0, 31.5), (99.0, 100.0), (101.0, 125.0), (299.0, 315.0)]
        {
            assert!((top_m(highest_m) - top).abs() < 1e-9, "{highest_m}: {}", top_m(highest_m));
        }
        assert!(top_m(f64::MAX) >= 1e6 && top_m(f64::MAX).is_finite());
    }
}
