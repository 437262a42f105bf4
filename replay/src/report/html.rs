//! Pieces of HTML.

use std::fmt::{self, Write as _};

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
