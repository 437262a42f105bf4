//! Rows of numbers, scales and sparklines.

use std::time::Duration;

use ratatui::Frame;
use ratatui::layout::Constraint::{Fill, Length};
use ratatui::layout::Rect;
use ratatui::text::{Line, Span};
use ratatui::widgets::Sparkline;

use super::{TextRole, Theme, draw_line, stacked};
pub use crate::model::words::{fixed, shortest};
use crate::model::{Model, Sample, quantity::Quantity};

/// The mark before a value that is too old.
pub const STALE_MARK: &str = "~";
/// The width of a value in a row, without its mark.
const VALUE_WIDTH: usize = 9;
const LABEL_WIDTH: usize = 10;

/// The mark and the role of a value by its age.
pub fn age_mark<T>(sample: &Sample<T>, now: Duration) -> (&'static str, TextRole) {
    if sample.is_stale(now) { (STALE_MARK, TextRole::Stale) } else { (" ", TextRole::Plain) }
}

/// A row with label, value and unit. A stale value is marked; a missing one is `--`.
pub fn row(
    theme: Theme,
    label: &str,
    value: Option<Sample<f64>>,
    decimals: usize,
    unit: &'static str,
    now: Duration,
) -> Line<'static> {
    let text = value.map_or_else(|| "--".to_owned(), |sample| fixed(sample.value, decimals));
    let (mark, role) = value.map_or((" ", TextRole::Label), |sample| age_mark(&sample, now));
    text_row(theme, label, mark, &text, role, unit)
}

/// A row with label and text, aligned like the numbers.
pub fn text_row(
    theme: Theme,
    label: &str,
    mark: &'static str,
    text: &str,
    role: TextRole,
    unit: &'static str,
) -> Line<'static> {
    Line::from(vec![
        theme.label(format!(" {label:<LABEL_WIDTH$.LABEL_WIDTH$}")),
        theme.span(format!("{mark}{text:>VALUE_WIDTH$}"), role),
        theme.label(format!(" {unit}")),
    ])
}

/// A duration in seconds, as in `3.2 s`.
pub fn seconds(duration: Duration) -> String {
    let seconds = duration.as_secs_f64();
    if seconds < 100.0 { format!("{seconds:.1} s") } else { format!("{seconds:.0} s") }
}

// Round numbers for scales: 1, 2 or 5 times a power of ten.

/// The smallest round step that divides a span into at most this many parts.
pub fn tick_step(span: f64, parts_max: usize) -> f64 {
    let least = span / parts_max.max(1) as f64;
    if !(least.is_finite() && least > 0.0) {
        return 1.0;
    }
    let decade = libm::exp10(libm::floor(libm::log10(least)));
    [1.0, 2.0, 5.0].into_iter().map(|step| step * decade).find(|step| *step >= least).unwrap_or(10.0 * decade)
}

/// The multiples of a step from one value to another, ends included.
pub fn ticks(from: f64, to: f64, step: f64) -> impl Iterator<Item = f64> {
    let (first, last) = (libm::ceil(from / step), libm::floor(to / step));
    // A scale of more ticks than columns would be an error of the caller; it must not hang.
    let count = (last - first + 1.0).clamp(0.0, 1_000.0) as u32;
    (0..count).map(move |k| (first + f64::from(k)) * step)
}

/// The decimals that a step needs.
pub fn tick_decimals(step: f64) -> usize {
    (-libm::floor(libm::log10(step))).clamp(0.0, 6.0) as usize
}

// A quantity over the last minute, in one or a few rows, with its name, its range and its present value.

/// How far back a sparkline reaches.
const SPAN: Duration = Duration::from_mins(1);
/// Rows of one sparkline with its heading.
pub const SPARKLINE_ROWS: u16 = 4;
/// Steps of the height of a bar; a terminal shows eight a row.
const STEPS: f64 = 100.0;

/// Draws as many sparklines as fit, one below the other.
pub fn draw_sparklines(
    names: &[&str],
    model: &Model,
    theme: Theme,
    now: Duration,
    frame: &mut Frame,
    area: Rect,
) {
    let known = names.iter().filter_map(|name| Quantity::named(name));
    for (quantity, y) in known.zip((area.y..area.bottom()).step_by(usize::from(SPARKLINE_ROWS))) {
        let at = Rect { y, height: SPARKLINE_ROWS, ..area };
        if at.bottom() <= area.bottom() {
            draw_sparkline(quantity, model, theme, now, frame, at);
        }
    }
}

