//! The page around the sections.

use super::html::{escaped, put};
use super::section::Section;
use super::track::Flight;
use crate::info::Info;

/// Readable in light and in dark, on paper and on a narrow screen; colours that colour-blind people tell apart.
const STYLE: &str = "
:root { color-scheme: light dark; --bg: #ffffff; --fg: #16202a; --muted: #55626f; --grid: #e2e7ec; --line: #c3ccd5;
  --card: #f6f8fa; --a: #0b62b8; --b: #c05a00; --c: #14784a; --d: #8a3fa8; --good: #14784a; --bad: #b3261e; }
@media (prefers-color-scheme: dark) { :root { --bg: #12171d; --fg: #e6ebf0; --muted: #9aa7b4; --grid: #27303a;
  --line: #3d4955; --card: #1a2129; --a: #62b0ff; --b: #ffa24d; --c: #4cc38a; --d: #cf9bf0; --good: #4cc38a;
  --bad: #ff7b72; } }
body { margin: 0; background: var(--bg); color: var(--fg); font: 15px/1.5 system-ui, sans-serif; }
main { max-width: 1080px; margin: 0 auto; padding: 24px 16px 64px; }
h1 { font-size: 22px; margin: 0 0 4px; overflow-wrap: anywhere; }
h2 { font-size: 17px; margin: 36px 0 8px; padding-top: 12px; border-top: 1px solid var(--line); }
p, ul { margin: 6px 0; max-width: 80ch; }
.muted { color: var(--muted); }
.verdict { font-size: 26px; font-weight: 700; margin: 12px 0; }
.good { color: var(--good); } .bad { color: var(--bad); }
.wide { overflow-x: auto; }
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
svg text { fill: var(--muted); font: 11px system-ui, sans-serif; }
svg .title { fill: var(--fg); font-size: 13px; font-weight: 600; }
svg .grid { stroke: var(--grid); stroke-width: 1; }
svg .frame { stroke: var(--line); fill: none; }
svg .limit { stroke: var(--bad); stroke-width: 1; stroke-dasharray: 5 4; }
svg .mark { stroke: var(--muted); stroke-width: 1; stroke-dasharray: 2 3; }
svg .l { fill: none; stroke-width: 1.8; stroke-linejoin: round; stroke-linecap: round; }
svg .place { fill: var(--fg); } svg .label { fill: var(--fg); }
svg .a { stroke: var(--a); } svg .b { stroke: var(--b); stroke-dasharray: 7 3; } svg .c { stroke: var(--c); }
svg .d { stroke: var(--d); stroke-dasharray: 2 2; } svg .thin { stroke: var(--muted); stroke-width: 0.7; fill: none; }
svg .fa { fill: var(--a); } svg .fb { fill: var(--b); } svg .fc { fill: var(--c); } svg .fd { fill: var(--d); }
svg .bar { fill: var(--a); } svg .barbad { fill: var(--bad); } svg .room { fill: var(--grid); }
@media (max-width: 980px) { figure.tall, figure.square { grid-row: auto; } }
@media (max-width: 640px) { .limits th:nth-child(6), .limits td:nth-child(6) { display: none; }
  main { padding: 16px 10px 48px; } .verdict { font-size: 21px; } th, td { font-size: 14px; }
  figure.full svg { min-width: 0; } td { white-space: normal; } td.n { white-space: nowrap; } th, td { padding-right: 8px; } }
@media print { main { max-width: none; } h2 { break-after: avoid; } figure { break-inside: avoid; } }
";

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
    for section in sections {
        if !section.title.is_empty() {
            put(&mut body, format_args!("<h2>{}</h2>\n", escaped(section.title)));
        }
        body.push_str(&section.html);
    }
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n<title>{}</title>\n\
         <style>{STYLE}</style>\n</head>\n<body>\n<main>\n{body}</main>\n</body>\n</html>\n",
        escaped(&title)
    )
}
