//! Pieces of HTML.

use std::fmt;
use std::fmt::Write as _;

use super::section::Section;
use super::track::Flight;
use crate::info::Info;

/// Appends to a text in memory, which cannot fail.
pub(super) fn put(text: &mut String, more: fmt::Arguments<'_>) {
    let _ = text.write_fmt(more);
}

/// Escapes text from a log for HTML.
pub(super) fn escaped(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            c if c.is_control() && c != '\n' => safe.push('\u{fffd}'),
            c => safe.push(c),
        }
    }
    safe
}

/// A table: headings, then rows; a heading that begins with `#` marks a column of numbers.
pub(super) fn table(heads: &[&str], rows: &[Vec<String>]) -> String {
    let numeric: Vec<bool> = heads.iter().map(|head| head.starts_with('#')).collect();
    let class = |place: usize| if numeric.get(place) == Some(&true) { " class=\"n\"" } else { "" };
    let mut html = "<div class=\"wide\"><table><thead><tr>".to_owned();
    for (place, head) in heads.iter().enumerate() {
        put(&mut html, format_args!("<th{}>{}</th>", class(place), escaped(head.trim_start_matches('#'))));
    }
    html.push_str("</tr></thead><tbody>\n");
    for row in rows {
        html.push_str("<tr>");
        for (place, cell) in row.iter().enumerate() {
            put(&mut html, format_args!("<td{}>{cell}</td>", class(place)));
        }
        html.push_str("</tr>\n");
    }
    html.push_str("</tbody></table></div>\n");
    html
}

/// A table of limits: on a narrow screen its pictures are left out.
pub(super) fn table_of_limits(heads: &[&str], rows: &[Vec<String>]) -> String {
    table(heads, rows).replacen("class=\"wide\"", "class=\"wide limits\"", 1)
}

/// A paragraph of text.
pub(super) fn paragraph(text: &str) -> String {
    format!("<p>{}</p>\n", escaped(text))
}

/// Pictures side by side, as many as fit.
pub(super) fn charts(pictures: &[String]) -> String {
    if pictures.is_empty() {
        return String::new();
    }
    format!("<div class=\"charts\">\n{}</div>\n", pictures.concat())
}

/// Readable in light and in dark, on paper and on a narrow screen; colours that colour-blind people tell apart.
const STYLE: &str = "
:root { color-scheme: light dark; --bg: #ffffff; --fg: #16202a; --muted: #55626f; --grid: #e2e7ec; --line: #c3ccd5;
  --card: #f6f8fa; --a: #0b62b8; --b: #c05a00; --c: #14784a; --d: #8a3fa8; --good: #14784a; --bad: #b3261e;
  --hot: #fdebd0; --cool: #e8ecf5; }
@media (prefers-color-scheme: dark) { :root { --bg: #12171d; --fg: #e6ebf0; --muted: #9aa7b4; --grid: #27303a;
  --line: #3d4955; --card: #1a2129; --a: #62b0ff; --b: #ffa24d; --c: #4cc38a; --d: #cf9bf0; --good: #4cc38a;
  --bad: #ff7b72; --hot: #3a2c17; --cool: #1c2738; } }
body { margin: 0; background: var(--bg); color: var(--fg); font: 15px/1.5 system-ui, sans-serif; }
main { max-width: 1280px; margin: 0 auto; padding: 24px 16px 64px; }
h1 { font-size: 22px; margin: 0 0 4px; overflow-wrap: anywhere; }
h2 { font-size: 17px; margin: 36px 0 8px; padding-top: 12px; border-top: 1px solid var(--line); }
p, ul { margin: 6px 0; max-width: 80ch; }
.muted { color: var(--muted); }
.verdict { font-size: 26px; font-weight: 700; margin: 12px 0; }
.good { color: var(--good); } .bad { color: var(--bad); }
.wide, pre { overflow-x: auto; }
table { border-collapse: collapse; margin: 8px 0; }
th, td { text-align: left; padding: 4px 12px 4px 0; border-bottom: 1px solid var(--grid); vertical-align: middle; }
th { color: var(--muted); font-weight: 600; }
td { white-space: nowrap; }
td.n, th.n { text-align: right; font-variant-numeric: tabular-nums; }
.charts { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 460px), 1fr)); gap: 12px; }
figure { margin: 0; overflow-x: auto; background: var(--card); border-radius: 6px; padding: 8px; }
figure.full { grid-column: 1 / -1; } figure.full svg { min-width: 640px; } figure.tall { grid-row: span 3; }
figure.square { grid-row: span 2; }
svg { display: block; width: 100%; height: auto; }
svg text { fill: var(--muted); font: 11px system-ui, sans-serif; } svg .ground { fill: none; }
svg .grid { stroke: var(--grid); stroke-width: 1; }
svg .frame { stroke: var(--line); fill: none; }
svg .limit { stroke: var(--bad); stroke-width: 1; stroke-dasharray: 5 4; }
svg .l { fill: none; stroke-width: 1.8; stroke-linejoin: round; stroke-linecap: round; }
svg circle.text { fill: var(--fg); }
svg .a { stroke: var(--a); } svg .b { stroke: var(--b); stroke-dasharray: 7 3; } svg .c { stroke: var(--c); }
svg .d { stroke: var(--d); stroke-dasharray: 2 2; } svg .thin { stroke: var(--muted); stroke-width: 0.7; fill: none; }
svg .fa { fill: var(--a); } svg .fb { fill: var(--b); } svg .fc { fill: var(--c); } svg .fd { fill: var(--d); }
svg .sign { fill: var(--bad); } svg .hot { fill: var(--hot); } svg .cool { fill: var(--cool); } svg .mark { fill: var(--fg); }
.first { display: grid; grid-template-columns: minmax(0, 5fr) minmax(0, 6fr); gap: 20px; align-items: start; }
@media (max-width: 980px) { .first { grid-template-columns: minmax(0, 1fr); } }
.first .charts { grid-template-columns: minmax(0, 1fr); } .first figure.square { max-width: 440px; }
h3 { font-size: 15px; margin: 12px 0 4px; } nav { font-size: 13px; margin: 4px 0; } a { color: var(--a); }
ol.findings { margin: 4px 0; padding-left: 26px; } ol.findings li { margin: 4px 0; } ol.findings li::marker { color: var(--bad); font-weight: 700; }
.pointer { stroke: var(--fg); stroke-width: 1; pointer-events: none; } .chosen { fill: var(--a); opacity: 0.15; }
.zoomed .tick { display: none; } svg text.at { fill: var(--fg); }
svg .bar { fill: var(--a); } svg .barbad { fill: var(--bad); } svg .room { fill: var(--grid); }
@media (max-width: 980px) { figure.tall, figure.square { grid-row: auto; } }
@media (max-width: 640px) { .limits th:nth-child(6), .limits td:nth-child(6) { display: none; }
  main { padding: 16px 10px 48px; } .verdict { font-size: 21px; } th, td { font-size: 14px; }
  figure.full svg { min-width: 0; } td { white-space: normal; } td.n { white-space: nowrap; } th, td { padding-right: 8px; } }
