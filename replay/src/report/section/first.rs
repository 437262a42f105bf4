//! The first screen: how the flight ended, what went wrong, the whole flight, its place and its limits.

use flight::rules::verdict::Landing;

use crate::findings::over;
use crate::info::{Info, rounded};
use crate::log::{VerdictFacts, VerdictLimit};
use crate::refly::{FaultChanges, ReflyOptions, refly_flight};
use crate::report::chart::{Chart, Line};
use crate::report::html::{escaped, paragraph, put, table_of_limits};
use crate::report::track::Flight;

use super::motion;

pub(super) fn html(flight: &Flight, info: &Info) -> String {
    let mut html = verdict(info);
    html += "<div class=\"first\">\n<div>\n";
    html += &findings(flight, info);
    html += &limits(info);
    html += "</div>\n<div class=\"charts\">\n";
    html += &height(flight);
    html += &motion::from_above(flight);
    html += "</div>\n</div>\n";
    html + &paragraph(
        "Backgrounds are phases; red numbers are the findings, where they begin. Drag in a picture to see a part of the \
         time in all of them, double click for the whole.",
    )
}

/// The ending, the worst limit, and the first sign.
fn verdict(info: &Info) -> String {
    let ending = info.ending.as_deref().unwrap_or("No verdict in this log");
    let class = match &info.verdict {
        Some(VerdictFacts { landing: Landing { stands: false, .. }, .. }) => " bad",
        Some(VerdictFacts { landing: Landing { envelope: true, .. }, .. }) => " good",
        // It stands, and its legs were not designed for it.
        Some(_) | None => "",
    };
    let mut html = format!("<p class=\"verdict{class}\">{}</p>\n", escaped(ending));
    let mut words = Vec::new();
    if let Some(verdict) = &info.verdict {
        let sorted = worst_first(verdict.of_the_legs());
        let broken = sorted.iter().filter(|(limit, _)| !limit.passed).count();
        if let Some((worst, share)) = sorted.first().filter(|(_, share)| share.is_finite()) {
            let far =
                if *share > 1.0 { over(*share) } else { format!("{:.0} % of its limit", 100.0 * share) };
            let all = sorted.len();
            words.push(format!(
                "Worst of the limits: {} {:.2} {}, {far}; {broken} of {all} broken.",
                worst.name,
                worst.value.abs(),
                worst.unit
            ));
        }
        words.push(format!("Touchdown at {}.", info.clocks.words(verdict.contact())));
    } else {
        words.push(
            "The vehicle did not touch down while it was recorded, or its verdict was not recorded."
                .to_owned(),
        );
    }
    if let Some(first) = info.findings.iter().flatten().next() {
        words.insert(0, format!("First sign: {}, at T+{:.2} s.", first.words, first.since_s));
    }
    for words in words {
        html += &paragraph(&words);
    }
    html
}

fn findings(flight: &Flight, info: &Info) -> String {
    let mut html = "<h3 id=\"findings\">Findings, first in time</h3>\n".to_owned();
    let Some(findings) = &info.findings else {
        return html
            + &paragraph(
                "Nothing was looked for: the log has no frames, or this build does not make their decisions again.",
            );
    };
    if findings.is_empty() {
        html += &paragraph(info.no_findings());
    }
    html += "<ol class=\"findings\">\n";
    for finding in findings {
        put(
            &mut html,
            format_args!(
                "<li><b>T+{:.2} s</b> <a href=\"#{}\">{}</a></li>\n",
                finding.since_s,
                finding.section,
                escaped(&finding.words)
            ),
        );
    }
    html += "</ol>\n";
    html + &without_its_faults(flight)
}

