//! Numbers that keep their place: a fixed width whatever arrives over the radio.

use std::time::Duration;

use ratatui::text::{Line, Span};

use super::theme::{Role, Theme};
use crate::model::vehicle::Sample;

/// The mark before a value that is too old.
pub const STALE_MARK: &str = "~";
/// Width of a row's value, its mark not counted.
const VALUE_WIDTH: usize = 9;
const LABEL_WIDTH: usize = 10;

/// A number in a few characters; `--` for what is no number.
pub fn fixed(value: f64, decimals: usize) -> String {
    if !value.is_finite() {
        "--".to_owned()
    } else if value.abs() >= 1e6 {
        format!("{value:.1e}")
    } else {
        // Rounds to zero without a minus sign.
        let text = format!("{value:.decimals$}");
        match text.strip_prefix('-') {
            Some(digits) if digits.chars().all(|c| matches!(c, '0' | '.')) => digits.to_owned(),
            _ => text,
        }
    }
}

/// A setting without needless digits: `20`, `0.1`, `82.5`. Three decimals hide that it came as an `f32`.
pub fn shortest(value: f64) -> String {
    let text = fixed(value, 3);
    match text.split_once('.') {
        Some((_, decimals)) if decimals.bytes().all(|digit| digit.is_ascii_digit()) => {
            text.trim_end_matches('0').trim_end_matches('.').to_owned()
        }
        _ => text,
    }
}

/// The mark and the role of a value of this age.
pub fn age_mark<T>(sample: &Sample<T>, now: Duration) -> (&'static str, Role) {
    if sample.is_stale(now) { (STALE_MARK, Role::Stale) } else { (" ", Role::Plain) }
}

/// A labelled value with its unit; its age marked; `--` when it was never received.
pub fn row(
    theme: Theme,
    label: &str,
    value: Option<Sample<f64>>,
    decimals: usize,
    unit: &'static str,
    now: Duration,
) -> Line<'static> {
    let text = value.map_or_else(|| "--".to_owned(), |sample| fixed(sample.value, decimals));
    let (mark, role) = value.map_or((" ", Role::Label), |sample| age_mark(&sample, now));
    text_row(theme, label, mark, &text, role, unit)
}

/// A labelled text, aligned like the numbers.
pub fn text_row(
    theme: Theme,
    label: &str,
    mark: &'static str,
    text: &str,
    role: Role,
    unit: &'static str,
) -> Line<'static> {
    Line::from(vec![
        Span::styled(format!(" {label:<LABEL_WIDTH$.LABEL_WIDTH$}"), theme.style(Role::Label)),
        Span::styled(format!("{mark}{text:>VALUE_WIDTH$}"), theme.style(role)),
        Span::styled(format!(" {unit}"), theme.style(Role::Label)),
    ])
}

/// A duration in seconds for people.
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
    fn settings_have_no_needless_digits() {
        let cases = [(20.0, "20"), (f64::from(0.1_f32), "0.1"), (82.5, "82.5"), (0.0, "0"), (f64::NAN, "--")];
        for (value, expected) in cases {
            assert_eq!(shortest(value), expected);
        }
        assert_eq!(shortest(1e9), "1.0e9");
    }
}
