//! Pieces of HTML.

use std::path::Path;

pub(super) use onboard_sim::card::escaped;

use super::section::{Section, motion};
use super::track::Flight;
use crate::info::{Info, utc};

/// A table, or nothing without rows: headings, then rows; a heading that begins with `#` marks a
/// column of numbers.
pub(super) fn table<R: AsRef<[String]>>(heads: &[&str], rows: impl IntoIterator<Item = R>) -> String {
    let cell = |tag: &str, place: usize, words: &str| {
        let is_number = heads.get(place).is_some_and(|head| head.starts_with('#'));
        format!("<{tag}{}>{words}</{tag}>", if is_number { " class=\"n\"" } else { "" })
    };
    let row = |row: R| {
        let cells = row.as_ref().iter().enumerate().map(|(place, words)| cell("td", place, words));
        format!("<tr>{}</tr>\n", cells.collect::<String>())
    };
    let head = |(place, head): (usize, &&str)| cell("th", place, &escaped(head.trim_start_matches('#')));
    let (head, rows): (String, String) =
        (heads.iter().enumerate().map(head).collect(), rows.into_iter().map(row).collect());
    if rows.is_empty() {
        return rows;
    }
    format!(
        "<div class=\"wide\"><table><thead><tr>{head}</tr></thead><tbody>\n{rows}</tbody></table></div>\n"
    )
}

/// A paragraph of text.
pub(super) fn paragraph(text: &str) -> String {
    format!("<p>{}</p>\n", escaped(text))
}

/// Pictures side by side, as many as fit.
pub(super) fn charts(drawn: &str) -> String {
    if drawn.is_empty() { String::new() } else { format!("<div class=\"charts\">\n{drawn}</div>\n") }
}

const STYLE: &str = include_str!("style.css");

/// One time in every picture, the vehicle at that time, and a part of the time. Without it the page
/// is whole.
const SCRIPT: &str = include_str!("script.js");

/// The complete page.
pub(super) fn page(flight: &Flight, info: &Info, sections: &[Section]) -> String {
    let title = format!("Flight report: {}", flight.recording.name);
    let mut body = format!("<header><p>{}</p>\n", escaped(&about(flight, info).join(" \u{b7} ")));
    let named = sections.iter().filter(|section| !section.title.is_empty());
    let word = |title: &'static str| title.split(' ').next().unwrap_or_default();
    let links = named.map(|section| format!("<a href=\"#{}\">{}</a> ", section.id, word(section.title)));
    body.extend([format!("<nav>{}</nav></header>\n", links.collect::<String>())]);
    for section in sections {
        if !section.title.is_empty() {
            body.extend([format!("<h2 id=\"{}\">{}</h2>\n", section.id, escaped(section.title))]);
        }
        body.push_str(&section.html);
    }
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n<title>{}</title>\n\
         <style>{STYLE}</style>\n</head>\n<body>\n<main>\n{body}</main>\n\
         <script id=\"flight\" type=\"application/json\">{}</script>\n<script>//<![CDATA[\n{SCRIPT}//]]></script>\n</body>\n</html>\n",
        escaped(&title),
        motion::json(flight)
    )
}

/// Logs of simulated flights may count from the Unix epoch; no real flight was before 2001, ns.
const NO_DATE_NS: u64 = 1_000_000_000_000_000_000;

/// What flew, when, where, and what wrote it.
fn about(flight: &Flight, info: &Info) -> Vec<String> {
    let name = info.profile.as_ref().and_then(|profile| profile.name.clone());
    let begun = info.span.filter(|span| span.first_ns > NO_DATE_NS).map(|span| utc(span.first_ns));
    let begun = begun.map(|utc| format!("{} UTC", utc.get(..16).unwrap_or(&utc).replace('T', " ")));
    let place = flight.pilot.as_ref().map(|pilot| {
        let (start, site) = (pilot.mission().start.at.name(), pilot.mission().site);
        format!("from {start} at {:.4}, {:.4}, {site}", site.latitude_deg, site.longitude_deg)
    });
    let run = info.run.iter().filter(|(key, value)| *key != "profile" && !value.is_empty());
    let run: Vec<String> = run.map(|(key, value)| format!("{key} {value}")).collect();
    let known = [name, Some(begun.unwrap_or_else(|| "no date recorded".to_owned())), place];
    let file = Path::new(&info.file).file_name().unwrap_or_default().to_string_lossy().into_owned();
    let written = [run.join(", "), file, info.library.clone()];
    known.into_iter().flatten().chain(written).filter(|words| !words.is_empty()).collect()
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
