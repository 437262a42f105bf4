//! Pieces of HTML.

use std::fmt;
use std::fmt::Write as _;

pub(super) use onboard_sim::card::escaped;

use super::section::Section;
use super::track::Flight;
use crate::info::Info;

/// Appends to a text in memory, which cannot fail.
pub(super) fn put(text: &mut String, more: fmt::Arguments<'_>) {
    let _ = text.write_fmt(more);
}

/// A table: headings, then rows; a heading that begins with `#` marks a column of numbers.
pub(super) fn table<R: AsRef<[String]>>(heads: &[&str], rows: impl IntoIterator<Item = R>) -> String {
    let numeric: Vec<bool> = heads.iter().map(|head| head.starts_with('#')).collect();
    let class = |place: usize| if numeric.get(place) == Some(&true) { " class=\"n\"" } else { "" };
    let mut html = "<div class=\"wide\"><table><thead><tr>".to_owned();
    for (place, head) in heads.iter().enumerate() {
        put(&mut html, format_args!("<th{}>{}</th>", class(place), escaped(head.trim_start_matches('#'))));
    }
    html.push_str("</tr></thead><tbody>\n");
    for row in rows {
        html.push_str("<tr>");
        for (place, cell) in row.as_ref().iter().enumerate() {
            put(&mut html, format_args!("<td{}>{cell}</td>", class(place)));
        }
        html.push_str("</tr>\n");
    }
    html.push_str("</tbody></table></div>\n");
    html
}

/// A paragraph of text.
pub(super) fn paragraph(text: &str) -> String {
    format!("<p>{}</p>\n", escaped(text))
}

/// Pictures side by side, as many as fit.
pub(super) fn charts(pictures: &[String]) -> String {
    let drawn = pictures.concat();
    if drawn.is_empty() { drawn } else { format!("<div class=\"charts\">\n{drawn}</div>\n") }
}

const STYLE: &str = include_str!("style.css");

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
        let html = table(&["a", "#b"], [[escaped("<i>"), "1".to_owned()]]);
        assert!(html.contains("<th class=\"n\">b</th>") && html.contains("&lt;i&gt;"), "{html}");
    }
}
