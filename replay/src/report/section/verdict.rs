//! The verdict, each value against its limit.

use crate::info::{Info, VerdictLimit};
use crate::report::html::{escaped, paragraph, table};
use crate::report::track::Flight;

pub(super) fn html(_: &Flight, info: &Info) -> String {
    let Some(verdict) = &info.verdict else {
        return "<p class=\"verdict\">No verdict in this log</p>\n".to_owned()
            + &paragraph(
                "The vehicle did not touch down while it was recorded, or its verdict was not recorded.",
            );
    };
    let broken: Vec<&str> =
        verdict.limits.iter().filter(|limit| !limit.passed).map(|limit| limit.name.as_str()).collect();
    let (class, words) = if verdict.landed {
        ("good", format!("LANDED at {:.3} s, inside every limit", verdict.time_s))
    } else {
        ("bad", format!("NOT LANDED at {:.3} s: outside in {}", verdict.time_s, broken.join(", ")))
    };
    let rows: Vec<Vec<String>> = verdict
        .limits
        .iter()
        .map(|limit| {
            let (class, word) = if limit.passed { ("good", "inside") } else { ("bad", "OUTSIDE") };
            vec![
                escaped(&limit.name),
                format!("{:.4}", limit.value),
                escaped(&limit.unit),
                format!("{:.4} to {:.4}", limit.minimum, limit.maximum),
                format!("<span class=\"{class}\">{word}</span>"),
                bar(limit),
            ]
        })
        .collect();
    format!("<p class=\"verdict {class}\">{}</p>\n", escaped(&words))
        + &table(&["touchdown", "#value", "unit", "limit", "", "share of the limit"], &rows)
}

/// Where the value lies in its range, the grey strip; a value outside is drawn at the end of the strip.
fn bar(limit: &VerdictLimit) -> String {
    const WIDTH: f64 = 160.0;
    let share = (limit.value - limit.minimum) / (limit.maximum - limit.minimum);
    if !share.is_finite() {
        return String::new();
    }
    let at = 4.0 + share.clamp(-0.02, 1.02) * (WIDTH - 8.0);
    let class = if limit.passed { "bar" } else { "barbad" };
    format!(
        "<svg viewBox=\"0 0 {WIDTH} 14\" style=\"width:{WIDTH}px\" aria-hidden=\"true\"><rect class=\"room\" x=\"4\" \
         y=\"4\" width=\"{}\" height=\"6\"/><rect class=\"{class}\" x=\"{:.1}\" y=\"1\" width=\"4\" height=\"12\"/></svg>",
        WIDTH - 8.0,
        at - 2.0
    )
}