@media print { main { max-width: none; } h2 { break-after: avoid; } figure { break-inside: avoid; } }
";

/// A pointer's time and values in every picture over time, and one part of the time in all of them. Without it the page is whole.
const SCRIPT: &str = include_str!("zoom.js");

/// The whole page.
pub(super) fn page(flight: &Flight, info: &Info, sections: &[Section]) -> String {
    let title = format!("Flight report: {}", flight.recording.name);
    let mut body = format!("<h1>{}</h1>\n", escaped(&title));
    let span = info.span.map(|span| format!("{:.1} s of log", span.duration_s)).unwrap_or_default();
    let said = info.run.iter().filter(|(_, value)| !value.is_empty());
    let run: Vec<String> = said.map(|(key, value)| format!("{key} {value}")).collect();
    put(
        &mut body,
        format_args!(
            "<p class=\"muted\">{}</p>\n",
            escaped(&[span, run.join(", "), format!("written by {}", info.library)].join("; "))
        ),
    );
    let named = sections.iter().filter(|section| !section.title.is_empty());
    let links: Vec<String> =
        named.map(|section| format!("<a href=\"#{}\">{}</a>", section.id, escaped(section.title))).collect();
    put(&mut body, format_args!("<nav>{}</nav>\n", links.join(" \u{b7} ")));
    for section in sections {
        if !section.title.is_empty() {
            put(&mut body, format_args!("<h2 id=\"{}\">{}</h2>\n", section.id, escaped(section.title)));
        }
        body.push_str(&section.html);
    }
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n<title>{}</title>\n\
         <style>{STYLE}</style>\n</head>\n<body>\n<main>\n{body}</main>\n<script>//<![CDATA[\n{SCRIPT}//]]></script>\n</body>\n</html>\n",
        escaped(&title)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_of_a_log_does_not_become_markup() {
        assert_eq!(escaped("<script>\"&\u{1b}[2J"), "&lt;script&gt;&quot;&amp;\u{fffd}[2J");
        let html = table(&["a", "#b"], &[vec![escaped("<i>"), "1".to_owned()]]);
        assert!(html.contains("<th class=\"n\">b</th>") && html.contains("&lt;i&gt;"), "{html}");
    }
}