/// A simulated flight flown again with nothing broken in it.
fn without_its_faults(flight: &Flight) -> String {
    let faults = flight.recording.head.run.get("faults").map_or("", String::as_str);
    if faults.is_empty() {
        return String::new();
    }
    let changes = FaultChanges { without: vec!["all".to_owned()], ..FaultChanges::default() };
    let options = ReflyOptions { faults: changes, ..ReflyOptions::default() };
    let flown = refly_flight(&flight.recording, &options).ok().and_then(|(_, flown)| flown.verdict);
    let Some(verdict) = flown else { return String::new() };
    let ending = verdict.ending.unwrap_or_default();
    paragraph(&format!("Simulated: flown again without {faults}: {ending}."))
}

fn worst_first<'a>(limits: impl Iterator<Item = &'a VerdictLimit>) -> Vec<(&'a VerdictLimit, f64)> {
    let mut sorted: Vec<(&VerdictLimit, f64)> = limits.map(|limit| (limit, limit.share())).collect();
    sorted.sort_by(|a, b| b.1.total_cmp(&a.1));
    sorted
}

fn limits(info: &Info) -> String {
    let Some(verdict) = &info.verdict else { return String::new() };
    let [_, _, envelope, table_2] = Landing::WORDS;
    let more = limit_table(table_2, &verdict.table_2);
    limit_table("borne", &verdict.borne)
        + &limit_table(envelope, &verdict.envelope)
        + &format!("<details><summary>{table_2}</summary>\n{more}</details>\n")
}

fn limit_table(title: &str, limits: &[VerdictLimit]) -> String {
    let row = |(limit, share): (&VerdictLimit, f64)| {
        let (class, word) = if limit.passed { ("good", "inside") } else { ("bad", "OUTSIDE") };
        vec![
            escaped(&limit.name),
            format!("{:.2} {}", limit.value + 0.0, escaped(&limit.unit)),
            format!("{} to {}", rounded(limit.minimum) + 0.0, rounded(limit.maximum) + 0.0),
            bar(limit, share),
            format!("<span class=\"{class}\">{word}</span>"),
        ]
    };
    let rows: Vec<Vec<String>> = worst_first(limits.iter()).into_iter().map(row).collect();
    if rows.is_empty() {
        return String::new();
    }
    table_of_limits(&[title, "#value", "#limit", "share; the mark is the limit", ""], &rows)
}

/// A value's share of its limit, up to half more than it.
fn bar(limit: &VerdictLimit, share: f64) -> String {
    const WIDTH: f64 = 120.0;
    const LONGEST: f64 = 1.5;
    if !share.is_finite() {
        return String::new();
    }
    let class = if limit.passed { "bar" } else { "barbad" };
    let px = |share: f64| WIDTH * share.min(LONGEST) / LONGEST;
    format!(
        "<svg viewBox=\"0 0 {WIDTH} 14\" style=\"width:{WIDTH}px\" aria-hidden=\"true\"><rect class=\"room\" x=\"0\" y=\"3\" \
         width=\"{WIDTH}\" height=\"8\"/><rect class=\"{class}\" x=\"0\" y=\"3\" width=\"{:.1}\" height=\"8\"/>\
         <rect class=\"mark\" x=\"{:.1}\" y=\"0\" width=\"2\" height=\"14\"/></svg>",
        px(share),
        px(1.0) - 1.0
    )
}

/// The whole flight: height over time, and what the barometer said.
fn height(flight: &Flight) -> String {
    let track = flight.track.iter().map(|sample| (flight.axis_s(sample.time_s), sample.state[1]));
    let frames = flight.recording.frames.iter().filter_map(|frame| {
        let height_m = frame.input.measured.as_ref()?.pressure_altitude_m?;
        Some((flight.axis_s(frame.input.time_s), height_m))
    });
    let lines = vec![
        Line { name: "barometer", class: "thin", points: frames.collect() },
        Line { name: "feet", class: "a", points: track.collect() },
    ];
    Chart {
        spans: flight.spans.clone(),
        marks: Vec::new(),
        ..flight.over_time("Height over the whole flight, m", lines)
    }
    .svg()
}