/// Draws one sparkline: a heading and the bars.
pub fn draw_sparkline(
    quantity: &Quantity,
    model: &Model,
    theme: Theme,
    now: Duration,
    frame: &mut Frame,
    area: Rect,
) {
    let [heading, bars] = stacked(area, [Length(1), Fill(1)]);
    let columns = usize::from(bars.width.saturating_sub(2));
    let values = resampled(quantity, model, now, columns);
    let known = || values.iter().flatten().copied();
    let (least, most) = (known().fold(f64::INFINITY, f64::min), known().fold(f64::NEG_INFINITY, f64::max));
    let sample = quantity.read(model, now);
    let (mark, role) = sample.as_ref().map_or((" ", TextRole::Label), |sample| age_mark(sample, now));
    let value = sample.map_or_else(|| "--".to_owned(), |sample| fixed(sample.value, quantity.decimals));
    let mut spans = vec![
        theme.label(format!(" {}", quantity.name)),
        theme.span(format!("{mark}{value} {}", quantity.unit), role),
    ];
    if least <= most {
        let range =
            format!("  60 s: {}..{}", fixed(least, quantity.decimals), fixed(most, quantity.decimals));
        let used: usize = spans.iter().map(Span::width).sum();
        if used + range.len() <= usize::from(heading.width) {
            spans.push(theme.label(range));
        }
    }
    draw_line(frame, heading, Line::from(spans));
    let span = (most - least).max(f64::MIN_POSITIVE);
    let heights =
        values.iter().map(|value| value.map(|value| (1.0 + (STEPS - 1.0) * (value - least) / span) as u64));
    let bars = Rect { x: bars.x + 1, width: bars.width.saturating_sub(2), ..bars };
    let widget = Sparkline::default()
        .data(heights.collect::<Vec<_>>())
        .absent_value_symbol(" ")
        .max(STEPS as u64)
        .style(theme.ground().fg(theme.ink(crate::view::theme::Ink::Predicted)));
    frame.render_widget(widget, bars);
}

/// The last value in each of so many equal parts of the last minute; `None` where none is known.
fn resampled(quantity: &Quantity, model: &Model, now: Duration, columns: usize) -> Vec<Option<f64>> {
    // Steps of a whole part, so that the bars do not tremble while time passes.
    let part = SPAN.as_secs_f64() / columns.max(1) as f64;
    let last = libm::floor(now.as_secs_f64() / part);
    let first = last - columns as f64 + 1.0;
    let mut values = vec![None; columns];
    let from = Duration::from_secs_f64((first * part).max(0.0));
    for (at, value) in model.history.trace.values(quantity, from, now) {
        let place = libm::floor(at.as_secs_f64() / part) - first;
        if let Some(slot) = (place >= 0.0).then(|| values.get_mut(place as usize)).flatten() {
            *slot = Some(value);
        }
    }
    values
}

#[cfg(test)]
mod ticks_tests {
    use super::*;

    #[test]
    fn steps_are_round_and_few() {
        for (span, parts, expected) in
            [(100.0, 5, 20.0), (90.0, 4, 50.0), (0.7, 5, 0.2), (1.0, 1, 1.0), (301.0, 10, 50.0)]
        {
            assert!(
                (tick_step(span, parts) - expected).abs() < 1e-12,
                "{span} in {parts}: {}",
                tick_step(span, parts)
            );
        }
        for odd in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!((tick_step(odd, 4) - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn ticks_are_the_multiples_inside() {
        assert_eq!(ticks(-12.0, 31.0, 10.0).collect::<Vec<_>>(), [-10.0, 0.0, 10.0, 20.0, 30.0]);
        assert_eq!(ticks(1.0, 4.0, 5.0).count(), 0);
        assert_eq!(ticks(0.0, 1e9, 1e-9).count(), 1_000);
        assert_eq!([tick_decimals(0.2), tick_decimals(5.0), tick_decimals(0.05)], [1, 0, 2]);
    }
}
