//! The verdict, each value against its limit.

use crate::info::{Info, VerdictLimit};
use crate::report::html::{escaped, paragraph, table_of_limits};
use crate::report::track::Flight;

pub(super) fn html(_: &Flight, info: &Info) -> String {
    let Some(verdict) = &info.verdict else {
        let ending = info.ending.as_deref().unwrap_or("No verdict in this log");
        return format!("<p class=\"verdict\">{}</p>\n", escaped(ending))
            + &paragraph(
                "The vehicle did not touch down while it was recorded, or its verdict was not recorded.",
            );
    };
    let class = if verdict.landed { "good" } else { "bad" };
    let contact = info.clocks.words(verdict.contact());
    let mut html = format!("<p class=\"verdict {class}\">{}</p>\n", escaped(&verdict.ending))
        + &paragraph(&format!("Touchdown at {contact}."));
    if verdict.table_2.is_empty() {
        html += &limits("touchdown", &verdict.limits);
    } else {
        html += &limits("by the limits of the legs", &verdict.limits);
        html += &limits("by the landing paper's Table 2", &verdict.table_2);
    }
    html
}

fn limits(title: &str, limits: &[VerdictLimit]) -> String {
    let row = |limit: &VerdictLimit| {
        let (class, word) = if limit.passed { ("good", "inside") } else { ("bad", "OUTSIDE") };
        vec![
            escaped(&limit.name),
            format!("{:.3}", limit.value + 0.0),
            format!("{} to {}", short(limit.minimum), short(limit.maximum)),
            escaped(&limit.unit),
            format!("<span class=\"{class}\">{word}</span>"),
            bar(limit),
        ]
    };
    let rows: Vec<Vec<String>> = limits.iter().map(row).collect();
    table_of_limits(&[title, "#value", "#limit", "unit", "", "share of the limit"], &rows)
}

/// Rounds away the error of converting degrees to radians and back.
fn short(limit: f64) -> String {
    format!("{}", (1e6 * limit).round() / 1e6 + 0.0)
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
