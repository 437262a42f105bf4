//! Formats numbers with a bounded width, whatever arrives over the radio.

use std::time::Duration;

use ratatui::text::{Line, Span};

use super::theme::{TextRole, Theme};
use crate::model::vehicle::Sample;

/// The mark before a value that is too old.
pub const STALE_MARK: &str = "~";
/// The width of a value in a row, without its mark.
const VALUE_WIDTH: usize = 9;
const LABEL_WIDTH: usize = 10;

/// A number with fixed decimals; `--` for NaN and infinity.
pub fn fixed(value: f64, decimals: usize) -> String {
    if !value.is_finite() {
        "--".to_owned()
    } else if value.abs() >= 1e6 {
        format!("{value:.1e}")
    } else {
        // A value that rounds to zero has no minus sign.
        let text = format!("{value:.decimals$}");
        match text.strip_prefix('-') {
            Some(digits) if digits.chars().all(|c| matches!(c, '0' | '.')) => digits.to_owned(),
            _ => text,
        }
    }
}

/// A number without unneeded digits: `20`, `0.1`, `82.5`. Rounding to three decimals hides the error of an `f32`.
pub fn shortest(value: f64) -> String {
    let text = fixed(value, 3);
    match text.split_once('.') {
        Some((_, decimals)) if decimals.bytes().all(|digit| digit.is_ascii_digit()) => {
            text.trim_end_matches('0').trim_end_matches('.').to_owned()
        }
        _ => text,
    }
}

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
        Span::styled(format!(" {label:<LABEL_WIDTH$.LABEL_WIDTH$}"), theme.style(TextRole::Label)),
        Span::styled(format!("{mark}{text:>VALUE_WIDTH$}"), theme.style(role)),
        Span::styled(format!(" {unit}"), theme.style(TextRole::Label)),
    ])
}

/// A duration in seconds, as in `3.2 s`.
pub fn seconds(duration: Duration) -> String {
    let seconds = duration.as_secs_f64();
    if seconds < 100.0 { format!("{seconds:.1} s") } else { format!("{seconds:.0} s") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_never_grow_wide() {
        let wild = [0.0, -0.0, -0.001, 1.0, f64::MAX, f64::MIN, f64::NAN, f64::INFINITY, -999_999.99];
        for value in wild {
            assert!(fixed(value, 2).len() <= 10, "{value} became {}", fixed(value, 2));
        }
        assert_eq!(fixed(-0.001, 2), "0.00");
        assert_eq!(fixed(-0.01, 2), "-0.01");
    }

    #[test]
    fn numbers_have_no_unneeded_digits() {
        let cases = [(20.0, "20"), (f64::from(0.1_f32), "0.1"), (82.5, "82.5"), (0.0, "0"), (f64::NAN, "--")];
        for (value, expected) in cases {
            assert_eq!(shortest(value), expected);
        }
        assert_eq!(shortest(1e9), "1.0e9");
    }
}
