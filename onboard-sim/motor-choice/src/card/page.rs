//! A sheet as text and as HTML.

use core::fmt::{self, Write};

use super::sheet::Sheet;
use crate::markup::escaped;

/// The style of the page: one sheet of A4 in black and white, readable in the sun.
const STYLE: &str = "@page{size:A4;margin:12mm}body{font:13px/1.35 sans-serif;max-width:186mm;margin:0 auto;color:#000}\
h1{font-size:20px;margin:6px 0 0}p{margin:2px 0 6px}h2{font-size:14px;margin:10px 0 2px;border-bottom:1px solid #000}\
table{border-collapse:collapse;width:100%}td{padding:2px 6px 2px 0;vertical-align:top}td:first-child{width:25%}\
td.v{font-weight:bold;width:29%}td.r{color:#333}ul{list-style:none;padding:0;margin:2px 0}li:before{content:'\\2610\\00a0'}\
small{display:block;color:#333;margin-top:3px;overflow-wrap:anywhere}";

pub(super) fn text(sheet: &Sheet) -> String {
    let mut out = String::new();
    // Writing to a String cannot fail.
    let _ = write_text(sheet, &mut out);
    out
}

fn write_text(sheet: &Sheet, out: &mut String) -> fmt::Result {
    writeln!(out, "{}\n{}", sheet.title, sheet.subtitle)?;
    for section in &sheet.sections {
        writeln!(out, "\n{}", section.title)?;
        for [what, value, remark] in &section.rows {
            writeln!(out, "  {}", format!("{what:<28}{value:<32}{remark}").trim_end())?;
        }
    }
    writeln!(out, "\nCheck")?;
    for check in &sheet.checks {
        writeln!(out, "  [ ] {check}")?;
    }
    writeln!(out)?;
    sheet.notes.iter().try_for_each(|note| writeln!(out, "{note}"))
}

pub(super) fn html(sheet: &Sheet) -> String {
    let mut out = String::new();
    // Writing to a String cannot fail.
    let _ = write_html(sheet, &mut out);
    out
}

fn write_html(sheet: &Sheet, out: &mut String) -> fmt::Result {
    let title = escaped(&sheet.title);
    writeln!(
        out,
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"/><title>{title}</title>"
    )?;
    writeln!(out, "<style>{STYLE}</style></head><body>")?;
    writeln!(out, "<h1>{title}</h1>\n<p>{}</p>", escaped(&sheet.subtitle))?;
    for section in &sheet.sections {
        writeln!(out, "<h2>{}</h2>\n<table>", escaped(section.title))?;
        for [what, value, remark] in &section.rows {
            let [what, value, remark] = [what, value, remark].map(|cell| escaped(cell));
            writeln!(
                out,
                "<tr><td>{what}</td><td class=\"v\">{value}</td><td class=\"r\">{remark}</td></tr>"
            )?;
        }
        writeln!(out, "</table>")?;
    }
    writeln!(out, "<h2>Check</h2>\n<ul>")?;
    for check in &sheet.checks {
        writeln!(out, "<li>{}</li>", escaped(check))?;
    }
    writeln!(out, "</ul>")?;
    for note in &sheet.notes {
        writeln!(out, "<small>{}</small>", escaped(note))?;
    }
    writeln!(out, "</body></html>")
}
