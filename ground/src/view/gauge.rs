//! The height gauge: a scale from the pad upwards with the ignition band and the vehicle.

use std::time::Duration;

use ratatui::text::{Line, Span};

use super::number::{age_mark, fixed};
use super::theme::{TextRole, Theme};
use crate::model::Model;
use crate::model::dead_reckoning::{is_unheard, predict_position};

/// The least height of the scale, m.
const TOP_MIN_M: f64 = 25.0;
/// Heights of a row within a decade, and how many rows make a tick, so that every tick is round.
const ROW_HEIGHTS: [(f64, usize); 5] = [(1.0, 5), (2.0, 5), (2.5, 4), (4.0, 5), (5.0, 4)];

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
    // On the way up there is no commit height yet, and on the way down no apogee any more.
    let above_ground = |height: f32| finite(f64::from(height)).filter(|height_m| *height_m > 0.0);
    let apogee = descent.and_then(|d| above_ground(d.value.apogee_m));
    let commit = descent.and_then(|d| above_ground(d.value.commit_height_m));
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
    let (per_row, tick_rows) = scale(marks.into_iter().flatten().fold(0.0, f64::max), rows - 1);
    (0..rows)
        .rev()
        .map(|row| {
            let (low, high) = ((row as f64 - 0.5) * per_row, (row as f64 + 0.5) * per_row);
            let here = |height: Option<f64>| height.is_some_and(|height| (low..high).contains(&height));
            let inside = band.is_some_and(|(bottom, top)| bottom < high && top >= low);
            let is_tick = row % tick_rows == 0;
            let tick = if is_tick { fixed(row as f64 * per_row, 0) } else { String::new() };
            let bar = match (inside, is_tick) {
                (true, _) => "▐█▌",
                (false, true) => "─┤ ",
                (false, false) => " │ ",
            };
            let mut spans = vec![
                Span::styled(format!("{tick:>6} "), theme.style(TextRole::Label)),
                Span::styled(bar, theme.style(TextRole::Plain)),
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

/// The least height of a row for which a height fits into this many rows, m, and how many rows make a tick.
fn scale(highest_m: f64, rows: usize) -> (f64, usize) {
    let least_m = highest_m.clamp(TOP_MIN_M, 1e6) / rows as f64;
    let decade = libm::exp10(libm::floor(libm::log10(least_m)));
    // A hundredth, because a power of ten is not exact.
    let fits = ROW_HEIGHTS.into_iter().find(|(height, _)| height * decade >= 0.99 * least_m);
    fits.map_or((10.0 * decade, 5), |(height, tick_rows)| (height * decade, tick_rows))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_tick_is_a_round_height() {
        for rows in [10, 11, 16, 29, 48] {
            for highest_m in [0.0, 25.0, 26.0, 99.0, 101.0, 299.0, 4_321.0, f64::MAX] {
                let (per_row, tick_rows) = scale(highest_m, rows);
                let tick_m = per_row * tick_rows as f64;
                let digits = tick_m / libm::exp10(libm::floor(libm::log10(tick_m) + 1e-9));
                assert!([1.0, 2.0, 5.0].iter().any(|round| (digits - round).abs() < 1e-6), "{tick_m}");
                let top_m = per_row * rows as f64;
                assert!(top_m >= 0.98 * highest_m.clamp(TOP_MIN_M, 1e6), "{top_m} for {highest_m}");
                assert!(top_m <= 2.1 * highest_m.clamp(TOP_MIN_M, 1e6), "{top_m} for {highest_m}");
            }
        }
    }
}
