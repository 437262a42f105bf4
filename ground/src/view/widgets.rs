//! Rows of numbers, scales, and the borders of panels.

use std::time::Duration;

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect, Spacing};
use ratatui::symbols::merge::MergeStrategy;
use ratatui::text::Line;
use ratatui::widgets::Block;

use super::{TextRole, Theme, draw_lines};
pub use crate::model::words::{fixed, shortest};
use crate::model::{Model, Sample, quantity::Quantity};

/// The mark before a value that is too old.
pub const STALE_MARK: &str = "~";
/// The width of a value in a row, without its mark.
const VALUE_WIDTH: usize = 9;
const LABEL_WIDTH: usize = 17;

/// The mark and the role of a value by its age.
pub fn age_mark<T>(sample: &Sample<T>, now: Duration, fresh: TextRole) -> (&'static str, TextRole) {
    if sample.is_stale(now) { (STALE_MARK, TextRole::Stale) } else { (" ", fresh) }
}

/// A row with the name, the value and the unit of a quantity. A stale value is marked; a missing
/// one is `--`.
pub fn quantity_row(quantity: &Quantity, model: &Model, theme: Theme, now: Duration) -> Line<'static> {
    let value = quantity.read(model, now);
    let text = value.map_or_else(|| "--".to_owned(), |sample| fixed(sample.value, quantity.decimals));
    let age = value.map_or((" ", TextRole::Label), |sample| age_mark(&sample, now, TextRole::Plain));
    text_row(theme, quantity.name, age, &text, quantity.unit)
}

/// A row with label, text and unit; before the text stands its mark.
pub fn text_row(theme: Theme, label: &str, age: (&str, TextRole), text: &str, unit: &str) -> Line<'static> {
    let (mark, role) = age;
    Line::from(vec![
        theme.label(format!(" {label:<LABEL_WIDTH$}")),
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

// Panels.

/// Splits an area into panels beside each other, which share a border.
pub fn columns<const N: usize>(area: Rect, columns: [Constraint; N]) -> [Rect; N] {
    area.layout(&Layout::horizontal(columns).spacing(Spacing::Overlap(1)))
}

/// Splits an area into panels above each other, which share a border.
pub fn rows<const N: usize>(area: Rect, rows: [Constraint; N]) -> [Rect; N] {
    area.layout(&Layout::vertical(rows).spacing(Spacing::Overlap(1)))
}

/// Draws the border of a panel with its title, and what stands at the right end of it. Returns its
/// inside.
pub fn framed(title: &str, right: Line<'static>, theme: Theme, frame: &mut Frame, area: Rect) -> Rect {
    let title = theme.line(format!(" {title} "), TextRole::Title);
    let block = Block::bordered().border_style(theme.border()).merge_borders(MergeStrategy::Exact);
    let block = block.title(title);
    let block = if right.width() == 0 { block } else { block.title(right.right_aligned()) };
    let inside = block.inner(area);
    frame.render_widget(block, area.intersection(frame.area()));
    inside
}

/// A panel with lines.
pub fn table(title: &str, lines: &[Line], theme: Theme, frame: &mut Frame, area: Rect) {
    let inside = framed(title, Line::default(), theme, frame, area);
    // The most important first; the rest is on the page of all values.
    draw_lines(frame, inside, &lines[..lines.len().min(usize::from(inside.height))]);
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
    }
}
